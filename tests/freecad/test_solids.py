"""The solids, built from the running service, against the theory: volumes, contacts, clearances, exchange by STEP."""

import math
import tempfile
import unittest

import FreeCAD
import Part
import toothwave_client
import toothwave_drive
from cases import PAPER, Assembly, base_wires, designs, example, section_area_mm2
from service import running_service

STEPS_A_TURN = 24
MASS_PROPERTIES = 5e-6  # how far FreeCAD's own Volume may be off: it takes few points along a spline, however many spans it has


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
                for solid in sum(assembly.solids.values(), []):
                    self.assertEqual(solid.ShapeType, "Solid")
                    self.assertTrue(solid.isValid())
                    self.assertTrue(solid.isClosed())

    def test_volumes_are_the_theorys_areas_times_the_width(self):
        for name, document in designs().items():
            assembly = Assembly(service, document, input_angle_deg=17.0)
            width_mm = assembly.theory.width_mm
            for part, area_mm2 in assembly.theory.areas_mm2().items():
                for solid in assembly.solids[part]:
                    with self.subTest(name, part=part):
                        heights = {round(vertex.Z, 9) for vertex in solid.Vertexes}
                        self.assertEqual(heights, {0.0, width_mm})
                        off = abs(section_area_mm2(solid) / area_mm2 - 1)
                        worst.note("area of " + part, off)
                        self.assertLess(off, 1e-6)
                        off = abs(solid.Volume / (area_mm2 * width_mm) - 1)
                        worst.note("FreeCAD's volume of " + part, off)
                        self.assertLess(off, MASS_PROPERTIES)

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

    def setUp(self):
        self.maxDiff = None

    def assemblies(self):
        for name, document in designs().items():
            for step in range(STEPS_A_TURN):
                angle_deg = 360.0 * step / STEPS_A_TURN
                with self.subTest(name, input_angle_deg=angle_deg):
                    yield Assembly(service, document, angle_deg)

    def test_teeth_touch_cam_and_ring_where_they_carry_load_and_enter_neither(self):
        for assembly in self.assemblies():
            theory, tolerance_mm = assembly.theory, assembly.tolerance_mm
            cam_wire = base_wires(assembly.cam)[0]
            (ring_wire,) = base_wires(assembly.ring)[1]
            to_cam_mm = theory.r_mm + theory.clearance_mm("wave_generator")
            to_ring_mm = theory.r_mm + theory.clearance_mm("ring")
            engagement_rad = theory.engagement_rad()
            ring_face, cam_face = Part.Face(ring_wire), Part.Face(cam_wire)
            loaded = 0
            for centre, position_rad in zip(assembly.centres, assembly.positions_rad()):
                vertex = Part.Vertex(centre)
                off = vertex.distToShape(cam_wire)[0] - to_cam_mm
                worst.note("|distance to cam - r| mm", abs(off))
                self.assertLess(abs(off), tolerance_mm)
                self.assertFalse(cam_face.isInside(centre, 1e-9, True))
                self.assertTrue(ring_face.isInside(centre, 1e-9, True))
                off = vertex.distToShape(ring_wire)[0] - to_ring_mm
                worst.note("entering the ring mm", -off)
                self.assertGreater(off, -tolerance_mm)
                # The flanks that carry load and their mirror images, which would with the other sense of rotation.
                if abs(position_rad) <= engagement_rad:
                    loaded += 0 < position_rad
                    worst.note("|distance to ring - r| mm", abs(off))
                    self.assertLess(off, tolerance_mm)
                elif abs(position_rad) > engagement_rad + math.radians(15):
                    self.assertGreater(off, tolerance_mm, "a tooth past the trimmed flank touches nothing")
            expected = engagement_rad * theory.installed / math.pi
            self.assertLess(abs(loaded - expected), 2.0 + 1e-9, "teeth in both zones")

    def test_slot_walls_touch_the_teeth(self):
        for assembly in self.assemblies():
            theory = assembly.theory
            half_slot_mm = theory.r_mm + theory.clearance_mm("carrier")
            inner_mm, outer_mm = (math.sqrt(radius**2 - half_slot_mm**2) for radius in theory.carrier_radii_mm())
            fingers = assembly.solids["carrier"]
            for slot, centre in enumerate(assembly.centres):
                vertex = Part.Vertex(centre)
                for finger in (fingers[slot], fingers[slot - 1]):
                    off = vertex.distToShape(finger)[0] - half_slot_mm
                    worst.note("entering a slot's wall mm", -off)
                    self.assertGreater(off, -1e-9)
                    if inner_mm <= centre.Length <= outer_mm:
                        worst.note("|distance to slot's wall - r| mm", abs(off))
                        self.assertLess(off, 1e-9)

    def test_teeth_are_clear_of_each_other_cam_of_carrier_carrier_of_ring(self):
        axis = Part.Vertex(FreeCAD.Vector())
        for assembly in self.assemblies():
            theory = assembly.theory
            for one, other in zip(assembly.centres, assembly.centres[1:] + assembly.centres[:1]):
                self.assertGreater(one.distanceToPoint(other), 2 * theory.r_mm)
            cam_reach_mm = max(point.Length for point in base_wires(assembly.cam)[0].discretize(2000))
            carrier_from_mm = min(axis.distToShape(finger)[0] for finger in assembly.solids["carrier"])
            carrier_reach_mm = max(math.hypot(v.X, v.Y) for finger in assembly.solids["carrier"] for v in finger.Vertexes)
            ring_from_mm = axis.distToShape(base_wires(assembly.ring)[1][0])[0]
            self.assertLess(cam_reach_mm, carrier_from_mm)
            self.assertLess(carrier_reach_mm, ring_from_mm)

    def test_no_two_solids_have_a_volume_in_common(self):
        for name in (*PAPER, "ring-with-more-teeth"):
            for angle_deg in (0.0, 131.7):
                assembly = Assembly(service, example(name), angle_deg)
                theory, tolerance_mm = assembly.theory, assembly.tolerance_mm
                # A surface that is off by the tolerance makes a lens of that depth, so wide as a chord of that sagitta.
                lens_mm3 = 2 * tolerance_mm * 2 * math.sqrt(2 * tolerance_mm * theory.r_mm) * theory.width_mm
                parts = {part: Part.makeCompound(solids) for part, solids in assembly.solids.items()}
                pairs = (("teeth", "ring"), ("teeth", "wave_generator"), ("teeth", "carrier"), ("wave_generator", "carrier"), ("carrier", "ring"))
                for one, other in pairs:
                    with self.subTest(name, input_angle_deg=angle_deg, parts=(one, other)):
                        for solid in parts[one].common(parts[other]).Solids:
                            worst.note("common volume mm3", solid.Volume)
                            self.assertLess(solid.Volume, lens_mm3)


if __name__ == "__main__":
    unittest.main()
