"""A client that sends requests at a fixed rate, however slowly they are answered, and accounts for each of them."""

import asyncio
import collections
import hashlib
import itertools
import json
import random
import time

# A client whose connection is cut tries once more after this time.
RETRY_AFTER_S = 3.0
PATIENCE_S = 45.0
REFUSALS = ("queue_full", "deadline_exceeded", "too_many_unread_bytes")


class Tally:
    """What became of the requests of one load."""

    def __init__(self):
        self.sent = self.answered = self.retried = 0
        self.refused, self.lost, self.seconds = collections.Counter(), collections.Counter(), []

    def __iadd__(self, other):
        for name in ("sent", "answered", "retried", "refused", "lost", "seconds"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        return self


class Answer:
    """Bodies have megabytes: their digest, length and beginning are kept."""

    def __init__(self, head):
        first, *lines = head.decode("latin-1").split("\r\n")
        self.status = int(first.split()[1])
        self.headers = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
        self.digest, self.length, self.beginning = hashlib.blake2b(digest_size=16), 0, b""

    async def read(self, reader):
        if self.headers.get("transfer-encoding", "").lower() == "chunked":
            while size := int(await reader.readline() or b"0", 16):
                await self._read(reader, size)
                await reader.readexactly(2)
        else:
            await self._read(reader, int(self.headers.get("content-length", 0)))
        return self

    async def _read(self, reader, size):
        while size:
            part = await reader.read(min(size, 1 << 16))
            if not part:
                raise asyncio.IncompleteReadError(b"", size)
            self.digest.update(part)
            self.beginning = self.beginning or part
            size, self.length = size - len(part), self.length + len(part)


async def read_answer(reader):
    return await Answer(await reader.readuntil(b"\r\n\r\n")).read(reader)


async def ask(host, port, request):
    """The answer; an OSError, EOFError or ValueError if the connection ends before it does."""
    reader, writer = await asyncio.open_connection(host, port)
    try:
        writer.write(request)
        return await read_answer(reader)
    finally:
        writer.transport.abort()


class Work:
    """One kind of request: a path, and a document to be posted there; `fresh` ones have a torque that nobody asked for before."""

    def __init__(self, path, document=None, headers=(), fresh=False):
        self.path, self.document, self.headers, self.fresh, self.digest = path, document, headers, fresh, None

    def request(self):
        document = self.document
        if self.fresh:
            document = document | {"load": {"input_torque_nm": 10 + 10 * random.random()}}
        body = json.dumps(document).encode() if document else b""
        head = [f"{'POST' if document else 'GET'} {self.path} HTTP/1.1", "Host: localhost", *self.headers]
        head += ["Content-Type: application/json", f"Content-Length: {len(body)}"] if document else []
        return "\r\n".join([*head, "", ""]).encode() + body

    def is_right(self, answer):
        """The same document has the same answer, byte for byte, from either replica."""
        if self.fresh or not self.document:
            return True
        self.digest = self.digest or answer.digest.hexdigest()
        return self.digest == answer.digest.hexdigest()


async def _one(host, port, work, due, tally):
    tally.sent += 1
    request = work.request()
    try:
        answer = await asyncio.wait_for(ask(host, port, request), PATIENCE_S)
    except (OSError, EOFError, ValueError):
        tally.retried += 1
        await asyncio.sleep(RETRY_AFTER_S)
        try:
            answer = await asyncio.wait_for(ask(host, port, request), PATIENCE_S)
        except (OSError, EOFError, ValueError) as error:
            tally.lost[type(error).__name__] += 1
            return
    if answer.status != 200:
        _count_refusal(answer, tally)
    elif work.is_right(answer):
        tally.answered += 1
        tally.seconds.append(time.monotonic() - due)
    else:
        tally.lost["another answer to the same document"] += 1


def _count_refusal(answer, tally):
    try:
        code = json.loads(answer.beginning)["code"]
    except (ValueError, KeyError):
        code = "no problem"
    is_proper = answer.status == 503 and code in REFUSALS and answer.headers.get("retry-after", "").isdigit()
    (tally.refused if is_proper else tally.lost)[f"{answer.status} {code}"] += 1


async def send(host, port, works, rate, until):
    """Sends `rate` requests a second, the works in turn, until `until()`; returns what became of them when all have ended."""
    tally, tasks, start = Tally(), set(), time.monotonic()
    for index, work in zip(itertools.count(), itertools.cycle(works)):
        due = start + index / rate
        await asyncio.sleep(max(0.0, due - time.monotonic()))
        if until():
            break
        tasks.add(asyncio.create_task(_one(host, port, work, due, tally)))
    if tasks:
        await asyncio.wait(tasks)
    return tally
