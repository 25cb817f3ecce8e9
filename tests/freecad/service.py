"""The real service on a free port, and hosts that are none, for as long as a test needs them."""

import contextlib
import os
import socket
import subprocess
import threading
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


DIES_WITHIN = b'HTTP/1.1 200 OK\r\nContent-Length: 1000\r\nETag: "x"\r\n\r\n{"bodies": ['


@contextlib.contextmanager
def host(*answers):
    """Says these bytes to one connection after the other, the last to all that follow; gives its address and what it was sent."""
    heard = []

    def serve():
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            with connection, contextlib.suppress(OSError):
                heard.append(whole_request(connection))
                connection.sendall(answers[min(len(heard), len(answers)) - 1])

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield f"127.0.0.1:{listener.getsockname()[1]}", heard
        listener.shutdown(socket.SHUT_RDWR)
    thread.join()


def whole_request(connection):
    """Head and body, so that closing does not reset what is still to be read."""
    with connection.makefile("rb") as stream:
        head = b"".join(iter(stream.readline, b"\r\n"))
        length = next((int(line[15:]) for line in head.splitlines() if line.lower().startswith(b"content-length:")), 0)
        stream.read(length)
        return head.decode()


def answer(status, body=b"", *headers):
    """An HTTP answer as bytes."""
    lines = [f"HTTP/1.1 {status} .", f"Content-Length: {len(body)}", "Connection: close", *headers]
    return "\r\n".join([*lines, "", ""]).encode() + body
