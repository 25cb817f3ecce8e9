"""What the model leaves out in case 5.2: how the ring's pointed teeth bend, and that the wave generator moves on under its teeth as it winds up.

Writes ring_teeth.json, what the ring gives way under each tooth beyond a straight wall, beside this file, and prints the tables of docs/explanation/validation.md. The model is
written down here a second time, so that both can be put into it. `ring_teeth.py tables` takes the ring's compliance from the file.
"""

import json
import logging
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import drives
from calculate import ENGAGED_DEG
from drives import DRIVES, E_MPA, NU, Case
from elastic import Body, weights_of

HERE = Path(__file__).parent
RING_TEETH = HERE / "ring_teeth.json"
PER_MPA = (1 - NU**2) / (np.pi * E_MPA)


def of_patch(body, patches, index, depth_mm):
    """Mean displacement under Hertz's pressure of a unit force, beyond Johnson's to the depth at which the body is held, in units of (1 - ν²)/(π E)."""
    nodes = patches[index].nodes_mm
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(nodes, axis=0).T))])
    s -= s[-1] / 2
    mass, half_mm = weights_of(s), s[-1] / 1.6
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
        teeth = drives.solve(case, 2.3e-3, np.radians(ENGAGED_DEG["5.2"]))["teeth"]
    finally:
        drives.Body = whole
    (_, _), (patches, ring), (wall_patches, wall) = caught[:3]
    beyond = [of_patch(ring, patches, index, case.depth_mm) for index in range(len(teeth))]
    return [tooth["position_deg"] for tooth in teeth], beyond, of_patch(wall, wall_patches, 0, case.depth_mm)


def model(case, beyond_at, moves):
    """Virtual work with Johnson's law, the ring giving way besides by `beyond_at(degrees)`: forces at the wave generator, and the wind-up.

    With `moves` the wave generator pushes its teeth where it stands when it has turned by its wind-up, otherwise where it stood without load.
    """
    drive = case.drive
    r, k = drive.radius_mm, drive.ring_teeth / drive.lobes
    unit = PER_MPA / drive.width_mm
    modulus = E_MPA / (2 * (1 - NU**2))
    ring_gap_mm = 1e-3 * case.ring_gap_um
    tangent = lambda psi: np.tan(drive.normal_at(psi) - psi)

    def at(psi):
        """Centre radius, pressure angles, lever arm and curvatures where a tooth stands."""
        phi, d, e = drive.normal_at(psi), drive.center_radius_mm(psi), 1e-5
        gamma = phi - psi
        beta = np.arctan(k * np.tan(gamma))
        h, slope = drive.support(phi)
        second = (drive.support(phi + e)[1] - drive.support(phi - e)[1]) / (2 * e)
        kappa = np.cos(beta) / d * (1 + k * k * (tangent(psi + e) - tangent(psi - e)) / (2 * e) / (1 + np.tan(beta) ** 2))
        return d, gamma, beta, abs(slope), [1 / r + 1 / (h + second), 1 / (r * (1 + r * kappa)), 1 / r]

    teeth = []
    for i in range(-drive.installed, 2 * drive.installed):
        psi = 2 * np.pi * i / drive.installed - np.radians(case.input_angle_deg) * drive.ring_teeth / drive.count
        if 1e-9 < psi <= np.radians(ENGAGED_DEG[drive.name]) + 1e-9:
            # Aside in its slot by the gap there it stands so far back on the flank, and the wave generator comes under it the later.
            aside = 1e-3 * case.slot_gap_um / drive.center_radius_mm(psi)
            teeth.append((psi - k * aside, (k + drive.sense) * aside, at(psi - k * aside)))

    def approach(force, curvature, besides):
        half = np.sqrt(4 * force / (np.pi * drive.width_mm * modulus * curvature))
        return force * unit * (2 * np.log(4 * r / half) - 1 + 2 * np.log(2 * case.depth_mm / half) - NU / (1 - NU) + besides)

    def force_and_arm(tooth, turned):
        psi, lost_motion, (d, gamma, beta, arm, curvatures) = tooth
        turned -= lost_motion
        way = turned * arm
        if moves:
            moved_d, gamma, _, arm, moved = at(psi - turned)
            way, curvatures = np.cos(gamma) * (moved_d - d), [moved[0], *curvatures[1:]]
        # Equilibrium of the tooth between cam, flank and wall.
        ratios = [1.0, np.cos(gamma) / np.cos(beta), np.cos(gamma) * np.tan(beta) + drive.sense * np.sin(gamma)]
        room = way - ratios[1] * ring_gap_mm if turned > 0 else 0.0
        if room <= 0:
            return 0.0, arm
        besides = [0.0, beyond_at(np.degrees(psi)), 0.0]
        return brentq(lambda F: sum(f * approach(f * F, c, b) for f, c, b in zip(ratios, curvatures, besides)) - room, 1e-9, 1e6), arm

    torque = 1e3 * drive.input_torque_nm / drive.lobes
    turned = brentq(lambda x: sum(force * arm for force, arm in (force_and_arm(tooth, x) for tooth in teeth)) - torque, 1e-9, 0.04, xtol=1e-13)
    return np.array([force_and_arm(tooth, turned)[0] for tooth in teeth]), turned


