"""Faults on a real Dask cluster: a scheduler process and two worker processes compute 2000 chunks."""

import concurrent.futures
import contextlib
import os
import pathlib
import signal
import socket
import subprocess
import sys
import time

import pytest
import toothwave

distributed = pytest.importorskip("distributed")

CHUNKS = 2000
KILLER = 777


class Cluster:
    """Processes of a cluster on loopback. Each leads a process group, because a nanny process restarts a dead worker."""

    def __init__(self, folder):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        self.folder = folder
        port = self.address.rpartition(":")[2]
        self.scheduler = self.start("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")
        self.workers = [self.start("worker", self.address, "--nthreads", "1", "--no-dashboard") for _ in range(2)]

    def start(self, *arguments):
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(filter(None, [str(pathlib.Path(__file__).parent), os.environ.get("PYTHONPATH")])),
            "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "5s",
        }
        command = [sys.executable, "-m", "dask", *arguments]
        with open(self.folder / "dask.log", "ab") as log:
            return subprocess.Popen(command, cwd=self.folder, env=environment, stdout=log, stderr=log, start_new_session=True)

    @contextlib.contextmanager
    def executor(self):
        with distributed.Client(self.address, timeout=30) as client:
            client.wait_for_workers(2, timeout=60)
            yield client.get_executor()

    def signal(self, process, number):
        os.killpg(process.pid, number)

    def close(self):
        for process in [*self.workers, self.scheduler]:
            with contextlib.suppress(ProcessLookupError):
                self.signal(process, signal.SIGKILL)
            process.wait()


@pytest.fixture
def cluster(tmp_path):
    cluster = Cluster(tmp_path)
    yield cluster
    cluster.close()


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "parts"
    folder.mkdir()
    return folder


@pytest.fixture
def study(tolerance):
    """A study with four variants in each chunk."""
    return toothwave.Study(tolerance | {"samples": 4 * CHUNKS - 1}, chunk_variants=4)


@pytest.fixture
def whole(study):
    """The result computed in one process."""
    assert study.chunks == CHUNKS
    return study.run(progress=False)


@contextlib.contextmanager
def running(study, executor, folder, parts):
    """Starts the study and yields its future when `folder` has `parts` files."""
    with concurrent.futures.ThreadPoolExecutor(1) as thread:
        run = thread.submit(study.run, executor, checkpoint=folder, progress=False)
        while len(os.listdir(folder)) < parts:
            assert not run.done(), run.result()
            time.sleep(0.02)
        yield run


def assert_same(result, whole):
    assert result.gaps == [] and result.json() == whole.json()
    assert result.rows["variant"].tolist() == list(range(4 * CHUNKS))
    assert (result.rows["peak_stress_ring_mpa"] == whole.rows["peak_stress_ring_mpa"]).all()


def test_worker_killed(cluster, study, whole, folder):
    with cluster.executor() as executor, running(study, executor, folder, 300) as run:
        cluster.signal(cluster.workers[0], signal.SIGKILL)
        assert_same(run.result(timeout=120), whole)


def test_worker_stopped_for_12_s(cluster, study, whole, folder):
    with cluster.executor() as executor, running(study, executor, folder, 300) as run:
        cluster.signal(cluster.workers[0], signal.SIGSTOP)
        time.sleep(12)
        cluster.signal(cluster.workers[0], signal.SIGCONT)
        assert_same(run.result(timeout=120), whole)


def test_scheduler_killed(cluster, study, whole, folder, tmp_path):
    with cluster.executor() as executor, running(study, executor, folder, 300) as run:
        cluster.signal(cluster.scheduler, signal.SIGKILL)
        with pytest.raises(concurrent.futures.BrokenExecutor):
            run.result(timeout=120)
    done = len(os.listdir(folder))
    assert 300 <= done < CHUNKS
    cluster.close()
    other = Cluster(tmp_path)
    try:
        with other.executor() as executor:
            assert_same(study.run(executor, checkpoint=folder, progress=False), whole)
    finally:
        other.close()


def compute_or_die(function, *arguments):
    """Computes a chunk, but kills its own process at chunk `KILLER`."""
    if arguments[-1] == KILLER:
        os.kill(os.getpid(), signal.SIGKILL)
    return function(*arguments)


def test_chunk_that_kills_its_process_is_a_gap(cluster, study, whole, folder):
    with cluster.executor() as executor:
        submit, submitted = executor.submit, []
        executor.submit = lambda *arguments: submitted.append(arguments[-1]) or submit(compute_or_die, *arguments)
        result = study.run(executor, checkpoint=folder, progress=False)
    # Dask itself tries it on several workers. Then it runs alone.
    assert submitted.count(KILLER) == 2
    variants = range(4 * KILLER, 4 * KILLER + 4)
    assert [(gap.chunk, gap.variants) for gap in result.gaps] == [(KILLER, variants)]
    rows = {variant: stress for variant, stress in zip(whole.rows["variant"], whole.rows["peak_stress_ring_mpa"])}
    assert result.rows["variant"].tolist() == [variant for variant in rows if variant not in variants]
    assert result.rows["peak_stress_ring_mpa"].tolist() == [rows[variant] for variant in result.rows["variant"]]
    # A run that can compute the chunk closes the gap.
    assert_same(study.run(checkpoint=folder, progress=False), whole)
