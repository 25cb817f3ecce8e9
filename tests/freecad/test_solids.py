"""The solids, built from the running service, against the theory: volumes, contacts, clearances, exchange by STEP."""

import itertools
import math
import tempfile
import unittest

import FreeCAD
import Part

import toothwave_client
import toothwave_drive
from cases import KINDS, PAPER, Assembly, base_wires, designs, example, section_area_mm2, with_clearances
from service import running_service

STEPS_A_TURN = 24
STEPS_A_TURN_OF_KINDS = 5
MASS_PROPERTIES = 2e-5  # how far FreeCAD's own Volume may be off: it takes few points along a spline, however many spans it has


def setUpModule():
    global service
    service = toothwave_client.Service(unittest.enterModuleContext(running_service()))


class Worst(dict):
    """The worst value of each kind, printed at the end: what the tests allow, and what there was."""

    def note(self, kind, value):
        self[kind] = max(self.get(kind, 0.0), value)


worst = Worst()


def tearDownModule():
    print("\nworst: " + ", ".join(f"{kind} {value:.2e}" for kind, value in worst.items()))


class Solids(unittest.TestCase):
    def test_every_prism_is_a_valid_closed_solid_and_none_is_missing(self):
        for name, document in designs().items():
            with self.subTest(name):
                assembly = Assembly(service, document, input_angle_deg=17.0)
                installed = assembly.theory.installed
                counts = {part: len(solids) for part, solids in assembly.solids.items()}
                self.assertEqual(counts, {"ring": 1, "wave_generator": 1, "carrier": installed, "teeth": installed})
                for solid in itertools.chain(*assembly.solids.values()):
                    self.assertEqual(solid.ShapeType, "Solid")
                    self.assertTrue(solid.isValid())
                    self.assertTrue(solid.isClosed())

    def test_volumes_are_the_theorys_areas_times_the_width(self):
        for name, document in designs().items():
            assembly = Assembly(service, document, input_angle_deg=17.0)
            width_mm, volumes_mm3 = assembly.theory.width_mm, assembly.theory.volumes_mm3()
            for part, area_mm2 in assembly.theory.areas_mm2().items():
                for solid in assembly.solids[part]:
                    with self.subTest(name, part=part):
                        off = abs(solid.Volume / volumes_mm3[part] - 1)
                        worst.note("FreeCAD's volume of " + part, off)
                        self.assertLess(off, MASS_PROPERTIES)
                        if part == "teeth" and assembly.theory.is_ball:
                            continue  # it has no section to stand on
                        heights = {round(vertex.Z, 9) for vertex in solid.Vertexes}
                        self.assertEqual(heights, {0.0, width_mm})
                        off = abs(section_area_mm2(solid) / area_mm2 - 1)
                        worst.note("area of " + part, off)
                        self.assertLess(off, 1e-6)

    def test_balls_stand_in_the_middle_of_the_prisms_and_have_the_volume_of_balls(self):
        assembly = Assembly(service, with_clearances(example("balls")), input_angle_deg=17.0)
        volume_mm3 = assembly.theory.volumes_mm3()["teeth"]
        for solid, centre in zip(assembly.solids["teeth"], assembly.centres):
            self.assertLess(abs(solid.Volume / volume_mm3 - 1), 1e-12)
            self.assertLess(solid.CenterOfMass.distanceToPoint(centre + FreeCAD.Vector(0, 0, 3.0)), 1e-9)

    def test_the_rings_area_in_the_theory_is_converged(self):
        for name, document in designs().items():
            with self.subTest(name):
                theory = Assembly(service, document).theory
                coarse, fine = (theory.ring_opening_area_mm2(points) for points in (2000, 4000))
                self.assertLess(abs(coarse / fine - 1), 1e-9)

    def test_step_gives_back_what_was_exported(self):
        for name in PAPER:
            with self.subTest(name), tempfile.NamedTemporaryFile(suffix=".step") as file:
                document = FreeCAD.newDocument()
                drive = toothwave_drive.make_drive(example(name), service.url, document)
                document.recompute()
                parts = [document.getObject(part) for part in toothwave_drive.PARTS.values()]
                Part.export(parts, file.name)
                read = Part.read(file.name)
                self.assertTrue(read.isValid())
                written = sorted(solid.Volume for part in parts for solid in part.Shape.Solids)
                back = sorted(solid.Volume for solid in read.Solids)
                self.assertEqual(len(back), len(written))
                for volume, expected in zip(back, written):
                    worst.note("volume through STEP", abs(volume / expected - 1))
                    self.assertLess(abs(volume / expected - 1), 1e-9)
                self.assertEqual(drive.Problem, "")
                FreeCAD.closeDocument(document.Name)


