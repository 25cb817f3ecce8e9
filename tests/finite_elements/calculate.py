"""Calculates all cases, anew, and writes results.json beside this file."""

import json
import logging
import sys
import time
from pathlib import Path

import numpy as np

from drives import DRIVES, NU, E_MPA, Case, settle, single_contact

ENGAGED_DEG = {"5.1": 90.0, "5.2": 43.607599, "eccentric": 180.0}
# Input angles at which no tooth stands near a pointed tip, where a patch would reach over it.
ANGLES_DEG = {"5.1": [2.769231, 8.307692, 11.538462], "5.2": [5.0, 6.5, 8.0], "eccentric": [6.0]}
GAPS_UM = [(0.0, 0.0), (10.0, 0.0), (0.0, 10.0)]


def write(results):
    """After each case, so that a run that is broken off leaves what it has."""
    Path(__file__).with_name("results.json").write_text(json.dumps(results, indent=1) + "\n")


def main():
    logging.getLogger("skfem").setLevel(logging.ERROR)
    started = time.time()
    results = {"youngs_modulus_gpa": E_MPA / 1e3, "poissons_ratio": NU, "single_contacts": [], "convergence": [], "cases": []}
    for radius_mm, force, depth_mm in [(5.0, 90.0, 5.0), (5.0, 90.0, 10.0), (1.5, 30.0, 5.0)]:
        pressure, approach = single_contact(radius_mm, force, depth_mm)
        results["single_contacts"].append(dict(radius_mm=radius_mm, force_n_per_mm=force, depth_mm=depth_mm, pressure_mpa=pressure, approach_mm=approach))
        print(results["single_contacts"][-1], flush=True)
    for refinement in (1.0, 1.5, 2.0):
        found = settle(Case(DRIVES["5.1"], 8.307692, refinement=refinement), np.pi / 2, 3e-3)
        results["convergence"].append(dict(cells=2 * round(16 * refinement), force_n=max(row["force_n"][0] for row in found["teeth"]), wind_up_rad=found["wind_up_rad"]))
        print(results["convergence"][-1], flush=True)
    for name, drive in DRIVES.items():
        for angle in ANGLES_DEG[name]:
            for ring_gap_um, slot_gap_um in GAPS_UM if name != "eccentric" else GAPS_UM[:2]:
                case = Case(drive, angle, ring_gap_um, slot_gap_um)
                found = settle(case, np.radians(ENGAGED_DEG[name]), 3e-3)
                results["cases"].append(dict(drive=name, input_angle_deg=angle, ring_gap_um=ring_gap_um, slot_gap_um=slot_gap_um, depth_mm=case.depth_mm, **found))
                row = max(found["teeth"], key=lambda row: row["force_n"][0])
                print(f"{time.time() - started:6.0f} s  {name} {angle} {ring_gap_um} {slot_gap_um}: {row['force_n'][0]:.2f} N, {np.degrees(found['wind_up_rad']):.5f} deg", flush=True)
                write(results)
    print(f"{time.time() - started:.0f} s in all", file=sys.stderr)


if __name__ == "__main__":
    main()
