"""The service's DXF and SVG, opened by FreeCAD: every outline one closed wire, of the theory's area."""

import json
import sys
import tempfile
import unittest
import urllib.request

sys.path += ["/usr/share/freecad/Mod", "/usr/share/freecad/Mod/Draft"]

import FreeCAD
import Import
import importSVG
import Part

from cases import PAPER, example
from service import running_service
from theory import Theory

PATHS = {"ring": "ring", "wave_generator": "wave-generator", "carrier": "carrier", "teeth": "tooth"}


def setUpModule():
    global url
    url = unittest.enterModuleContext(running_service())


def wires_of(path, document, accept, suffix, read):
    """What FreeCAD makes of a drawing's outlines, each of which has to close."""
    headers = {"content-type": "application/json", "accept": accept}
    request = urllib.request.Request(f"{url}/v1/drawings/{path}", json.dumps(document).encode(), headers)
    opened = FreeCAD.newDocument()
    with urllib.request.urlopen(request) as response, tempfile.NamedTemporaryFile(suffix=suffix) as file:
        file.write(response.read())
        file.flush()
        read(file.name, opened.Name)
    edges = [edge for thing in opened.Objects for edge in thing.Shape.Edges]
    wires = [Part.Wire(sorted_edges) for sorted_edges in Part.sortEdges(edges)]
    FreeCAD.closeDocument(opened.Name)
    return wires


class Drawings(unittest.TestCase):
    def check(self, accept, suffix, read, tolerance):
        for name in PAPER:
            document = example(name) | {"profile": {"chord_tolerance_mm": 1e-3}}
            theory = Theory(document)
            for part, area_mm2 in theory.areas_mm2().items():
                with self.subTest(name, part=part):
                    wires = wires_of(PATHS[part], document, accept, suffix, read)
                    self.assertEqual(len(wires), {"ring": 2, "carrier": theory.installed}.get(part, 1))
                    self.assertTrue(all(wire.isClosed() for wire in wires))
                    areas = sorted((Part.Face(wire).Area for wire in wires), reverse=True)
                    # Areas of the theory are those of one prism; the ring's second wire is its hole.
                    found = areas[0] - areas[1] if part == "ring" else areas[0]
                    self.assertLess(abs(found / area_mm2 - 1), tolerance)

    def test_a_dxf_has_the_theorys_areas(self):
        self.check("image/vnd.dxf", ".dxf", Import.readDXF, 3e-5)

    def test_an_svg_has_the_theorys_areas_as_far_as_freecads_reader_takes_arcs(self):
        self.check("image/svg+xml", ".svg", importSVG.insert, 1e-3)


if __name__ == "__main__":
    unittest.main()
