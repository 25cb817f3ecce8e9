"""The parametric object and its dialog: edits reach the solids, problems reach the eye, numbers are the service's."""

import math
import tempfile
import unittest

import FreeCAD
from PySide import QtGui

import toothwave_client
import toothwave_design
import toothwave_drive
from cases import KINDS, complete, example
from service import running_service
from theory import Theory

CAM_TOO_ROUND = (
    "The design is impossible\n/drive/wave_generator/semi_major_mm: the semi-major axis (50.0 mm) must exceed "
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
        solids = [self.document.getObject(name).Proxy.solid for name in toothwave_drive.PARTS.values()]
        self.drive.InputAngle = 30
        self.document.recompute()
        self.assertEqual(solids, [self.document.getObject(name).Proxy.solid for name in toothwave_drive.PARTS.values()])
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
        self.assertEqual((self.cell("A1"), self.cell("A2")), ("Problem", "The document has the wrong form"))
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


class Kinds(OfDrive):
    def shown(self):
        """Names of the properties that the property view shows."""
        return {name for name in self.drive.PropertiesList if "Hidden" not in self.drive.getEditorMode(name)}

    def test_every_example_is_a_drive_of_the_theorys_volumes_and_gives_its_document_back(self):
        for name in (*KINDS, "paper-5.2-bored"):
            with self.subTest(name):
                toothwave_drive.set_document(self.drive, example(name))
                self.document.recompute()
                self.assertEqual(self.drive.Problem, "")
                self.assertEqual(toothwave_drive.document_of(self.drive), complete(example(name)))
                theory = Theory(example(name))
                volumes_mm3 = theory.volumes_mm3()
                for part, object_name in toothwave_drive.PARTS.items():
                    count = theory.installed if part in ("carrier", "teeth") else 1
                    found_mm3 = self.volumes_mm3()[object_name]
                    self.assertAlmostEqual(found_mm3 / (count * volumes_mm3[part]), 1, delta=2e-5, msg=part)

    def test_teeth_become_balls_and_cylinders_again(self):
        volume_mm3 = self.volumes_mm3()["Teeth"]
        self.drive.ToothShape, self.drive.StiffnessLaw, self.drive.Compatibility = "ball", "hertz", "virtual_work"
        self.document.recompute()
        self.assertEqual(self.drive.Problem, "")
        self.assertAlmostEqual(self.volumes_mm3()["Teeth"], 28 * 4 / 3 * math.pi * 125, 6)
        self.assertAlmostEqual(self.document.Ring.Shape.BoundBox.ZMax, 10)
        # Of a prism as wide as the ball is high, with the same section.
        self.drive.ToothShape, self.drive.ToothWidth, self.drive.StiffnessLaw = "cylinder", 10, "default"
        self.document.recompute()
        self.assertAlmostEqual(self.volumes_mm3()["Teeth"], volume_mm3 * 10 / 15, 6)

    def test_properties_of_other_kinds_are_hidden(self):
        own = {
            "ellipse": {"SemiMajor", "SemiMinor"},
            "eccentric": {"CircleRadius", "Eccentricity"},
            "harmonic": {"Lobes", "MeanRadius", "Amplitude"},
            "harmonic_path": {"Lobes", "MeanPathRadius", "Amplitude"},
        }
        for kind, names in own.items():
            self.drive.WaveGeneratorKind = kind
            self.assertEqual(self.shown() & set().union(*own.values()), names)
        for name, value, appear in (
            ("ToothShape", "ball", {"WaveGeneratorGrooveRadius", "RingGrooveRadius", "CarrierGrooveRadius"}),
            ("ToothShape", "flat_sided", {"ToothWidth", "FlatLength"}),
            ("StiffnessLaw", "johnson", {"WaveGeneratorDepth", "RingDepth", "CarrierDepth"}),
            ("StiffnessLaw", "fixed", {"WaveGeneratorStiffnessNPerMm", "RingStiffnessNPerMm", "CarrierStiffnessNPerMm"}),
            (
                "FrictionKind",
                "plain",
                {f"{part}{of}" for part in ("WaveGenerator", "Ring", "Carrier") for of in ("Friction", "WearMm3PerNm")},
            ),
            ("FrictionKind", "rolling", {"BearingFriction", "BearingRadius", "BearingRatingN", "BearingElement"}),
            ("TipRelief", True, {"TipReliefUm", "TipReliefStart", "TipReliefPower"}),
        ):
            before = self.shown()
            setattr(self.drive, name, value)
            self.assertEqual(self.shown() - before, appear - before, value)
            self.assertLessEqual(appear, self.shown())
        # As a file has it, too.
        shown = self.shown()
        with tempfile.NamedTemporaryFile(suffix=".FCStd") as file:
            self.document.saveAs(file.name)
            FreeCAD.closeDocument(self.document.Name)
            self.document = FreeCAD.openDocument(file.name)
            self.drive = self.document.HarmonicDrive
            self.assertEqual(self.shown(), shown)

    def test_friction_and_speed_bring_losses_into_the_sheet(self):
        self.drive.FrictionKind, self.drive.InputSpeedRpm = "plain", 1500
        self.document.recompute()
        self.assertIn("losses.efficiency.ring_fixed", self.names())

    def names(self):
        """What stands in the spreadsheet's first column."""
        sheet = self.document.Results
        return [self.cell(f"A{row}") for row in range(1, sheet.Rows + 1) if sheet.getContents(f"A{row}")]

    def test_deviations_of_a_measured_drive_are_computed_with(self):
        runout = {"deviations": {"ring_runout": {"amount_um": 2.0, "angle_deg": 40.0}}}
        toothwave_drive.set_document(self.drive, example("flat-sided") | {"sweep": {"samples": 4}} | runout)
        self.drive.RingClearanceUm = 5.0  # else the ring interferes
        self.document.recompute()
        self.assertEqual(self.drive.Problem, "")
        self.assertEqual(toothwave_drive.document_of(self.drive)["deviations"], runout["deviations"])
        self.assertIn("sweep_period_deg", self.names())

    def test_other_fields_reach_the_service(self):
        self.drive.OtherFields = '{"profile": {"extent": "whole"}}'
        self.document.recompute()
        self.assertIn("/profile/extent", self.drive.Problem)
        self.drive.OtherFields = "{"
        self.document.recompute()
        self.assertIn("The other fields are no JSON", self.drive.getStatusString())
        self.drive.OtherFields = '{"profile": {"extent": "full"}}'
        self.document.recompute()
        self.assertEqual((self.drive.Problem, self.drive.State), ("", ["Up-to-date"]))

    def test_an_input_angle_beyond_a_turn_which_freecads_angles_do_not_hold_is_another_field(self):
        design = complete(example("paper-5.1")) | {"assembly": {"input_angle_deg": 392.3}}
        toothwave_drive.set_document(self.drive, design)
        self.document.recompute()
        self.assertEqual(toothwave_drive.document_of(self.drive), design)
        turned_deg = math.degrees(self.document.Carrier.Shape.Solids[0].Placement.Rotation.Angle)
        self.assertAlmostEqual(turned_deg, 392.3 / 14, 9)

    def test_what_is_out_of_its_range_reaches_the_service_as_it_is(self):
        self.drive.TipRadius = -5
        self.document.recompute()
        self.assertIn("/drive/ring/tip_radius_mm", self.drive.Problem)
        self.assertIn("-5", self.drive.Problem)

    def test_an_older_file_gets_the_fields_that_it_lacks_and_stays_the_same_drive(self):
        """Such as one of version 0.1, of ellipses and cylinders under three laws."""
        self.drive.OtherFields = ""
        of_0_1 = toothwave_drive.document_of(self.drive)
        for field in toothwave_design.FIELDS:
            if field.shown or field.name in ("WaveGeneratorKind", "ToothShape", "FrictionKind", "OtherFields"):
                if field.name not in ("SemiMajor", "SemiMinor", "ToothWidth"):
                    self.drive.removeProperty(field.name)
        self.drive.Compatibility = ["projection", "virtual_work"]
        self.drive.StiffnessLaw = ["linear", "fixed", "palmgren"]
        self.drive.Compatibility, self.drive.StiffnessLaw = "projection", "linear"
        with tempfile.NamedTemporaryFile(suffix=".FCStd") as file:
            self.document.saveAs(file.name)
            FreeCAD.closeDocument(self.document.Name)
            self.document = FreeCAD.openDocument(file.name)
        drive = self.document.HarmonicDrive
        self.assertEqual(toothwave_drive.document_of(drive), of_0_1)
        drive.StiffnessLaw, drive.Compatibility = "johnson", "virtual_work"
        self.document.recompute()
        self.assertEqual((drive.Problem, drive.State), ("", ["Up-to-date"]))


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
                told = list(sweep["findings"])
                told += [finding for finding in service.drawing("assembly", example(name))["findings"] if finding not in told]
                self.assertEqual([row[1] for row in findings], [finding["code"] for finding in told])
                for row, finding in zip(findings, told):
                    self.assertEqual((row[2], row[5], row[6]), (finding["value"], finding["detail"], finding["advice"]))

    def test_findings_of_the_parts_as_drawn_are_told_with_a_load_and_without(self):
        for torque_nm in (20, 0):
            self.drive.InputTorqueNm = torque_nm
            self.drive.CarrierInnerRadius, self.drive.CarrierOuterRadius = 58.1, 58.2
            self.document.recompute()
            self.assertIn("tooth_leaves_slot", [row[1] for row in self.rows().values()])

    def test_the_readme_names_the_cell_of_the_rings_stress(self):
        peaks = toothwave_client.Service(url).sweep(example("paper-5.1"))["peaks"]
        self.assertEqual(self.cell("C5"), peaks["ring"]["stress_mpa"]["value"])

    def rows(self):
        """By their first cell; findings, which may share it, by number."""
        sheet, rows = self.document.Results, {}
        for number in range(1, sheet.Rows + 1):
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

    def choose(self, name, value):
        """As a user does, in a list."""
        entry = self.panel.edits[name].entry
        entry.setCurrentIndex(self.panel.edits[name].field.choices.index(value))
        entry.activated.emit(entry.currentIndex())

    def shown(self):
        return {name for name, edit in self.panel.edits.items() if not edit.isHidden()}

    def test_it_shows_the_fields_that_the_property_view_shows(self):
        for name, value in (
            ("WaveGeneratorKind", "harmonic_path"),
            ("ToothShape", "flat_sided"),
            ("StiffnessLaw", "johnson"),
            ("FrictionKind", "rolling"),
        ):
            self.choose(name, value)
            self.assertTrue(self.panel.apply(), self.drive.Problem)
            self.assertEqual(self.drive.Problem, "")
            for field in toothwave_design.FIELDS:
                is_shown = "Hidden" not in self.drive.getEditorMode(field.name)
                self.assertEqual(field.name in self.shown(), is_shown, (value, field.name))
        self.panel.edits["TipRelief"].entry.setChecked(True)
        self.assertIn("TipReliefStart", self.shown())

    def test_every_kind_and_shape_can_be_chosen_and_what_must_suit_it_does(self):
        for kind in ("eccentric", "harmonic", "harmonic_path", "ellipse"):
            for shape in ("flat_sided", "ball", "cylinder"):
                with self.subTest(kind, shape=shape):
                    self.choose("WaveGeneratorKind", kind)
                    self.choose("ToothShape", shape)
                    self.assertTrue(self.panel.apply(), self.drive.Problem)
                    self.assertEqual(self.drive.Problem, "")
                    self.assertEqual(self.drive.RingTeeth, 27 if kind == "eccentric" else 26)

    def test_a_law_and_a_way_of_adding_up_that_do_not_go_together_give_way_to_the_one_chosen(self):
        for name, value, law, way in (
            ("StiffnessLaw", "johnson", "johnson", "virtual_work"),
            ("Compatibility", "projection", "default", "projection"),
            ("StiffnessLaw", "fixed", "fixed", "projection"),
            ("ToothShape", "ball", "fixed", "projection"),
            ("StiffnessLaw", "hertz", "hertz", "virtual_work"),
            ("Compatibility", "projection", "hertz", "virtual_work"),
            ("ToothShape", "cylinder", "default", "virtual_work"),
            ("StiffnessLaw", "hertz", "default", "virtual_work"),
        ):
            self.choose(name, value)
            self.assertEqual((self.panel.edits["StiffnessLaw"].value(), self.panel.edits["Compatibility"].value()), (law, way))
            self.assertTrue(self.panel.apply())
            self.assertEqual(self.drive.Problem, "")

    def test_another_number_of_lobes_changes_the_rings_teeth(self):
        self.choose("WaveGeneratorKind", "harmonic")
        for before, after in (("26", "24"), ("30", "32")):
            self.enter("RingTeeth", before)
            self.enter("Lobes", "4")
            self.panel.edits["Lobes"].entry.editingFinished.emit()
            self.assertEqual(self.panel.edits["RingTeeth"].entry.text(), after)

    def test_a_hidden_field_that_cannot_be_read_is_in_nobodys_way(self):
        self.choose("WaveGeneratorKind", "harmonic")
        self.enter("MeanRadius", "five")
        self.choose("WaveGeneratorKind", "ellipse")
        self.assertTrue(self.panel.apply())

    def test_other_fields_that_are_no_json_are_marked_and_not_sent(self):
        self.enter("OtherFields", "{")
        self.assertFalse(self.panel.apply())
        self.assertIn("The other fields are no JSON", self.panel.edits["OtherFields"].note.text())
        self.enter("OtherFields", '{"profile": {"extent": "tooth"}}')
        self.assertTrue(self.panel.apply())
        self.assertEqual(toothwave_drive.document_of(self.drive)["profile"], {"extent": "tooth"})

    def test_what_is_no_number_at_all_is_none(self):
        for text in ("nan", "inf", "1e999", "five"):
            self.enter("ToothRadius", text)
            self.assertFalse(self.panel.apply())
            self.assertEqual(self.panel.edits["ToothRadius"].note.text(), "a number is wanted here")

    def test_an_entry_that_nobody_touches_changes_nothing(self):
        self.drive.ToothRadius = 5 + 2**-50
        self.panel.edits["ToothRadius"].show_value(self.drive.ToothRadius)
        self.assertTrue(self.panel.apply())
        self.assertEqual(self.drive.ToothRadius.Value, 5 + 2**-50)

    def test_every_example_on_offer_can_be_taken(self):
        for index in range(1, self.panel.examples.count()):
            name = self.panel.examples.itemText(index)
            with self.subTest(name):
                self.panel._take_example(index)
                self.assertEqual((self.drive.Problem, self.drive.State), ("", ["Up-to-date"]))
                served = toothwave_client.Service(url).example(name)
                self.assertEqual(toothwave_drive.document_of(self.drive), complete(served))

    def test_findings_of_the_parts_as_drawn_are_told_at_the_top(self):
        self.enter("CarrierInnerRadius", "58.1")
        self.enter("CarrierOuterRadius", "58.2")
        self.assertTrue(self.panel.apply())
        self.assertIn("the centre of a tooth", self.panel.outcome.text())

    def test_the_slider_turns_the_drive(self):
        self.panel.slider.setValue(90)
        self.assertEqual(self.drive.InputAngle.Value, 45)
        self.assertEqual(self.panel.edits["InputAngle"].entry.text(), "45")

    def test_the_slider_follows_an_angle_that_is_typed_and_does_not_round_it(self):
        self.enter("InputAngle", "-327.7")
        self.assertTrue(self.panel.apply())
        self.assertEqual((self.panel.slider.value(), self.drive.InputAngle.Value), (65, -327.7))

    def test_an_angle_beyond_a_turn_is_objected_to_and_not_cut_short(self):
        self.enter("InputAngle", "392.3")
        self.assertFalse(self.panel.apply())
        self.assertIn("-360 to 360", self.panel.edits["InputAngle"].note.text())


if __name__ == "__main__":
    unittest.main()
