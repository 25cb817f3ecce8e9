"""A drive's zone as elastic bodies: where its teeth stand, what they touch, and what follows when it is loaded.

Geometry comes from the supporting lines of the cam alone; contacts are found by looking for the nearest points, with the cam already turned
by about its wind-up, so that nothing of the solver's theory is used but the place of each slot.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from elastic import Body, Patch, graded, solve_contact, weights_of

E_MPA, NU = 210e3, 0.3


@dataclass(frozen=True)
class Drive:
    """Support function h(normal angle) and its derivative, lobes U, tooth radius, width, counts."""

    name: str
    support: object
    lobes: int
    radius_mm: float
    width_mm: float
    count: int
    installed: int
    ring_teeth: int
    input_torque_nm: float

    @property
    def sense(self):
        return 1 if self.count > self.ring_teeth else -1

    def offset_point(self, phi, distance_mm):
        h, slope = self.support(phi)
        n = np.array([np.cos(phi), np.sin(phi)])
        return (h + distance_mm) * n + slope * np.array([-n[1], n[0]])

    def normal_at(self, psi):
        """The normal's angle under a tooth at the position psi."""
        def error(phi):
            x, y = self.offset_point(phi, self.radius_mm)
            return np.arctan2(y * np.cos(psi) - x * np.sin(psi), x * np.cos(psi) + y * np.sin(psi))
        return brentq(error, psi - 0.7, psi + 0.7, xtol=1e-15)

    def center_radius_mm(self, psi):
        return np.hypot(*self.offset_point(self.normal_at(psi), self.radius_mm))

    def ring_point(self, middle_rad, psi):
        """The ring's flank, in the cam's frame at its start, where a tooth at psi touched it; `middle_rad` is the middle of its space."""
        step = 1e-5
        along = psi * self.lobes / self.ring_teeth
        angle = middle_rad - self.sense * along
        d = self.center_radius_mm(psi)
        # The normal of the path of centres, by differences.
        def center(p):
            a = middle_rad - self.sense * p * self.lobes / self.ring_teeth
            return self.center_radius_mm(p) * np.array([np.cos(a), np.sin(a)])
        tangent = center(psi + step) - center(psi - step)
        normal = np.array([tangent[1], -tangent[0]]) / np.hypot(*tangent)
        c = d * np.array([np.cos(angle), np.sin(angle)])
        if normal @ c < 0:
            normal = -normal
        return c + self.radius_mm * normal


def ellipse(a, b):
    def support(phi):
        h = np.hypot(a * np.cos(phi), b * np.sin(phi))
        return h, -(a - b) * (a + b) * np.sin(phi) * np.cos(phi) / h
    return support


def eccentric(radius_mm, eccentricity_mm):
    return lambda phi: (radius_mm + eccentricity_mm * np.cos(phi), -eccentricity_mm * np.sin(phi))


DRIVES = {
    "5.1": Drive("5.1", ellipse(58.0, 56.0), 2, 5.0, 15.0, 28, 28, 26, 20.0),
    "5.2": Drive("5.2", ellipse(50.7, 49.3), 2, 1.5, 15.0, 80, 40, 78, 3.0),
    "eccentric": Drive("eccentric", eccentric(30.8, 1.2), 1, 2.0, 12.0, 20, 20, 19, 5.0),
}


@dataclass(frozen=True)
class Case:
    drive: Drive
    input_angle_deg: float
    ring_gap_um: float = 0.0
    slot_gap_um: float = 0.0
    depth_mm: float = 5.0
    refinement: float = 1.0


def curve_lengths(points):
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def turned_by(angle_rad, point):
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])


class Chain:
    """The same curve again and again, each turned about the axis, joined end to end."""

    def __init__(self, pieces):
        self.pieces = pieces
        self.starts = np.concatenate([[0.0], np.cumsum([curve.total for curve, _ in pieces])])
        self.total = self.starts[-1]

    def length_at(self, piece, parameter):
        return self.starts[piece] + float(self.pieces[piece][0].length_at(parameter))

    def at(self, lengths):
        lengths = np.atleast_1d(lengths)
        which = np.clip(np.searchsorted(self.starts, lengths, side="right") - 1, 0, len(self.pieces) - 1)
        points = []
        for length, piece in zip(lengths, which):
            curve, turn = self.pieces[piece]
            points.append(turned_by(turn, curve.at(min(length - self.starts[piece], curve.total))))
        return np.array(points)


