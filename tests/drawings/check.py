"""Drawings of the running service, read by ezdxf: every part opens without a fault and has the area of an independent calculation.

    check.py URL        with ezdxf installed (PyPI)

The ring's area is that of the envelope as docs/explanation/theory.md section 2 derives it, written here anew: contact points of the moving tooth,
as many as the areas are compared to.
"""

import io
import json
import math
import sys
import urllib.request
from math import atan, atan2, cos, hypot, pi, sin, sqrt

import ezdxf
from ezdxf.math import area, bulge_to_arc

# Half a tooth space in so many chords: their area is true to about 1e-9.
CHORDS = 20_000
# The service's chords are true to this, over some hundred millimetres.
CHORD_TOLERANCE_MM = 1e-4
RELATIVE_ERROR = 1e-5


def is_eccentric(design):
    return design["drive"]["wave_generator"].get("kind") == "eccentric"


def lobes(design):
    return 1 if is_eccentric(design) else 2


def contact(design, normal, clearance_mm):
    """Polar radius and angle of the flank where a tooth touches it, from the cam's normal angle."""
    cam, r = design["drive"]["wave_generator"], design["drive"]["teeth"]["radius_mm"]
    k = design["drive"]["ring"]["teeth"] / lobes(design)
    if is_eccentric(design):
        e = cam["eccentricity_mm"]
        h, dh = cam["radius_mm"] + e * cos(normal), -e * sin(normal)
    else:
        a, b = cam["semi_major_mm"], cam["semi_minor_mm"]
        h = hypot(a * cos(normal), b * sin(normal))
        dh = -(a * a - b * b) * sin(normal) * cos(normal) / h
    d, psi = hypot(h + r, dh), normal + atan(dh / (h + r))
    beta = atan(-k * dh / (h + r))
    distance = r + clearance_mm
    along, across = d + distance * cos(beta), distance * sin(beta)
    return hypot(along, across), psi / k + atan2(across, along)


def bisected(function, low, high):
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) < 0 else (low, middle)
    return low


def tooth_spaces_mm2(design, clearance_mm):
    """What the ring's flanks, tips and lands bound."""
    ring = design["drive"]["ring"]
    pitch = pi / ring["teeth"]
    overshoot = lambda normal: contact(design, normal, clearance_mm)[1] - pitch
    valley = pi / lobes(design)
    scan = [valley * i / 2000 for i in range(1, 2000)]
    beyond = next((normal for normal in scan if overshoot(normal) > 0), None)
    end = valley if beyond is None else bisected(overshoot, beyond - valley / 2000, beyond)
    bore = ring.get("tip_radius_mm")
    if bore and contact(design, end, clearance_mm)[0] < bore:
        end = bisected(lambda normal: bore - contact(design, normal, clearance_mm)[0], 0, end)
    points = [contact(design, end * i / CHORDS, clearance_mm) for i in range(CHORDS + 1)]
    half = sum(0.5 * r0 * r1 * sin(t1 - t0) for (r0, t0), (r1, t1) in zip(points, points[1:]))
    radius, angle = points[-1]
    return 2 * ring["teeth"] * (half + 0.5 * radius * radius * (pitch - angle))


def expected_mm2(part, design):
    drive, parts = design["drive"], design["parts"]
    cam, r = drive["wave_generator"], drive["teeth"]["radius_mm"]
    clearance_mm = {name: 1e-3 * group.get("clearance_um", 0) for name, group in parts.items()}
    if part == "tooth":
        return pi * (r - clearance_mm["teeth"]) ** 2
    if part == "wave-generator" and is_eccentric(design):
        return pi * ((cam["radius_mm"] - clearance_mm["wave_generator"]) ** 2 - parts["wave_generator"]["bore_radius_mm"] ** 2)
    if part == "wave-generator":
        a, b = cam["semi_major_mm"], cam["semi_minor_mm"]
        # Steiner: the inner parallel curve of a curve of length L bounds L c - pi c² less.
        steps = 10_000
        normals = [2 * pi * (i + 0.5) / steps for i in range(steps)]
        length = sum(hypot(a * cos(t), b * sin(t)) for t in normals) * 2 * pi / steps
        c = clearance_mm["wave_generator"]
        return pi * a * b - length * c + pi * c * c - pi * parts["wave_generator"]["bore_radius_mm"] ** 2
    if part == "carrier":
        inner, outer = (parts["carrier"][f"{edge}_radius_mm"] for edge in ("inner", "outer"))
        w = r + clearance_mm["carrier"]
        slot = lambda radius: w * sqrt(radius**2 - w**2) + radius**2 * math.asin(w / radius)
        return pi * (outer**2 - inner**2) - drive["teeth"].get("installed", drive["teeth"]["count"]) * (slot(outer) - slot(inner))
    return pi * parts["ring"]["outer_radius_mm"] ** 2 - tooth_spaces_mm2(design, clearance_mm["ring"])


