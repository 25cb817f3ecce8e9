#!/usr/bin/env python3
"""Loads of every kind of wave generator, tooth, modification and deviation, to 40 digits.

Writes family.json beside itself: what tests/calculation/reference.rs holds the answers to whole documents against.

    usage: python3 family.py

Geometry is that of friction.py: curves of the cam and of the path of the teeth's centres, differentiated numerically, and forces from the
balance of a tooth in the plane. Gaps are not the formulas of docs/explanation/theory.md section 4.8: each part's displacement is a vector, and the gap is how
far it takes the surface away from the tooth along the contact's normal. A tooth then gives way, by the laws of section 4.3 and with elliptic integrals
from mpmath, as far as the work of its three forces says; one rotation serves all teeth and is found by bisection and the rule of false position.
Speeds of the members are the one linear relation that each contact's rolling gives, in fractions.
"""

import json
import math
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

from mpmath import mp, mpf

from friction import CONTACTS, ELLIPSE, HARMONIC, HARMONIC_PATH, Drive, dot, left_of, tooth_at

mp.dps = 60
STEEL_MPA, POISSON = mpf(210000), mpf(0.3)
EACH = 2 * (1 - POISSON ** 2) / STEEL_MPA          # (1 - nu^2)/E of both bodies of a contact
PALMGREN_MM = mpf("3.84e-5")
ARCSEC = mp.pi / 648000
DIGITS = 25


def cam(kind, *numbers):
    names = {
        "ellipse": ("semi_major_mm", "semi_minor_mm"),
        "eccentric": ("radius_mm", "eccentricity_mm"),
        "harmonic": ("lobes", "mean_radius_mm", "amplitude_mm"),
        "harmonic_path": ("lobes", "mean_path_radius_mm", "amplitude_mm"),
    }[kind]
    return {"kind": kind} | dict(zip(names, numbers))


def document(wave_generator, count, ring_teeth, radius, torque, law, installed=None, samples=4, **more):
    teeth = {"shape": "cylinder", "count": count, "radius_mm": radius, "width_mm": 15.0}
    if installed:
        teeth["installed"] = installed
    teeth |= more.pop("teeth", {})
    if teeth["shape"] == "ball":
        del teeth["width_mm"]
    model = {"compatibility": "virtual_work", "stiffness": {"law": law}} | more.pop("model", {})
    return {
        "drive": {"wave_generator": wave_generator, "teeth": teeth, "ring": {"teeth": ring_teeth}},
        "load": {"input_torque_nm": torque},
        "model": model,
        "sweep": {"samples": samples, "wind_up": True},
    } | more


GAP = {"clearance": {"wave_generator_um": 3.0, "ring_um": 4.0, "carrier_um": 5.0}}
WIDE = {"clearance": {"ring_um": 60.0}}
FLAT = {"shape": "flat_sided", "flat_length_mm": 4.0}
BALL = {"shape": "ball"}
GROOVED = {"shape": "ball", "groove_radius_mm": {"wave_generator": 3.2, "ring": 3.15, "carrier": 3.1}}
MODIFICATION = {
    "ring_equidistant_um": 10.0, "ring_path_shift_um": 3.0, "ring_profile_shift_um": -2.0, "ring_rotation_arcsec": 20.0,
    "wave_generator_equidistant_um": 1.0, "slot_wall_um": 2.0, "carrier_rotation_arcsec": 5.0, "tooth_radius_um": 0.5,
    "ring_tip_relief": {"amount_um": 6.0, "start_deg": 40.0, "power": 2.5},
}


def lists(slots, spaces, lobes):
    """Deviations of everything: numbers without a pattern, each a few micrometres or arc seconds."""
    def numbers(count, seed, size):
        return [round(size * math.sin(7.3 * seed + 2.9 * i + 0.4 * i * i), 3) for i in range(count)]
    return {
        "tooth_radius_um": numbers(slots, 1, 1.5), "slot_angle_arcsec": numbers(slots, 2, 4.0),
        "slot_wall_um": numbers(slots, 3, 2.0), "ring_space_um": numbers(spaces, 4, 3.0),
        "ring_space_angle_arcsec": numbers(spaces, 5, 5.0), "wave_generator_lobe_um": numbers(lobes, 6, 2.0),
        "wave_generator_runout": {"amount_um": 2.0, "angle_deg": 40.0}, "ring_runout": {"amount_um": 3.0, "angle_deg": -70.0},
        "carrier_runout": {"amount_um": 1.5, "angle_deg": 110.0},
    }


