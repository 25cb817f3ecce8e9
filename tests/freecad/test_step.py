"""STEP straight from the service, read by FreeCAD: the theory's solids, closed, and material where it belongs."""

import json
import tempfile
import unittest
import urllib.request

import FreeCAD
import Part  # after FreeCAD: before it, it crashes

from cases import designs, example, modified, section_area_mm2
from service import running_service
from theory import Theory

PATHS = {"ring": "ring", "wave_generator": "wave-generator", "carrier": "carrier", "teeth": "tooth", None: "assembly"}

OWN_VOLUME = 6e-7  # how far OpenCascade's own volume may be off, exact for these solids but for how near their faces are to the theory's


def setUpModule():
    global url
    url = unittest.enterModuleContext(running_service())


def read(part, document):
    """The solids of a drawing."""
    headers = {"content-type": "application/json", "accept": "model/step"}
    request = urllib.request.Request(f"{url}/v1/drawings/{PATHS[part]}", json.dumps(document).encode(), headers)
    with urllib.request.urlopen(request) as response, tempfile.NamedTemporaryFile(suffix=".step") as file:
        file.write(response.read())
        file.flush()
        shape = Part.Shape()
        shape.read(file.name)
        return shape.Solids


class Step(unittest.TestCase):
    def test_every_prism_is_one_valid_closed_solid_of_the_theorys_area(self):
        worst = {}
        for name, document in (designs() | modified()).items():
            theory = Theory(document)
            for part, area_mm2 in theory.areas_mm2().items():
                with self.subTest(name, part=part):
                    solids = read(part, document)
                    self.assertEqual(len(solids), theory.installed if part == "carrier" else 1)
                    for solid in solids:
                        self.assertEqual((solid.ShapeType, solid.isValid(), solid.isClosed()), ("Solid", True, True))
                        # Edges meet at their vertices: a reader that had to close gaps would widen this.
                        self.assertLess(max(vertex.Tolerance for vertex in solid.Vertexes), 1e-6)
                        if part == "teeth" and theory.is_ball:
                            continue  # it has no section to stand on
                        self.assertEqual({round(vertex.Z, 9) for vertex in solid.Vertexes}, {0.0, theory.width_mm})
                        off = abs(section_area_mm2(solid) / area_mm2 - 1)
                        worst[part] = max(worst.get(part, 0.0), off)
                        self.assertLess(off, 1e-6)
                        own = abs(solid.Volume / (area_mm2 * theory.width_mm) - 1)
                        worst[f"volume of {part}"] = max(worst.get(f"volume of {part}", 0.0), own)
                        self.assertLess(own, OWN_VOLUME)
        print("\nSTEP, worst: " + ", ".join(f"{part} {off:.2e}" for part, off in worst.items()))

    def test_balls_are_balls_in_the_middle_of_the_prisms(self):
        for name, document in designs().items():
            theory = Theory(document)
            if not theory.is_ball:
                continue
            (ball,) = read("teeth", document)
            self.assertLess(abs(ball.Volume / theory.volumes_mm3()["teeth"] - 1), 1e-12, name)
            self.assertLess(ball.CenterOfMass.distanceToPoint(FreeCAD.Vector(0, 0, theory.width_mm / 2)), 1e-9)
            self.assertEqual({face.Surface.TypeId for face in ball.Faces}, {"Part::GeomSphere"})

    def test_an_eccentric_and_its_bore_are_cylinders(self):
        for clearance_um in (0.0, 50.0):
            part = {"bore_radius_mm": 10.0, "clearance_um": clearance_um}
            (cam,) = read("wave_generator", example("eccentric-roller") | {"parts": {"wave_generator": part}})
            curved = [face.Surface for face in cam.Faces if face.Surface.TypeId != "Part::GeomPlane"]
            self.assertEqual({surface.TypeId for surface in curved}, {"Part::GeomCylinder"})
            found = sorted({(round(surface.Radius, 9), round(surface.Center.x, 9)) for surface in curved})
            self.assertEqual(found, [(10.0, 0.0), (30.8 - clearance_um / 1000, 1.2)])

    def test_the_thinnest_walls_that_are_drawn_are_valid_solids(self):
        parts = {"wave_generator": {"bore_radius_mm": 56 - 6e-5}, "ring": {"outer_radius_mm": 68 + 7e-5}}
        for part in parts:
            (solid,) = read(part, example("paper-5.1") | {"parts": parts})
            self.assertTrue(solid.isValid() and solid.isClosed(), part)

    def test_material_is_inside_and_holes_are_outside(self):
        for name, document in designs().items():
            with self.subTest(name):
                (ring,), (cam,) = read("ring", document), read("wave_generator", document)
                height_mm = Theory(document).width_mm / 2
                self.assertTrue(ring.isInside(FreeCAD.Vector(ring.BoundBox.XMax - 0.5, 0, height_mm), 1e-6, False))
                self.assertFalse(ring.isInside(FreeCAD.Vector(0, 0, height_mm), 1e-6, False))
                is_bored = "clearances" in name
                self.assertEqual(cam.isInside(FreeCAD.Vector(0, 0, height_mm), 1e-6, False), not is_bored)
                self.assertTrue(cam.isInside(FreeCAD.Vector(30, 0, height_mm), 1e-6, False))
                self.assertGreater(min(ring.Volume, cam.Volume), 0.0)

    def test_an_assembly_holds_every_part_in_place(self):
        for name, document in designs().items():
            with self.subTest(name):
                installed = Theory(document).installed
                solids = read(None, document | {"assembly": {"input_angle_deg": 17.0}})
                self.assertEqual(len(solids), 2 + 2 * installed)
                self.assertTrue(all(solid.isValid() and solid.isClosed() for solid in solids))


if __name__ == "__main__":
    unittest.main()
