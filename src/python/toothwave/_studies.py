"""Studies on threads of this process, or on whatever has the interface of `concurrent.futures.Executor`."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack
from functools import cached_property, lru_cache
from queue import Empty, SimpleQueue
from typing import NamedTuple

from tqdm.auto import tqdm

from . import _native
from ._answers import Answer, Document, document_bytes
from ._tables import Columns, Tabular

WINDOW = 1000
"""Chunks that are with the executor at once. A cluster with more cores needs more."""

LOSSES = 3
"""A chunk that was lost so often is computed once more, alone."""


class Gap(NamedTuple):
    """A chunk that has no part, because it was lost every time."""

    chunk: int
    variants: range | None
    """Its variants; of a search, whose chunks are islands, `None`."""
    error: str
    """How it was lost at last."""


class StudyResult(Tabular, Answer):
    """What a study comes to: a read-only dict like the JSON of the service, and a table like its CSV.

    `gaps` tells what is missing.
    """

    def __init__(self, gathered: _native.Gathered, gaps: list[Gap]):
        super().__init__(gathered.answer())
        self._gathered = gathered
        self.gaps = gaps

    @cached_property
    def columns(self) -> Columns:
        """The columns of the answer's table. A number that is not there is NaN."""
        return Columns(self._gathered.columns())

    @cached_property
    def rows(self) -> Columns:
        """A row for each variant. A search has none."""
        columns = self._gathered.rows()
        if columns is None:
            raise ValueError("a search has no rows: `front` has the designs that it found")
        return Columns(columns)


class Study:
    """Many variants of one design: a map, a search, a sensitivity or a tolerance study, as the service takes it.

    A study consists of chunks, whose size follows from the number of variants. `chunk_variants` sets another size, which changes no bit of the
    result; the islands of a search stay as they are.
    """

    def __init__(self, document: Document, *, chunk_variants: int | None = None):
        self._document = document_bytes(document)
        self._chunk_variants = chunk_variants
        self._native = _native.Study(self._document, chunk_variants)

    id = property(lambda self: self._native.id, doc="A hash of what is asked, of the build and of the machine's arithmetic.")
    kind = property(lambda self: self._native.kind, doc="`map`, `search`, `sensitivity` or `tolerance`.")
    variants = property(lambda self: self._native.variants, doc="How many variants it has.")
    chunks = property(lambda self: self._native.chunks, doc="How many chunks it consists of.")

    def __repr__(self) -> str:
        return f"Study: a {self.kind} of {self.variants} variants in {self.chunks} chunks"

    def run(
        self,
        executor: Executor | None = None,
        checkpoint: str | os.PathLike[str] | None = None,
        progress: bool = True,
    ) -> StudyResult:
        """Computes all chunks, and merges them as they come.

        executor: threads on all cores by default. Others are Dask's `client.get_executor()`, `mpi4py.futures.MPIPoolExecutor()` and loky's
        `get_reusable_executor()`. Its workers need this package, of the same build, and processors with the same arithmetic.

        checkpoint: a folder for the parts, one Parquet file for each chunk. What is there already is not computed again.

        progress: whether a progress bar is shown.

        A chunk that is lost, because its worker died or raised, is submitted again. After three losses it is computed once more, alone. If it is
        lost again, it is a gap of the result. If the executor itself breaks, or if its workers lack this package, this raises, and the checkpoint
        stays.
        """
        gathered = _native.Gathered(self._native)
        folder = _native.Folder(checkpoint) if checkpoint is not None else None
        for chunk in folder.chunks() if folder else ():
            try:
                gathered.add(chunk, folder.read(chunk))
            except _native.PartError as error:
                raise _native.PartError(f"{folder.file(chunk)}: {error}") from None
        gaps = []
        with ExitStack() as stack:
            if executor is None:
                executor = ThreadPoolExecutor(_cores())
                stack.callback(executor.shutdown, cancel_futures=True)
            bar = stack.enter_context(tqdm(total=self.variants, initial=gathered.variants, unit=" variants", disable=not progress))
            for chunk, part in self._computed(executor, gathered.missing()):
                if isinstance(part, BaseException):
                    span = self._native.span(chunk)
                    gaps.append(Gap(chunk, span and range(*span), f"{type(part).__name__}: {part}"))
                    continue
                gathered.add(chunk, part)
                if folder:
                    folder.write(chunk, part)
                bar.update(gathered.variants - bar.n)
        if gaps and not gathered.variants:
            raise RuntimeError(f"all chunks were lost, the first with {gaps[0].error}")
        return StudyResult(gathered, sorted(gaps))

    def _computed(self, executor: Executor, chunks: Iterable[int]) -> Iterator[tuple[int, bytes | BaseException]]:
        """Each chunk with its part, or with why it was lost at last."""
        waiting, lost_often = list(reversed(list(chunks))), []
        losses: Counter[int] = Counter()
        with _Pending(executor, self._document, self._chunk_variants) as pending:
            while waiting or pending or lost_often:
                while waiting and len(pending) < WINDOW:
                    pending.submit(waiting.pop())
                if not pending:
                    pending.submit(lost_often.pop())
                chunk, future = pending.next()
                try:
                    yield chunk, future.result()
                except (BrokenExecutor, ImportError):
                    raise
                except CancelledError as error:
                    raise BrokenExecutor("the executor has cancelled a chunk") from error
                except Exception as error:
                    if losses[chunk] == LOSSES:
                        yield chunk, error
                        continue
                    # Dask itself has tried such a chunk on several workers.
                    is_last = losses[chunk] + 1 == LOSSES or type(error).__name__ == "KilledWorker"
                    losses[chunk] = LOSSES if is_last else losses[chunk] + 1
                    (lost_often if is_last else waiting).append(chunk)


class _Pending:
    """The chunks that are with the executor."""

    def __init__(self, executor: Executor, document: bytes, chunk_variants: int | None):
        self._executor = executor
        self._arguments = (compute_chunk, document, chunk_variants)
        self._chunks: dict[Future[bytes], int] = {}
        self._done: SimpleQueue[Future[bytes]] = SimpleQueue()

    def __enter__(self) -> _Pending:
        return self

    def __exit__(self, *error: object) -> None:
        for future in list(self._chunks):
            future.cancel()

    def __len__(self) -> int:
        return len(self._chunks)

    def submit(self, chunk: int) -> None:
        require_connected(self._executor)
        future = self._executor.submit(*self._arguments, chunk)
        self._chunks[future] = chunk
        future.add_done_callback(self._done.put)

    def next(self) -> tuple[int, Future[bytes]]:
        """The next chunk that is over."""
        while True:
            try:
                future = self._done.get(timeout=1.0)
            except Empty:
                require_connected(self._executor)
            else:
                return self._chunks.pop(future), future


def require_connected(executor: Executor) -> None:
    """Raises if the executor is of a Dask client without its scheduler: its futures are lost then, and some of them never say so."""
    status = getattr(getattr(executor, "_client", None), "status", "running")
    if status != "running":
        raise BrokenExecutor(f"the Dask client has lost its scheduler: it is {status}")


def _cores() -> int:
    """The cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def compute_chunk(document: bytes, chunk_variants: int | None, chunk: int) -> bytes:
    """A part of a study: what workers compute."""
    return _study(document, chunk_variants).compute(chunk)


@lru_cache(maxsize=8)
def _study(document: bytes, chunk_variants: int | None) -> _native.Study:
    """The study of the chunks before, which need not be read and checked again."""
    return _native.Study(document, chunk_variants)