def calculated():
    """What the ring gives way under each tooth, by finite elements."""
    logging.getLogger("skfem").setLevel(logging.ERROR)
    found = []
    for angle_deg in (5.0, 6.5, 8.0):
        positions, beyond, wall = ring_and_wall(angle_deg)
        found += [dict(position_deg=position, beyond=value, beyond_wall=value - wall) for position, value in zip(positions, beyond)]
    found.sort(key=lambda tooth: tooth["position_deg"])
    RING_TEETH.write_text(json.dumps(dict(unit="(1 - ν²)/(π E L1)", teeth=found), indent=1, ensure_ascii=False) + "\n")


def main():
    if sys.argv[1:] != ["tables"]:
        calculated()
    found = json.loads(RING_TEETH.read_text())["teeth"]
    print(f"| ψ, ° | {' | '.join(format(tooth['position_deg'], '.1f') for tooth in found)} |\n|{'---|' * (len(found) + 1)}")
    print(f"| further than a straight wall | {' | '.join(format(tooth['beyond_wall'], '.2f') for tooth in found)} |\n")
    places, values = [tooth["position_deg"] for tooth in found], [tooth["beyond_wall"] for tooth in found]
    straight, bending = (lambda _: 0.0), (lambda degrees: np.interp(degrees, places, values))
    head = ["drive", "input angle, °", "gap", "model: peak", "worst tooth", "wind-up", "moved: peak", "worst tooth", "wind-up", "moved, teeth bend: peak", "worst tooth", "wind-up"]
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for case in json.loads((HERE / "results.json").read_text())["cases"]:
        forces = np.array([tooth["force_n"][0] for tooth in case["teeth"]])
        drive = DRIVES[case["drive"]]
        row = [drive.name, f"{case['input_angle_deg']:.2f}", "10 µm at the ring" if case["ring_gap_um"] else "10 µm at the slot" if case["slot_gap_um"] else "no gap"]
        for beyond_at, moves in ((straight, False), (straight, True), (bending, True)):
            if beyond_at is bending and drive.name != "5.2":
                row += ["", "", ""]
                continue
            of_model, turned = model(Case(drive, case["input_angle_deg"], case["ring_gap_um"], case["slot_gap_um"]), beyond_at, moves)
            row += [f"{100 * (of_model.max() / forces.max() - 1):+.1f} %", f"{100 * abs(of_model - forces).max() / forces.max():.1f} %",
                    f"{100 * (turned / case['wind_up_rad'] - 1):+.1f} %"]
        print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
