"""Compares answers in Python with those of the command line, which are those of the service."""

import concurrent.futures
import io
import json
import threading
import time

import numpy
import pytest
import toothwave
from conftest import ROOT, command_line


def assert_same(found, wanted):
    """Asserts that values are equal. Arrays equal lists with the same items."""
    if isinstance(wanted, dict):
        assert set(found) == set(wanted)
        for name, value in wanted.items():
            assert_same(found[name], value)
    elif isinstance(wanted, list):
        assert len(found) == len(wanted)
        if isinstance(found, numpy.ndarray):
            assert found.tolist() == wanted
        else:
            for one, other in zip(found, wanted):
                assert_same(one, other)
    else:
        assert found == wanted


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "examples").glob("*.json")))
def test_answers_equal_command_line(name):
    path = ROOT / f"examples/{name}.json"
    for ask, command in [
        (toothwave.sweep, "sweep"),
        (toothwave.geometry, "geometry"),
        (toothwave.coincidence_degree, "coincidence-degree"),
    ]:
        text = command_line(command, path, "--format", "json").rstrip(b"\n")
        answer = ask(path)
        assert answer.json() == text
        assert_same(answer, json.loads(text))


def test_sweep_with_friction(paper):
    friction = {"wave_generator": {"kind": "plain", "coefficient": 0.03}, "ring": {"coefficient": 0.05}, "carrier": {"coefficient": 0.05}}
    design = paper | {"friction": friction, "load": paper["load"] | {"input_speed_rpm": 100}}
    answer = toothwave.sweep(json.dumps(design))
    assert_same(answer, json.loads(answer.json()))
    assert set(answer.columns["rolls"]) <= {"wave_generator", "ring", "carrier", "nowhere"}


@pytest.mark.parametrize("part", ["ring", "wave_generator", "carrier", "tooth", "assembly"])
def test_drawings_equal_command_line(part):
    path = ROOT / "examples/paper-5.1.json"
    for form in ["dxf", "step", "svg"]:
        text = command_line("draw", part.replace("_", "-"), path, "--format", form).decode()
        assert toothwave.drawing(path, part, form) == text
    assert toothwave.drawing(path, part, "json")["bodies"]
    with pytest.raises(ValueError, match="formats"):
        toothwave.drawing(path, part, "pdf")


def test_columns_share_memory_and_are_read_only(paper):
    columns = toothwave.sweep(paper).columns
    force = columns["force_ring_n"]
    assert not force.flags.owndata and not force.flags.writeable
    # The array keeps the answer alive.
    kept = force.copy()
    del columns
    [toothwave.sweep(paper | {"load": {"input_torque_nm": torque}}) for torque in range(1, 50)]
    assert (force == kept).all()


def test_data_frames_equal_csv(paper):
    pandas, polars, pyarrow = (pytest.importorskip(name) for name in ["pandas", "polars", "pyarrow"])
    sweep = toothwave.sweep(paper)
    csv = pandas.read_csv(io.BytesIO(command_line("sweep", "-", "--format", "csv", document=paper)))
    assert (sweep.to_pandas() == csv).all(axis=None)
    assert sweep.to_polars().to_dict(as_series=False) == csv.to_dict("list")
    assert pyarrow.table(sweep).to_pydict() == csv.to_dict("list")
    assert polars.from_arrow(pyarrow.table(sweep)).shape == csv.shape


def test_problem_names_the_field(paper):
    teeth = paper["drive"]["teeth"]
    with pytest.raises(toothwave.Problem, match="radius_mm") as raised:
        toothwave.sweep(paper | {"drive": paper["drive"] | {"teeth": teeth | {"radius_mm": -1.0}}})
    problem = raised.value
    assert problem.code == "impossible_design"
    assert problem.errors[0]["pointer"] == "/drive/teeth/radius_mm" and problem.errors[0]["value"] == -1.0
    with pytest.raises(toothwave.Problem) as raised:
        toothwave.geometry("{")
    assert (raised.value.code, raised.value.errors) == ("malformed_json", [])


def test_accepts_numpy_numbers(paper):
    load = {"input_torque_nm": numpy.float64(20.0)}
    samples = {"samples": numpy.int64(50)}
    assert toothwave.sweep(paper | {"load": load, "sweep": samples}).json() == toothwave.sweep(paper).json()


def test_other_threads_run_during_computation(paper):
    design = json.dumps(paper | {"sweep": {"samples": 1_000_000}})
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        computed = pool.submit(toothwave.sweep, design)
        turns = 0
        while not computed.done():
            time.sleep(0.001)
            turns += 1
    assert turns > 10 and threading.active_count() >= 1
    assert len(computed.result().columns["tooth"]) > 7_000_000


def test_notebook_shows_figures_and_plot(paper):
    html = toothwave.sweep(paper)._repr_html_()
    assert "contact ratio" in html and "980.4 MPa" in html and "<svg" in html
