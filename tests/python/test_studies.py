"""Compares studies in Python with the command line bit by bit, on several executors and with checkpoints."""

import concurrent.futures
import json
import multiprocessing
import os
import pathlib
import signal

import numpy
import pytest
import toothwave
from conftest import command_line
from toothwave import _studies


class Faulty(concurrent.futures.ThreadPoolExecutor):
    """An executor that loses a chunk `times` times and records the submitted chunks."""

    def __init__(self, chunk, times):
        super().__init__(2)
        self.chunk, self.times, self.submitted, self.running = chunk, times, [], 0

    def submit(self, function, *arguments):
        chunk = arguments[-1]
        self.submitted.append(chunk)
        if chunk == self.chunk and self.submitted.count(chunk) <= self.times:
            return super().submit(self.lose)
        return super().submit(function, *arguments)

    def lose(self):
        raise OSError("the worker was lost")


def kills_its_process(*arguments):
    os.kill(os.getpid(), signal.SIGKILL)


class Killer(concurrent.futures.ProcessPoolExecutor):
    """An executor in which chunk 40 kills its process."""

    def submit(self, function, *arguments):
        return super().submit(kills_its_process if arguments[-1] == 40 else function, *arguments)


@pytest.mark.parametrize("kind", ["map_study", "tolerance", "search"])
def test_result_equals_command_line(kind, request):
    document = request.getfixturevalue(kind)
    result = toothwave.Study(document).run(progress=False)
    assert result.json() + b"\n" == command_line("study", "-", document=document)
    assert result["is_complete"] and result.gaps == []
    if kind == "search":
        assert result["front"] and len(result.columns) == 3
        with pytest.raises(ValueError, match="front"):
            result.rows
    else:
        csv = command_line("study", "-", "--rows", document=document).decode().splitlines()
        assert list(result.rows) == csv[0].split(",") and len(result.rows["variant"]) == len(csv) - 1


def test_rows_of_impossible_drives_are_nan(map_study):
    rows = toothwave.Study(map_study).run(progress=False).rows
    impossible = numpy.array([reason is not None for reason in rows["reason"]])
    assert 0 < impossible.sum() < len(impossible)
    assert (numpy.isnan(rows["peak_stress_ring_mpa"]) == impossible).all()


def test_chunk_size_and_processes_keep_the_bits(tolerance):
    whole = toothwave.Study(tolerance).run(progress=False)
    study = toothwave.Study(tolerance, chunk_variants=7)
    assert (study.chunks, study.variants) == (50, 350)
    with concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as processes:
        result = study.run(processes, progress=False)
    assert result.json() == whole.json()
    assert (result.rows["peak_stress_ring_mpa"] == whole.rows["peak_stress_ring_mpa"]).all()


@pytest.mark.parametrize("kind", ["map_study", "tolerance", "search"])
def test_second_run_computes_missing_chunks(kind, request, tmp_path):
    study = toothwave.Study(request.getfixturevalue(kind))
    whole = study.run(checkpoint=tmp_path, progress=False)
    parts = sorted(tmp_path.iterdir())
    assert len(parts) == study.chunks
    parts[0].unlink()
    with Faulty(None, 0) as executor:
        again = study.run(executor, checkpoint=tmp_path, progress=False)
    assert executor.submitted == [0]
    assert again.json() == whole.json()


def test_array_jobs_and_python_share_folder(tolerance, tmp_path):
    folder, document = tmp_path / "parts", tmp_path / "study.json"
    document.write_text(json.dumps(tolerance))
    for number in [0, 2]:
        command_line("study", document, "--part", f"{number}/3", "--into", folder)
    with Faulty(None, 0) as executor:
        result = toothwave.Study(tolerance).run(executor, checkpoint=folder, progress=False)
    assert executor.submitted == list(range(1, toothwave.Study(tolerance).chunks, 3))
    assert result.json() + b"\n" == command_line("study", document, "--merge", folder)
    frame = pytest.importorskip("pandas").read_parquet(folder)
    assert (frame["peak_stress_ring_mpa"] == result.rows["peak_stress_ring_mpa"]).all()


