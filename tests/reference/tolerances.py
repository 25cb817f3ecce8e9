#!/usr/bin/env python3
"""An independent sampler of the reference calculation: drives whose single teeth and ring spaces deviate by chance.

    usage: python3 tolerances.py            (writes tolerances.json beside itself; needs mpmath and numpy)

Geometry, directions and compliances of the teeth are those of reference.py; chance is numpy's (PCG64), not the counter-based generator of
the studies, and the load is shared by bisection, not by counting the teeth that have closed their gaps. Which space a tooth meets follows
from counting: in the carrier's frame tooth i stands at i/Z_G turns and the cam at `shift`/Z_G; it is on lobe l of two where
|psi| <= a quarter turn, psi = i/Z_G - shift/Z_G - l/2, and stands then in the space i - l modulo Z_K (docs/explanation/theory.md, section 9).

`values` holds the drives' quantities, sorted, each with nine digits; `drives` the deviations of some of them with their own quantities.
"""

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import reference
from mpmath import mp

mp.dps = 60
reference.STEP = reference.mpf(10) ** -16
reference.CONVERGED = reference.mpf(10) ** -30

DRIVES = 4000
SHOWN = 12
SEED = 20130136

DESIGN = {
    "drive": {"wave_generator": {"semi_major_mm": 58.0, "semi_minor_mm": 56.0},
              "teeth": {"count": 12, "radius_mm": 8.0, "width_mm": 15.0}, "ring": {"teeth": 10}},
    "load": {"input_torque_nm": 100.0, "allowable_stress_mpa": 3500.0},
    "model": {"compatibility": "virtual_work", "stiffness": {"law": "linear"}, "clearance": {"wave_generator_um": 2.0, "ring_um": 10.0, "carrier_um": 4.0}},
    "sweep": {"samples": 8},
}
DEVIATIONS = {
    "ring_space_um": {"distribution": "normal", "sigma": 3.0, "limit": 7.5},
    "tooth_radius_um": {"distribution": "uniform", "limit": 1.5},
}


def nominal_teeth():
    """Of each place at which a tooth may mesh, as part of a turn from the major axis, what load sharing takes."""
    drive = reference.read_document(DESIGN)
    assert reference.geometry(drive).span == Fraction(drive.installed, 4), "the mesh is cut short"
    path = reference.path_of(drive)
    places = {}
    for step in range(1, drive.samples * drive.installed // 4 + 1):
        turn = Fraction(step, drive.samples * drive.installed)
        tooth = reference.tooth_at(path, turn)
        if turn == Fraction(1, 4):
            continue  # no lever arm
        shared = reference.tooth_in_load_sharing(drive, tooth, reference.contact_laws(drive))
        of_unit_force = reference.stresses(drive, tooth, shared.ratios)
        places[turn] = [float(x) for x in (shared.lever, shared.compliance, *shared.ratios, *of_unit_force)]
    return drive, places


def main():
    drive, places = nominal_teeth()
    count, spaces = drive.teeth, drive.ring_teeth
    clearance_mm = [DESIGN["model"]["clearance"].get(f"{contact}_um", 0.0) / 1000 for contact in reference.CONTACTS]
    random = np.random.default_rng(SEED)

    def normal(shape, sigma, limit):
        drawn = random.normal(0.0, sigma, shape)
        while (beyond := np.abs(drawn) > limit).any():
            drawn[beyond] = random.normal(0.0, sigma, beyond.sum())
        return drawn

    of_space = DEVIATIONS["ring_space_um"]
    space_mm = normal((DRIVES, spaces), of_space["sigma"], of_space["limit"]) / 1000
    limit = DEVIATIONS["tooth_radius_um"]["limit"]
    tooth_mm = random.uniform(-limit, limit, (DRIVES, count)) / 1000
    torque = 1000 * DESIGN["load"]["input_torque_nm"]
    allowable = DESIGN["load"]["allowable_stress_mpa"]

    stress_ring, stress_cam = np.zeros(DRIVES), np.zeros(DRIVES)
    least, most = np.full(DRIVES, np.inf), np.full(DRIVES, -np.inf)
    capacity = np.full(DRIVES, np.inf)
    # The lobes come back to the same teeth and spaces after as many half turns of the cam as there are spaces.
    for step in range(spaces * count // 2 * drive.samples + 1):
        shift = Fraction(step, drive.samples)
        found = []
        for tooth in range(count):
            for lobe in range(-2, spaces + 3):
                # The cam turns forward: a tooth falls back from lobe to lobe, each of which stands half a turn behind the last.
                psi = (tooth - shift) / count + Fraction(lobe, 2)
                if 0 < psi < Fraction(1, 4):
                    found.append((tooth, (tooth + lobe) % spaces, *places[psi]))
        lever, compliance, *rest = np.array([row[2:] for row in found]).T
        ratios, of_unit_force = rest[:3], rest[3:]
        thinner = tooth_mm[:, [row[0] for row in found]]
        deeper = space_mm[:, [row[1] for row in found]]
        gap = sum(w * (c + thinner) for w, c in zip(ratios, clearance_mm)) + ratios[1] * deeper
        assert (gap >= 0).all(), "a part is too full"

        low, high = np.zeros(DRIVES), np.full(DRIVES, 0.1)
        for _ in range(60):
            middle = 0.5 * (low + high)
            force = np.maximum(0.0, middle[:, None] * lever - gap) / compliance
            is_high = (force * lever).sum(axis=1) > torque
            high, low = np.where(is_high, middle, high), np.where(is_high, low, middle)
        assert (high < 0.1).all()
        rotation = 0.5 * (low + high)
        root = np.sqrt(np.maximum(0.0, rotation[:, None] * lever - gap) / compliance)
        stress_cam = np.maximum(stress_cam, (of_unit_force[0] * root).max(axis=1))
        stress_ring = np.maximum(stress_ring, (of_unit_force[1] * root).max(axis=1))
        least, most = np.minimum(least, rotation), np.maximum(most, rotation)
        # The first tooth at which a contact reaches the allowable stress says how far the cam may turn, and that says the torque.
        with np.errstate(divide="ignore"):
            allowed = np.min([(allowable / of_unit) ** 2 for of_unit in of_unit_force], axis=0)
        turned = ((allowed * compliance + gap) / lever).min(axis=1)
        force = np.maximum(0.0, turned[:, None] * lever - gap) / compliance
        capacity = np.minimum(capacity, (force * lever).sum(axis=1) / 1000)

    values = {
        "peak_stress_ring_mpa": stress_ring,
        "peak_stress_wave_generator_mpa": stress_cam,
        "transmission_error_peak_to_peak_deg": np.degrees(most - least) / (count / reference.WAVES),
        "torque_capacity_output_nm": capacity * count / reference.WAVES,
    }
    answer = {
        "design": DESIGN,
        "deviations": DEVIATIONS,
        "drives": [
            {"ring_space_um": (1000 * space_mm[drive]).tolist(), "tooth_radius_um": (1000 * tooth_mm[drive]).tolist(),
             "values": {name: float(column[drive]) for name, column in values.items()}}
            for drive in range(SHOWN)
        ],
        "values": {name: [float(f"{value:.9g}") for value in np.sort(column)] for name, column in values.items()},
    }
    Path(__file__).with_name("tolerances.json").write_text(json.dumps(answer) + "\n")
    for name, column in values.items():
        print(name, np.quantile(column, [0.01, 0.5, 0.99]))


main()
