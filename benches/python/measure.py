"""Times the Python package beside the Rust library, and studies on several executors."""

import concurrent.futures
import json
import pathlib
import statistics
import subprocess
import tempfile
import time

import toothwave
from dask.distributed import Client, LocalCluster

ROOT = pathlib.Path(__file__).parents[2]
PAPER = json.loads((ROOT / "examples/paper-5.1.json").read_text())
RUNS = 3


def rust_us(design):
    """The Rust library's time for a sweep."""
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(design, file)
        file.flush()
        command = ["cargo", "bench", "--quiet", "--package", "toothwave-calculation", "--bench", "answer", "--", file.name]
        return float(subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout)


def python_us(design):
    """The same from a dict to all columns as arrays."""
    times = []
    for _ in range(400):
        started = time.perf_counter()
        dict(toothwave.sweep(design).columns)
        times.append(time.perf_counter() - started)
    return 1e6 * statistics.median(times)


def sweep():
    design = PAPER | {"sweep": {"samples": 5000}}
    ratios = []
    for _ in range(RUNS):
        rust, python = rust_us(design), python_us(design)
        ratios.append(python / rust)
        print(f"sweep of 5000 intervals: Rust {rust:.0f} µs, Python {python:.0f} µs, {python / rust:.2f} times")
    print(f"median of the ratios: {statistics.median(ratios):.2f}")


def map_of(chunks):
    """A map of 250 000 variants at 16 intervals, in so many chunks."""
    document = {
        "study": "map",
        "base": PAPER | {"sweep": {"samples": 16}},
        "over": {
            "/drive/teeth/radius_mm": {"min": 3.0, "max": 6.5, "steps": 500},
            "/drive/wave_generator/semi_minor_mm": {"min": 55.5, "max": 57.5, "steps": 500},
        },
        "quantities": ["peak_stress_ring_mpa"],
    }
    return toothwave.Study(document, chunk_variants=250_000 // chunks)


def rates(name, executor):
    """Variants a second in 250 chunks, and what each of 2000 more chunks adds."""
    seconds = {}
    for chunks in (250, 2500):
        times = []
        for _ in range(RUNS):
            started = time.perf_counter()
            map_of(chunks).run(executor, progress=False)
            times.append(time.perf_counter() - started)
        seconds[chunks] = statistics.median(times)
    overhead_ms = 1e3 * (seconds[2500] - seconds[250]) / 2250
    print(f"| {name} | {250_000 / seconds[250]:,.0f} | {overhead_ms:.2f} ms |", flush=True)


def main():
    sweep()
    print("\n| | variants a second | overhead of a chunk |\n|---|---|---|")
    with concurrent.futures.ThreadPoolExecutor(1) as executor:
        rates("one core", executor)
    rates("all cores (two), threads", None)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        rates("Dask, two workers", client.get_executor())


if __name__ == "__main__":
    main()
