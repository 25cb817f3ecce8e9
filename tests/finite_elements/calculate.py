"""Calculates all cases, anew, and writes results.json beside this file; then those in which a tooth stands at a pointed tip, and writes corners.json.

`calculate.py corners` does the second alone.
"""

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
# Of case 5.2, in 260ths of ten degrees: those at which a tooth stands near the end of the flank, on either side, and how far beyond it teeth may be pressed.
CORNER_STEPS, REACH_DEG = [219, 230, 0, 18, 30, 38, 60, 90], 3.4
CORNER_STEPS_WITH_GAP = [219, 0]


def write(results, name="results.json"):
    """After each case, so that a run that is broken off leaves what it has."""
    Path(__file__).with_name(name).write_text(json.dumps(results, indent=1) + "\n")


def at_corner(step, ring_gap_um=0.0, refinement=1.0):
    case = Case(DRIVES["5.2"], step * 10 / 260, ring_gap_um, refinement=refinement)
    found = settle(case, np.radians(ENGAGED_DEG["5.2"]), 1.2e-2 if ring_gap_um else 2.32e-3, np.radians(REACH_DEG))
    return dict(drive="5.2", input_angle_deg=case.input_angle_deg, ring_gap_um=ring_gap_um, slot_gap_um=0.0, depth_mm=case.depth_mm, **found)


def corners():
    results = {"convergence": [], "cases": []}
    for refinement in (1.0, 2.0):
        found = at_corner(0, refinement=refinement)
        results["convergence"].append(dict(cells=2 * round(16 * refinement), force_n=[tooth["force_n"][0] for tooth in found["teeth"]], wind_up_rad=found["wind_up_rad"]))
    for ring_gap_um, steps in ((0.0, CORNER_STEPS), (10.0, CORNER_STEPS_WITH_GAP)):
        for step in steps:
            results["cases"].append(at_corner(step, ring_gap_um))
            last = results["cases"][-1]["teeth"][-1]
            print(f"5.2, {ring_gap_um} at {last['position_deg']:.3f} deg: {last['force_n'][0]:.2f} N", flush=True)
            write(results, "corners.json")


def main():
    logging.getLogger("skfem").setLevel(logging.ERROR)
    if sys.argv[1:] == ["corners"]:
        corners()
        return
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
    corners()
    print(f"{time.time() - started:.0f} s in all", file=sys.stderr)


if __name__ == "__main__":
    main()
