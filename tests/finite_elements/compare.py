"""Holds the service's model against results.json: the tables of docs/explanation/validation.md on standard output, and its plots beside it.

usage: compare.py TOOTHWAVE, the built program
"""

import csv
import json
import subprocess
import sys
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
PLOTS = HERE.parent.parent / "docs" / "explanation" / "validation"
# Each input angle of the cases is one of so many equal intervals of its drive's period; the more of them are for cases whose teeth lie aside in their slots.
INTERVALS, OF_THESE = 240, 25
CYLINDER_5_1 = {"count": 28, "radius_mm": 5.0, "width_mm": 15.0}
CYLINDER_5_2 = {"count": 80, "installed": 40, "radius_mm": 1.5, "width_mm": 15.0}
DRIVES = {
    "5.1": ({"wave_generator": {"semi_major_mm": 58.0, "semi_minor_mm": 56.0}, "teeth": CYLINDER_5_1, "ring": {"teeth": 26}}, 20.0),
    "5.2": ({"wave_generator": {"semi_major_mm": 50.7, "semi_minor_mm": 49.3}, "teeth": CYLINDER_5_2, "ring": {"teeth": 78}}, 3.0),
    "eccentric": ({"wave_generator": {"kind": "eccentric", "radius_mm": 30.8, "eccentricity_mm": 1.2},
                   "teeth": {"count": 20, "radius_mm": 2.0, "width_mm": 12.0}, "ring": {"teeth": 19}}, 5.0),
}
CONTACTS = ("wave_generator", "ring", "carrier")
COLOURS = {"wave_generator": "#1f6fb4", "ring": "#c2501d", "carrier": "#3d7f3a"}


# What of the model is refined: nothing; the ring's teeth bend; and the wave generator moves on besides.
REFINED = ({"ring_teeth_bend": False, "wave_generator_moves": False}, {"ring_teeth_bend": True, "wave_generator_moves": False}, {"ring_teeth_bend": True, "wave_generator_moves": True})
# The same, and teeth that meet the corners of tips.
AT_CORNERS = {**REFINED[-1], "corner_contact": True}


def swept(program, case, refined=REFINED[0]):
    drive, torque_nm = DRIVES[case["drive"]]
    document = {
        "drive": drive,
        "load": {"input_torque_nm": torque_nm},
        "model": {
            "compatibility": "virtual_work",
            "stiffness": {"law": "johnson", "depth_mm": {contact: case["depth_mm"] for contact in CONTACTS}},
            "clearance": {"ring_um": case["ring_gap_um"], "carrier_um": case["slot_gap_um"]},
            **refined,
        },
        "sweep": {"samples": INTERVALS * (OF_THESE if case["slot_gap_um"] else 1), "wind_up": True},
    }
    ask = lambda form: subprocess.run([program, "sweep", "-", "--format", form], input=json.dumps(document), capture_output=True, text=True, check=True).stdout
    rows = [{name: float(value) for name, value in row.items() if name != "loaded"} for row in csv.DictReader(ask("csv").splitlines())]
    angles = json.loads(ask("json"))["wind_up"]
    return rows, dict(zip(angles["input_angle_deg"], angles["wind_up_deg"]))


def back_deg(case):
    """How far back on the flank teeth stand that lie aside in their slots: the model's positions are those on the flank."""
    drive, _ = DRIVES[case["drive"]]
    radius_mm = 0.5 * (drive["wave_generator"]["semi_major_mm"] + drive["wave_generator"]["semi_minor_mm"]) + drive["teeth"]["radius_mm"] if case["slot_gap_um"] else 1.0
    return 57.29577951308232 * drive["ring"]["teeth"] / 2 * 1e-3 * case["slot_gap_um"] / radius_mm


def input_angle_deg(case):
    drive, _ = DRIVES[case["drive"]]
    return case["input_angle_deg"] + back_deg(case) * drive["teeth"]["count"] / drive["ring"]["teeth"]


def gap_of(case):
    if case["ring_gap_um"]:
        return f"{case['ring_gap_um']:.0f} µm at the ring"
    return f"{case['slot_gap_um']:.0f} µm at the slot" if case["slot_gap_um"] else "no gap"


def share(value):
    return f"{100 * value:+.1f} %"


