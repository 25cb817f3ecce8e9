"""Areas and positions from the theory alone (docs/theory.md), to hold the solids against.

Nothing here asks the service or FreeCAD. Everything is written over the angle phi of the cam's outward normal, of which the
tooth's position psi is an explicit function; the service works the other way round.
"""

import functools
import math
from dataclasses import dataclass, field

POINTS = 4000  # of the coarser of two polygons along a flank; extrapolated, its area is converged far below 1e-9


@dataclass(eq=False)  # hashed by identity, for the cache
class Theory:
    """A drive as the design document has it, with the parts' clearances."""

    document: dict
    a_mm: float = field(init=False)
    b_mm: float = field(init=False)
    r_mm: float = field(init=False)

    def __post_init__(self):
        drive, parts = self.document["drive"], self.document.get("parts", {})
        self.a_mm = drive["wave_generator"]["semi_major_mm"]
        self.b_mm = drive["wave_generator"]["semi_minor_mm"]
        self.r_mm = drive["teeth"]["radius_mm"]
        self.width_mm = drive["teeth"]["width_mm"]
        self.count = drive["teeth"]["count"]
        self.installed = drive["teeth"].get("installed", self.count)
        self.ring_teeth = drive["ring"]["teeth"]
        self.bore_mm = drive["ring"].get("tip_radius_mm")
        self.k = self.ring_teeth / 2
        self.parts = parts

    def clearance_mm(self, part):
        return self.parts.get(part, {}).get("clearance_um", 0.0) / 1000

    # --- The cam's support function and what follows from it (section 2)

    def support(self, phi):
        """h, h' and h'' where the cam's normal stands at phi from the major axis."""
        a2, b2 = self.a_mm**2, self.b_mm**2
        h = math.sqrt(a2 * math.cos(phi) ** 2 + b2 * math.sin(phi) ** 2)
        h1 = -(a2 - b2) * math.sin(phi) * math.cos(phi) / h
        return h, h1, (-(a2 - b2) * math.cos(2 * phi) - h1 * h1) / h

    def position_rad(self, phi):
        h, h1, _ = self.support(phi)
        return phi + math.atan2(h1, h + self.r_mm)

    def centre_radius_mm(self, phi):
        h, h1, _ = self.support(phi)
        return math.hypot(h + self.r_mm, h1)

    def flank_point(self, phi, set_back_mm=0.0):
        """Radius and angle, from the middle of the tooth space, of the ring's flank."""
        h, h1, _ = self.support(phi)
        beta = math.atan(self.k * -h1 / (h + self.r_mm))
        reach = self.r_mm + set_back_mm
        along, across = self.centre_radius_mm(phi) + reach * math.cos(beta), reach * math.sin(beta)
        return math.hypot(along, across), self.position_rad(phi) / self.k + math.atan2(across, along)

    @functools.cache  # noqa: B019, few drives, all alive to the end
    def flank_end_phi(self, set_back_mm=0.0):
        """Where the flank ends, seen from the root: at the symmetry line of the ring's tooth, or at its bore."""
        tip_rad = math.pi / self.ring_teeth
        steps = 2000

        def is_over(phi):
            radius_mm, angle = self.flank_point(phi, set_back_mm)
            return angle > tip_rad or (self.bore_mm is not None and radius_mm < self.bore_mm)

        for step in range(1, steps):
            low, high = (step - 1) * math.pi / 2 / steps, step * math.pi / 2 / steps
            if is_over(high):
                while low < (middle := (low + high) / 2) < high:
                    low, high = (low, middle) if is_over(middle) else (middle, high)
                return low
        return math.pi / 2

    def engagement_rad(self):
        """psi_e, of the working surfaces without clearances."""
        return self.position_rad(self.flank_end_phi())

    def tip_radius_mm(self):
        return self.flank_point(self.flank_end_phi())[0]

    # --- Areas

    def cam_area_mm2(self):
        """The ellipse, set back inward: a parallel curve's area is A - c L + pi c^2."""
        c = self.clearance_mm("wave_generator")
        steps = 400  # the trapezoid rule over a whole period converges exponentially
        length = (
            sum(h + h2 for h, _, h2 in map(self.support, (2 * math.pi * i / steps for i in range(steps)))) * 2 * math.pi / steps
        )
        bore = self.parts.get("wave_generator", {}).get("bore_radius_mm") or 0.0
        return math.pi * self.a_mm * self.b_mm - c * length + math.pi * (c * c - bore * bore)

    def tooth_area_mm2(self):
        return math.pi * (self.r_mm - self.clearance_mm("teeth")) ** 2

    def carrier_radii_mm(self):
        carrier = self.parts.get("carrier", {})
        play = 0.1 * (self.tip_radius_mm() - self.a_mm)
        return carrier.get("inner_radius_mm", self.a_mm + play), carrier.get("outer_radius_mm", self.tip_radius_mm() - play)

    def finger_area_mm2(self):
        """A sector of the annulus without the half of a slot on either side; parallel walls w from the slot's middle."""
        inner, outer = self.carrier_radii_mm()
        w = self.r_mm + self.clearance_mm("carrier")
        inner = max(inner, w / math.sin(math.pi / self.installed))

        def half_slot(radius):
            return (radius * radius * math.asin(w / radius) + w * math.sqrt(radius * radius - w * w)) / 2

        return math.pi / self.installed * (outer**2 - inner**2) - 2 * (half_slot(outer) - half_slot(inner))

    def ring_outer_radius_mm(self):
        root = self.a_mm + 2 * self.r_mm + self.clearance_mm("ring")
        return self.parts.get("ring", {}).get("outer_radius_mm", 1.2 * root)

    def ring_opening_area_mm2(self, points=POINTS):
        """Inside the flanks, and inside the lands where the tips are bored. Two polygons, extrapolated."""
        c = self.clearance_mm("ring")
        end_phi = self.flank_end_phi(c)

        def half_space(count):
            flank = [self.flank_point(end_phi * i / count, c) for i in range(count + 1)]
            return math.fsum(p[0] * q[0] * math.sin(q[1] - p[1]) for p, q in zip(flank, flank[1:])) / 2

        coarse, fine = half_space(points), half_space(2 * points)
        radius_mm, angle = self.flank_point(end_phi, c)
        land = radius_mm**2 * (math.pi / self.ring_teeth - angle) / 2
        return 2 * self.ring_teeth * ((4 * fine - coarse) / 3 + land)

    def areas_mm2(self):
        return {
            "wave_generator": self.cam_area_mm2(),
            "teeth": self.tooth_area_mm2(),
            "carrier": self.finger_area_mm2(),
            "ring": math.pi * self.ring_outer_radius_mm() ** 2 - self.ring_opening_area_mm2(),
        }

    # --- Who touches (section 3)

    def position_of_tooth_rad(self, tooth, input_angle_deg):
        """psi of a tooth, folded to within half a turn of the nearer end of the major axis: -pi/2 to pi/2."""
        psi = 2 * math.pi * tooth / self.installed - math.radians(input_angle_deg) * self.ring_teeth / self.count
        return math.remainder(psi, math.pi)
