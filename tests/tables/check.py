"""Tables of the running service, read by pyarrow: Parquet of studies and Arrow streams of sweeps hold what CSV and JSON do.

    check.py URL      with pyarrow installed (PyPI)
"""

import io
import json
import os
import sys
import time
import urllib.request

import pyarrow.csv
import pyarrow.ipc
import pyarrow.parquet

URL = sys.argv[1]

BASE = {
    "drive": {"wave_generator": {"semi_major_mm": 58.0, "semi_minor_mm": 56.0},
              "teeth": {"count": 28, "radius_mm": 5.0, "width_mm": 15.0}, "ring": {"teeth": 26}},
    "load": {"input_torque_nm": 20.0},
    "model": {"compatibility": "projection", "stiffness": {"law": "linear"}},
}
NORMAL = {"distribution": "normal", "sigma": 0.002, "limit": 0.006}
STUDIES = [
    # Teeth of 8 mm touch: some rows have a reason and no numbers.
    {"study": "map", "base": BASE, "quantities": ["peak_stress_ring_mpa", "undercut"],
     "over": {"/drive/teeth/radius_mm": {"min": 3.0, "max": 8.0, "steps": 11}, "/model/compatibility": {"one_of": ["projection", "virtual_work"]}}},
    {"study": "search", "base": BASE, "evaluations": 500, "objectives": [{"quantity": "slot_wall_mm", "goal": "max"}, {"quantity": "peak_stress_mpa", "goal": "min"}],
     "free": {"/drive/teeth/radius_mm": {"min": 3.0, "max": 7.0}, "/drive/teeth/width_mm": {"min": 10.0, "max": 20.0}}},
    {"study": "sensitivity", "base": BASE, "quantities": ["peak_stress_ring_mpa"]},
    {"study": "tolerance", "base": BASE, "samples": 100, "quantities": ["peak_stress_ring_mpa"], "inputs": {"/drive/teeth/radius_mm": NORMAL}},
]


def ask(path, body=None, accept="application/json"):
    headers = {"accept": accept, "content-type": "application/json", "prefer": "wait=60"}
    data = None if body is None else json.dumps(body).encode()
    with urllib.request.urlopen(urllib.request.Request(URL + path, data, headers)) as answer:
        assert answer.headers["content-type"].split(";")[0] == accept, answer.headers["content-type"]
        return answer.read()


def without_types(table):
    """Numbers as doubles, everything else as it is, empty cells as nothing."""
    def plain(value):
        return None if value == "" else float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else value
    return {name: [plain(value) for value in column] for name, column in table.to_pydict().items()}


def check_study(study):
    href = json.loads(ask("/v1/studies", study))["result_href"]
    # The service waits for a study at most until its deadline.
    while json.loads(ask(href.removesuffix("/result")))["state"] == "running":
        time.sleep(0.1)
    parquet = pyarrow.parquet.read_table(io.BytesIO(ask(href, accept="application/vnd.apache.parquet")))
    csv = pyarrow.csv.read_csv(io.BytesIO(ask(href, accept="text/csv")))
    assert parquet.num_rows > 0 and parquet.column_names == csv.column_names, (parquet, csv)
    assert without_types(parquet) == without_types(csv), study["study"]
    print(study["study"], parquet.num_rows, "rows:", ", ".join(f"{field.name} {field.type}" for field in parquet.schema))


def check_sweep(document):
    stream = pyarrow.ipc.open_stream(ask("/v1/sweep", document, "application/vnd.apache.arrow.stream"))
    table = stream.read_all()
    answer = json.loads(ask("/v1/sweep", document))
    csv = pyarrow.csv.read_csv(io.BytesIO(ask("/v1/sweep", document, "text/csv")))
    assert table.column_names == csv.column_names and table.num_rows == len(answer["states"]["tooth"])
    assert without_types(table) == without_types(csv)
    columns = table.to_pydict()
    for name, column in answer["states"].items():
        assert columns[name] == column, name
    print("sweep", table.num_rows, "states in", len(columns), "columns")


for each in STUDIES:
    check_study(each)
check_sweep({**BASE, "sweep": {"samples": 20_000}})
check_sweep({
    **BASE,
    "model": {"compatibility": "virtual_work", "stiffness": {"law": "linear"}, "clearance": {"ring_um": 5.0}},
    "friction": {"wave_generator": {"kind": "plain", "coefficient": 0.03}, "ring": {"coefficient": 0.05}, "carrier": {"coefficient": 0.05}},
})
# pyarrow's own threads now and then abort an interpreter that ends in order, though all was read (apache/arrow, issue 34314).
sys.stdout.flush()
os._exit(0)
