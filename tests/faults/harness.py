"""What the harnesses of faults have in common: commands, ports, the build with failpoints, tables and where they are recorded."""

import json
import os
import pathlib
import shutil
import socket
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
WORK = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "faults"


def run(*command, check=True, **how):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, **how)
    if check and done.returncode:
        raise RuntimeError(f"{' '.join(map(str, command))}\n{done.stderr.strip()}")
    return done.stdout.strip()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def find_faulty_build():
    """The debug build whose failpoints `FAILPOINTS` sets."""
    WORK.mkdir(parents=True, exist_ok=True)
    command = ["cargo", "build", "--quiet", "--locked", "--bin", "toothwave"]
    try:
        for line in run(*command, "--features", "fault-injection", "--message-format=json", cwd=ROOT).splitlines():
            if executable := json.loads(line).get("executable"):
                shutil.copy(executable, WORK / "toothwave-that-panics")
    finally:
        # The usual one again, where others look for it.
        run(*command, cwd=ROOT)
    return WORK / "toothwave-that-panics"


def table(heads, rows, words=1):
    """A table in Markdown, of whose columns the first ones hold words and the others numbers."""
    lines = [heads, ["---"] * words + ["---:"] * (len(heads) - words), *rows]
    return "".join(f"| {' | '.join(map(str, line))} |\n" for line in lines)


def record(path, script, text):
    """Writes what a script measured between its markers."""
    begin, end = f"<!-- Written by {script} --record: -->\n", "<!-- End of what it writes. -->\n"
    before, begins, rest = path.read_text().partition(begin)
    _, ends, after = rest.partition(end)
    if not (begins and ends):
        sys.exit(f"{path} lacks the markers of {script}")
    path.write_text(f"{before}{begin}\n{text}\n{end}{after}")
