"""FreeCAD with its window, in a process of its own: with a window the module FreeCAD is another for all tests after it."""

import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path


class Window(unittest.TestCase):
    def test_it_does_what_a_user_expects(self):
        with tempfile.TemporaryDirectory() as home:
            done = subprocess.run(
                [sys.executable, Path(__file__).with_name("window.py"), "-v"],
                env={**os.environ, "HOME": home},
                capture_output=True,
                text=True,
                timeout=240,
                check=False,
            )
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        # Not what FreeCAD says of failures that are wanted there.
        ran = re.search(r"^Ran [1-9].*", done.stderr, re.MULTILINE)
        self.assertTrue(ran, done.stderr)
        print("with a window:", ran[0], file=sys.stderr)


if __name__ == "__main__":
    unittest.main()
