"""Writes a model as UPPAAL's XML, in the layout of UPPAAL's editor.

The text of an element is written exactly as it is, so that reading it gives the same text. What is
kept in `extra` comes last in its element: where two elements count once, the first one counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final
from xml.sax.saxutils import escape

from ntagen.build.arranging import arranged
from ntagen.build.model import Model, Outcome, Query
from ntagen.build.parts import (
    EDGE_LABELS,
    LOCATION_LABELS,
    BranchPoint,
    Edge,
    LabelKind,
    Location,
    Point,
)
from ntagen.build.structure import require_structure
from ntagen.build.template import Template
from ntagen.checker.picture import diagram

_HEADER: Final = (
    '<?xml version="1.0" encoding="utf-8"?>\n'
    "<!DOCTYPE nta PUBLIC '-//Uppaal Team//DTD Flat System 1.6//EN' "
    "'http://www.it.uu.se/research/group/darts/uppaal/flat-1_6.dtd'>\n"
)

_IN_TEXTS: Final = {"\r": "&#13;"}
_IN_ATTRIBUTES: Final = {"\r": "&#13;", '"': "&quot;", "\n": "&#10;", "\t": "&#9;"}
"""What is escaped besides ``&``, ``<`` and ``>``."""


def written(model: Model) -> str:
    """The model as the text of a file.

    Raises:
        InputError: Its structure is wrong.
    """
    require_structure(model)
    return "".join(f"{line}\n" for line in _lines(model))


def _lines(model: Model) -> Iterator[str]:
    yield _HEADER + f"<nta{_attributes(model.attributes)}>"
    yield from _indented(1, model.extra)
    yield from _text(1, "declaration", model.declarations)
    for template in model.templates:
        yield from _template(template)
    yield from _text(1, "instantiation", model.instantiations)
    yield from _text(1, "system", model.system)
    if model.queries or model.query_extra:
        yield "\t<queries>"
        yield from _indented(2, model.query_extra)
        for query in model.queries:
            yield from _query(query)
        yield "\t</queries>"
    yield "</nta>"


def _template(template: Template) -> Iterator[str]:
    drawn = arranged(template)
    yield f"\t<template{_attributes(template.attributes)}>"
    yield from _text(2, "name", template.name, _at(template.labels.get("name")))
    place = template.labels.get("parameters")
    yield from _text(2, "parameter", template.parameters, _at(place))
    yield from _text(2, "declaration", template.declarations)
    for location, drawn_location in zip(template.locations, drawn.locations, strict=True):
        yield from _location(location, drawn_location)
    for point, drawn_point in zip(template.branch_points, drawn.branch_points, strict=True):
        yield from _branch_point(point, drawn_point)
    if template.initial is not None:
        yield f"\t\t<init{_attributes({'ref': template.initial.id})}/>"
    for edge, drawn_edge in zip(template.edges, drawn.edges, strict=True):
        yield from _edge(edge, drawn_edge)
    yield from _indented(2, template.extra)
    yield "\t</template>"


def _location(location: Location, drawn: diagram.Location) -> Iterator[str]:
    attributes = {"id": location.id, **_at(location.position or drawn.position)}
    yield f"\t\t<location{_attributes(attributes | _color(location) | location.attributes)}>"
    places = _places(location, drawn)
    yield from _text(3, "name", location.name, _at(places.get("name")))
    yield from _labels(location, places, LOCATION_LABELS)
    if location.urgent:
        yield "\t\t\t<urgent/>"
    if location.committed:
        yield "\t\t\t<committed/>"
    yield from _indented(3, location.extra)
    yield "\t\t</location>"


def _branch_point(point: BranchPoint, drawn: diagram.BranchPoint) -> Iterator[str]:
    attributes = {"id": point.id, **_at(point.position or drawn.position)}
    head = f"\t\t<branchpoint{_attributes(attributes | _color(point) | point.attributes)}"
    yield f"{head}>" if point.extra else f"{head}/>"
    if point.extra:
        yield from _indented(3, point.extra)
        yield "\t\t</branchpoint>"


def _edge(edge: Edge, drawn: diagram.Edge) -> Iterator[str]:
    owner = {} if edge.controllable else {"controllable": "false"}
    yield f"\t\t<transition{_attributes(owner | _color(edge) | edge.attributes)}>"
    yield f"\t\t\t<source{_attributes({'ref': edge.source.id})}/>"
    yield f"\t\t\t<target{_attributes({'ref': edge.target.id})}/>"
    yield from _labels(edge, _places(edge, drawn), EDGE_LABELS)
    for nail in edge.nails or drawn.nails:
        yield f"\t\t\t<nail{_attributes(_at(nail))}/>"
    yield from _indented(3, edge.extra)
    yield "\t\t</transition>"


def _labels(
    part: Location | Edge, places: Mapping[LabelKind, Point], kinds: Mapping[str, LabelKind]
) -> Iterator[str]:
    """The labels of a part that have a text or a place in the file."""
    for name, kind in kinds.items():
        text = getattr(part, kind)
        attributes = {"kind": name, **_at(places.get(kind))}
        if text or kind in part.labels:
            yield f"\t\t\t<label{_attributes(attributes)}>{escape(text, _IN_TEXTS)}</label>"


def _places(
    part: Location | Edge, drawn: diagram.Location | diagram.Edge
) -> dict[LabelKind, Point]:
    """The places of the labels: those of the part, and computed ones."""
    places: dict[LabelKind, Point] = dict(drawn.labels.items())
    return places | part.labels


def _query(query: Query) -> Iterator[str]:
    yield f"\t\t<query{_attributes(query.attributes)}>"
    for tag in ("formula", "comment"):
        yield f"\t\t\t<{tag}>{escape(getattr(query, tag), _IN_TEXTS)}</{tag}>"
    for tag in ("expect", "result"):
        outcome: Outcome | None = getattr(query, tag)
        if outcome is not None:
            known = {name: getattr(outcome, name) for name in ("outcome", "type", "value")}
            given = {name: text for name, text in known.items() if text} | outcome.attributes
            inner = "".join(outcome.extra)
            head = f"\t\t\t<{tag}{_attributes(given)}"
            yield f"{head}>{inner}</{tag}>" if inner else f"{head}/>"
    yield from _indented(3, query.extra)
    yield "\t\t</query>"


def _text(
    level: int, tag: str, text: str, attributes: Mapping[str, str] | None = None
) -> Iterator[str]:
    """An element with a text; nothing if it says nothing."""
    if text or attributes:
        tabs = "\t" * level
        yield f"{tabs}<{tag}{_attributes(attributes or {})}>{escape(text, _IN_TEXTS)}</{tag}>"


def _indented(level: int, extra: list[str]) -> Iterator[str]:
    tabs = "\t" * level
    return (f"{tabs}{one}" for one in extra)


def _attributes(given: Mapping[str, str]) -> str:
    return "".join(f' {name}="{escape(text, _IN_ATTRIBUTES)}"' for name, text in given.items())


def _at(place: Point | None) -> dict[str, str]:
    return {} if place is None else {"x": f"{place[0]}", "y": f"{place[1]}"}


def _color(part: Location | BranchPoint | Edge) -> dict[str, str]:
    return {} if part.color is None else {"color": part.color}