ECCENTRIC = cam("eccentric", 30.8, 1.2)
THREE = cam("harmonic", 3, 48.0, 1.0)
PATH = cam("harmonic_path", 3, 52.0, 1.0)
HOLLOW = cam("harmonic_path", 3, 52.0, 5.5)
OVAL = cam("ellipse", 58.0, 56.0)

# name, document, intervals into the sweep at which it is looked at
CASES = [
    ("eccentric, ring with more teeth", document(ECCENTRIC, 20, 21, 2.0, 5.0, "johnson"), (0, 1)),
    ("eccentric, undercut", document(cam("eccentric", 20.0, 3.0), 11, 10, 3.5, 8.0, "linear", model={}), (1,)),
    ("eccentric, gaps", document(ECCENTRIC, 20, 19, 2.5, 5.0, "palmgren", model=GAP), (0, 3)),
    ("harmonic, three lobes", document(THREE, 36, 33, 2.5, 30.0, "linear"), (0, 2)),
    ("harmonic, zones unlike", document(THREE, 28, 25, 4.0, 30.0, "johnson", model=GAP), (0, 3)),
    ("harmonic, seven lobes", document(cam("harmonic", 7, 90.0, 0.5), 70, 63, 3.0, 60.0, "palmgren"), (1,)),
    ("harmonic path, one lobe", document(cam("harmonic_path", 1, 34.0, 1.2), 20, 19, 3.0, 5.0, "johnson"), (2,)),
    ("harmonic path, three lobes", document(PATH, 33, 36, 2.0, 30.0, "johnson", model=GAP), (0, 1)),
    ("harmonic path, hollow", document(HOLLOW, 12, 9, 6.0, 60.0, "linear"), (1,)),
    ("ellipse, zones unlike", document(OVAL, 27, 25, 5.0, 20.0, "johnson", model=WIDE), (0, 1)),
    ("balls", document(ECCENTRIC, 20, 21, 3.0, 5.0, "hertz", teeth=BALL), (0, 1)),
    ("balls, grooves and gaps", document(ECCENTRIC, 20, 21, 3.0, 5.0, "hertz", teeth=GROOVED, model=GAP), (0, 1)),
    ("balls, three lobes", document(THREE, 36, 33, 2.5, 20.0, "hertz", teeth=BALL), (2,)),
    ("balls, hollow path", document(HOLLOW, 12, 9, 6.0, 30.0, "hertz", teeth=BALL), (1,)),
    ("flats", document(OVAL, 28, 26, 5.0, 20.0, "johnson", teeth=FLAT), (1,)),
    ("flats beyond the carrier, gaps", document(OVAL, 28, 26, 5.0, 20.0, "palmgren", teeth=FLAT | {"flat_length_mm": 7.0},
                                                model=GAP), (1,)),
    ("flats, eccentric", document(ECCENTRIC, 20, 21, 3.0, 5.0, "linear", teeth=FLAT | {"flat_length_mm": 2.0}), (1,)),
    ("modified", document(OVAL, 28, 26, 5.0, 20.0, "johnson", modification=MODIFICATION), (0, 1)),
    ("modified, ring with more teeth", document(OVAL, 28, 30, 4.0, 20.0, "palmgren", modification=MODIFICATION), (2,)),
    ("modified eccentric", document(ECCENTRIC, 20, 21, 2.0, 5.0, "linear", modification=MODIFICATION, model=GAP), (1,)),
    ("modified balls", document(ECCENTRIC, 20, 21, 3.0, 5.0, "hertz", teeth=GROOVED, modification=MODIFICATION), (3,)),
    ("deviations", document(OVAL, 28, 26, 5.0, 20.0, "johnson", deviations=lists(28, 26, 2), model=WIDE), (0, 5, 1001)),
    ("deviations, every second slot", document(cam("ellipse", 50.7, 49.3), 80, 78, 1.5, 20.0, "linear", installed=40,
                                               deviations=lists(40, 78, 2), model=WIDE, samples=2), (3, 160)),
    ("deviations, eccentric", document(ECCENTRIC, 20, 21, 2.0, 5.0, "palmgren", deviations=lists(20, 21, 1), model=WIDE), (7, 66)),
    ("deviations, unlike lobes", document(THREE, 36, 33, 2.5, 30.0, "johnson", deviations=lists(36, 33, 3), model=WIDE), (9,)),
    ("deviations, balls", document(ECCENTRIC, 20, 21, 3.0, 5.0, "hertz", teeth=BALL, deviations=lists(20, 21, 1), model=WIDE), (30,)),
]