class Contacts(unittest.TestCase):
    """At every step of a turn: who must touch touches, and nothing runs into anything."""

    def at_every_step(self, check):
        for name, document in designs().items():
            if " with " in name and "5.1" not in name:
                continue
            steps = STEPS_A_TURN_OF_KINDS if name in KINDS else STEPS_A_TURN
            for step in range(steps):
                angle_deg = 360.0 * step / steps
                with self.subTest(name, input_angle_deg=angle_deg):
                    check(Assembly(service, document, angle_deg))

    def test_teeth_touch_cam_and_ring_where_they_carry_load_and_enter_neither(self):
        def check(assembly):
            theory, tolerance_mm = assembly.theory, assembly.tolerance_mm
            cam_wire = base_wires(assembly.cam)[0]
            (ring_wire,) = base_wires(assembly.ring)[1]
            engagement_rad = theory.engagement_rad()
            loaded = 0
            for centre, position_rad in zip(assembly.centres, assembly.positions_rad()):
                distance_mm, outward_mm = distance_and_outward_mm(centre, cam_wire)
                off = distance_mm - theory.r_mm - theory.clearance_mm("wave_generator")
                worst.note("|distance to cam - r| mm", abs(off))
                self.assertLess(abs(off), tolerance_mm)
                self.assertGreater(outward_mm, 0, "the tooth stands outside the cam")

                distance_mm, outward_mm = distance_and_outward_mm(centre, ring_wire)
                off = distance_mm - theory.r_mm - theory.clearance_mm("ring")
                worst.note("entering the ring mm", -off)
                self.assertGreater(off, -tolerance_mm)
                self.assertLess(outward_mm, 0, "the tooth stands inside the ring")
                # The flanks that carry load, and those that would with the other sense of rotation.
                if abs(position_rad) <= engagement_rad:
                    loaded += position_rad > 0
                    worst.note("|distance to ring - r| mm", abs(off))
                    self.assertLess(off, tolerance_mm)
                elif abs(position_rad) > engagement_rad + math.radians(15):
                    self.assertGreater(off, tolerance_mm, "past a flank that is cut short nothing touches")
            in_mesh = engagement_rad * theory.installed * theory.lobes / (2 * math.pi)
            self.assertLessEqual(abs(loaded - in_mesh), theory.lobes, "teeth in all zones")

        self.at_every_step(check)

    def test_slot_walls_touch_the_teeth(self):
        def check(assembly):
            theory = assembly.theory
            half_slot_mm = theory.half_width_mm + theory.clearance_mm("carrier")
            inner_mm, outer_mm = (math.sqrt(radius**2 - half_slot_mm**2) for radius in theory.carrier_radii_mm())
            fingers = assembly.solids["carrier"]
            for slot, centre in enumerate(assembly.centres):
                for finger in (fingers[slot], fingers[slot - 1]):
                    off = Part.Vertex(centre).distToShape(finger)[0] - half_slot_mm
                    worst.note("entering a slot's wall mm", -off)
                    self.assertGreater(off, -1e-9)
                    if inner_mm <= centre.Length <= outer_mm:
                        worst.note("|distance to slot's wall - r| mm", abs(off))
                        self.assertLess(off, 1e-9)

        self.at_every_step(check)

    def test_teeth_are_clear_of_each_other(self):
        def check(assembly):
            for one, other in zip(assembly.centres, assembly.centres[1:] + assembly.centres[:1]):
                self.assertGreater(one.distanceToPoint(other), 2 * assembly.theory.r_mm)

        self.at_every_step(check)

    def test_the_carrier_is_clear_of_cam_and_ring_however_it_stands(self):
        axis = Part.Vertex(FreeCAD.Vector())
        for name, document in designs().items():
            with self.subTest(name):
                assembly = Assembly(service, document)
                fingers = assembly.solids["carrier"]
                cam_reach_mm = max(point.Length for point in base_wires(assembly.cam)[0].discretize(2000))
                carrier_reach_mm = max(math.hypot(corner.X, corner.Y) for finger in fingers for corner in finger.Vertexes)
                self.assertLess(cam_reach_mm, min(axis.distToShape(finger)[0] for finger in fingers))
                self.assertLess(carrier_reach_mm, axis.distToShape(base_wires(assembly.ring)[1][0])[0])

    def test_no_two_solids_have_a_volume_in_common(self):
        """By booleans, with teeth thinner by the chord tolerance: of surfaces that only touch OCCT's booleans tell nothing."""
        pairs = (("ring", "teeth"), ("wave_generator", "teeth"), ("wave_generator", "carrier"), ("ring", "carrier"))
        for name in (*PAPER, "ring-with-more-teeth", *KINDS):
            # Of the other kinds teeth alone: how the carrier is clear of the rest follows from radii, as above.
            for angle_deg in (131.7,) if name in KINDS else (0.0, 131.7):
                thinner = example(name) | {"parts": {"teeth": {"clearance_um": 1.0}}}
                solids = Assembly(service, thinner, angle_deg).solids
                for one, other in pairs[:2] if name in KINDS else pairs:
                    with self.subTest(name, input_angle_deg=angle_deg, parts=(one, other)):
                        self.assertLess(common_mm3(solids[one][0], solids[other]), 1e-9)
                with self.subTest(name, input_angle_deg=angle_deg, parts=("carrier", "teeth")):
                    self.assertLess(sum(common_mm3(solids["carrier"][i], solids["teeth"]) for i in (0, 1)), 1e-9)

    def test_a_ring_half_a_tooth_off_has_a_volume_in_common_with_teeth(self):
        solids = Assembly(service, example("paper-5.1")).solids
        ring = solids["ring"][0].copy()
        ring.rotate(FreeCAD.Vector(), FreeCAD.Vector(0, 0, 1), 180 / 26)
        self.assertGreater(common_mm3(ring, solids["teeth"]), 100.0)


def distance_and_outward_mm(centre, wire):
    """How far it is to a wire around the axis, and how far the centre stands outside it, both from the wire's nearest point."""
    distance_mm, ((_, foot), *_), _ = Part.Vertex(centre).distToShape(wire)
    return distance_mm, (centre - foot).dot(foot) / foot.Length


def common_mm3(solid, others):
    """The volume that a solid shares with others."""
    return sum(piece.Volume for piece in solid.common(Part.makeCompound(others)).Solids)


if __name__ == "__main__":
    unittest.main()
