"""A PostgreSQL 15 of a harness's own: in a folder that goes with it, on a free port, as an unprivileged user."""

import contextlib
import os
import pathlib
import pwd
import shutil
import signal
import subprocess
import tempfile
import time

from harness import WORK, free_port, run

PROGRAMS = pathlib.Path("/usr/lib/postgresql/15/bin")
PASSWORD = "a password that stands in no log"

# Whoever connects by TCP has a password; the database `sealed` is to be had by TLS alone.
HOST_RULES = "local all all trust\nhostnossl sealed all all reject\nhost all all all scram-sha-256\n"


def install():
    """The programs, where they are missing (Debian, as root); nothing of Debian's own is started."""
    if (PROGRAMS / "initdb").exists():
        return
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    run("apt-get", "update", "-qq", env=environment)
    run("apt-get", "install", "-y", "-qq", "--no-install-recommends", "postgresql-common", env=environment)
    with open("/etc/postgresql-common/createcluster.conf", "a") as file:
        file.write("create_main_cluster = false\n")
    run("apt-get", "install", "-y", "-qq", "--no-install-recommends", "postgresql-15", env=environment)


class Postgres:
    """A server with an empty database `studies`. With `most_mib` all that it has, its log of transactions too, is on a file system of
    that size, where one can be mounted. One that is open wants no password: in a debug build it takes tens of milliseconds to prove."""

    def __init__(self, most_mib=None, connections=600, is_open=False):
        install()
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="toothwave-postgres-"))
        self.port, self.connections = free_port(), connections
        # PostgreSQL does not run as root.
        self.user = pwd.getpwnam("postgres") if os.geteuid() == 0 else None
        self.own(self.folder)
        self.disk = self.folder / "disk"
        self.disk.mkdir()
        size = f"size={most_mib}m"
        self.is_small = bool(most_mib) and not subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tmpfs", self.disk], capture_output=True).returncode
        self.own(self.disk)
        (self.folder / "password").write_text(PASSWORD)
        self.make_certificates()
        self.data, self.log = self.disk / "data", WORK / f"postgres-{self.port}.log"
        self.log.write_text("")
        words = ("-U", "toothwave", "-A", "scram-sha-256", "--pwfile", self.folder / "password", "-E", "UTF8")
        run(PROGRAMS / "initdb", "-D", self.data, *words, cwd=self.folder, **self.identity())
        rules = HOST_RULES.replace("scram-sha-256", "trust") if is_open else HOST_RULES
        (self.data / "pg_hba.conf").write_text(rules)
        self.start()
        self.say("CREATE DATABASE studies", "postgres")

    def own(self, path):
        if self.user:
            os.chown(path, self.user.pw_uid, self.user.pw_gid)

    def make_certificates(self):
        """An authority, a certificate of it for `localhost` and for nothing else, and another authority that signed neither."""
        for authority in ("authority", "stranger"):
            self.make_certificate(authority, "-x509", "-addext", "basicConstraints=critical,CA:TRUE")
        self.make_certificate("server")
        (self.folder / "name").write_text("subjectAltName=DNS:localhost\n")
        place = lambda name: self.folder / name
        signed = ("-CA", place("authority.crt"), "-CAkey", place("authority.key"), "-CAcreateserial", "-days", 2, "-extfile", place("name"))
        run("openssl", "x509", "-req", "-in", place("server.csr"), "-out", place("server.crt"), *signed)
        self.own(place("server.key"))

    def make_certificate(self, name, *how):
        out = ".crt" if how else ".csr"
        key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-keyout", self.folder / f"{name}.key")
        run("openssl", "req", "-new", *key, "-subj", f"/CN=toothwave {name}", "-out", self.folder / f"{name}{out}", *how, *(("-days", 2) if how else ()))

    def start(self):
        settings = {
            "listen_addresses": "localhost",
            "port": self.port,
            "unix_socket_directories": self.folder,
            "max_connections": self.connections,
            "ssl": "on",
            "ssl_cert_file": self.folder / "server.crt",
            "ssl_key_file": self.folder / "server.key",
        }
        words = [word for name, value in settings.items() for word in ("-c", f"{name}={value}")]
        command = list(map(str, [PROGRAMS / "postgres", "-D", self.data, *words]))
        # Ours and not pg_ctl's: where it is killed its number must be free again, or no other one starts.
        with self.log.open("a") as log:
            self.server = subprocess.Popen(command, cwd=self.folder, stdout=log, stderr=log, **self.identity())
        deadline = time.monotonic() + 60
        while subprocess.run([PROGRAMS / "pg_isready", "-q", "-h", "localhost", "-p", str(self.port)]).returncode:
            if self.has_ended() or time.monotonic() > deadline:
                raise RuntimeError(f"PostgreSQL does not start: {self.log.read_text()[-2000:]}")
            time.sleep(0.05)

    def identity(self):
        return {"user": self.user.pw_uid, "group": self.user.pw_gid, "extra_groups": []} if self.user else {}

    def has_ended(self):
        return self.server.poll() is not None

    def kill(self):
        """Without a word to anybody: the server and all its sessions, and it starts none meanwhile."""
        self.server.send_signal(signal.SIGSTOP)
        pid = self.server.pid
        sessions = list(map(int, pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()))
        for process in (pid, *sessions):
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        self.server.wait()
        while any(map(is_alive, sessions)):
            time.sleep(0.02)

    def end(self):
        if not self.has_ended():
            self.server.send_signal(signal.SIGQUIT)
            self.server.wait(60)
        if self.is_small:
            subprocess.run(["umount", self.disk], capture_output=True)
        shutil.rmtree(self.folder, ignore_errors=True)

    def say(self, statement, database="studies"):
        place = ("-h", self.folder, "-p", self.port, "-U", "toothwave", "-d", database)
        return run(PROGRAMS / "psql", "-qAtX", "-v", "ON_ERROR_STOP=1", *place, "-c", statement)

    @contextlib.contextmanager
    def holding(self, statements, database="studies"):
        """A session that has said this, and stays open."""
        command = [PROGRAMS / "psql", "-qAtX", "-h", self.folder, "-p", str(self.port), "-U", "toothwave", "-d", database]
        session = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        session.stdin.write(f"{statements};\nSELECT 'said';\n")
        session.stdin.flush()
        while "said" not in session.stdout.readline():
            pass
        try:
            yield
        finally:
            session.stdin.close()
            session.wait()

    def address(self, database="studies", host="localhost", port=None, query="?sslmode=disable"):
        return f"postgres://toothwave@{host}:{port or self.port}/{database}{query}"


def is_alive(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
