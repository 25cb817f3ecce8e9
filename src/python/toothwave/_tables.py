"""Columns of numbers, and what data frames make of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy


class Columns(Mapping[str, numpy.ndarray]):
    """A table by its columns: a NumPy array for each name, all of one length.

    pyarrow, polars, DuckDB and others read it by Arrow's PyCapsule interface, which needs pyarrow.
    """

    def __init__(self, columns: list[tuple[str, numpy.ndarray]]):
        self._columns = dict(columns)

    def __getitem__(self, name: str) -> numpy.ndarray:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __repr__(self) -> str:
        rows = len(next(iter(self._columns.values()), ()))
        return f"Columns of {rows} rows: {', '.join(self._columns)}"

    def to_pandas(self):
        """The table as a `pandas.DataFrame`."""
        import pandas

        return pandas.DataFrame(self._columns)

    def to_polars(self):
        """The table as a `polars.DataFrame`."""
        import polars

        # Words are Python objects to NumPy, and would stay such.
        plain = {name: list(column) if column.dtype == object else column for name, column in self.items()}
        return polars.DataFrame(plain)

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        import pyarrow

        return pyarrow.table(self._columns).__arrow_c_stream__(requested_schema)


class Tabular:
    """What has columns is a table itself."""

    columns: Columns

    def to_pandas(self):
        """The columns as a `pandas.DataFrame`."""
        return self.columns.to_pandas()

    def to_polars(self):
        """The columns as a `polars.DataFrame`."""
        return self.columns.to_polars()

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        return self.columns.__arrow_c_stream__(requested_schema)
