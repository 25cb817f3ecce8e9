"""The real service on a free port, for as long as a test module runs."""

import contextlib
import os
import socket
import subprocess
import time
import urllib.error
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BINARY = os.environ.get("TOOTHWAVE_BIN", str(ROOT / "target/debug/toothwave"))


@contextlib.contextmanager
def running_service(*flags):
    """Its address."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    process = subprocess.Popen([BINARY, "--listen", address, "--log", "error", *flags], stdout=subprocess.DEVNULL)
    try:
        _wait_until_ready(f"http://{address}", process)
        yield f"http://{address}"
    finally:
        process.terminate()
        process.wait(timeout=15)


def _wait_until_ready(url, process):
    for _ in range(200):
        if process.poll() is not None:
            raise RuntimeError(f"{BINARY} ended with {process.returncode}")
        with contextlib.suppress(urllib.error.URLError), urllib.request.urlopen(f"{url}/health/ready"):
            return
        time.sleep(0.05)
    raise RuntimeError(f"{BINARY} is not ready after 10 s")
