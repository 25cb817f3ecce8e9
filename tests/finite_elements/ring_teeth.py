"""How the ring's pointed teeth bend in case 5.2: what the ring gives way under each tooth beyond a straight wall, and the model with that.

Writes ring_teeth.json beside this file and prints the table of docs/validation.md. The model is written down here a second time, so that a compliance
that grows towards the tip can be put into it.
"""

import json
import logging
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import drives
from drives import DRIVES, E_MPA, NU, Case
from elastic import Body, weights_of

HERE = Path(__file__).parent
ENGAGED_RAD = np.radians(43.607599)
PER_MPA = (1 - NU**2) / (np.pi * E_MPA)


def of_patch(body, patches, index, depth_mm):
    """Mean displacement under Hertz's pressure of a unit force, beyond Johnson's to the depth at which the body is held, in units of (1 - ν²)/(π E)."""
    nodes = patches[index].nodes_mm
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(nodes, axis=0).T))])
    s -= s[-1] / 2
    mass, half_mm = weights_of(s[1] - s[0], len(s)), s[-1] / 1.6
    hertz = np.sqrt(np.maximum(1 - (s / half_mm) ** 2, 0.0))
    hertz /= (mass @ hertz).sum()
    place = slice(index * len(s), (index + 1) * len(s))
    return float(hertz @ body.flexibility[place, place] @ hertz / PER_MPA - (2 * np.log(2 * depth_mm / half_mm) - NU / (1 - NU) - 0.5))


def ring_and_wall(angle_deg):
    """Positions, and what ring and wall give way besides, at one input angle."""
    caught = []

    class Kept(Body):
        def __init__(self, outline, modulus, ratio, patches, *more):
            super().__init__(outline, modulus, ratio, patches, *more)
            caught.append((patches, self))

    whole, drives.Body = drives.Body, Kept
    try:
        case = Case(DRIVES["5.2"], angle_deg)
        # As far turned as the load turns it, to a few hundredths of a degree.
        teeth = drives.solve(case, 2.3e-3, ENGAGED_RAD)["teeth"]
    finally:
        drives.Body = whole
    (_, _), (patches, ring), (wall_patches, wall) = caught[:3]
    beyond = [of_patch(ring, patches, index, case.depth_mm) for index in range(len(teeth))]
    return [tooth["position_deg"] for tooth in teeth], beyond, of_patch(wall, wall_patches, 0, case.depth_mm)


def model(case, beyond_at):
    """Virtual work with Johnson's law, the ring giving way besides by `beyond_at(degrees)`: forces at the wave generator, and the wind-up."""
    drive = case.drive
    r, k = drive.radius_mm, drive.ring_teeth / drive.lobes
    unit = PER_MPA / drive.width_mm
    modulus = E_MPA / (2 * (1 - NU**2))
    gaps = [0.0, 1e-3 * case.ring_gap_um, 1e-3 * case.slot_gap_um]
    tangent = lambda psi: np.tan(drive.normal_at(psi) - psi)
    teeth = []
    for i in range(-drive.installed, 2 * drive.installed):
        psi = 2 * np.pi * i / drive.installed - np.radians(case.input_angle_deg) * drive.ring_teeth / drive.count
        if not 1e-9 < psi <= ENGAGED_RAD:
            continue
        phi, d, e = drive.normal_at(psi), drive.center_radius_mm(psi), 1e-5
        gamma = phi - psi
        beta = np.arctan(k * np.tan(gamma))
        h, slope = drive.support(phi)
        second = (drive.support(phi + e)[1] - drive.support(phi - e)[1]) / (2 * e)
        kappa = np.cos(beta) / d * (1 + k * k * (tangent(psi + e) - tangent(psi - e)) / (2 * e) / (1 + np.tan(beta) ** 2))
        curvatures = [1 / r + 1 / (h + second), 1 / (r * (1 + r * kappa)), 1 / r]
        ratios = [1.0, np.cos(gamma) / np.cos(beta), np.sin(gamma) * drive.count / drive.lobes]
        besides = [0.0, beyond_at(np.degrees(psi)), 0.0]
        teeth.append((abs(slope), ratios, curvatures, besides))

    def approach(force, curvature, besides):
        half = np.sqrt(4 * force / (np.pi * drive.width_mm * modulus * curvature))
        return force * unit * (2 * np.log(4 * r / half) - 1 + 2 * np.log(2 * case.depth_mm / half) - NU / (1 - NU) + besides)

    def force(tooth, turned):
        arm, ratios, curvatures, besides = tooth
        room = turned * arm - sum(f * gap for f, gap in zip(ratios, gaps))
        if room <= 0:
            return 0.0
        return brentq(lambda F: sum(f * approach(f * F, c, b) for f, c, b in zip(ratios, curvatures, besides)) - room, 1e-9, 1e6)

    torque = 1e3 * drive.input_torque_nm / drive.lobes
    turned = brentq(lambda x: sum(force(tooth, x) * tooth[0] for tooth in teeth) - torque, 1e-9, 0.1, xtol=1e-14)
    return np.array([force(tooth, turned) for tooth in teeth]), turned


def main():
    logging.getLogger("skfem").setLevel(logging.ERROR)
    found = []
    for angle_deg in (5.0, 6.5, 8.0):
        positions, beyond, wall = ring_and_wall(angle_deg)
        found += [dict(position_deg=position, beyond=value, beyond_wall=value - wall) for position, value in zip(positions, beyond)]
        print(angle_deg, [f"{position:.2f}: {value - wall:.2f}" for position, value in zip(positions, beyond)], f"wall {wall:.2f}", flush=True)
    found.sort(key=lambda tooth: tooth["position_deg"])
    (HERE / "ring_teeth.json").write_text(json.dumps(dict(unit="(1 - ν²)/(π E L1)", teeth=found), indent=1, ensure_ascii=False) + "\n")
    places, values = [tooth["position_deg"] for tooth in found], [tooth["beyond_wall"] for tooth in found]
    print("| input angle, ° | gap | model | worst tooth | wind-up | with the ring's teeth | worst tooth | wind-up |\n|---|---|---|---|---|---|---|---|")
    for case in json.loads((HERE / "results.json").read_text())["cases"]:
        if case["drive"] != "5.2":
            continue
        forces = np.array([tooth["force_n"][0] for tooth in case["teeth"]])
        row = []
        for beyond_at in (lambda _: 0.0, lambda degrees: np.interp(degrees, places, values)):
            of_model, turned = model(Case(DRIVES["5.2"], case["input_angle_deg"], case["ring_gap_um"], case["slot_gap_um"]), beyond_at)
            row += [f"{100 * (of_model.max() / forces.max() - 1):+.1f} %", f"{100 * abs(of_model - forces).max() / forces.max():.1f} %",
                    f"{100 * (turned / case['wind_up_rad'] - 1):+.1f} %"]
        gap = "10 µm at the ring" if case["ring_gap_um"] else "10 µm at the slot" if case["slot_gap_um"] else "no gap"
        print(f"| {case['input_angle_deg']:.2f} | {gap} | " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
