"""What studies' harnesses put on a database: services, workers, a cable that can be cut, and what must be true when a study has ended."""

import contextlib
import hashlib
import http.client
import json
import os
import signal
import socket
import subprocess
import threading
import time

from harness import ROOT, WORK, free_port, run
from postgres import PASSWORD

DESIGN = json.loads((ROOT / "examples/paper-5.1.json").read_text())


# So that a study has many chunks, and is soon over all the same.
CHUNK_VARIANTS = 40


def map_of(rows, seed):
    """A chunk a row, of variants that are soon looked at; each seed is another study."""
    over = {
        "/drive/teeth/radius_mm": {"min": 3.0, "max": 7.5, "steps": rows},
        "/drive/wave_generator/semi_minor_mm": {"min": 55.0, "max": 57.0 + seed / 1000, "steps": CHUNK_VARIANTS},
    }
    return {"study": "map", "base": DESIGN, "over": over, "quantities": ["slot_wall_mm", "coincidence_degree"]}


def wait_until(what, patience_s=60, pause_s=0.05):
    deadline = time.monotonic() + patience_s
    while not what():
        if time.monotonic() > deadline:
            raise RuntimeError(f"waited {patience_s} s in vain")
        time.sleep(pause_s)


# --- The service and its workers


class Process:
    def __init__(self, binary, name, *words, faults=None, environment=None, keep_to=None):
        self.log = WORK / f"studies-{name}.log"
        self.output = open(self.log, "w")
        ordered = ";".join(f"{point}=return({number})" for point, number in (faults or {}).items())
        environment = os.environ | {"PGPASSWORD": PASSWORD, "FAILPOINTS": ordered} | (environment or {})
        self.process = subprocess.Popen([binary, *map(str, words)], env=environment, stdout=self.output, stderr=self.output, preexec_fn=keep_to)
        self.pid = self.process.pid

    def send(self, number):
        self.process.send_signal(number)

    def end(self, number=signal.SIGTERM, patience_s=30):
        """Its status."""
        if self.process.poll() is None:
            self.send(number)
            # One that is paused gets it now.
            self.send(signal.SIGCONT)
        try:
            self.process.wait(patience_s)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise RuntimeError(f"{self.log.name} did not end within {patience_s} s") from None
        finally:
            self.output.close()
        return self.process.returncode

    def says(self, words):
        return words in self.log.read_text()


class Service(Process):
    def __init__(self, binary, name, studies, faults=None, environment=None, words=(), keep_to=None):
        self.port = free_port()
        super().__init__(
            binary, name, "serve", "--listen", f"127.0.0.1:{self.port}", "--studies", studies, *words, faults=faults, environment=environment, keep_to=keep_to
        )
        wait_until(self.is_ready)

    def is_ready(self):
        if self.process.poll() is not None:
            raise RuntimeError(self.log.read_text())
        try:
            return self.ask("GET", "/health/ready")[0] == 200
        except OSError:
            return False

    def ask(self, method, path, document=None, headers=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            connection.request(method, path, document and json.dumps(document), {"Content-Type": "application/json"} | (headers or {}))
            answer = connection.getresponse()
            return answer.status, answer.read()
        finally:
            connection.close()

    def begin(self, document):
        status, body = self.ask("POST", "/v1/studies", document)
        if status not in (200, 202):
            raise RuntimeError(f"{status} {body.decode()}")
        return json.loads(body)["id"]

    def stands(self, id_):
        status, body = self.ask("GET", f"/v1/studies/{id_}")
        if status != 200:
            raise RuntimeError(f"{status} {body.decode()}")
        return json.loads(body)

    def await_end(self, id_, patience_s=120):
        wait_until(lambda: self.stands(id_)["state"] != "running", patience_s)
        return self.stands(id_)

    def result(self, id_):
        return self.ask("GET", f"/v1/studies/{id_}/result")[1]


class Cable:
    """Between a worker and the server. Once cut it passes nothing on in either direction and says nothing of it; connections that were
    open then stay so for ever, as those of a machine that has gone do. With `cut_at` it is cut by whoever says these words."""

    def __init__(self, port, cut_at=None):
        self.to, self.cut_at, self.is_cut, self.ends = port, cut_at, False, []
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                near, _ = self.listener.accept()
                far = socket.create_connection(("127.0.0.1", self.to))
            except OSError:
                return
            link = {"is_cut": self.is_cut, "ends": (near, far)}
            self.ends.append(link)
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self.pass_on, args=(link, source, sink), daemon=True).start()

    def pass_on(self, link, source, sink):
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                if self.cut_at and self.cut_at in data:
                    self.cut()
                if not link["is_cut"]:
                    sink.sendall(data)
            if not link["is_cut"]:
                sink.shutdown(socket.SHUT_WR)

    def cut(self):
        self.is_cut = True
        for link in self.ends:
            link["is_cut"] = True

    def mend(self):
        """For connections that are made from now on."""
        self.is_cut = False

    def close(self):
        for each in (self.listener, *(end for link in self.ends for end in link["ends"])):
            each.close()


# --- One row


class Row:
    def __init__(self, name):
        self.name, self.wrong, self.digest, self.note = name, [], "", ""
        self.chunks = self.attempts = self.gaps = 0
        self.seconds = 0.0

    def require(self, is_right, text):
        if not is_right:
            self.wrong.append(text)

    def cells(self):
        return [self.name, self.note, self.digest, self.chunks, self.attempts, self.gaps, f"{self.seconds:.1f}"]


