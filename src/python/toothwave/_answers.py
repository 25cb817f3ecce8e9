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
    """An answer: a read-only dict like the service's JSON. Its columns of numbers are NumPy arrays."""

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
        """The bytes that the service answers with."""
        return self._native.text("json")


class Sweep(Tabular, Answer):
    """Forces and contact stresses over one period. As a table it has a row for each state: an input angle and a tooth."""

    @cached_property
    def columns(self) -> Columns:
        """The states: an array for each column of the CSV. They share the answer's memory."""
        return Columns(self._native.states())

    @cached_property
    def _object(self) -> dict[str, Any]:
        answer = self._native.object()
        slips = {"rolls", *(name for name in self.columns if name.startswith("slip_"))}
        answer["states"] = {name: column for name, column in self.columns.items() if name not in slips}
        return answer

    def svg(self) -> str:
        """Forces and stresses of a tooth on its way through the mesh, as a picture."""
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
    """The JSON text of a document."""
    if isinstance(document, bytes):
        return document
    if isinstance(document, os.PathLike):
        with open(document, "rb") as file:
            return file.read()
    if isinstance(document, str):
        return document.encode()
    return json.dumps(document, default=_plain).encode()


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays, and answers, as JSON knows them."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value).__name__} is nothing that JSON knows")


def sweep(design: Document) -> Sweep:
    """Forces and contact stresses over one period: the answer of `/v1/sweep`."""
    return Sweep(_native.ask("sweep", document_bytes(design)))


def geometry(design: Document) -> Answer:
    """Profiles of the mating parts: the answer of `/v1/geometry`."""
    return Answer(_native.ask("geometry", document_bytes(design)))


def coincidence_degree(design: Document) -> Answer:
    """How many teeth share the load: the answer of `/v1/coincidence-degree`."""
    return Answer(_native.ask("coincidence_degree", document_bytes(design)))


def drawing(design: Document, part: str = "assembly", format: str = "dxf") -> str | Answer:
    """A drawing of a part: `ring`, `wave_generator`, `carrier`, `tooth` or `assembly`.

    The formats are `dxf`, `step` and `svg`, which are texts, and `json`, which is an `Answer`.
    """
    if format not in ("dxf", "step", "svg", "json"):
        raise ValueError(f"a drawing has the formats dxf, step, svg and json, not {format!r}")
    answer = _native.ask(part.replace("-", "_"), document_bytes(design))
    return Answer(answer) if format == "json" else answer.text(format).decode()
