"""Converts a model from one format to another, and compares what was read with what was written."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from ntagen import build, checker
from ntagen.checker.queries import Query as FileQuery
from ntagen.convert.dot import written_dot
from ntagen.convert.flattening import network_of
from ntagen.convert.queries import add_queries, written_queries
from ntagen.convert.tck_import import model_of_tck
from ntagen.convert.tck_reading import parse_tck
from ntagen.convert.tck_writing import written_tck
from ntagen.convert.xta_reading import parse_xta
from ntagen.convert.xta_writing import left_out, written_xta
from ntagen.errors import InputError, NtagenError
from ntagen.values import dataclass

SOURCES: Final = ("xml", "xta", "ta", "tck", "nsl")
"""The formats that can be read; ``nsl`` is compiled by who calls."""

TARGETS: Final = ("xml", "xta", "tck", "jani", "dot")
"""The formats that can be written."""


@dataclass(frozen=True, slots=True)
class Source:
    """A model to be converted.

    Attributes:
        model: The model in the engine.
        written: Its parts as they are written, with its queries.
        path: The name of its file, for messages.
    """

    model: checker.Model
    written: build.Model
    path: str


@dataclass(frozen=True, slots=True)
class Converted:
    """What a model has become.

    Attributes:
        text: The text in the other format.
        queries: The text of a ``.q`` file for what the format has no room for; ``None`` if there
            are no queries, or the text has them.
        notes: What the text does not say of the model, a line each.
    """

    text: str
    queries: str | None
    notes: tuple[str, ...]


def source_of(model: checker.Model, path: str, queries: tuple[FileQuery, ...] = ()) -> Source:
    """A model that the engine has loaded from UPPAAL's XML or XTA.

    Args:
        model: The model.
        path: The name of its file, for messages.
        queries: Those of a ``.q`` file that belong to it.

    Raises:
        InputError: Its XML has what the parts of a model have no room for.
    """
    is_xml = model.text.lstrip("\ufeff \t\r\n").startswith("<")
    written = build.parse(model.text) if is_xml else parse_xta(model.text)
    add_queries(written, queries)
    return Source(model, written, path)


def source_of_tck(text: str, path: str) -> Source:
    """A system of TChecker.

    Raises:
        InputError: The text is wrong, or something has no counterpart in UPPAAL.
    """
    written = model_of_tck(parse_tck(text, path))
    return Source(checker.load(written_xta(written), f"{path}, converted"), written, path)


def convert(source: Source, target: str) -> Converted:
    """The model in one of the formats `TARGETS`.

    Raises:
        InputError: Something cannot be said in the format; the message has its place and a way out.
    """
    queries = [one.formula for one in source.written.queries if one.formula.strip()]
    name = Path(source.path).stem or "model"
    if target == "tck":
        network = network_of(source.model, source.written, source.path, "TChecker")
        tck = written_tck(network, queries, name, source.path)
        return Converted(tck.text, None, tck.notes)
    if target == "jani":
        from ntagen.convert.jani import written_jani

        network = network_of(source.model, source.written, source.path, "JANI")
        jani = written_jani(network, queries, name, source.path)
        return Converted(jani.text, None, jani.notes)
    if target == "dot":
        return Converted(written_dot(source.written, name), None, ())
    return _of_uppaal(source, target)


def _of_uppaal(source: Source, target: str) -> Converted:
    """The model in UPPAAL's XML or XTA, which the engine must load as the same network."""
    written = source.written
    if target == "xml":
        text, queries, notes = written.xml(), None, []
    else:
        if any("<lsc" in one for one in written.extra):
            raise InputError(
                f"{source.path}: the model has a live sequence chart, and XTA has none\n"
                "hint: delete the chart, or keep the model in XML"
            )
        text = written_xta(written)
        queries = written_queries(written.queries) if written.queries else None
        notes = [f"left out, for XTA has no room: {one}" for one in left_out(written)]
    again = checker.load(text, f"{source.path}, converted")
    if difference := first_difference(source.model, again):
        raise NtagenError(
            f"{source.path}: the text in {target} would be another model: {difference}\n"
            "hint: this is a mistake of ntagen; please report it with the model"
        )
    return Converted(text, queries, tuple(notes))


def first_difference(model: checker.Model, other: checker.Model) -> str:
    """Where two networks differ first; empty if they are the same but for names of locations."""
    return next(_differences(_nameless(model), _nameless(other), ""), "")


def _nameless(model: checker.Model) -> Any:  # noqa: ANN401  JSON
    """The network of a model without names of locations: XTA must invent those that are missing."""
    network = json.loads(model.network_json())
    for process in network["processes"]:
        for location in process["locations"]:
            del location["name"]
    return network


def _differences(one: Any, other: Any, place: str) -> Iterator[str]:  # noqa: ANN401  JSON
    if isinstance(one, Mapping) and isinstance(other, Mapping) and one.keys() == other.keys():
        for key in one:
            yield from _differences(one[key], other[key], f"{place}/{key}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, (left, right) in enumerate(zip(one, other, strict=True)):
            yield from _differences(left, right, f"{place}/{number}")
    elif one != other:
        yield f"{place}: {one!r} and {other!r}"
