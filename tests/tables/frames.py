"""From a sweep of a million states to a data frame, by each of its forms: bytes, the service's time, and the program's.

    frames.py URL        with pandas and pyarrow installed (PyPI)
"""

import gzip
import io
import json
import statistics
import sys
import time
import urllib.request

import pandas
import pyarrow.ipc

URL = sys.argv[1]
TIMES = 5
# Seven teeth carry at each input angle of case 5.1: a million states.
SAMPLES = 142_850

with urllib.request.urlopen(f"{URL}/v1/examples/paper-5.1") as example:
    DESIGN = json.load(example)

# What a program does that knows nothing but its library.
READ = {
    "application/json": lambda body: pandas.DataFrame(json.loads(body)["states"]),
    "text/csv": lambda body: pandas.read_csv(io.BytesIO(body)),
    "application/vnd.apache.arrow.stream": lambda body: pyarrow.ipc.open_stream(body).read_pandas(),
}


def answer(accept, samples):
    document = DESIGN | {"sweep": {"samples": samples}}
    headers = {"accept": accept, "content-type": "application/json"}
    request = urllib.request.Request(f"{URL}/v1/sweep", json.dumps(document).encode(), headers)
    started = time.monotonic()
    with urllib.request.urlopen(request) as response:
        body = response.read()
    return body, time.monotonic() - started


def main():
    print("| form | MB | MB by gzip | from request to the last byte, s | to a data frame, s | Arrow's share of both |\n|---|---|---|---|---|---|")
    rows, frames = {}, {}
    for turn in range(TIMES):
        for accept, read in READ.items():
            body, asked_s = answer(accept, SAMPLES + turn)  # So that none comes from the cache.
            started = time.monotonic()
            frame = read(body)
            rows.setdefault(accept, []).append((len(body), asked_s, time.monotonic() - started))
            if turn == 0:
                frames[accept] = frame
                rows[accept, "gzip"] = len(gzip.compress(body, 6))
    arrow = frames["application/vnd.apache.arrow.stream"]
    for accept, frame in frames.items():
        assert len(frame) == len(arrow) and all((frame[name].to_numpy() == arrow[name].to_numpy()).all() for name in frame), accept
    median = {accept: [statistics.median(column) for column in zip(*rows[accept])] for accept in READ}
    of_arrow = sum(median["application/vnd.apache.arrow.stream"][1:])
    for accept, (size, asked_s, read_s) in median.items():
        print(f"| `{accept}` | {size / 1e6:.0f} | {rows[accept, 'gzip'] / 1e6:.0f} | {asked_s:.2f} | {read_s:.2f} | {of_arrow / (asked_s + read_s):.2f} |")
    print(f"\n{len(arrow)} states in {len(arrow.columns)} columns, medians of {TIMES}.")


main()