def drive_of(name, doc):
    wave_generator, teeth = doc["drive"]["wave_generator"], doc["drive"]["teeth"]
    kind, *numbers = wave_generator.values()
    lobes = {"ellipse": 2, "eccentric": 1}.get(kind) or numbers.pop(0)
    shape = {"ellipse": ELLIPSE, "eccentric": HARMONIC, "harmonic": HARMONIC, "harmonic_path": HARMONIC_PATH}[kind]
    installed = teeth.get("installed", teeth["count"])
    drive = Drive(name, shape, *numbers, lobes, teeth["count"], installed, doc["drive"]["ring"]["teeth"], teeth["radius_mm"], ())
    drive.alike = drive.alike and "deviations" not in doc
    drive.end = drive.flank_end()
    # The carrier whose radii are not given: a tenth of the annulus between cam and ring tips stays free on either side.
    low, tip = drive.distance(mpf(0)) - drive.radius, drive.ring_contact(drive.end)[0]
    high = mp.sqrt(dot(tip, tip))
    drive.carrier = (low + (high - low) / 10, high - (high - low) / 10)
    return drive


def placed(drive, moment):
    """Position, slot, lobe and ring space of the teeth in mesh: friction.py's places, with their numbers."""
    found = []
    for slot in range(drive.installed):
        for lobe in range(1 if drive.alike else drive.lobes):
            turn = Fraction(slot, drive.installed) - moment / drive.installed - Fraction(lobe, drive.lobes)
            turn -= math.floor(turn)
            psi = 2 * mp.pi * turn.numerator / turn.denominator
            if 0 < turn < Fraction(1, 2 * drive.lobes) and psi <= drive.end:
                # The carrier has turned by s U j/Z_G; the tooth stands before the middle of its space by s psi/k.
                input_turns = moment * Fraction(drive.teeth, drive.installed) / drive.ring_teeth
                turns = Fraction(slot, drive.installed) + drive.sense * Fraction(drive.lobes, drive.teeth) * input_turns
                turns += drive.sense * turn * Fraction(drive.lobes, drive.ring_teeth)
                space = turns * drive.ring_teeth
                assert space.denominator == 1, "a tooth stands between spaces"
                found.append((psi, slot, lobe, int(space) % drive.ring_teeth))
    return found


def direction(angle):
    return (mp.cos(angle), mp.sin(angle))


def gaps(drive, doc, tooth, slot, lobe, space):
    """How far the displaced surfaces stand away from the tooth, along the outward normals of its contacts."""
    outward = [tuple(-value for value in push) for push in tooth.pushes]
    points, s = tooth.points, drive.sense
    um = {name[:-3]: mpf(value) / 1000 for name, value in doc["model"].get("clearance", {}).items()}
    found = [um.get(contact, mpf(0)) for contact in CONTACTS]
    m, d = doc.get("modification", {}), doc.get("deviations", {})

    def mm(name):
        return mpf(m.get(name, 0)) / 1000

    def entry(name, index):
        return mpf(d[name][index]) if d.get(name) else mpf(0)

    def moved(contact, vector):
        return dot(vector, outward[contact])

    def turned(contact, angle):
        return angle * dot(left_of(points[contact]), outward[contact])

    thinner = mm("tooth_radius_um") + entry("tooth_radius_um", slot) / 1000
    found = [gap + thinner for gap in found]
    found[0] += mm("wave_generator_equidistant_um") + entry("wave_generator_lobe_um", lobe) / 1000
    found[1] += mm("ring_equidistant_um") + entry("ring_space_um", space) / 1000
    found[1] += moved(1, (mm("ring_path_shift_um"), mpf(0)))
    reach = mp.sqrt(dot(points[1], points[1]))
    found[1] += moved(1, tuple(mm("ring_profile_shift_um") * value / reach for value in points[1]))
    # Away from the flank under load the ring is turned against the carrier, the carrier with it.
    found[1] += turned(1, -s * ARCSEC * (mpf(m.get("ring_rotation_arcsec", 0)) + entry("ring_space_angle_arcsec", space)))
    found[2] += mm("slot_wall_um") + entry("slot_wall_um", slot) / 1000
    found[2] += turned(2, s * ARCSEC * (mpf(m.get("carrier_rotation_arcsec", 0)) + entry("slot_angle_arcsec", slot)))
    if relief := m.get("ring_tip_relief"):
        start = mpf(relief["start_deg"]) * mp.pi / 180
        if tooth.psi > start:
            share = (tooth.psi - start) / (drive.end - start)
            found[1] += mpf(relief["amount_um"]) / 1000 * share ** mpf(relief["power"])
    # Where the tooth's radius stands, seen in each part.
    seen = (
        tooth.psi + 2 * mp.pi * lobe / drive.lobes,
        2 * mp.pi * space / drive.ring_teeth - s * tooth.psi / drive.k,
        2 * mp.pi * slot / drive.installed,
    )
    for contact, (name, angle) in enumerate(zip(CONTACTS, seen)):
        if runout := d.get(f"{name}_runout"):
            vector = direction(mpf(runout["angle_deg"]) * mp.pi / 180 - angle)
            found[contact] += moved(contact, tuple(mpf(runout["amount_um"]) / 1000 * value for value in vector))
    return found


