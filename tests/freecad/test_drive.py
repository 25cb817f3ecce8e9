"""The parametric object and its dialog: edits reach the solids, problems reach the eye, numbers are the service's."""

import math
import tempfile
import unittest

import FreeCAD
from PySide import QtGui

import toothwave_client
import toothwave_drive
from cases import example
from service import running_service
from theory import Theory

CAM_TOO_ROUND = (
    "Values that no design can have\n/drive/wave_generator/semi_major_mm: the semi-major axis (50.0 mm) must exceed "
    "the semi-minor axis (56.0 mm): a round cam moves no tooth"
)


def setUpModule():
    global url
    url = unittest.enterModuleContext(running_service())


class OfDrive(unittest.TestCase):
    def setUp(self):
        self.document = FreeCAD.newDocument()
        self.addCleanup(lambda: FreeCAD.closeDocument(self.document.Name))
        self.drive = toothwave_drive.make_drive(example("paper-5.1"), url, self.document)
        self.document.recompute()

    def volumes_mm3(self):
        return {name: self.document.getObject(name).Shape.Volume for name in toothwave_drive.PARTS.values()}

    def cell(self, address):
        return self.document.Results.get(address)


class Object(OfDrive):
    def test_its_parts_stand_in_one_assembly_none_twice(self):
        names = [obj.Name for obj in self.document.Assembly.Group]
        self.assertEqual(names, ["HarmonicDrive", "Ring", "Carrier", "Teeth", "WaveGenerator", "Results"])
        self.assertEqual(len(self.document.Teeth.Shape.Solids), 28)

    def test_an_edit_changes_the_solids(self):
        self.drive.ToothRadius = 4.5
        self.drive.CamBoreRadius = 20
        self.document.recompute()
        design = example("paper-5.1") | {"parts": {"wave_generator": {"bore_radius_mm": 20.0}}}
        design["drive"]["teeth"]["radius_mm"] = 4.5
        areas = Theory(design).areas_mm2()
        for part, name in toothwave_drive.PARTS.items():
            count = 28 if part in ("carrier", "teeth") else 1
            self.assertAlmostEqual(self.volumes_mm3()[name] / (15 * count * areas[part]), 1, delta=2e-5, msg=name)

    def test_the_input_angle_moves_the_parts_without_building_them_anew(self):
        prisms = [self.document.getObject(name).Proxy.prism for name in toothwave_drive.PARTS.values()]
        self.drive.InputAngle = 30
        self.document.recompute()
        self.assertEqual(prisms, [self.document.getObject(name).Proxy.prism for name in toothwave_drive.PARTS.values()])
        for name, turned_deg in (("WaveGenerator", 30), ("Carrier", 30 / 14)):
            placement = self.document.getObject(name).Shape.Solids[0].Placement
            self.assertAlmostEqual(math.degrees(placement.Rotation.Angle), turned_deg, 9)
        self.assertEqual({state for obj in self.document.Objects for state in obj.State}, {"Up-to-date"})

    def test_an_impossible_drive_says_why_and_leaves_the_solids_and_the_results(self):
        volumes, peak = self.volumes_mm3(), self.cell("B2")
        self.drive.SemiMajor = 50
        self.document.recompute()
        self.assertEqual(self.drive.Problem, CAM_TOO_ROUND)
        self.assertIn(CAM_TOO_ROUND, self.drive.getStatusString())
        self.assertIn("Invalid", self.drive.State)
        self.assertEqual((self.volumes_mm3(), self.cell("B2")), (volumes, peak))
        self.drive.SemiMajor = 58
        self.document.recompute()
        self.assertEqual((self.drive.Problem, self.drive.State), ("", ["Up-to-date"]))

    def test_a_drive_without_a_load_is_drawn_and_the_sheet_says_what_is_missing(self):
        self.drive.InputTorqueNm = 0
        self.drive.ToothWidth = 20
        self.document.recompute()
        self.assertAlmostEqual(self.document.Teeth.Shape.BoundBox.ZMax, 20)
        self.assertEqual((self.cell("A1"), self.cell("A2")), ("Problem", "The document is no design document"))
        self.assertTrue(self.cell("A3").startswith("/load: forces need a load"))
        self.assertNotIn("Invalid", self.drive.State)

    def test_without_a_service_the_address_is_named(self):
        self.drive.ServiceUrl = "http://127.0.0.1:1"
        self.document.recompute()
        self.assertIn("No toothwave service answers at http://127.0.0.1:1", self.drive.getStatusString())

    def test_it_goes_on_from_a_file(self):
        with tempfile.NamedTemporaryFile(suffix=".FCStd") as file:
            self.document.saveAs(file.name)
            FreeCAD.closeDocument(self.document.Name)
            self.document = FreeCAD.openDocument(file.name)
            self.assertAlmostEqual(self.cell("B2"), 1429.443293502519, 9)
            self.document.Ring.touch()
            self.document.recompute()
            self.document.HarmonicDrive.ToothWidth = 12
            self.document.recompute()
            self.assertAlmostEqual(self.document.Ring.Shape.BoundBox.ZMax, 12)
            self.assertEqual({state for obj in self.document.Objects for state in obj.State}, {"Up-to-date"})