class SmoothCurve:
    """A curve over a parameter, by arc length, through splines, so that arcs keep their curvature."""

    def __init__(self, function, start, end, count=1201):
        from scipy.interpolate import CubicSpline
        u = np.linspace(start, end, count)
        points = np.array([function(x) for x in u])
        spline = CubicSpline(u, points)
        fine = np.linspace(start, end, 20 * count)
        lengths = curve_lengths(spline(fine))
        self.length_at = lambda x: np.interp(x, fine, lengths)
        self.spline = CubicSpline(lengths[:: 5], spline(fine[:: 5]))
        self.total = lengths[-1]

    def at(self, length):
        return self.spline(length)


def solve(case, turned_rad=None, engaged_rad=None, reach_rad=0.0):
    """Forces and pressures of one zone, and its wind-up; `turned_rad` is how far the cam is meshed as already turned.

    The flank ends at `engaged_rad`, in a corner of the ring that teeth up to `reach_rad` farther on may be pressed against.
    """
    drive = case.drive
    turned_rad = turned_rad or 0.0
    r, k = drive.radius_mm, drive.ring_teeth / drive.lobes
    j = np.radians(case.input_angle_deg)
    end = engaged_rad or np.pi / drive.lobes
    teeth = []
    for i in range(-drive.installed, 2 * drive.installed):
        psi = 2 * np.pi * i / drive.installed - j * drive.ring_teeth / drive.count
        if 1e-9 < psi <= end + reach_rad + 1e-12:
            teeth.append((i, psi))
    # What the load will be about, for the width of the patches: all on three teeth.
    lever = max(abs(drive.support(drive.normal_at(p))[1]) for _, p in teeth)
    about_n = 1e3 * drive.input_torque_nm / drive.lobes / lever / max(1.0, 0.35 * len(teeth)) / drive.width_mm
    modulus = E_MPA / (2 * (1 - NU**2))
    b = np.sqrt(8 * about_n * r / (np.pi * modulus)) * (1.3 if case.ring_gap_um or case.slot_gap_um else 1.0)
    half, cells = 1.6 * b, 2 * int(round(16 * case.refinement))
    step = 2 * half / cells
    s = np.linspace(-half, half, cells + 1)
    cam_curve = SmoothCurve(lambda phi: drive.offset_point(phi, 0.0), -0.35, np.pi / drive.lobes + 0.35)
    placed = []
    for i, psi in teeth:
        # The tooth against the wall that it will be pressed on, aside in its slot by the gap there, outward until it meets the turned cam.
        slot = np.array([np.cos(psi), np.sin(psi)])
        forward = np.array([-slot[1], slot[0]])
        aside_mm = 1e-3 * case.slot_gap_um
        aside_rad = brentq(lambda a: drive.center_radius_mm(psi - turned_rad + drive.sense * a) * np.sin(a) - aside_mm, -1e-12, 0.1, xtol=1e-15) if aside_mm else 0.0
        seen = psi - turned_rad + drive.sense * aside_rad
        phi = drive.normal_at(seen)
        d = drive.center_radius_mm(seen)
        center = d * (np.cos(aside_rad) * slot + drive.sense * np.sin(aside_rad) * forward)
        middle = psi + drive.sense * psi / k
        away = lambda p: np.hypot(*(drive.ring_point(middle, p) - center))
        near = minimize_scalar(away, bounds=(max(psi - 0.15, -0.5), min(psi + 0.15, end)), method="bounded", options={"xatol": 1e-11}).x
        # A search within bounds stops a little before them.
        near = end if reach_rad > 0.0 and end - near < 1e-6 else near
        ring_at = drive.ring_point(middle, near)
        placed.append(dict(number=i, psi=psi, center=center, phi=phi, ring_at=ring_at, near=near, middle=middle, slot=slot, forward=forward * drive.sense))

    # The three patches of each tooth: common normal from the tooth, nodes on both surfaces, gap between them.
    cosine, sine = np.cos(turned_rad), np.sin(turned_rad)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    for tooth in placed:
        n_cam = -(turn @ np.array([np.cos(tooth["phi"]), np.sin(tooth["phi"])]))
        n_ring = tooth["ring_at"] - tooth["center"]
        n_ring = n_ring / np.hypot(*n_ring)
        tooth["normals"] = [n_cam, n_ring, tooth["forward"]]
        tooth["along"] = [s, s, s]

    def on_tooth(tooth, normal, s):
        angle = np.arctan2(normal[1], normal[0]) + s / r
        return tooth["center"] + r * np.column_stack([np.cos(angle), np.sin(angle)])

    # Cam.
    cam_centers = cam_curve.length_at(np.array([tooth["phi"] for tooth in placed]))
    cam_nodes, cam_patches = outline_along(cam_curve.at, cam_curve.total, cam_centers, [s] * len(placed), step)
    cam_patches = [Patch(nodes @ turn.T, -tooth["normals"][0]) for nodes, tooth in zip(cam_patches, placed)]
    back = [drive.offset_point(phi, -case.depth_mm) for phi in np.linspace(np.pi / drive.lobes + 0.35, -0.35, 200)]
    outline = np.vstack([cam_nodes, back]) @ turn.T
    held = np.arange(len(cam_nodes), len(outline))
    cam = Body(outline, E_MPA, NU, cam_patches, held)

    # Ring: each space from tip to tip, counter-clockwise with the inside on the left of the material, so walked backwards.
    spaces = sorted({round(tooth["middle"], 12): tooth for tooth in placed}.values(), key=lambda tooth: tooth["middle"])
    pitch = 2 * np.pi / drive.ring_teeth
    middles = [spaces[0]["middle"] - pitch] + [tooth["middle"] for tooth in spaces] + [spaces[-1]["middle"] + pitch]
    first_middle, number_of_spaces = middles[0], round((middles[-1] - middles[0]) / pitch) + 1
    flank = SmoothCurve(lambda p: turned_by(-first_middle, drive.ring_point(first_middle, -drive.sense * p)), -end, end)
    chain = Chain([(flank, first_middle + space * pitch) for space in range(number_of_spaces)])
    centers = [chain.length_at(round((tooth["middle"] - first_middle) / pitch), -drive.sense * tooth["near"]) for tooth in placed]
    if reach_rad > 0.0:
        for tooth, center in zip(placed, centers):
            tooth["along"][1] = up_to_corner(s, drive.sense * (center - chain.length_at(round((tooth["middle"] - first_middle) / pitch), -drive.sense * end)), drive.sense)
    inner, patches = outline_along(chain.at, chain.total, centers, [tooth["along"][1] for tooth in placed], step)
    patches_ring = [Patch(nodes, -tooth["normals"][1]) for nodes, tooth in zip(patches, placed)]
    root = max(np.hypot(*inner.T))
    angles = np.linspace(first_middle + (number_of_spaces - 0.5) * pitch, first_middle - 0.5 * pitch, 200)
    outer = (root + case.depth_mm) * np.column_stack([np.cos(angles), np.sin(angles)])
    # Inner side counter-clockwise about the axis has the material on its right: turn the whole round.
    outline = np.vstack([inner, outer])[::-1]
    held = np.arange(0, len(outer))
    ring = Body(outline, E_MPA, NU, patches_ring, held)

    # One block stands for every wall of the carrier.
    wall = wall_block(s, step, case.depth_mm)

    # Unknowns: patches tooth by tooth (cam, ring, wall).
    count, nodes = len(placed), cells + 1
    flexibility = np.zeros((3 * count * nodes, 3 * count * nodes))
    gaps = np.zeros(3 * count * nodes)
    motions = np.zeros((3 * count * nodes, 2 * count + 1))
    place = lambda tooth, contact: slice((3 * tooth + contact) * nodes, (3 * tooth + contact + 1) * nodes)
    for one in range(count):
        for other in range(count):
            flexibility[place(one, 0), place(other, 0)] += cam.flexibility[one * nodes : (one + 1) * nodes, other * nodes : (other + 1) * nodes]
            ring_part = ring.flexibility[one * nodes : (one + 1) * nodes, other * nodes : (other + 1) * nodes]
            # The ring's nodes run as its outline does.
            flexibility[place(one, 1), place(other, 1)] += ring_part
        flexibility[place(one, 2), place(one, 2)] += wall.flexibility
    for index, tooth in enumerate(placed):
        surfaces = [on_tooth(tooth, *of_patch) for of_patch in zip(tooth["normals"], tooth["along"])]
        masses = [weights_of(along) for along in tooth["along"]]
        partners = [cam_patches[index].nodes_mm, patches_ring[index].nodes_mm, None]
        rim = disc_outline(tooth, r)
        body = Body(rim, E_MPA, NU, [Patch(surface, normal) for surface, normal in zip(surfaces, tooth["normals"])], None,
                    [(tooth["center"], 0), (tooth["center"], 1), (farthest(rim, tooth), 0)])
        for one in range(3):
            for other in range(3):
                part = body.flexibility[one * nodes : (one + 1) * nodes, other * nodes : (other + 1) * nodes]
                flexibility[place(index, one), place(index, other)] += part
        for contact, (normal, surface, partner) in enumerate(zip(tooth["normals"], surfaces, partners)):
            along = np.array([-normal[1], normal[0]])
            if contact == 2:
                gap = surface @ normal
                gap = gap.max() - gap
            else:
                # Both surfaces by the coordinate along the common tangent.
                x_tooth, x_partner = surface @ along, partner @ along
                order = np.argsort(x_partner)
                gap = np.interp(x_tooth, x_partner[order], (partner @ normal)[order]) - surface @ normal
                if contact == 1:
                    gap = gap + 1e-3 * case.ring_gap_um
                if x_partner[0] > x_partner[-1]:
                    # Partner's nodes run the other way: match them node by node.
                    tooth.setdefault("reversed", set()).add(contact)
            gaps[place(index, contact)] = masses[contact] @ gap
            motions[place(index, contact), 2 * index : 2 * index + 2] = masses[contact] @ np.tile(normal, (nodes, 1))
            if contact == 0:
                lever = partner[:, 0] * -normal[1] - partner[:, 1] * -normal[0]
                lever = lever[::-1] if 0 in tooth.get("reversed", ()) else lever
                motions[place(index, 0), -1] = masses[0] @ lever
    # Turn the partners' flexibilities round where their nodes run against the tooth's.
    for contact, body in ((0, cam), (1, ring)):
        block = np.zeros_like(flexibility)
        for one in range(count):
            for other in range(count):
                part = body.flexibility[one * nodes : (one + 1) * nodes, other * nodes : (other + 1) * nodes]
                flexibility[place(one, contact), place(other, contact)] -= part
                a = part[::-1] if contact in placed[one].get("reversed", ()) else part
                a = a[:, ::-1] if contact in placed[other].get("reversed", ()) else a
                block[place(one, contact), place(other, contact)] = a
        flexibility += block
    loads = np.zeros(2 * count + 1)
    loads[-1] = 1e3 * drive.input_torque_nm / drive.lobes / drive.width_mm
    pressure, motion = solve_contact(flexibility, gaps, motions, loads)
    rows = []
    for index, tooth in enumerate(placed):
        parts = [(pressure[place(index, contact)], weights_of(tooth["along"][contact])) for contact in range(3)]
        rows.append(dict(tooth=tooth["number"], position_deg=float(np.degrees(tooth["psi"])),
                         force_n=[float((mass @ p).sum() * drive.width_mm) for p, mass in parts], pressure_mpa=[largest_pressure(p, mass) for p, mass in parts],
                         reaches_edge=[bool(max(p[0], p[-1]) > 1e-3 * p.max() > 1e-6) for p, _ in parts]))
    return dict(teeth=rows, wind_up_rad=turned_rad + float(motion[-1]), turned_rad=turned_rad)


