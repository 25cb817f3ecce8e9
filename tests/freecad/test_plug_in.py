"""docs/how-to/plug-ins.md shows a whole program: the file itself, and it runs."""

import importlib.util
import os
import subprocess
import sys
import tempfile
import unittest
import urllib.error
from pathlib import Path
from unittest import mock

from service import DIES_WITHIN, ROOT, answer, host, running_service

PROGRAM = ROOT / "clients/python/plug_in.py"


def run(url, design, **environment):
    return subprocess.run(
        [sys.executable, PROGRAM, url, design],
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
        env={**os.environ, **environment},
    )


class PlugIn(unittest.TestCase):
    def test_the_page_shows_the_file_verbatim(self):
        self.assertIn(
            f"```python\n{PROGRAM.read_text(encoding='utf-8')}```\n", (ROOT / "docs/how-to/plug-ins.md").read_text(encoding="utf-8")
        )

    def test_it_gets_every_part_and_what_it_has_is_not_sent_again(self):
        with running_service() as url:
            done = run(url, ROOT / "examples/paper-5.2.json")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        lines = done.stdout.splitlines()
        self.assertEqual(len(lines), 13)
        self.assertEqual(lines[:4], lines[8:12])
        self.assertIn("teeth           40 of circle, 15.0 mm wide, the first at (52.2000, 0.0000) mm", lines[2])
        self.assertEqual(lines[-1], "2 drawings were sent")

    def test_no_proxy_stands_before_this_machine(self):
        with running_service() as url:
            done = run(url, ROOT / "examples/paper-5.2.json", http_proxy="http://127.0.0.1:1")
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_it_says_what_the_service_objects_to(self):
        with running_service() as url, tempfile.TemporaryDirectory() as folder:
            design = Path(folder, "design.json")
            example = (ROOT / "examples/paper-5.1.json").read_text(encoding="utf-8")
            design.write_text(example.replace("58.0", "50.0"), encoding="utf-8")
            done = run(url, design)
        self.assertEqual(done.returncode, 1)
        self.assertIn("The design is impossible\n/drive/wave_generator/semi_major_mm: ", done.stderr)


class NoAnswer(unittest.TestCase):
    """Whatever stands at the address, the program says so in a line and ends, without a traceback."""

    def assert_says(self, address, pattern):
        done = run(address, ROOT / "examples/paper-5.1.json")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, pattern)
        self.assertNotIn("Traceback", done.stderr)

    def test_an_address_that_can_be_none(self):
        for address in ("", " ", "http://", "local host:80", "127.0.0.1:port", "127.0.0.1:99999", "ftp://x", "http://[::1"):
            with self.subTest(address):
                self.assert_says(address, "No toothwave service answers at ")

    def test_a_port_that_no_port_can_be_is_not_taken_for_another_one(self):
        for port, why in (("99999", "Port out of range"), ("0", "no host and port"), ("-1", "Port could not be cast")):
            with self.subTest(port):
                self.assert_says(f"127.0.0.1:{port}", why)

    def test_a_key_that_is_none_is_objected_to_and_not_told(self):
        for key in ("se cret", "se\ncret", "secret\u00e9"):
            with self.subTest(key), mock.patch.dict(os.environ, TOOTHWAVE_KEY=key):
                done = run("127.0.0.1:1", ROOT / "examples/paper-5.1.json")
                self.assertIn("TOOTHWAVE_KEY has blanks", done.stderr)
                self.assertNotIn("cret", done.stderr)

    def test_a_connection_that_is_lost_while_asking_is_tried_again_and_one_that_is_refused_is_not(self):
        spec = importlib.util.spec_from_file_location("plug_in", PROGRAM)
        program = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(program)
        for reason, attempts in ((BrokenPipeError(), 4), (ConnectionAbortedError(), 4), (ConnectionRefusedError(), 1)):
            lost = mock.patch.object(program.urllib.request.OpenerDirector, "open", side_effect=urllib.error.URLError(reason))
            with self.subTest(reason), lost as opened, mock.patch.object(program.time, "sleep"):
                with self.assertRaises(SystemExit):
                    program.drawing("127.0.0.1:1", {})
                self.assertEqual(opened.call_count, attempts)

    def test_a_host_that_is_no_service_or_dies(self):
        for said in (
            b"SSH-2.0-OpenSSH_9.2\r\n",
            answer(200, b"<html>"),
            answer(200, b"[]"),
            answer(404, b"<html>"),
            answer(422, b'{"errors": [1]}'),
            answer(304, b"", 'ETag: "b"'),
            answer(503, b"<html>", "Retry-After: Thu, 01 Jan 1970 00:00:00 GMT"),
        ):
            with self.subTest(said), host(said) as (address, _):
                self.assert_says(address, f"No toothwave service answers at {address}: ")

    def test_a_replica_that_dies_within_its_answer_is_not_the_last_word(self):
        drawing = answer(200, b'{"bodies": []}', 'ETag: "x"')
        with host(DIES_WITHIN, drawing) as (address, heard):
            done = run(f" {address}/", ROOT / "examples/paper-5.1.json")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "1 drawings were sent\n", ""))
        self.assertEqual(len(heard), 4)

    def test_a_date_to_come_again_is_understood(self):
        full = answer(503, b"{}", "Retry-After: Thu, 01 Jan 1970 00:00:00 GMT")
        with host(full, answer(200, b'{"bodies": []}')) as (address, _):
            self.assertEqual(run(address, ROOT / "examples/paper-5.1.json").returncode, 0)


if __name__ == "__main__":
    unittest.main()
