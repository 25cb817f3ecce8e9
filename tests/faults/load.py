"""An open-loop HTTP client that accounts for each request: when one is due it is sent, however many are still under way."""

import asyncio
import collections
import hashlib
import itertools
import json
import pathlib
import pickle
import random
import subprocess
import sys
import time
import uuid

# What a client does when its connection is cut: it tries again, once, after this.
RETRY_AFTER_S = 3.0
PATIENCE_S = 45.0
REFUSALS = ("queue_full", "deadline_exceeded", "too_many_unread_bytes")


class Cut(Exception):
    """The connection was refused, or ended before its answer did."""


class Tally:
    """What became of the requests of one load."""

    def __init__(self, panics=False):
        self.panics = panics  # Whether solves panic by order, and 500 is the proper answer then.
        self.sent = self.answered = self.served_by_retry = self.left = 0
        self.cut = []  # The ids of requests that had no answer at the first try.
        self.refused = collections.Counter()
        self.lost = collections.Counter()
        self.seconds = []

    def __iadd__(self, other):
        for name in ("sent", "answered", "served_by_retry", "left"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.cut += other.cut
        self.refused += other.refused
        self.lost += other.lost
        self.seconds += other.seconds
        return self


class Client:
    """Asks one address; connections that stayed open are used again, as browsers and libraries do."""

    def __init__(self, host, port):
        self.host, self.port = host, port
        self.idle = []

    async def _connection(self):
        while self.idle:
            reader, writer = self.idle.pop()
            if not reader.at_eof() and not writer.is_closing():
                return reader, writer
            writer.close()
        return await asyncio.open_connection(self.host, self.port, limit=1 << 17)

    async def ask(self, request, leave_after_s=None, slowly=False):
        """Status, headers, and the body's digest and length; or a Cut."""
        writer = None
        keep = False
        try:
            reader, writer = await self._connection()
            writer.write(request)
            await writer.drain()
            if leave_after_s is not None:
                await asyncio.sleep(leave_after_s)
                return None
            head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").split("\r\n")
            status = int(head[0].split()[1])
            headers = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in head[1:])}
            body = Body()
            if headers.get("transfer-encoding", "").lower() == "chunked":
                while size := int(await reader.readline() or b"0", 16):
                    await body.read(reader, size, slowly)
                    await reader.readexactly(2)
                await reader.readline()
            else:
                await body.read(reader, int(headers.get("content-length", 0)), slowly)
            keep = headers.get("connection", "").lower() != "close"
            return status, headers, body
        except (OSError, asyncio.IncompleteReadError, ValueError, IndexError) as error:
            raise Cut(type(error).__name__) from error
        finally:
            if writer and keep:
                self.idle.append((reader, writer))
            elif writer:
                writer.transport.abort()

    def close(self):
        for _, writer in self.idle:
            writer.transport.abort()


class Body:
    """Answers have megabytes; what is kept of one are its digest and its beginning."""

    def __init__(self):
        self.digest, self.beginning = hashlib.blake2b(digest_size=16), b""

    async def read(self, reader, size, slowly):
        while size:
            part = await reader.read(min(size, 1 << 16))
            if not part:
                raise asyncio.IncompleteReadError(b"", size)
            self.digest.update(part)
            self.beginning = (self.beginning + part)[:4096] if len(self.beginning) < 4096 else self.beginning
            size -= len(part)
            if slowly:
                await asyncio.sleep(0.005)


class Work:
    """One kind of request: a path, and documents to be posted there, the same one or always another; or a path alone."""

    def __init__(self, host, path, document=None, *, headers=(), fresh=False, slowly=False):
        self.host, self.path, self.document, self.headers = host, path, document, headers
        self.fresh, self.slowly = fresh, slowly
        self.digest = None

    def request(self, id=None):
        headers = [*self.headers, *([f"X-Request-Id: {id}"] if id else [])]
        if self.document is None:
            return "\r\n".join([f"GET {self.path} HTTP/1.1", f"Host: {self.host}", *headers, "", ""]).encode()
        document = dict(self.document)
        if self.fresh:
            # Nobody asked for this torque before: it must be solved.
            document["load"] = {"input_torque_nm": 10 + 10 * random.random()}
        body = json.dumps(document).encode()
        head = [f"POST {self.path} HTTP/1.1", f"Host: {self.host}", "Content-Type: application/json"]
        head += [f"Content-Length: {len(body)}", *headers, "", ""]
        return "\r\n".join(head).encode() + body

    def is_right(self, body):
        """The same document has the same answer, byte for byte, whichever replica gives it."""
        if self.fresh:
            return True
        self.digest = self.digest or body.digest.hexdigest()
        return self.digest == body.digest.hexdigest()