def largest_pressure(pressure, mass):
    """That of Hertz's distribution with the same force and the same square: of few elements over a narrow contact a single node says less.

    Of `p0 sqrt(1 - x²/b²)` the integral is `π/2 p0 b`, that of its square `4/3 p0² b`.
    """
    force = (mass @ pressure).sum()
    return float(3 * np.pi / 8 * (pressure @ mass @ pressure) / force) if force > 0 else 0.0


def wall_block(s, step, depth_mm):
    """A straight wall with one patch: as deep as it is held, twice as wide to either side."""
    side = graded(s[-1], 2 * depth_mm, step, 1.0, 1.0)
    line = np.concatenate([[-2 * depth_mm], -side[::-1], s, side, [2 * depth_mm]])
    face = np.column_stack([line, np.zeros_like(line)])
    back = np.linspace(2 * depth_mm, -2 * depth_mm, 20)
    outline = np.vstack([face, np.column_stack([back, np.full_like(back, depth_mm)])])
    return Body(outline, E_MPA, NU, [Patch(np.column_stack([s, 0 * s]), [0.0, -1.0])], np.arange(len(face), len(outline)))


def farthest(rim, tooth):
    """The highest point of the rim, which held sideways keeps the tooth from spinning: without friction nothing else does, or acts there."""
    return rim[np.argmax((rim - tooth["center"])[:, 1])]


