"""Meshes of the running service, read by trimesh: each is closed, and has the volume of an independent calculation.

    meshes.py URL       with trimesh, networkx and lxml installed (PyPI)

The volumes are those of tests/freecad/theory.py, which asks neither the service nor FreeCAD.
"""

import io
import json
import sys
import urllib.request
from pathlib import Path

import trimesh

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/freecad"))
from theory import Theory  # noqa: E402

PATHS = {"ring": "ring", "wave_generator": "wave-generator", "carrier": "carrier", "teeth": "tooth"}
EXAMPLES = ("paper-5.1", "paper-5.2-bored", "eccentric-roller", "harmonic-path", "balls", "flat-sided")
PRINTED = {part: {"clearance_um": 50.0} for part in PATHS}
CHORD_TOLERANCE_MM = 2e-3


def post(url, design, accept):
    headers = {"content-type": "application/json", "accept": accept}
    request = urllib.request.Request(url, json.dumps(design).encode(), headers)
    with urllib.request.urlopen(request, timeout=60) as response:
        return io.BytesIO(response.read())


def check_solid(mesh, solids, volume_mm3, name):
    """Closed, oriented outward, and true to the chord tolerance: its surface is nowhere farther from the theory's than that."""
    assert mesh.is_watertight and mesh.is_winding_consistent, f"{name} is open"
    bodies = len(trimesh.graph.connected_components(mesh.face_adjacency, engine="networkx"))
    assert bodies == solids, f"{name} is {bodies} bodies"
    off_mm3 = abs(mesh.volume - solids * volume_mm3)
    assert off_mm3 <= CHORD_TOLERANCE_MM * mesh.area, f"{name}: {mesh.volume} mm³, expected {solids * volume_mm3}"
    print(f"{name:44} {len(mesh.faces):8} triangles {mesh.volume:16.4f} mm³  {mesh.volume / (solids * volume_mm3) - 1:.1e} off")


def check(url, name, design, query):
    theory = Theory(design | {"parts": PRINTED} if query else design)
    volumes_mm3 = theory.volumes_mm3()
    counts = {"ring": 1, "wave_generator": 1, "carrier": theory.installed, "teeth": theory.installed}
    for part, path in PATHS.items():
        stl = post(f"{url}/v1/drawings/{path}{query}", design, "model/stl")
        solids = 1 if part == "teeth" else counts[part]
        check_solid(trimesh.load(stl, file_type="stl"), solids, volumes_mm3[part], f"{name}{query} {part} as STL")
    assembly = trimesh.load(post(f"{url}/v1/drawings/assembly{query}", design, "model/3mf"), file_type="3mf")
    assert assembly.units == "millimeter", assembly.units
    assert set(assembly.geometry) == set(PATHS), set(assembly.geometry)
    for part, mesh in assembly.geometry.items():
        check_solid(mesh, 1, volumes_mm3[part], f"{name}{query} {part} as 3MF")
    items = [assembly.graph[node][1] for node in assembly.graph.nodes_geometry]
    assert {part: items.count(part) for part in PATHS} == counts
    # Placed by 3MF's matrices or by the service, the assembly is the same.
    placed = trimesh.load(post(f"{url}/v1/drawings/assembly{query}", design, "model/stl"), file_type="stl")
    assert abs(assembly.to_mesh().bounds - placed.bounds).max() < 1e-4, name


def main():
    url = sys.argv[1].rstrip("/")
    for name in EXAMPLES:
        design = json.loads((ROOT / "examples" / f"{name}.json").read_text(encoding="utf-8"))
        design["profile"] = {"chord_tolerance_mm": CHORD_TOLERANCE_MM}
        design["assembly"] = {"input_angle_deg": 17.0}
        for query in ("", "?preset=printing"):
            check(url, name, design, query)


if __name__ == "__main__":
    main()