async def _one(client, work, due, tally, leaves):
    tally.sent += 1
    id = uuid.uuid4().hex
    request = work.request(id)
    if leaves:
        try:
            await client.ask(request, leave_after_s=random.uniform(0.005, 0.15))
        except Cut:
            pass
        tally.left += 1
        return
    for attempt in range(2):
        try:
            status, headers, body = await asyncio.wait_for(client.ask(request, slowly=work.slowly), PATIENCE_S)
        except asyncio.TimeoutError:
            tally.lost["no answer"] += 1
            return
        except Cut as cut:
            if attempt:
                tally.lost[f"cut twice: {cut}"] += 1
                return
            tally.cut.append(id)
            await asyncio.sleep(RETRY_AFTER_S)
            continue
        if status == 200 and not work.is_right(body):
            tally.lost["another answer to the same document"] += 1
        elif status == 200:
            tally.answered += 1
            tally.served_by_retry += attempt
            if not attempt:
                tally.seconds.append(time.monotonic() - due)
        else:
            _refusal(status, headers, body, tally)
        return


def _refusal(status, headers, body, tally):
    try:
        problem = json.loads(body.beginning)
    except ValueError:
        problem = {}
    code = problem.get("code", "no problem")
    if status == 500:
        proper = tally.panics and code == "internal_error"
    else:
        retry_after = headers.get("retry-after", "0")
        proper = status == 503 and code in REFUSALS and retry_after.isdigit() and int(retry_after) >= 1
    proper = proper and headers.get("content-type") == "application/problem+json"
    if proper:
        tally.refused[code] += 1
    else:
        tally.lost[f"{status} {code}"] += 1


async def send(host, port, works, rate, until, *, leaves=False, panics=False):
    """Sends `rate` requests a second, the works in turn, until `until()`; returns what became of them when all have ended."""
    tally, client, tasks = Tally(panics), Client(host, port), set()
    start = time.monotonic()
    for index, work in zip(itertools.count(), itertools.cycle(works)):
        due = start + index / rate
        await asyncio.sleep(max(0.0, due - time.monotonic()))
        if until():
            break
        task = asyncio.create_task(_one(client, work, due, tally, leaves))
        tasks.add(task)
        task.add_done_callback(tasks.discard)
    if tasks:
        await asyncio.wait(tasks)
    client.close()
    return tally


class Apart:
    """A load in a process of its own, whose times do not wait for what another load does."""

    def __init__(self, *load):
        command = [sys.executable, "-c", "import load; load.apart()"]
        here = pathlib.Path(__file__).parent
        self.process = subprocess.Popen(command, cwd=here, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        pickle.dump(load, self.process.stdin)
        self.process.stdin.flush()

    async def end(self):
        """What became of its requests."""
        answer, _ = await asyncio.to_thread(self.process.communicate)
        return pickle.loads(answer)


def apart():
    """What an `Apart` runs: `send` until nobody holds its input any more."""

    async def until_told(*load):
        loop, is_over = asyncio.get_running_loop(), asyncio.Event()

        def told():
            loop.remove_reader(sys.stdin)
            is_over.set()

        loop.add_reader(sys.stdin, told)
        return await send(*load, is_over.is_set)

    pickle.dump(asyncio.run(until_told(*pickle.load(sys.stdin.buffer))), sys.stdout.buffer)


async def hold(host, port, work, count, seconds):
    """Clients that ask and then do not read."""
    connections = []
    for _ in range(count):
        reader, writer = await asyncio.open_connection(host, port, limit=1 << 10)
        writer.write(work.request())
        connections.append((reader, writer))
        await asyncio.sleep(0.1)
    await asyncio.sleep(seconds)
    for _, writer in connections:
        writer.transport.abort()


def percentile(values, share):
    """The value that `share` of all do not exceed."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else float("nan")