def test_refuses_parts_of_another_build_or_study(tolerance, tmp_path):
    study = toothwave.Study(tolerance)
    study.run(checkpoint=tmp_path, progress=False)
    part = min(tmp_path.iterdir())
    build = study.run(checkpoint=tmp_path, progress=False)["build"].encode()
    part.write_bytes(part.read_bytes().replace(build, b"0" * len(build)))
    with pytest.raises(toothwave.PartError, match=f"{part.name}: .* computed by the build `0000"):
        study.run(checkpoint=tmp_path, progress=False)
    part.unlink()
    with pytest.raises(toothwave.PartError, match="another study"):
        toothwave.Study(tolerance | {"seed": 2}).run(checkpoint=tmp_path, progress=False)
    with pytest.raises(toothwave.PartError, match="another study"):
        toothwave.Study(tolerance, chunk_variants=3).run(checkpoint=tmp_path, progress=False)
    part = min(tmp_path.iterdir())
    part.write_bytes(part.read_bytes()[:-9])
    with pytest.raises(toothwave.PartError, match="damaged"):
        study.run(checkpoint=tmp_path, progress=False)


@pytest.mark.parametrize("losses", [1, 3])
def test_lost_chunk_is_computed_again(tolerance, losses):
    study = toothwave.Study(tolerance, chunk_variants=7)
    with Faulty(40, losses) as executor:
        result = study.run(executor, progress=False)
    assert result.gaps == [] and executor.submitted.count(40) == losses + 1
    # After three losses the chunk runs alone, after all others.
    assert losses < 3 or executor.submitted[-1] == 40
    assert result.json() == study.run(progress=False).json()


def test_chunk_that_is_always_lost_is_a_gap(tolerance, tmp_path):
    study = toothwave.Study(tolerance, chunk_variants=7)
    with Faulty(40, 99) as executor:
        result = study.run(executor, checkpoint=tmp_path, progress=False)
    assert executor.submitted.count(40) == 4
    assert result.gaps == [(40, range(280, 287), "OSError: the worker was lost")]
    assert not result["is_complete"] and result["samples"] == 342
    # The checkpoint has all other chunks.
    assert study.run(checkpoint=tmp_path, progress=False).json() == study.run(progress=False).json()


def test_raises_if_executor_breaks(tolerance, tmp_path, monkeypatch):
    monkeypatch.setattr(_studies, "WINDOW", 1)
    study = toothwave.Study(tolerance, chunk_variants=7)
    with Killer(1, multiprocessing.get_context("spawn")) as executor:
        with pytest.raises(concurrent.futures.BrokenExecutor):
            study.run(executor, checkpoint=tmp_path, progress=False)
    assert len(list(tmp_path.iterdir())) == 40
    assert study.run(checkpoint=tmp_path, progress=False).json() == study.run(progress=False).json()


def test_raises_if_all_chunks_are_lost(tolerance):
    class Broken(Faulty):
        def submit(self, function, *arguments):
            return concurrent.futures.ThreadPoolExecutor.submit(self, self.lose)

    with Broken(0, 0) as executor, pytest.raises(RuntimeError, match="all chunks were lost"):
        toothwave.Study(tolerance).run(executor, progress=False)


def test_progress_counts_variants(tolerance, tmp_path, capsys):
    toothwave.Study(tolerance).run(checkpoint=tmp_path)
    assert "350/350" in capsys.readouterr().err
    next(iter(pathlib.Path(tmp_path).iterdir())).unlink()
    toothwave.Study(tolerance).run(checkpoint=tmp_path)
    assert "350/350" in capsys.readouterr().err


def test_problem_names_the_field_of_the_study(tolerance):
    with pytest.raises(toothwave.Problem) as raised:
        toothwave.Study(tolerance | {"quantities": ["beauty"]})
    assert raised.value.errors[0]["pointer"] == "/quantities/0"
