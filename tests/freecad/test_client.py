"""The calls: what is imported, what is sent again and what is not, what is said when there is no answer."""

import ast
import email.utils
import json
import os
import sys
import threading
import time
import unittest
from http.server import BaseHTTPRequestHandler, HTTPServer
from unittest import mock

import FreeCAD
import toothwave_client
import toothwave_design
from cases import complete, designs, example
from service import DIES_WITHIN, ROOT, answer, host, running_service

CLIENT = ROOT / "clients/freecad"


class Imports(unittest.TestCase):
    def test_nothing_but_the_standard_library_and_freecad(self):
        own = {path.stem for path in CLIENT.glob("*.py")}
        of_freecad = {"FreeCAD", "FreeCADGui", "Part", "PySide"}
        for path in CLIENT.glob("*.py"):
            allowed = sys.stdlib_module_names | own
            if path.stem not in ("toothwave_client", "toothwave_design"):
                allowed |= of_freecad
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [name.name for name in node.names] if isinstance(node, ast.Import) else []
                names += [node.module] if isinstance(node, ast.ImportFrom) else []
                for name in names:
                    self.assertIn(name.split(".")[0], allowed, path.name)

    def test_every_file_is_python_3_8(self):
        """Neither its grammar nor what `str` and `dict` learnt in 3.9; `|` joins Qt's flags alone."""
        for path in [*CLIENT.glob("*.py"), *(ROOT / "clients/python").glob("*.py")]:
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), feature_version=(3, 8))):
                self.assertNotIn(getattr(node, "attr", ""), ("removeprefix", "removesuffix"), path.name)
                if isinstance(node, (ast.BinOp, ast.AugAssign)) and isinstance(node.op, ast.BitOr):
                    self.assertIn("QtGui", ast.unparse(node), path.name)

    def test_the_addon_manager_finds_the_workbench(self):
        metadata = FreeCAD.Metadata(str(ROOT / "package.xml"))
        (workbench,) = metadata.Content["workbench"]
        self.assertTrue(metadata.supportsCurrentFreeCAD())
        self.assertIn(f'version = "{metadata.Version}"', (ROOT / "Cargo.toml").read_text(encoding="utf-8"))
        self.assertIn(f"class {workbench.Classname}", (ROOT / workbench.Subdirectory / "InitGui.py").read_text(encoding="utf-8"))
        self.assertTrue((ROOT / workbench.Subdirectory / workbench.Icon).is_file())

    def test_no_file_depends_on_another_in_a_circle(self):
        """Imports within functions count too."""
        paths = {path.stem: path for path in CLIENT.glob("*.py")}
        uses = {}
        for stem, path in paths.items():
            tree = ast.parse(path.read_text(encoding="utf-8"))
            names = {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
            uses[stem] = names & set(paths)
        while uses:
            free = {stem for stem, names in uses.items() if not names & set(uses)}
            self.assertTrue(free, f"in a circle: {uses}")
            uses = {stem: names for stem, names in uses.items() if stem not in free}


# What has no field of its own, and why; it goes through the other fields.
NOT_IN_THE_FORM = {
    "/accuracy": "no drawing and no sweep reads it",
    "/parts/carrier/fingers": "no drawing and no spreadsheet cell reads it",
    "/parts/carrier/finger_fillet_radius_mm": "no drawing and no spreadsheet cell reads it",
    "/parts/carrier/strength": "no drawing and no spreadsheet cell reads it",
    "/load/cycle": "no drawing and no spreadsheet cell reads it",
    "/parts/ring/rim": "no drawing and no spreadsheet cell reads it",
    "/model/clearance": "deprecated: documents are converted",
    "/profile/extent": "no drawing and no sweep reads it",
    **{
        f"/deviations/{name}": "a list of measured items, one entry for each tooth, slot or space, is pasted as it is, not typed"
        for name in (
            "tooth_radius_um",
            "slot_angle_arcsec",
            "slot_wall_um",
            "ring_space_um",
            "ring_space_angle_arcsec",
            "wave_generator_lobe_um",
        )
    },
    "/load/duty": "a load spectrum is a list too",
    "/load/allowable_stress_mpa/": "one number for all contacts has a field",
    "/friction/wave_generator/coefficient of rolling": "nothing depends on it",
}


def api_values():
    """Schema of every value that a design document may have, by pointer, as the API document has it."""
    schemas = json.loads((ROOT / "openapi/openapi.json").read_text(encoding="utf-8"))["components"]["schemas"]

    def values(schema, place=""):
        for option in schema.get("oneOf", schema.get("allOf", [schema])):
            if option.get("deprecated"):
                continue
            option = schemas.get(option.get("$ref", "").rpartition("/")[2], option)
            if "oneOf" in option:
                yield from values(option, place)
            for key, value in option.get("properties", {}).items():
                yield from values(value, f"{place}/{key}")
            if "properties" not in option and "oneOf" not in option:
                yield place, option

    return values(schemas["Design"])


EVERYTHING = {
    "drive": {
        "wave_generator": {"kind": "harmonic_path", "lobes": 2, "mean_path_radius_mm": 52.0, "amplitude_mm": 1.0},
        "teeth": {"shape": "flat_sided", "count": 28, "installed": 14, "radius_mm": 4.0, "width_mm": 12.0, "flat_length_mm": 3.0},
        "ring": {"teeth": 26, "tip_radius_mm": 54.7},
    },
    "materials": {"teeth": {"youngs_modulus_gpa": 310.0, "poissons_ratio": 0.26}, "ring": {"poissons_ratio": 0.0}},
    "load": {"output_torque_nm": 200.0, "input_speed_rpm": 1500.0, "allowable_stress_mpa": 1500.0},
    "friction": {
        "wave_generator": {
            "kind": "race",
            "coefficient": 0.0,
            "bearing_coefficient": 0.0015,
            "bearing_radius_mm": 28.0,
            "bearing_element": "roller",
        },
        "ring": {"coefficient": 0.0},
        "carrier": {"coefficient": 0.05},
        "wear_rate_mm3_per_nm": {"wave_generator": 1e-6, "ring": 2e-6},
    },
    "deviations": {"ring_runout": {"amount_um": 3.0, "angle_deg": -40.0}, "carrier_runout": {"amount_um": 2.0}},
    "model": {
        "compatibility": "virtual_work",
        "stiffness": {"law": "johnson", "depth_mm": {"wave_generator": 5.0, "carrier": 7.0}},
        "series_compliance_mm_per_n": {"ring": 1e-7},
        "refinements": "none",
    },
    "modification": {
        "ring_equidistant_um": 4.0,
        "ring_path_shift_um": -2.0,
        "ring_profile_shift_um": 1.0,
        "ring_rotation_arcsec": 20.0,
        "wave_generator_equidistant_um": 1.0,
        "slot_wall_um": 1.0,
        "carrier_rotation_arcsec": -1.0,
        "tooth_radius_um": 0.5,
        "ring_tip_relief": {"amount_um": 0.0, "start_deg": 0.0, "power": 2.0},
    },
    "sweep": {"samples": 20, "wind_up": True},
    "profile": {"chord_tolerance_mm": 0.002},
    "parts": {
        "wave_generator": {"bore_radius_mm": 20.0, "clearance_um": 7.0},
        "teeth": {"clearance_um": 3.0},
        "ring": {"outer_radius_mm": 70.0, "clearance_um": 2.0},
        "carrier": {"inner_radius_mm": 49.5, "outer_radius_mm": 54.0, "clearance_um": 1.0},
    },
    "assembly": {"input_angle_deg": 12.5},
}


class Document(unittest.TestCase):
    def test_every_example_comes_back_from_the_fields_as_it_was(self):
        for path in (ROOT / "examples").glob("*.json"):
            with self.subTest(path.stem):
                document = example(path.stem)
                through = toothwave_design.document_of(toothwave_design.values_of(document))
                self.assertEqual(through, complete(document))

    def test_a_document_with_everything_comes_back_as_it_was_and_needs_no_other_fields(self):
        plain = {"kind": "plain", "coefficient": 0.03}
        friction = {"wave_generator": plain, "ring": {"coefficient": 0.05}, "carrier": {"coefficient": 0.0}}
        bearing = {"bearing_radius_mm": 28.0, "bearing_load_rating_n": 14000.0, "bearing_element": "ball"}
        rolling = {"kind": "rolling", "bearing_coefficient": 0.0} | bearing
        for change in ({}, {"friction": friction}, {"friction": friction | {"wave_generator": rolling}}):
            document = EVERYTHING | change
            values = toothwave_design.values_of(document)
            self.assertEqual(values["OtherFields"], "")
            self.assertEqual(toothwave_design.document_of(values), document)

    def test_a_document_of_an_earlier_version_is_converted(self):
        old = {"model": {"clearance": {"ring_um": 10.0, "carrier_um": 0.0}, "corner_contact": True}}
        new = {"model": {"refinements": ["auto", "corner_contact"]}, "parts": {"ring": {"clearance_um": 10.0}}}
        self.assertEqual(toothwave_design.converted(old), new)
        self.assertEqual(toothwave_design.converted({"model": {"ring_teeth_bend": False}}), {"model": {"refinements": "none"}})
        contradiction = {"model": {"clearance": {"ring_um": 10.0}}, "parts": {"teeth": {"clearance_um": 3.0}}}
        self.assertEqual(toothwave_design.converted(contradiction), contradiction)
        retired = {"RingGapUm": 5.0, "CarrierGapUm": 0.0, "CornerContact": False, "RingTeethBend": "default"}
        self.assertEqual(toothwave_design.with_retired({}, retired), {"model": {"clearance": {"ring_um": 5.0}}})

    def test_the_service_answers_it_as_it_would_have_been_answered(self):
        with running_service() as url:
            for name, document in (designs() | {"everything": EVERYTHING}).items():
                with self.subTest(name):
                    through = toothwave_design.document_of(toothwave_design.values_of(document))
                    service = toothwave_client.Service(url)
                    self.assertIs(service.drawing("assembly", through), service.drawing("assembly", document))
                    self.assertIs(service.sweep(through), service.sweep(document))

    def test_what_has_no_field_goes_through_the_other_fields(self):
        document = complete(example("flat-sided")) | {
            "deviations": {"tooth_radius_um": [1.0, -0.5], "ring_runout": {}},
            "load": {"input_torque_nm": 20.0, "allowable_stress_mpa": {"ring": 1500.0}},
            "profile": {"extent": "full"},
        }
        values = toothwave_design.values_of(document)
        self.assertEqual(set(json.loads(values["OtherFields"])), {"deviations", "load", "profile"})
        self.assertEqual(toothwave_design.document_of(values), document)

    def test_other_fields_that_are_none_or_have_a_field_of_their_own_are_objected_to(self):
        values = toothwave_design.values_of(example("paper-5.1"))
        for text, why in {
            "{": "are no JSON: ",
            "[]": "are no JSON object",
            '{"drive": {"ring": {"teeth": 28}}}': "/drive/ring/teeth has a field of its own",
            '{"load": 3}': "/load has a field of its own",
        }.items():
            with self.subTest(text), self.assertRaisesRegex(toothwave_design.NoDocument, why):
                toothwave_design.document_of(values | {"OtherFields": text})

    def test_what_a_field_cannot_hold_is_objected_to_and_not_rounded(self):
        for part, key, value in (
            ("wave_generator", "kind", "square"),
            ("teeth", "count", 28.5),
            ("teeth", "radius_mm", "thick"),
            ("teeth", "installed", [28]),
        ):
            document = example("paper-5.1")
            document["drive"][part][key] = value
            with self.subTest(key), self.assertRaisesRegex(toothwave_design.NoDocument, f"/drive/{part}/{key}: .*cannot hold"):
                toothwave_design.values_of(document)

    def test_what_is_not_set_is_left_out(self):
        document = toothwave_design.document_of(toothwave_design.values_of(toothwave_design.START))
        self.assertEqual(
            document,
            toothwave_design.START
            | {
                "drive": {
                    "wave_generator": {"kind": "ellipse", "semi_major_mm": 58.0, "semi_minor_mm": 56.0},
                    "teeth": {"shape": "cylinder", "count": 28, "radius_mm": 5.0, "width_mm": 15.0},
                    "ring": {"teeth": 26},
                }
            },
        )

    def test_a_document_has_the_fields_of_the_chosen_kinds_alone(self):
        values = toothwave_design.values_of(EVERYTHING)
        changed = {"WaveGeneratorKind": "eccentric", "ToothShape": "ball", "StiffnessLaw": "default"}
        document = toothwave_design.document_of(values | changed | {"FrictionKind": "none", "TipRelief": False})
        self.assertEqual(document["drive"]["wave_generator"], {"kind": "eccentric", "radius_mm": 57.0, "eccentricity_mm": 1.0})
        self.assertEqual(document["drive"]["teeth"], {"shape": "ball", "count": 28, "installed": 14, "radius_mm": 4.0})
        self.assertNotIn("stiffness", document["model"])
        self.assertNotIn("friction", document)
        self.assertNotIn("ring_tip_relief", document["modification"])
        self.assertEqual(toothwave_design.document_of(values), EVERYTHING)

    def test_what_the_service_sets_by_itself_is_denied_where_the_document_denies_it(self):
        for refinements in ("none", ["ring_teeth_bend"], ["auto", "corner_contact"]):
            design = complete(example("paper-5.2")) | {"model": {"refinements": refinements}}
            with self.subTest(refinements):
                through = toothwave_design.document_of(toothwave_design.values_of(design))
                self.assertEqual(through["model"], {"refinements": refinements})
        silent = {name: part for name, part in complete(example("paper-5.2")).items() if name != "model"}
        self.assertNotIn("model", toothwave_design.document_of(toothwave_design.values_of(silent)))

    def test_there_is_a_field_for_all_that_drawings_and_sweeps_read(self):
        known = {field.pointer for field in toothwave_design.FIELDS}
        # In place of the three compliances one word may stand.
        missing = {pointer for pointer, _ in api_values()} - known - {"/model/series_compliance_mm_per_n"}
        self.assertEqual({pointer for pointer in missing if not pointer.startswith(tuple(NOT_IN_THE_FORM))}, set())

    def test_fields_have_the_ranges_the_choices_and_the_defaults_of_the_api(self):
        of_api = {}
        for pointer, schema in api_values():
            of_api.setdefault(pointer, []).append(schema)
        for field in toothwave_design.FIELDS:
            for schema in of_api.get(field.pointer, ()):
                with self.subTest(field.pointer):
                    low, high = ([each.get(name, each.get(f"exclusive{name.title()}")) for each in of_api[field.pointer]] for name in ("minimum", "maximum"))
                    # One field for several kinds has the range of all of them.
                    limits = [None if None in low else min(low), None if None in high else max(high)]
                    self.assertEqual(list(field.limits) or [None, None], limits)
                    self.assertLessEqual(set(schema.get("enum", ())), set(field.choices))
                    # A document of the workbench always names its kinds.
                    is_kind = field.name in ("WaveGeneratorKind", "ToothShape", "StiffnessLaw", "FrictionKind")
                    if "default" in schema and not field.blank and not is_kind:
                        self.assertEqual(field.default, schema["default"])
                    if field.blank and isinstance(schema.get("default"), (int, float)) and schema["default"]:
                        self.assertIn(str(schema["default"]), field.blank, "a 0 that stands for it says so")
            is_known = field.is_object or not field.pointer
            self.assertTrue(is_known or field.pointer in of_api, f"{field.pointer} is none of the API's")
            self.assertTrue(is_known or field.limits or field.choices or isinstance(field.default, bool), "a number has a range")

    def test_what_a_field_is_hidden_with_is_no_other_kinds(self):
        """Of each kind the fields are just those that the API document gives it."""
        schemas = json.loads((ROOT / "openapi/openapi.json").read_text(encoding="utf-8"))["components"]["schemas"]
        for union, place, tag, choosing in (
            ("WaveGenerator", "/drive/wave_generator", "kind", "WaveGeneratorKind"),
            ("Teeth", "/drive/teeth", "shape", "ToothShape"),
            ("Stiffness", "/model/stiffness", "law", "StiffnessLaw"),
            ("WaveGeneratorFriction", "/friction/wave_generator", "kind", "FrictionKind"),
        ):
            variants = [schemas[variant["$ref"].rpartition("/")[2]]["properties"] for variant in schemas[union]["oneOf"]]
            for properties in variants:
                (kind,) = properties[tag]["enum"]
                values = toothwave_design.values_of(EVERYTHING) | {choosing: kind}
                shown = {field.pointer for field in toothwave_design.FIELDS if field.is_shown(values)}
                shown = {pointer.removeprefix(f"{place}/").split("/")[0] for pointer in shown if pointer.startswith(f"{place}/")}
                expected = set(properties)
                expected = {field for field in expected if f"{place}/{field}" not in NOT_IN_THE_FORM}
                if f"{place}/coefficient of {kind}" in NOT_IN_THE_FORM:
                    expected.remove("coefficient")
                with self.subTest(union, kind=kind):
                    self.assertEqual(shown, expected)

    def test_a_field_of_a_kind_without_an_entry_has_its_name_and_range(self):
        listed = [field for field in toothwave_design.FIELDS if not field.pointer.endswith("mean_path_radius_mm")]
        (found,) = (field for field in toothwave_design._with_kinds(listed) if field.pointer.endswith("mean_path_radius_mm"))
        self.assertEqual((found.label, found.name, found.unit, found.start), ("Mean path radius", "MeanPathRadius", "mm", 1.0))
        self.assertEqual((found.limits, found.shown), (toothwave_design.LENGTH_MM, ("WaveGeneratorKind", ("harmonic_path",))))


class Cache(unittest.TestCase):
    def test_what_a_drawing_does_not_read_asks_for_no_drawing_again(self):
        with running_service() as url:
            service = toothwave_client.Service(url)
            design = example("paper-5.1")
            first = service.drawing("assembly", design)
            self.assertIs(service.drawing("assembly", design | {"load": {"input_torque_nm": 7.0}}), first)
            turned = service.drawing("assembly", design | {"assembly": {"input_angle_deg": 5.0}})
            self.assertIsNot(turned, first)
            self.assertIs(service.drawing("assembly", design), first)


class Stand(BaseHTTPRequestHandler):
    """A service that is full at first."""

    busy = 2

    def do_POST(self):
        self.rfile.read(int(self.headers["Content-Length"]))
        status, body = (503, b'{"title": "full"}') if Stand.busy else (200, b'{"bodies": []}')
        Stand.busy -= Stand.busy > 0
        self.send_response(status)
        self.send_header("Retry-After", "0")
        self.send_header("ETag", '"x"')
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        pass


class NoAnswer(unittest.TestCase):
    def test_a_full_service_is_asked_again(self):
        with HTTPServer(("127.0.0.1", 0), Stand) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            service = toothwave_client.Service(f"http://127.0.0.1:{server.server_port}")
            self.assertEqual(service.drawing("ring", {}), {"bodies": []})
            Stand.busy = 100
            with self.assertRaises(toothwave_client.Problem) as caught:
                service.drawing("ring", {})
            self.assertEqual(str(caught.exception), "full")
            server.shutdown()

    def test_a_problem_is_told_in_the_services_words_and_every_field_at_fault(self):
        with running_service() as url, self.assertRaises(toothwave_client.Problem) as caught:
            design = example("paper-5.1")
            design["drive"]["teeth"]["radius_mm"] = -1
            design["drive"]["ring"]["teeth"] = 27
            toothwave_client.Service(url).drawing("ring", design)
        pointers = [error["pointer"] for error in caught.exception.errors]
        self.assertEqual(pointers, ["/drive/teeth/radius_mm", "/drive/ring/teeth"])
        for said in (caught.exception.title, *(error["detail"] for error in caught.exception.errors), *pointers):
            self.assertIn(said, str(caught.exception))

    def test_where_no_service_stands_the_address_is_named(self):
        with self.assertRaisesRegex(toothwave_client.NoService, "http://127.0.0.1:1/: .*refused"):
            toothwave_client.Service("http://127.0.0.1:1/").sweep({})


DRAWING = answer(200, b'{"bodies": []}', 'ETag: "x"')


class NoPause:
    """Pauses are noted, not made."""

    def setUp(self):
        self.pauses_s = []
        self.enterContext(mock.patch("toothwave_client.time.sleep", self.pauses_s.append))


class Addresses(NoPause, unittest.TestCase):
    def test_this_machine_needs_no_proxy_and_another_one_does(self):
        with host(DRAWING) as (address, heard), mock.patch.dict(os.environ, http_proxy=f"http://{address}", no_proxy=""):
            for name, port in (("127.0.0.1", address.split(":")[1]), ("drives.example", "8080")):
                toothwave_client.Service(f"{name}:{port}").drawing("ring", {})
        self.assertTrue(heard[0].startswith("POST /v1/"), heard[0])
        self.assertTrue(heard[1].startswith("POST http://drives.example:8080/v1/"), heard[1])

    def test_what_can_be_no_address_is_no_service_and_says_why(self):
        for text, why in {
            "": "the address is empty",
            "   ": "the address is empty",
            "http://": "no host and port",
            "http:///x": "no host and port",
            "127.0.0.1 :8080": "no blanks",
            "http://local host:8080": "no blanks",
            "http://127.0.0.1:80\t80": "no blanks",
            "http://127.0.0.1:port": "port",
            "http://127.0.0.1:0": "no host and port",
            "http://127.0.0.1:99999": "(?i)port out of range",
            "http://[::1": "IPv6",
            "http://a..b": "label",
            "file:///etc/hostname": "file is not spoken",
            "ftp://127.0.0.1": "ftp is not spoken",
            "http://127.0.0.1:1/ä": "ascii",
            "localhost:1": "refused",
        }.items():
            for call in ("examples", "sweep"):
                with self.subTest(text, call=call), self.assertRaisesRegex(toothwave_client.NoService, why):
                    getattr(toothwave_client.Service(text), call)(*(({},) if call == "sweep" else ()))

    def test_scheme_blanks_around_and_a_slash_at_the_end_do_not_matter(self):
        with host(DRAWING) as (address, _):
            for text in (address, f" {address}/ ", f"http://{address}", f"http://{address}//\n"):
                with self.subTest(text):
                    self.assertEqual(toothwave_client.Service(text).drawing("ring", {}), {"bodies": []})


class Replicas(NoPause, unittest.TestCase):
    def test_one_that_dies_within_its_answer_is_no_answer_and_the_next_is_asked(self):
        for lost in (DIES_WITHIN, b""):
            with self.subTest(lost), host(lost, lost, DRAWING) as (address, heard):
                self.assertEqual(toothwave_client.Service(address).drawing("ring", {}), {"bodies": []})
                self.assertEqual((len(heard), self.pauses_s), (3, [1.0, 1.0]))
                self.pauses_s.clear()

    def test_where_all_of_them_die_that_is_said_and_not_for_ever_tried(self):
        for lost in (DIES_WITHIN, b""):
            with self.subTest(lost), host(lost) as (address, heard):
                with self.assertRaisesRegex(toothwave_client.NoService, "IncompleteRead|without response"):
                    toothwave_client.Service(address).drawing("ring", {})
                self.assertEqual(len(heard), toothwave_client.ATTEMPTS)

    def test_what_speaks_no_http_or_is_no_toothwave_is_no_service(self):
        for said in (
            b"SSH-2.0-OpenSSH_9.2\r\n",
            b"HTTP/1.1 two hundred\r\n\r\n",
            b"HTTP/1.1 200 OK\r\nContent-Le",
            b"HTTP/9.9 200 OK\r\n\r\n",
            b"HTTP/1.1 200 OK\r\n" + b"x: y\r\n" * 200 + b"\r\n",
            answer(200, b"<html>"),
            answer(200, b"null"),
            answer(200, b"[]"),
            answer(200, b"{}", 'ETag: "x"'),
            answer(200, b"\xff"),
            answer(404, b"<html>"),
            answer(404, b"[]"),
            answer(422, b'{"errors": [1]}'),
            answer(422, b'{"errors": [{}]}'),
            b"HTTP/1.1 500 .\r\nContent-Length: 9\r\n\r\n{",
            answer(304),
            answer(301, b"", "Location: file:///etc/hostname"),
        ):
            for call in (
                lambda service: service.drawing("ring", {}),
                lambda service: service.sweep({}),
                lambda service: service.examples(),
                lambda service: service.example("paper-5.1"),
            ):
                with self.subTest(said), host(said) as (address, _), self.assertRaises(toothwave_client.NoService) as caught:
                    call(toothwave_client.Service(address))
                self.assertIn(address, str(caught.exception))

    def test_a_full_one_is_waited_for_as_long_as_it_says_within_reason(self):
        in_a_minute, long_ago = (email.utils.formatdate(time.time() + s, usegmt=True) for s in (60, -1e6))
        for header, pause_s in {
            "0": 0.0,
            "3": 3.0,
            "86400": 5.0,
            in_a_minute: 5.0,
            long_ago: 0.0,
            "soon": 1.0,
            "-1": 1.0,
            "nan": 1.0,
            "²": 1.0,
            "Mon, 99 Foo 2026": 1.0,
        }.items():
            with self.subTest(header):
                self.assertEqual(toothwave_client.pause_of(header), pause_s)
                full = answer(503, b"{}", f"Retry-After: {header}")
                with host(full, DRAWING) as (address, _):
                    self.assertEqual(toothwave_client.Service(address).drawing("ring", {}), {"bodies": []})
                self.assertEqual(self.pauses_s, [pause_s])
                self.pauses_s.clear()
        self.assertEqual(toothwave_client.pause_of(None), 1.0)

    def test_an_unknown_304_is_asked_again_without_tags(self):
        first = answer(200, b'{"bodies": [1]}', 'ETag: "a"')
        with host(first, answer(304, b"", 'ETag: "b"'), DRAWING) as (address, heard):
            service = toothwave_client.Service(address)
            service.drawing("ring", {})
            self.assertEqual(service.drawing("ring", {}), {"bodies": []})
            self.assertEqual(["If-None-Match" in head for head in heard], [False, True, False])

    def test_tags_made_weak_by_a_proxy_are_the_same_tags(self):
        weak = answer(200, b'{"bodies": [1]}', 'ETag: W/"a"')
        with host(weak, answer(304, b"", 'ETag: "a"'), answer(304, b"", 'ETag: W/"a"')) as (address, heard):
            service = toothwave_client.Service(address)
            for _ in range(3):
                self.assertEqual(service.drawing("ring", {}), {"bodies": [1]})
            self.assertIn('If-None-Match: "a"\r\n', heard[2])

    def test_an_answer_without_a_tag_is_an_answer(self):
        with host(answer(200, b'{"bodies": []}')) as (address, heard):
            service = toothwave_client.Service(address)
            for _ in range(2):
                self.assertEqual(service.drawing("ring", {}), {"bodies": []})
            self.assertNotIn("If-None-Match", heard[1])


class Key(NoPause, unittest.TestCase):
    def test_it_comes_from_the_environment_and_goes_to_no_other_address(self):
        with mock.patch.dict(os.environ, TOOTHWAVE_KEY=" secret\n"), host(DRAWING) as (other, heard_there):
            with host(answer(307, b"", f"Location: http://{other}/v1/examples")) as (address, heard):
                with self.assertRaises(toothwave_client.NoService):
                    toothwave_client.Service(address).examples()
        self.assertIn("Authorization: Bearer secret\r\n", heard[0])
        self.assertNotIn("Authorization", heard_there[0])

    def test_one_that_is_none_is_objected_to_and_not_told(self):
        for key in ("se cret", "se\ncret", "secret\u00e9"):
            with self.subTest(key), mock.patch.dict(os.environ, TOOTHWAVE_KEY=key), host(DRAWING) as (address, _):
                with self.assertRaisesRegex(toothwave_client.NoService, "TOOTHWAVE_KEY has blanks") as caught:
                    toothwave_client.Service(address).sweep({})
                self.assertNotIn("cret", str(caught.exception))

    def test_the_readme_says_where_it_comes_from(self):
        self.assertIn("TOOTHWAVE_KEY", (CLIENT / "README.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    unittest.main()
