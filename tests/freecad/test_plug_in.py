"""docs/plug-ins.md shows a whole program: the file itself, and it runs."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from service import ROOT, running_service

PROGRAM = ROOT / "clients/python/plug_in.py"


def run(url, design):
    return subprocess.run([sys.executable, PROGRAM, url, design], capture_output=True, text=True, encoding="utf-8", check=False)


class PlugIn(unittest.TestCase):
    def test_the_page_shows_the_file_verbatim(self):
        self.assertIn(
            f"```python\n{PROGRAM.read_text(encoding='utf-8')}```\n", (ROOT / "docs/plug-ins.md").read_text(encoding="utf-8")
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

    def test_it_says_what_the_service_objects_to(self):
        with running_service() as url, tempfile.TemporaryDirectory() as folder:
            design = Path(folder, "design.json")
            example = (ROOT / "examples/paper-5.1.json").read_text(encoding="utf-8")
            design.write_text(example.replace("58.0", "50.0"), encoding="utf-8")
            done = run(url, design)
        self.assertEqual(done.returncode, 1)
        self.assertIn("Values that no design can have\n/drive/wave_generator/semi_major_mm: ", done.stderr)


if __name__ == "__main__":
    unittest.main()