def polyline_mm2(entity):
    """Chords by ezdxf, and the segments between arcs and their chords."""
    points = list(entity.get_points("xyb"))
    segments = 0.0
    for (x0, y0, bulge), (x1, y1, _) in zip(points, points[1:] + points[:1]):
        if bulge:
            _, start, end, radius = bulge_to_arc((x0, y0), (x1, y1), bulge)
            angle = (end - start) % (2 * pi)
            segments += math.copysign(0.5 * radius**2 * (angle - sin(angle)), bulge)
    signed = sum(0.5 * (x0 * y1 - x1 * y0) for (x0, y0, _), (x1, y1, _) in zip(points, points[1:] + points[:1]))
    assert abs(abs(signed) - area([(x, y) for x, y, _ in points])) <= 1e-9 * abs(signed)
    return signed + segments


def post(url, design, accept):
    headers = {"content-type": "application/json", "accept": accept}
    request = urllib.request.Request(url, json.dumps(design).encode(), headers)
    with urllib.request.urlopen(request, timeout=60) as response:
        return response.read()


def check(url, name, part, design):
    dxf = post(f"{url}/v1/drawings/{part}", design, "image/vnd.dxf")
    document = ezdxf.read(io.TextIOWrapper(io.BytesIO(dxf), encoding="ascii"))
    auditor = document.audit()
    faults = auditor.errors + auditor.fixes
    assert not faults, [fault.message for fault in faults]
    assert document.header["$INSUNITS"] == 4, "millimetres"
    sizes = []
    for entity in document.modelspace():
        hash_of_design = entity.get_xdata("TOOTHWAVE")[0].value
        assert "design" in hash_of_design, hash_of_design
        if entity.dxftype() == "CIRCLE":
            size = pi * entity.dxf.radius**2
        else:
            assert entity.dxftype() == "LWPOLYLINE" and entity.closed, entity
            size = abs(polyline_mm2(entity))
        sizes.append(size)
    # Fingers have no holes; of the other parts what bounds them comes first.
    found = sum(sizes) if part == "carrier" else sizes[0] - sum(sizes[1:])
    circles = [entity for entity in document.modelspace() if entity.dxftype() == "CIRCLE"]
    # The rim; an eccentric and its bore, or the bore; no finger; a tooth.
    wanted = {"ring": 1, "wave-generator": 1 + is_eccentric(design), "carrier": 0, "tooth": 1}[part]
    assert len(circles) == wanted, f"{name} {part}: {len(circles)} circles"
    expected = expected_mm2(part, design)
    error = abs(found / expected - 1)
    assert error < RELATIVE_ERROR, f"{name} {part}: {found} mm², expected {expected}"
    print(f"{name:22} {part:14} {found:16.6f} mm²  {expected:16.6f} expected  {error:.1e} off")


def main():
    url = sys.argv[1].rstrip("/")
    for name in ("paper-5.1", "paper-5.2", "paper-5.2-bored", "eccentric-roller"):
        with urllib.request.urlopen(f"{url}/v1/examples/{name}", timeout=60) as response:
            design = json.load(response)
        cam = design["drive"]["wave_generator"]
        r = design["drive"]["teeth"]["radius_mm"]
        design["profile"] = {"chord_tolerance_mm": CHORD_TOLERANCE_MM}
        if is_eccentric(design):
            lobe_mm, valley_mm = (cam["radius_mm"] + sign * cam["eccentricity_mm"] for sign in (1, -1))
        else:
            lobe_mm, valley_mm = cam["semi_major_mm"], cam["semi_minor_mm"]
        tip_mm = valley_mm + 2 * r
        parts = {
            "wave_generator": {"bore_radius_mm": valley_mm / 2},
            "teeth": {},
            "ring": {"outer_radius_mm": 1.25 * (lobe_mm + 2 * r)},
            "carrier": {"inner_radius_mm": lobe_mm + 0.1, "outer_radius_mm": tip_mm - 0.1},
        }
        for clearance_um in (0.0, 8.0):
            made = {group: {**fields, "clearance_um": clearance_um} for group, fields in parts.items()}
            for part in ("ring", "wave-generator", "carrier", "tooth"):
                check(url, f"{name} {clearance_um:.0f} µm", part, {**design, "parts": made})


if __name__ == "__main__":
    main()
