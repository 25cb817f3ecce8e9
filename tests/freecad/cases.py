"""The drives that the tests build, and ways to look at FreeCAD's solids."""

import functools
import json
import math

import FreeCAD
import Part  # after FreeCAD: before it, it crashes

import toothwave_design
import toothwave_parts
from service import ROOT
from theory import Theory

PAPER = ("paper-5.1", "paper-5.2", "paper-5.2-bored")
KINDS = ("eccentric-roller", "harmonic-three-lobes", "harmonic-path", "balls", "flat-sided")  # one of each other kind
PIECES = 32  # of an edge that is no spline, for quadrature


def gauss_legendre(count):
    """Places and weights over -1 to 1: Legendre's roots by Newton's method."""
    for i in range(count):
        x = math.cos(math.pi * (i + 0.75) / (count + 0.5))
        for _ in range(10):
            before, value = 1.0, x
            for n in range(2, count + 1):
                before, value = value, ((2 * n - 1) * x * value - (n - 1) * before) / n
            slope = count * (x * value - before) / (x * x - 1)
            x -= value / slope
        yield x, 2 / ((1 - x * x) * slope * slope)


GAUSS = tuple(gauss_legendre(8))  # exact for the polynomials of degree 8 that solids have, times their slopes


def example(name):
    """A design document from examples/."""
    return json.loads((ROOT / "examples" / f"{name}.json").read_text(encoding="utf-8"))


def complete(document):
    """A document as the fields have it: kind and shape named, values that are the API's defaults left out."""
    document = json.loads(json.dumps(document))
    document["drive"]["wave_generator"].setdefault("kind", "ellipse")
    document["drive"]["teeth"].setdefault("shape", "cylinder")
    for field in toothwave_design.FIELDS:
        if field.default is not None and not field.blank and field.pointer and not field.is_object:
            *parents, key = field.pointer.strip("/").split("/")
            places = [document]
            for parent in parents:
                places.append(places[-1].get(parent, {}))
            if places[-1].get(key) == field.default:
                del places[-1][key]
                for place, parent, inner in reversed(list(zip(places, parents, places[1:]))):
                    if not inner:
                        del place[parent]
    return document


def with_clearances(document):
    """The same drive, every working surface set back by another distance, the cam bored."""
    parts = {
        part: {"clearance_um": um} for part, um in (("wave_generator", 7.0), ("teeth", 3.0), ("ring", 12.0), ("carrier", 5.0))
    }
    parts["wave_generator"]["bore_radius_mm"] = 20.0
    return document | {"parts": parts}


def designs():
    """All drives by name: the paper's, one with fewer teeth than its ring, one of each other kind, and those with clearances."""
    documents = {name: example(name) for name in (*PAPER, "ring-with-more-teeth", *KINDS)}
    documents |= {f"{name} with clearances": with_clearances(example(name)) for name in (*PAPER, *KINDS)}
    return documents


def modified():
    """Drives whose parts are made otherwise than conjugate, by name."""
    relief = {"amount_um": 30.0, "start_deg": 30.0, "power": 2.0}
    ring = {"ring_equidistant_um": 8.0, "ring_path_shift_um": -15.0, "ring_tip_relief": relief}
    others = {"wave_generator_equidistant_um": 4.0, "slot_wall_um": 3.0, "tooth_radius_um": 2.0}
    documents = {
        f"{name} modified": with_clearances(example(name)) | {"modification": ring | others}
        for name in ("paper-5.1", "paper-5.2", "harmonic-path")
    }
    for name, arcsec in (("eccentric-roller", 60.0), ("paper-5.2-bored", 60.0), ("paper-5.1", -60.0)):
        turned = {"ring_rotation_arcsec": arcsec, "ring_path_shift_um": 10.0}
        documents[f"{name} turned by {arcsec}"] = example(name) | {"modification": turned}
    return documents


@functools.lru_cache(maxsize=64)
def _solid(section):
    return toothwave_parts.solid_of(json.loads(section))


def solid_of(body):
    """Built once for all angles, as the drive does."""
    return _solid(json.dumps({key: body[key] for key in ("outer", "holes", "width_mm", "solid")}))


class Assembly:
    """All parts of a design at an input angle, built from one call."""

    def __init__(self, service, document, input_angle_deg=0.0):
        document = document | {"assembly": {"input_angle_deg": input_angle_deg}}
        drawing = service.drawing("assembly", document)
        self.theory = Theory(document)
        self.input_angle_deg = input_angle_deg
        self.tolerance_mm = drawing["chord_tolerance_mm"]
        bodies = {body["part"]: body for body in drawing["bodies"]}
        self.solids = {
            part: toothwave_parts.shape_of(body, solid_of(body)).Solids
            for part, body in bodies.items()
        }
        self.centres = [FreeCAD.Vector(place["x_mm"], place["y_mm"], 0) for place in bodies["teeth"]["placements"]]

    @property
    def ring(self):
        return self.solids["ring"][0]

    @property
    def cam(self):
        return self.solids["wave_generator"][0]

    def positions_rad(self):
        """psi of every tooth, from the theory, to the nearest lobe."""
        return [self.theory.position_of_tooth_rad(tooth, self.input_angle_deg) for tooth in range(len(self.centres))]


def base_wires(solid):
    """Outer wire and holes' wires of the face on which a prism stands."""
    (base,) = (face for face in solid.Faces if face.BoundBox.ZMax < 1e-6)
    outer = base.OuterWire
    return outer, [wire for wire in base.Wires if not wire.isSame(outer)]


def enclosed_area_mm2(wire):
    """By Green's theorem along the wire's own curves, span by span."""

    def along(edge):
        low, high = edge.ParameterRange
        curve = edge.Curve
        is_spline = isinstance(curve, Part.BSplineCurve)
        ends = curve.getKnots() if is_spline else [low + (high - low) * i / PIECES for i in range(PIECES + 1)]
        total = []
        for start, end in zip(ends, ends[1:]):
            for place, weight in GAUSS:
                parameter = (start + end) / 2 + place * (end - start) / 2
                point, tangent = edge.valueAt(parameter), edge.derivative1At(parameter)
                total.append(weight * (end - start) / 4 * (point.x * tangent.y - point.y * tangent.x))
        area = math.fsum(total)
        return -area if edge.Orientation == "Reversed" else area

    return abs(math.fsum(along(edge) for edge in wire.Edges))


def section_area_mm2(solid):
    """Area of the section of a prism."""
    outer, holes = base_wires(solid)
    return enclosed_area_mm2(outer) - sum(map(enclosed_area_mm2, holes))
