"""Studies on threads of this process, or on any executor with the interface of `concurrent.futures.Executor`."""

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
"""Largest number of chunks submitted to the executor at once. A cluster with more cores needs a larger one."""

LOSSES = 3
"""Number of losses after which a chunk is computed once more, alone."""


class Gap(NamedTuple):
    """A chunk without a part: every attempt to compute it failed."""

    chunk: int
    variants: range | None
    """Variants of the chunk. `None` for a search, whose chunks are islands."""
    error: str
    """Error of the last attempt."""


class StudyResult(Tabular, Answer):
    """Result of a study: a read-only mapping with the names of the service's JSON, and a table like its CSV.

    `gaps` lists the missing chunks.
    """

    def __init__(self, gathered: _native.Gathered, gaps: list[Gap]):
        super().__init__(gathered.answer())
        self._gathered = gathered
        self.gaps = gaps

    @cached_property
    def columns(self) -> Columns:
        """Columns of the result's table. A missing number is NaN."""
        return Columns(self._gathered.columns())

    @cached_property
    def rows(self) -> Columns:
        """Columns with one row for each variant. A search has none."""
        columns = self._gathered.rows()
        if columns is None:
            raise ValueError("A search has no rows. Use `front`, which lists the designs found.")
        return Columns(columns)


class Study:
    """Many variants of one design: a map, a search, a sensitivity or a tolerance study. The document has the form of the service.

    A study consists of chunks. Their size follows from the number of variants. `chunk_variants` sets another size, which does not
    change the result. It does not apply to a search, whose chunks are islands.
    """

    def __init__(self, document: Document, *, chunk_variants: int | None = None):
        self._document = document_bytes(document)
        self._chunk_variants = chunk_variants
        self._native = _native.Study(self._document, chunk_variants)

    id = property(lambda self: self._native.id, doc="Hash of the document, the build and the machine's arithmetic.")
    kind = property(lambda self: self._native.kind, doc="`map`, `search`, `sensitivity` or `tolerance`.")
    variants = property(lambda self: self._native.variants, doc="Number of variants.")
    chunks = property(lambda self: self._native.chunks, doc="Number of chunks.")

    def __repr__(self) -> str:
        return f"Study: a {self.kind} of {self.variants} variants in {self.chunks} chunks"

    def run(
        self,
        executor: Executor | None = None,
        checkpoint: str | os.PathLike[str] | None = None,
        progress: bool = True,
    ) -> StudyResult:
        """Computes all chunks and returns the merged result.

        executor: threads on all cores by default. Others are Dask's `client.get_executor()`, `mpi4py.futures.MPIPoolExecutor()` and loky's
        `get_reusable_executor()`. Its workers need the same build of this package and processors with the same arithmetic.

        checkpoint: a folder for the parts, one Parquet file for each chunk. Chunks with a part in the folder are not computed again.

        progress: True shows a progress bar.

        If the worker of a chunk dies or raises an exception, the chunk is submitted again. After three losses it is computed once more,
        alone. If that fails too, the result lists the chunk in `gaps`. If the executor breaks, or its workers lack this package, `run` raises
        an exception and keeps the checkpoint.
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
            raise RuntimeError(f"all chunks were lost. First error: {gaps[0].error}")
        return StudyResult(gathered, sorted(gaps))

    def _computed(self, executor: Executor, chunks: Iterable[int]) -> Iterator[tuple[int, bytes | BaseException]]:
        """Yields each chunk with its part, or with the error of its last attempt."""
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
                    raise BrokenExecutor("the executor cancelled a chunk") from error
                except Exception as error:
                    if losses[chunk] == LOSSES:
                        yield chunk, error
                        continue
                    # Dask has already tried this chunk on several workers.
                    is_last = losses[chunk] + 1 == LOSSES or type(error).__name__ == "KilledWorker"
                    losses[chunk] = LOSSES if is_last else losses[chunk] + 1
                    (lost_often if is_last else waiting).append(chunk)


class _Pending:
    """Chunks submitted to the executor."""

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
        """Waits for a chunk to end and returns it with its future."""
        while True:
            try:
                future = self._done.get(timeout=1.0)
            except Empty:
                require_connected(self._executor)
            else:
                return self._chunks.pop(future), future


def require_connected(executor: Executor) -> None:
    """Raises `BrokenExecutor` if a Dask client has lost its scheduler, because some of its futures would never end."""
    status = getattr(getattr(executor, "_client", None), "status", "running")
    if status != "running":
        raise BrokenExecutor(f"the Dask client lost its scheduler (status {status}). Connect again and run the study with the same checkpoint")


def _cores() -> int:
    """Returns the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def compute_chunk(document: bytes, chunk_variants: int | None, chunk: int) -> bytes:
    """Computes a chunk on a worker and returns its part."""
    return _study(document, chunk_variants).compute(chunk)


@lru_cache(maxsize=8)
def _study(document: bytes, chunk_variants: int | None) -> _native.Study:
    """Returns the study, cached so that it is read and checked once for all its chunks."""
    return _native.Study(document, chunk_variants)