def up_to_corner(s, room_mm, sense):
    """The places of a patch that ends at a corner, on the side of lesser lengths if `sense` is positive: at the corner itself the denser the nearer to it."""
    half, share = s[-1], np.linspace(0.0, 1.0, len(s))
    if room_mm >= half:
        return s
    places = half * share**2 if room_mm <= 0.0 else -room_mm + (half + room_mm) * share
    return places if sense > 0 else -places[::-1]


def outline_along(at, total, centers, places, step):
    """Points along a curve with a patch around each centre, and the patches."""
    centers = np.asarray(centers)
    order = np.argsort(centers)
    lengths, last, patches = [0.0], 0.0, [None] * len(centers)
    fine_start = 0.5
    for index in order:
        s = places[index]
        start, end = centers[index] + s[0], centers[index] + s[-1]
        lengths.extend(graded(last, start, fine_start if last == 0.0 else step, s[1] - s[0], 0.8))
        lengths.extend(centers[index] + s)
        last, step = end, s[-1] - s[-2]
    lengths.extend(graded(last, total, step, 0.5, 0.8))
    lengths.append(total)
    lengths = np.array(lengths)
    assert (np.diff(lengths) > 0).all(), "patches overlap or leave the curve"
    for index in range(len(centers)):
        patches[index] = at(centers[index] + places[index])
    return at(lengths), patches