HEADS = ["fault", "what was seen", "bytes", "results", "attempts", "gaps", "s"]


def digest(result):
    return hashlib.sha256(result.strip()).hexdigest()


class Stage:
    """A database with its tables, a service, a study, and whatever workers a row wants."""

    seeds = iter(range(1, 1000))
    alone = {}

    def __init__(self, binary, row, postgres, rows_of_map, studies=None):
        self.binary, self.row, self.postgres = binary, row, postgres
        self.studies, self.processes = studies or postgres.address(), []
        self.is_shared = self.studies.startswith("postgres")
        self.document, self.id = map_of(rows_of_map, next(self.seeds)), None
        self.are_leases_lost = False

    def __enter__(self):
        if self.is_shared:
            self.migrate({"PGPASSWORD": PASSWORD})
        self.service = self.serve("replica-1")
        self.started = time.monotonic()
        return self

    def __exit__(self, *_):
        # What is left is of no interest any more.
        for process in self.processes:
            with contextlib.suppress(RuntimeError):
                process.end(signal.SIGKILL)

    def migrate(self, environment):
        run(self.binary, "migrate", "--studies", self.studies, env=os.environ | environment)

    def serve(self, name, chunk_variants=CHUNK_VARIANTS, slow_ms=None, **how):
        faults = {name: number for name, number in (("chunk_variants", chunk_variants), ("slow_ms", slow_ms)) if number} or None
        service = Service(self.binary, name, self.studies, faults=faults, **how)
        self.processes.append(service)
        return service

    def work(self, name="worker-1", studies=None, slots=1, environment=None, parts=None, keep_to=None, **faults):
        words = ["worker", "--studies", studies or self.studies, "--max-concurrent-solves", slots]
        if parts:
            words += ["--study-parts", parts]
        worker = Process(self.binary, name, *words, faults=faults, environment=environment, keep_to=keep_to)
        self.processes.append(worker)
        return worker

    def begin(self, document=None, lease_ms=None):
        self.document = document or self.document
        self.id = self.service.begin(self.document)
        if lease_ms:
            self.say(f"UPDATE studies SET lease_ms = {lease_ms} WHERE id = '{self.id}'")

    def say(self, statement):
        return self.postgres.say(statement)

    def count(self, table, where="TRUE"):
        return int(self.say(f"SELECT count(*) FROM {table} WHERE study = '{self.id}' AND {where}"))

    def results_of(self, worker):
        return self.count("results", f"worker LIKE '%:{worker.pid}'")

    def await_chunks(self, more):
        least = self.count("results") + more
        wait_until(lambda: self.count("results") >= least, 60, 0.02)

    def await_work(self):
        """Until a chunk is in somebody's hands."""
        wait_until(lambda: self.count("attempts") > self.count("results"), 60, 0.0)

    def complete(self):
        """It has come to its end, whole and to the bytes of a single process."""
        chunks = int(self.say(f"SELECT chunks FROM studies WHERE id = '{self.id}'")) if self.is_shared else 0
        wait_until(lambda: not self.is_shared or self.count("results") == chunks, 240)
        # Whoever asks learns it soon, whatever has befallen the database.
        stands = self.service.await_end(self.id, 30)
        self.row.seconds = time.monotonic() - self.started
        self.row.require(stands["state"] == "done", f"it stands {stands}")
        self.row.require(self.is_counted(stands["looked_at"], stands["variants"]), f"of its variants are counted: {stands}")
        self.compare(self.service.result(self.id))

    def is_counted(self, looked_at, variants):
        """Each variant once; a search judges what it found besides."""
        return looked_at >= variants if self.document["study"] == "search" else looked_at == variants

    def compare(self, result):
        """With the bytes of a single process, without any store."""
        text = json.dumps(self.document)
        if text not in self.alone:
            done = subprocess.run([self.binary, "study", "-"], input=text.encode(), capture_output=True, check=True)
            self.alone[text] = digest(done.stdout)
        is_same = digest(result) == self.alone[text]
        self.row.digest = "as alone" if is_same and self.row.digest in ("", "as alone") else "OTHERS"
        self.row.require(is_same, f"its bytes are others: {result[:200]}")

    def account(self):
        """From the database itself: each chunk once, each variant once."""
        self.row.chunks, self.row.attempts, self.row.gaps = map(self.count, ("results", "attempts", "gaps"))
        chunks, variants = self.say(f"SELECT chunks, variants FROM studies WHERE id = '{self.id}'").split("|")
        looked_at = int(self.say(f"SELECT coalesce(sum(variants), 0) FROM results WHERE study = '{self.id}'"))
        self.row.require(self.row.chunks == int(chunks), f"{self.row.chunks} results of {chunks} chunks")
        self.row.require(self.is_counted(looked_at, int(variants)), f"{looked_at} of {variants} variants")
        # Of those who lose a lease to another each takes back its own.
        self.row.require(self.row.attempts >= self.row.chunks or self.are_leases_lost, "there are results without an attempt")

    def listen(self):
        """What no log should hold."""
        for process in self.processes:
            for words in (PASSWORD, "panicked"):
                self.row.require(not process.says(words), f"{process.log.name} says {words!r}")