def curvatures(drive, tooth):
    r = drive.radius
    return (1 / r + tooth.cam_curvature, 1 / (r * tooth.regularity), 1 / r)


def half_axes(in_plane, axial):
    """Of a ball's contact under 1 N: in the plane of motion, along the axis; and the approach."""
    large, small = max(in_plane, axial), min(in_plane, axial)
    if large == small:
        k, K, E = mpf(1), mp.pi / 2, mp.pi / 2
    else:
        def off(t):
            k = mp.exp(-t)
            K, E = mp.ellipk(1 - k * k), mp.ellipe(1 - k * k)
            return mp.log((E / k ** 2 - K) / (K - E)) - mp.log(large / small)
        t = root(off, mp.log(large / small) / 4, mp.log(large / small))
        k = mp.exp(-t)
        K, E = mp.ellipk(1 - k * k), mp.ellipe(1 - k * k)
    long = mp.root(3 * E * EACH / (mp.pi * k ** 2 * (large + small)), 3)
    approach = 3 * EACH * K / (2 * mp.pi * long)
    return ((k * long, long) if in_plane >= axial else (long, k * long)), approach


def root(function, low, high):
    """By false position with bisection: the bracket's ends have unlike signs."""
    at_low, at_high = function(low), function(high)
    assert at_low * at_high < 0, "no bracket"
    side = 0
    for step in range(400):
        x = (low * at_high - high * at_low) / (at_high - at_low) if step % 4 else (low + high) / 2
        value = function(x)
        if value == 0 or abs(high - low) < abs(x) * mpf(10) ** -44:
            return x
        if value * at_low > 0:
            low, at_low = x, value
            at_high = at_high / 2 if side == 1 else at_high
            side = 1
        else:
            high, at_high = x, value
            at_low = at_low / 2 if side == 2 else at_low
            side = 2
    raise ArithmeticError("no root")


def contact_laws(drive, doc, tooth):
    """For each contact of a tooth the approach by the force, and the stress."""
    teeth, law = doc["drive"]["teeth"], doc["model"]["stiffness"]["law"]
    r, laws = drive.radius, []
    for index, (name, curvature) in enumerate(zip(CONTACTS, curvatures(drive, tooth))):
        if teeth["shape"] == "ball":
            groove = teeth.get("groove_radius_mm", {}).get(name)
            (x, y), q = half_axes(curvature, 1 / r - (1 / mpf(groove) if groove else 0))
            laws.append((lambda f, q=q: q * mp.root(f, 3) ** 2, lambda f, x=x, y=y: 3 * mp.root(f, 3) / (2 * mp.pi * x * y)))
            continue
        width = mpf(teeth["width_mm"])

        def johnson(f, curvature=curvature):
            half = mp.sqrt(4 * f * EACH / (mp.pi * width * curvature))
            one = f * EACH / (2 * mp.pi * width)
            return one * (2 * mp.log(4 * r / half) - 1) + one * (2 * mp.log(2 * r / half) - POISSON / (1 - POISSON))

        approach = {
            "linear": lambda f: f * 2 * EACH / (mp.pi * width),
            "palmgren": lambda f: PALMGREN_MM * f / mp.root(f, 10) / width ** (mpf(8) / 10),
            "johnson": johnson,
        }[law]
        stress = (lambda f, c=curvature: mp.sqrt(f * c / (mp.pi * width * EACH)))
        if index == 2 and teeth["shape"] == "flat_sided":
            flat = mpf(teeth["flat_length_mm"])
            low, high = max(tooth.distance - flat / 2, drive.carrier[0]), min(tooth.distance + flat / 2, drive.carrier[1])
            l = high - low
            assert l > 0
            diagonal = mp.sqrt(l * l + width * width)
            integral = mpf(2) / 3 * (3 * l * l * width * mp.asinh(width / l) + 3 * l * width ** 2 * mp.asinh(l / width)
                                     + l ** 3 + width ** 3 - diagonal ** 3)
            q = EACH * integral / (mp.pi * (l * width) ** 2)
            approach, stress = (lambda f, q=q: q * f), (lambda f, l=l: f / (l * width))
        laws.append((approach, stress))
    return laws


