"""The calls: what is imported, what is sent again and what is not, what is said when there is no answer."""

import ast
import json
import sys
import threading
import unittest
from http.server import BaseHTTPRequestHandler, HTTPServer

import toothwave_client
import toothwave_design
from cases import designs, example
from service import ROOT, running_service

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


class Document(unittest.TestCase):
    def test_it_survives_the_way_through_the_fields(self):
        with running_service() as url:
            for name, document in designs().items():
                with self.subTest(name):
                    through = toothwave_design.document_of(toothwave_design.values_of(document))
                    service = toothwave_client.Service(url)
                    self.assertIs(service.drawing("assembly", through), service.drawing("assembly", document))
                    self.assertIs(service.sweep(through), service.sweep(document))

    def test_there_is_a_field_for_all_that_drawings_and_sweeps_read(self):
        schemas = json.loads((ROOT / "openapi/openapi.json").read_text(encoding="utf-8"))["components"]["schemas"]

        def pointers(schema, place=""):
            options = schema.get("oneOf", [schema])
            for option in options:
                name = option.get("$ref", "").rpartition("/")[2]
                option = schemas.get(name, option)
                if "oneOf" in option:
                    yield from pointers(option, place)
                for key, value in option.get("properties", {}).items():
                    yield from pointers(value, f"{place}/{key}")
                if "properties" not in option and "oneOf" not in option:
                    yield place

        known = {field.pointer for field in toothwave_design.FIELDS}
        missing = set(pointers(schemas["Design"])) - known - {"/accuracy/requested_error", "/profile/extent"}
        self.assertEqual(missing, set())


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
        with self.assertRaisesRegex(toothwave_client.NoService, "http://127.0.0.1:1: .*refused"):
            toothwave_client.Service("http://127.0.0.1:1/").sweep({})


if __name__ == "__main__":
    unittest.main()
