"""Areas and positions from the theory alone (docs/explanation/theory.md), to hold the solids against.

Nothing here asks the service or FreeCAD. Everything is written over a parameter of the wave generator of which the tooth's
position psi is an explicit function: the angle phi of the cam's outward normal, or, of a path that is given, psi itself. For cams
the service works the other way round.
"""

import functools
import math
from dataclasses import dataclass, field

# What sets a part's surface back by itself.
EQUIDISTANT = {
    "wave_generator": "wave_generator_equidistant_um",
    "teeth": "tooth_radius_um",
    "ring": "ring_equidistant_um",
    "carrier": "slot_wall_um",
}
POINTS = 4000  # of the coarser of two polygons along a flank; extrapolated, its area is converged far below 1e-9
STEPS = 2000  # of the trapezoid rule over a whole turn, where it converges exponentially


def whole_turn(values_at):
    """The integral over a turn of what is periodic and smooth."""
    return math.fsum(values_at(2 * math.pi * i / STEPS) for i in range(STEPS)) * 2 * math.pi / STEPS


@dataclass(frozen=True)
class Ellipse:
    """Section 2.1."""

    a_mm: float
    b_mm: float
    lobes = 2

    def support(self, phi):
        """h, h' and h'' where the cam's normal stands at phi from a lobe."""
        a2, b2 = self.a_mm**2, self.b_mm**2
        h = math.sqrt(a2 * math.cos(phi) ** 2 + b2 * math.sin(phi) ** 2)
        h1 = -(a2 - b2) * math.sin(phi) * math.cos(phi) / h
        return h, h1, (-(a2 - b2) * math.cos(2 * phi) - h1 * h1) / h


@dataclass(frozen=True)
class Harmonic:
    """Section 2.9; of one lobe, an eccentric circle."""

    lobes: int
    mean_mm: float
    e_mm: float

    def support(self, phi):
        u, angle = self.lobes, self.lobes * phi
        return self.mean_mm + self.e_mm * math.cos(angle), -self.e_mm * u * math.sin(angle), -self.e_mm * u * u * math.cos(angle)


@dataclass(frozen=True)
class OfCam:
    """The path of the teeth around a cam (section 2.2), over phi."""

    cam: object
    r_mm: float

    @property
    def lobes(self):
        return self.cam.lobes

    def at(self, phi):
        """psi, the centre's radius d, and T = tan gamma."""
        h, h1, _ = self.cam.support(phi)
        return phi + math.atan2(h1, h + self.r_mm), math.hypot(h + self.r_mm, h1), -h1 / (h + self.r_mm)

    def cam_area_mm2(self, set_back_mm):
        """Of the inner parallel curve, whose support function is h less the distance: half the integral of h (h + h'')."""

        def density(phi):
            h, _, h2 = self.cam.support(phi)
            return (h - set_back_mm) * (h - set_back_mm + h2) / 2

        return whole_turn(density)


@dataclass(frozen=True)
class HarmonicPath:
    """The path that is given (section 2.9), over psi."""

    lobes: int
    mean_mm: float
    e_mm: float
    r_mm: float

    def at(self, psi):
        d = self.mean_mm + self.e_mm * math.cos(self.lobes * psi)
        return psi, d, self.e_mm * self.lobes * math.sin(self.lobes * psi) / d

    def cam_area_mm2(self, set_back_mm):
        """The cam is the path's inner parallel curve: A - s L + pi s^2."""
        s = self.r_mm + set_back_mm

        def length(psi):
            _, d, t = self.at(psi)
            return d * math.hypot(1, t)

        area_mm2 = math.pi * (self.mean_mm**2 + self.e_mm**2 / 2)
        return area_mm2 - s * whole_turn(length) + math.pi * s * s