def cam_force(tooth, stretch):
    """The F_H under which a tooth gives way by this much along it, by the secant method in the logarithms."""
    if stretch <= 0:
        return mpf(0)

    def off(log_force):
        force = mp.exp(log_force)
        return mp.log(sum(f * law(force * f) for f, (law, _) in zip(tooth.ratios, tooth.laws)) / stretch)
    before, now = tooth.last, tooth.last + mpf("0.1")
    value_before, value = off(before), off(now)
    for _ in range(60):
        if value == value_before or abs(now - before) < mpf(10) ** -48:
            tooth.last = now
            return mp.exp(now)
        before, now, value_before = now, now - value * (now - before) / (value - value_before), value
        value = off(now)
    raise ArithmeticError("no force")


def state(drive, doc, moment):
    teeth = []
    for psi, slot, lobe, space in placed(drive, moment):
        tooth = SimpleNamespace(**vars(tooth_at(drive, psi, lobe)), slot=slot, space=space, last=mp.log(100))
        tooth.gaps = gaps(drive, doc, tooth, slot, lobe, space)
        tooth.gap = sum(f * gap for f, gap in zip(tooth.ratios, tooth.gaps))
        assert tooth.gap >= 0, "interference"
        tooth.laws = contact_laws(drive, doc, tooth)
        teeth.append(tooth)
    torque = 1000 * mpf(doc["load"]["input_torque_nm"]) / (drive.lobes if drive.alike else 1)

    def excess(rotation):
        return sum(cam_force(t, rotation * t.lever - t.gap) * t.lever for t in teeth) - torque
    first = min(t.gap / t.lever for t in teeth)
    high = first + mpf("1e-4")
    while excess(high) < 0:
        high = first + 2 * (high - first)
    rotation = root(excess, first, high)
    rows = []
    for tooth in teeth:
        force = cam_force(tooth, rotation * tooth.lever - tooth.gap)
        forces = [force * ratio for ratio in tooth.ratios]
        stresses = [law(f) if f else mpf(0) for f, (_, law) in zip(forces, tooth.laws)]
        rows.append({
            "position_deg": float(tooth.psi * 180 / mp.pi), "slot": tooth.slot, "lobe": tooth.lobe,
            "force_n": [mp.nstr(value, DIGITS) for value in forces], "stress_mpa": [mp.nstr(value, DIGITS) for value in stresses],
        })
    return {
        "wind_up_deg": mp.nstr(rotation * 180 / mp.pi, DIGITS), "unloaded_wind_up_deg": mp.nstr(first * 180 / mp.pi, DIGITS),
        "teeth": rows,
    }


def members(drive):
    """Input over output speed for each fixed member: against the carrier cam and ring turn by 1 and -s/k."""
    cam_speed, ring_speed = Fraction(1), -drive.sense * Fraction(drive.lobes, drive.ring_teeth)
    speed = {"wave_generator": cam_speed, "ring": ring_speed, "carrier": Fraction(0)}
    pairs = {"ring": ("wave_generator", "carrier"), "carrier": ("wave_generator", "ring"), "wave_generator": ("ring", "carrier")}
    ratios = {}
    for fixed, (one, other) in pairs.items():
        ratio = (speed[one] - speed[fixed]) / (speed[other] - speed[fixed])
        ratios[fixed] = [one, other, ratio.numerator, ratio.denominator]
    return ratios


def main():
    cases = []
    for name, doc, intervals in CASES:
        drive = drive_of(name, doc)
        samples = doc["sweep"]["samples"]
        states = [{"interval": n} | state(drive, doc, Fraction(n, samples)) for n in intervals]
        cases.append({"name": name, "document": doc, "alike": drive.alike, "members": members(drive), "states": states})
        print(name, sum(len(s["teeth"]) for s in states), flush=True)
    lines = ",\n".join(json.dumps(case, separators=(",", ":")) for case in cases)
    Path(__file__).with_name("family.json").write_text('{"cases": [\n' + lines + "\n]}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