def disc_outline(tooth, r):
    angles = []
    centers = sorted(((np.arctan2(n[1], n[0]) % (2 * np.pi), s) for n, s in zip(tooth["normals"], tooth["along"])), key=lambda of_patch: of_patch[0])
    for (a, s), (b, t) in zip(centers, centers[1:] + [(centers[0][0] + 2 * np.pi, centers[0][1])]):
        angles.extend(a + s / r)
        angles.extend(graded(a + s[-1] / r, b + t[0] / r, (s[-1] - s[-2]) / r, (t[1] - t[0]) / r, 0.6 / r if r > 2 else 0.25 / r))
    angles = np.array(angles)
    return tooth["center"] + r * np.column_stack([np.cos(angles), np.sin(angles)])


def settle(case, engaged_rad, first=0.0, reach_rad=0.0):
    """Meshes the cam anew until it is meshed where the load turns it."""
    turned = first
    for _ in range(4):
        result = solve(case, turned, engaged_rad, reach_rad)
        if abs(result["wind_up_rad"] - turned) < 0.02 * result["wind_up_rad"]:
            return result
        turned = result["wind_up_rad"]
    raise RuntimeError("the wind-up did not settle")


def single_contact(radius_mm, force_n_per_mm, depth_mm, refinement=1.0):
    """A disc pressed between two like blocks, held at their backs: the largest pressure, and how far the disc's middle comes nearer to a back."""
    modulus = E_MPA / (2 * (1 - NU**2))
    half = 1.6 * np.sqrt(4 * force_n_per_mm * radius_mm / (np.pi * modulus))
    cells = 2 * int(round(16 * refinement))
    s = np.linspace(-half, half, cells + 1)
    step, mass = s[1] - s[0], weights_of(s)
    wall = wall_block(s, step, depth_mm)
    tooth = dict(normals=[np.array([0.0, -1.0]), np.array([0.0, 1.0])], along=[s, s], center=np.zeros(2))
    rim = disc_outline(tooth, radius_mm)
    surfaces = [radius_mm * np.column_stack([np.cos(a + s / radius_mm), np.sin(a + s / radius_mm)]) for a in (-np.pi / 2, np.pi / 2)]
    disc = Body(rim, E_MPA, NU, [Patch(surface, normal) for surface, normal in zip(surfaces, tooth["normals"])], None,
                [((0, 0), 0), ((0, 0), 1), ((radius_mm, 0), 1)])
    nodes = cells + 1
    flexibility = disc.flexibility.copy()
    for contact in (0, 1):
        place = slice(contact * nodes, (contact + 1) * nodes)
        flexibility[place, place] += wall.flexibility
    gap = radius_mm * (1 - np.cos(s / radius_mm))
    gaps = np.concatenate([mass @ gap, mass @ gap])
    # The blocks come nearer to each other, the disc's middle stays.
    motions = np.concatenate([mass.sum(axis=1), mass.sum(axis=1)])[:, None]
    pressure, motion = solve_contact(flexibility, gaps, motions, np.array([2 * force_n_per_mm]))
    return largest_pressure(pressure[:nodes], mass), float(motion[0])