def path_of(wave_generator, r_mm):
    """The path of the teeth's centres."""
    match wave_generator.get("kind", "ellipse"), wave_generator:
        case "ellipse", {"semi_major_mm": a_mm, "semi_minor_mm": b_mm}:
            return OfCam(Ellipse(a_mm, b_mm), r_mm)
        case "eccentric", {"radius_mm": radius_mm, "eccentricity_mm": e_mm}:
            return OfCam(Harmonic(1, radius_mm, e_mm), r_mm)
        case "harmonic", {"lobes": lobes, "mean_radius_mm": mean_mm, "amplitude_mm": e_mm}:
            return OfCam(Harmonic(lobes, mean_mm, e_mm), r_mm)
        case "harmonic_path", {"lobes": lobes, "mean_path_radius_mm": mean_mm, "amplitude_mm": e_mm}:
            return HarmonicPath(lobes, mean_mm, e_mm, r_mm)


@dataclass(eq=False)  # hashed by identity, for the cache
class Theory:
    """A drive as the design document has it, with the parts' clearances."""

    document: dict
    r_mm: float = field(init=False)

    def __post_init__(self):
        drive, parts = self.document["drive"], self.document.get("parts", {})
        teeth = drive["teeth"]
        self.r_mm = teeth["radius_mm"]
        self.is_ball = teeth.get("shape") == "ball"
        self.width_mm = 2 * self.r_mm if self.is_ball else teeth["width_mm"]
        self.half_width_mm = math.sqrt(self.r_mm**2 - teeth.get("flat_length_mm", 0.0) ** 2 / 4)  # across the slot
        self.count = teeth["count"]
        self.installed = teeth.get("installed", self.count)
        self.ring_teeth = drive["ring"]["teeth"]
        self.bore_mm = drive["ring"].get("tip_radius_mm")
        self.path = path_of(drive["wave_generator"], self.r_mm)
        self.lobes = self.path.lobes
        self.k = self.ring_teeth / self.lobes
        self.valley_rad = math.pi / self.lobes
        self.cam_outer_mm = self.path.at(0.0)[1] - self.r_mm
        self.parts = parts
        self.modification = self.document.get("modification", {})

    def clearance_mm(self, part):
        """How far a part's surface is set back, its equidistant modification included."""
        equidistant_um = self.modification.get(EQUIDISTANT[part], 0.0)
        return (self.parts.get(part, {}).get("clearance_um", 0.0) + equidistant_um) / 1000

    @property
    def turned_rad(self):
        return math.radians(self.modification.get("ring_rotation_arcsec", 0.0) / 3600)

    # --- The ring's flank (section 2.4)

    def flank_point(self, place, set_back_mm=0.0, is_modified=False):
        """Radius and angle, from the middle of the tooth space, of the ring's flank where the path's parameter has this value, before it is turned."""
        psi, d, t = self.path.at(place)
        shifted = d + self.modification.get("ring_path_shift_um", 0.0) / 1000 * is_modified
        beta = math.atan(self.k * t * d / shifted)
        d, reach = shifted, self.r_mm + set_back_mm
        relief = self.modification.get("ring_tip_relief")
        if relief and is_modified:
            start = math.radians(relief["start_deg"])
            share = max(0.0, (psi - start) / (self.engagement_rad() - start))
            reach += relief["amount_um"] / 1000 * share ** relief["power"]
        along, across = d + reach * math.cos(beta), reach * math.sin(beta)
        return math.hypot(along, across), psi / self.k + math.atan2(across, along)

    @functools.cache  # noqa: B019, few drives, all alive to the end
    def flank_end(self, set_back_mm=0.0, is_modified=False):
        """Where the flank ends, seen from the root: at the symmetry line of the ring's tooth, or at its bore. Flanks that are turned
        apart are over earlier, those turned together as they would be where they were."""
        tip_rad = math.pi / self.ring_teeth - max(0.0, self.turned_rad) * is_modified
        steps = 2000

        def is_over(place):
            radius_mm, angle = self.flank_point(place, set_back_mm, is_modified)
            return angle > tip_rad or (self.bore_mm is not None and radius_mm < self.bore_mm)

        for step in range(1, steps):
            low, high = (step - 1) * self.valley_rad / steps, step * self.valley_rad / steps
            if is_over(high):
                while low < (middle := (low + high) / 2) < high:
                    low, high = (low, middle) if is_over(middle) else (middle, high)
                return low
        return self.valley_rad

    def engagement_rad(self):
        """psi_e, of the working surfaces without clearances."""
        return self.path.at(self.flank_end())[0]

    def tip_radius_mm(self):
        return self.flank_point(self.flank_end())[0]

    # --- Areas

    def cam_area_mm2(self):
        bore = self.parts.get("wave_generator", {}).get("bore_radius_mm") or 0.0
        return self.path.cam_area_mm2(self.clearance_mm("wave_generator")) - math.pi * bore * bore

    def tooth_area_mm2(self):
        """Two arcs, and where there are flats two lines: sectors and triangles."""
        c = self.clearance_mm("teeth")
        r, w = self.r_mm - c, self.half_width_mm - c
        return 2 * (r * r * math.asin(w / r) + w * math.sqrt(r * r - w * w))

    def carrier_radii_mm(self):
        carrier = self.parts.get("carrier", {})
        play = 0.1 * (self.tip_radius_mm() - self.cam_outer_mm)
        return carrier.get("inner_radius_mm", self.cam_outer_mm + play), carrier.get("outer_radius_mm", self.tip_radius_mm() - play)

    def finger_area_mm2(self):
        """A sector of the annulus without the half of a slot on either side; parallel walls w from the slot's middle."""
        inner, outer = self.carrier_radii_mm()
        w = self.half_width_mm + self.clearance_mm("carrier")
        inner = max(inner, w / math.sin(math.pi / self.installed))

        def half_slot(radius):
            return (radius * radius * math.asin(w / radius) + w * math.sqrt(radius * radius - w * w)) / 2

        return math.pi / self.installed * (outer**2 - inner**2) - 2 * (half_slot(outer) - half_slot(inner))

    def ring_outer_radius_mm(self):
        c = self.clearance_mm("ring")
        root = self.flank_point(self.flank_start(c), c, True)[0]
        return self.parts.get("ring", {}).get("outer_radius_mm", 1.2 * root)

    def ring_opening_area_mm2(self, points=POINTS):
        """Inside the flanks, and inside the lands where the tips are bored. Two polygons, extrapolated."""
        c = self.clearance_mm("ring")
        end, start = self.flank_end(c, True), self.flank_start(c)

        def half_space(count):
            flank = [self.flank_point(start + (end - start) * i / count, c, True) for i in range(count + 1)]
            return math.fsum(p[0] * q[0] * math.sin(q[1] - p[1]) for p, q in zip(flank, flank[1:])) / 2

        coarse, fine = half_space(points), half_space(2 * points)
        radius_mm, angle = self.flank_point(end, c, True)
        land = radius_mm**2 * (math.pi / self.ring_teeth - angle - self.turned_rad) / 2
        root = self.flank_point(0.0, c, True)[0] ** 2 * max(0.0, self.turned_rad) / 2
        return 2 * self.ring_teeth * ((4 * fine - coarse) / 3 + land + root)

    def flank_start(self, set_back_mm):
        """Where flanks that are turned together cross in the middle of the space."""
        low, high = 0.0, self.valley_rad / 2
        if self.turned_rad >= 0:
            return low
        while low < (middle := (low + high) / 2) < high:
            is_beyond = self.flank_point(middle, set_back_mm, True)[1] + self.turned_rad > 0
            low, high = (low, middle) if is_beyond else (middle, high)
        return low

    def areas_mm2(self):
        return {
            "wave_generator": self.cam_area_mm2(),
            "teeth": self.tooth_area_mm2(),
            "carrier": self.finger_area_mm2(),
            "ring": math.pi * self.ring_outer_radius_mm() ** 2 - self.ring_opening_area_mm2(),
        }

    def volumes_mm3(self):
        """Of one solid of each part; a ball's too."""
        volumes = {part: area_mm2 * self.width_mm for part, area_mm2 in self.areas_mm2().items()}
        if self.is_ball:
            volumes["teeth"] = 4 / 3 * math.pi * (self.r_mm - self.clearance_mm("teeth")) ** 3
        return volumes

    # --- Who touches (section 3)

    def position_of_tooth_rad(self, tooth, input_angle_deg):
        """psi of a tooth, folded to the nearest lobe."""
        psi = 2 * math.pi * tooth / self.installed - math.radians(input_angle_deg) * self.ring_teeth / self.count
        return math.remainder(psi, 2 * math.pi / self.lobes)
