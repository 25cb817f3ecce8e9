"""Fixtures and helpers of the Python package's tests."""

import json
import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).parents[2]
BINARY = os.environ.get("TOOTHWAVE_BIN", str(ROOT / "target/debug/toothwave"))


def command_line(*arguments, document=None):
    """Returns the standard output of the command. `document` is its standard input."""
    text = None if document is None else json.dumps(document).encode()
    return subprocess.run([BINARY, *map(str, arguments)], input=text, stdout=subprocess.PIPE, check=True).stdout


@pytest.fixture(scope="session")
def paper():
    """Case 5.1 of the paper."""
    return json.loads((ROOT / "examples/paper-5.1.json").read_text())


@pytest.fixture
def tolerance(paper):
    """A study of 350 variants with rows."""
    base = paper | {"sweep": {"samples": 16}}
    base["drive"] = base["drive"] | {"ring": {"teeth": 26}}
    return {
        "study": "tolerance",
        "base": base,
        "inputs": {"/drive/teeth/radius_mm": {"distribution": "normal", "sigma": 0.01}},
        "quantities": ["peak_stress_ring_mpa"],
        "samples": 349,
    }


@pytest.fixture
def map_study(paper):
    """A map of 66 variants, some of which cannot be built."""
    return {
        "study": "map",
        "base": paper | {"sweep": {"samples": 16}},
        "over": {
            "/drive/teeth/radius_mm": {"min": 3.0, "max": 9.0, "steps": 33},
            "/model/compatibility": {"one_of": ["projection", "virtual_work"]},
        },
        "quantities": ["peak_stress_ring_mpa", "undercut"],
    }


@pytest.fixture
def search(paper):
    """A small search."""
    return {
        "study": "search",
        "base": paper,
        "evaluations": 500,
        "free": {"/drive/teeth/radius_mm": {"min": 3.0, "max": 7.0}},
        "objectives": [{"quantity": "slot_wall_mm", "goal": "max"}, {"quantity": "peak_stress_mpa", "goal": "min"}],
    }
