"""Columns of numbers and their conversion to data frames."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy


class Columns(Mapping[str, numpy.ndarray]):
    """A table: a mapping from names to NumPy arrays of one length.

    pyarrow, polars, DuckDB and others read it through Arrow's PyCapsule interface, which needs pyarrow.
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
        """Returns the table as a `pandas.DataFrame`."""
        import pandas

        return pandas.DataFrame(self._columns)

    def to_polars(self):
        """Returns the table as a `polars.DataFrame`."""
        import polars

        # A NumPy array of strings has the type `object`, which polars would keep.
        plain = {name: list(column) if column.dtype == object else column for name, column in self.items()}
        return polars.DataFrame(plain)

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        import pyarrow

        return pyarrow.table(self._columns).__arrow_c_stream__(requested_schema)


class Tabular:
    """Base of answers with columns, which can be used as tables."""

    columns: Columns

    def to_pandas(self):
        """Returns the columns as a `pandas.DataFrame`."""
        return self.columns.to_pandas()

    def to_polars(self):
        """Returns the columns as a `polars.DataFrame`."""
        return self.columns.to_polars()

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        return self.columns.__arrow_c_stream__(requested_schema)
