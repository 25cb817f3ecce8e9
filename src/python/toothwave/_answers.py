"""Answers to single designs."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

from . import _native
from ._tables import Columns, Tabular

Document = Mapping[str, Any] | str | bytes | os.PathLike[str]


class Answer(Mapping[str, Any]):
    """An answer: a read-only mapping with the names of the service's JSON. Columns of numbers are NumPy arrays."""

    def __init__(self, native: _native.Answer):
        self._native = native

    @cached_property
    def _object(self) -> dict[str, Any]:
        return self._native.object()

    def __getitem__(self, name: str) -> Any:
        return self._object[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._object)

    def __len__(self) -> int:
        return len(self._object)

    def __repr__(self) -> str:
        return f"{type(self).__name__}: {', '.join(self)}"

    def json(self) -> bytes:
        """Returns the bytes of the service's JSON response."""
        return self._native.text("json")


class Sweep(Tabular, Answer):
    """Forces and contact stresses over one period. Its table has one row for each state: an input angle and a tooth."""

    @cached_property
    def columns(self) -> Columns:
        """The states: one array for each column of the CSV. The arrays share the answer's memory."""
        return Columns(self._native.states())

    @cached_property
    def _object(self) -> dict[str, Any]:
        answer = self._native.object()
        slips = {"rolls", *(name for name in self.columns if name.startswith("slip_"))}
        answer["states"] = {name: column for name, column in self.columns.items() if name not in slips}
        return answer

    def svg(self) -> str:
        """Returns a plot of the forces and stresses of a tooth over one pass through the mesh, as SVG text."""
        return self._native.text("svg").decode()

    def _repr_html_(self) -> str:
        rows = [
            ("contact ratio", f"{self['coincidence_degree']:.4g}"),
            *(
                (f"{contact.replace('_', ' ')}, {what}", f"{peaks[key]['value']:.4g} {unit}")
                for contact, peaks in self["peaks"].items()
                for what, key, unit in (("largest force", "force_n", "N"), ("largest stress", "stress_mpa", "MPa"))
            ),
        ]
        cells = "".join(f"<tr><td>{html.escape(name)}</td><td>{html.escape(value)}</td></tr>" for name, value in rows)
        findings = "".join(f"<li>{html.escape(finding['detail'])}</li>" for finding in self["findings"])
        return f"<table>{cells}</table><ul>{findings}</ul>{self.svg()}"


def document_bytes(document: Document) -> bytes:
    """Returns the JSON text of a document."""
    if isinstance(document, bytes):
        return document
    if isinstance(document, os.PathLike):
        with open(document, "rb") as file:
            return file.read()
    if isinstance(document, str):
        return document.encode()
    return json.dumps(document, default=_plain).encode()


def _plain(value: Any) -> Any:
    """Returns NumPy numbers, NumPy arrays and answers as values that `json` can write."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value).__name__} cannot be written as JSON. Use dict, list, str, numbers, bool, None or NumPy arrays")


def sweep(design: Document) -> Sweep:
    """Computes forces and contact stresses over one period: the answer of `/v1/sweep`."""
    return Sweep(_native.ask("sweep", document_bytes(design)))


def geometry(design: Document) -> Answer:
    """Computes the profiles of the mating parts: the answer of `/v1/geometry`."""
    return Answer(_native.ask("geometry", document_bytes(design)))


def coincidence_degree(design: Document) -> Answer:
    """Computes the contact ratio: the answer of `/v1/coincidence-degree`."""
    return Answer(_native.ask("coincidence_degree", document_bytes(design)))


def drawing(design: Document, part: str = "assembly", format: str = "dxf") -> str | Answer:
    """Returns a drawing of a part: `ring`, `wave_generator`, `carrier`, `tooth` or `assembly`.

    The formats `dxf`, `step` and `svg` give text. The format `json` gives an `Answer`.
    """
    if format not in ("dxf", "step", "svg", "json"):
        raise ValueError(f"unknown format {format!r}. Drawings have the formats dxf, step, svg and json")
    answer = _native.ask(part.replace("-", "_"), document_bytes(design))
    return Answer(answer) if format == "json" else answer.text(format).decode()