class Spreadsheet(OfDrive):
    def test_it_holds_the_peaks_and_findings_of_the_service(self):
        service = toothwave_client.Service(url)
        for name in ("paper-5.1", "paper-5.2", "paper-5.2-bored", "paper-5.1"):
            with self.subTest(name):
                toothwave_drive.set_document(self.drive, example(name))
                self.document.recompute()
                sweep = service.sweep(example(name))
                rows = self.rows()
                for column, (contact, peaks) in enumerate(sweep["peaks"].items(), 1):
                    self.assertEqual(rows["Peaks"][column], contact)
                    for quantity in ("force_n", "stress_mpa"):
                        for key, value in peaks[quantity].items():
                            self.assertEqual(rows[f"{quantity}.{key}"][column], value)
                self.assertEqual(rows["coincidence_degree"][1], sweep["coincidence_degree"])
                findings = [row for row in rows.values() if row[0] in ("info", "warning")]
                self.assertEqual([row[1] for row in findings], [finding["code"] for finding in sweep["findings"]])
                for row, finding in zip(findings, sweep["findings"]):
                    self.assertEqual((row[2], row[5], row[6]), (finding["value"], finding["detail"], finding["advice"]))

    def test_the_readme_names_the_cell_of_the_rings_stress(self):
        peaks = toothwave_client.Service(url).sweep(example("paper-5.1"))["peaks"]
        self.assertEqual(self.cell("C5"), peaks["ring"]["stress_mpa"]["value"])

    def rows(self):
        """By their first cell; findings, which may share it, by number."""
        sheet, rows = self.document.Results, {}
        for number in range(1, 60):
            row = [sheet.get(f"{c}{number}") if sheet.getContents(f"{c}{number}") else "" for c in "ABCDEFGH"]
            rows[number if row[0] in ("info", "warning", "") else row[0]] = row
        return rows


class Dialog(OfDrive):
    """The dialog's widgets, without FreeCAD's window around them."""

    @classmethod
    def setUpClass(cls):
        cls.application = QtGui.QApplication.instance() or QtGui.QApplication([])

    def setUp(self):
        super().setUp()
        import toothwave_panel

        self.panel = toothwave_panel.Panel(self.drive)

    def enter(self, name, text):
        self.panel.edits[name].entry.setText(text)

    def test_an_entry_reaches_the_solids(self):
        self.enter("ToothRadius", "4,75")
        self.assertTrue(self.panel.apply())
        self.assertEqual(self.drive.ToothRadius.Value, 4.75)
        self.assertIn("Stress at ring up to ", self.panel.stresses.text())

    def test_a_problem_stands_at_the_top_and_beside_the_field(self):
        self.enter("SemiMajor", "50")
        self.assertFalse(self.panel.apply())
        self.assertEqual(self.panel.outcome.text(), CAM_TOO_ROUND)
        self.assertIn(self.panel.edits["SemiMajor"].note.text(), CAM_TOO_ROUND)
        self.assertEqual(self.panel.edits["SemiMinor"].note.text(), "")
        self.enter("SemiMajor", "58")
        self.assertTrue(self.panel.apply())
        self.assertEqual(self.panel.edits["SemiMajor"].note.text(), "")

    def test_a_drive_that_is_drawn_without_a_load_can_be_kept(self):
        self.enter("InputTorqueNm", "")
        self.assertTrue(self.panel.apply())
        self.assertIn("/load: forces need a load", self.panel.outcome.text())
        self.assertEqual(self.panel.stresses.text(), "")

    def test_what_is_no_number_is_marked_and_not_sent(self):
        self.enter("RingTeeth", "26.5")
        self.enter("SemiMajor", "")
        self.assertFalse(self.panel.apply())
        self.assertEqual(self.panel.edits["RingTeeth"].note.text(), "a whole number is wanted here")
        self.assertEqual(self.panel.edits["SemiMajor"].note.text(), "a number is wanted here")
        self.assertEqual(self.drive.Problem, "")

    def test_examples_are_offered_and_taken(self):
        names = [self.panel.examples.itemText(index) for index in range(1, self.panel.examples.count())]
        self.assertIn("paper-5.2-bored", names)
        self.panel._take_example(1 + names.index("paper-5.2-bored"))
        self.assertEqual((self.drive.TipRadius.Value, len(self.document.Teeth.Shape.Solids)), (52.8227, 40))

    def test_the_slider_turns_the_drive(self):
        self.panel.slider.setValue(90)
        self.assertEqual(self.drive.InputAngle.Value, 45)
        self.assertEqual(self.panel.edits["InputAngle"].entry.text(), "45")


if __name__ == "__main__":
    unittest.main()
