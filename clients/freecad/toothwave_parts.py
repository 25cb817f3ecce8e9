"""A drawing of the service as FreeCAD's shapes: prisms on the plane of the section, or balls, each where the drawing puts it."""

import math

import Part
from FreeCAD import Placement, Rotation, Vector

Z = Vector(0, 0, 1)


def _points(edge):
    return [Vector(x_mm, y_mm, 0) for x_mm, y_mm in zip(edge["x_mm"], edge["y_mm"])]


def _direction(angle_deg):
    return Vector(math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg)), 0)


def _curve(edge):
    """One cubic spline through the points, with the directions at its ends.

    The parameter is the chords' length, so unit vectors are the right derivatives. OCCT's own scaling of tangents misses that
    and makes the first and last spans swing: the outline keeps its place, but volumes come out up to 0.2 % wrong.
    """
    points = _points(edge)
    lengths_mm = [0.0]
    for start, end in zip(points, points[1:]):
        lengths_mm.append(lengths_mm[-1] + start.distanceToPoint(end))
    spline = Part.BSplineCurve()
    spline.interpolate(
        Points=points,
        Parameters=lengths_mm,
        InitialTangent=_direction(edge["start_tangent_deg"]),
        FinalTangent=_direction(edge["end_tangent_deg"]),
        Scale=False,
    )
    return spline


def wire_of(outline):
    """The closed wire of an outline."""
    if outline["kind"] == "circle":
        return Part.Wire(Part.Circle(Vector(), Z, outline["radius_mm"]).toShape())
    makers = {
        "line": lambda edge: Part.LineSegment(*_points(edge)),
        "arc": lambda edge: Part.Arc(*_points(edge)),
        "curve": _curve,
    }
    return Part.Wire([makers[edge["kind"]](edge).toShape() for edge in outline["edges"]])


def prism_of(body):
    """The solid of a body's section, before it is put anywhere."""
    holes = [wire_of(hole) for hole in body["holes"]]
    for hole in holes:
        hole.reverse()  # outlines are counter-clockwise, all of them
    return Part.Face([wire_of(body["outer"]), *holes]).extrude(body["width_mm"] * Z)


def ball_of(body):
    """The ball of a tooth's section, before it is put anywhere: in the middle of the prism that the drawing has."""
    return Part.makeSphere(body["outer"]["radius_mm"], body["width_mm"] / 2 * Z)


def solid_of(body):
    """The solid that stands on a body's section, before it is put anywhere."""
    return {"prism": prism_of, "ball": ball_of}[body["solid"]](body)


def placement_of(placement):
    """Where a solid stands."""
    return Placement(Vector(placement["x_mm"], placement["y_mm"], 0), Rotation(Z, placement["rotation_deg"]))


def shape_of(body, solid):
    """The solid where it stands, or a compound of it where it stands several times; copies share their geometry."""
    copies = []
    for placement in body["placements"]:
        copy = Part.Shape(solid)
        copy.Placement = placement_of(placement)
        copies.append(copy)
    return copies[0] if len(copies) == 1 else Part.makeCompound(copies)