def table(program, cases, refined):
    print("| drive | input angle, ° | gap | largest F_H, N | model | worst tooth | σ_H | σ_K | σ_S | wind-up, ° | model |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for case in cases:
        rows, wind_ups = swept(program, case, refined)
        at = min(wind_ups, key=lambda angle: abs(angle - input_angle_deg(case)))
        here = [row for row in rows if row["input_angle_deg"] == at]
        pairs = [(tooth, min(here, key=lambda row: abs(row["position_deg"] + back_deg(case) - tooth["position_deg"]))) for tooth in case["teeth"]]
        peak_n = max(tooth["force_n"][0] for tooth in case["teeth"])
        model_n = max(row["force_wave_generator_n"] for row in here)
        worst_n = max(abs(row["force_wave_generator_n"] - tooth["force_n"][0]) for tooth, row in pairs)
        stresses = []
        for contact, name in enumerate(CONTACTS):
            tooth, row = max(pairs, key=lambda pair: pair[0]["force_n"][contact])
            stresses.append(row[f"stress_{name}_mpa"] / tooth["pressure_mpa"][contact] - 1)
        wind_up_deg = case["wind_up_rad"] * 57.29577951308232
        print(f"| {case['drive']} | {case['input_angle_deg']:.2f} | {gap_of(case)} | {peak_n:.1f} | {share(model_n / peak_n - 1)} | {100 * worst_n / peak_n:.1f} % | "
              + " | ".join(share(stress) for stress in stresses) + f" | {wind_up_deg:.4f} | {share(wind_ups[at] / wind_up_deg - 1)} |")


def corner_table(program, cases, refined):
    """Of the tooth that is nearest to the flank's end besides."""
    print("| ψ, ° | gap | its F_H, N | model | largest F_H, N | model | worst tooth | wind-up, ° | model |")
    print("|---|---|---|---|---|---|---|---|---|")
    for case in sorted(cases, key=lambda case: (case["ring_gap_um"], -case["teeth"][-1]["position_deg"])):
        rows, wind_ups = swept(program, case, refined)
        at = min(wind_ups, key=lambda angle: abs(angle - input_angle_deg(case)))
        here = [row for row in rows if row["input_angle_deg"] == at]
        # A tooth that is not listed carries nothing.
        of_model = lambda deg: sum(row["force_wave_generator_n"] for row in here if abs(row["position_deg"] - deg) < 1e-3)
        forces_n = {tooth["position_deg"]: tooth["force_n"][0] for tooth in case["teeth"]}
        peak_n, last_deg = max(forces_n.values()), max(forces_n)
        worst_n = max(abs(of_model(deg) - force_n) for deg, force_n in forces_n.items())
        model_n = max(row["force_wave_generator_n"] for row in here)
        wind_up_deg = case["wind_up_rad"] * 57.29577951308232
        print(f"| {last_deg:.2f} | {gap_of(case)} | {forces_n[last_deg]:.1f} | {of_model(last_deg):.1f} | {peak_n:.1f} | {share(model_n / peak_n - 1)} | "
              f"{100 * worst_n / peak_n:.1f} % | {wind_up_deg:.4f} | {share(wind_ups[at] / wind_up_deg - 1)} |")


def plot(program, drive, cases):
    gaps = sorted({gap_of(case) for case in cases}, key=lambda gap: ("no gap", "ring", "slot").index("no gap" if gap == "no gap" else gap[-4:]))
    figure, panels = plt.subplots(1, len(gaps), figsize=(4.2 * len(gaps), 3.6), sharey=True, layout="constrained")
    for gap, panel in zip(gaps, panels):
        of_gap = [case for case in cases if gap_of(case) == gap]
        rows, _ = swept(program, of_gap[0])
        rows.sort(key=lambda row: row["position_deg"])
        for contact, name in enumerate(CONTACTS):
            panel.plot([row["position_deg"] for row in rows], [row[f"force_{name}_n"] for row in rows], color=COLOURS[name], linewidth=1)
            panel.plot([tooth["position_deg"] - back_deg(case) for case in of_gap for tooth in case["teeth"]],
                       [tooth["force_n"][contact] for case in of_gap for tooth in case["teeth"]], "o", markersize=4, markerfacecolor="none", color=COLOURS[name],
                       label=name.replace("_", " "))
        panel.set_title(f"{drive}, {gap}", fontsize=10)
        panel.set_xlabel("position ψ, °")
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("force, N")
    panels[0].legend(fontsize=8, frameon=False)
    PLOTS.mkdir(exist_ok=True)
    figure.savefig(PLOTS / f"{drive}.svg", metadata={"Date": None})
    plt.close(figure)


def main():
    program = sys.argv[1]
    plt.rcParams["svg.hashsalt"] = "validation"
    cases = json.loads((HERE / "results.json").read_text())["cases"]
    for refined in REFINED:
        print(refined)
        table(program, cases, refined)
        print()
    corners = json.loads((HERE / "corners.json").read_text())["cases"]
    for refined in (REFINED[-1], AT_CORNERS):
        print(refined)
        corner_table(program, corners, refined)
        print()
    for drive in DRIVES:
        plot(program, drive, [case for case in cases if case["drive"] == drive])


if __name__ == "__main__":
    main()
