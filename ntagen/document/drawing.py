"""A template of a model as the contents of a picture, also while the model has mistakes."""

from __future__ import annotations

from typing import Any

from ntagen.build.arranging import with_places
from ntagen.checker.picture import diagram
from ntagen.checker.picture.diagram import Point
from ntagen.document.content import content_of
from ntagen.document.elements import Element
from ntagen.document.outline import end_of, kind_of, place_of

_EDGE_KINDS: dict[str, diagram.LabelKind] = {
    "select": "select",
    "guard": "guard",
    "synchronisation": "sync",
    "assignment": "update",
    "probability": "weight",
}
_LOCATION_KINDS: dict[str, diagram.LabelKind] = {
    "invariant": "invariant",
    "exponentialrate": "rate",
}
DRAWN_KINDS = _EDGE_KINDS | _LOCATION_KINDS | {"name": "name"}
"""The kinds of labels of a picture, by what the file calls them."""


def diagram_of(template: Element, data: bytes) -> diagram.Diagram:
    """A template with the places that the file gives; locations are known by the file's ids."""
    init = template.first("init")
    initial = "" if init is None else init.attributes.get("ref", "").strip()
    return diagram.Diagram(
        _text(template.first("name"), data),
        (),
        tuple(_location(one, data, initial) for one in template.all("location")),
        tuple(
            diagram.BranchPoint(one.attributes.get("id", ""), _point(one))
            for one in template.all("branchpoint")
        ),
        tuple(_edge(one, data) for one in template.all("transition")),
    )


def placed_diagram(template: Element, data: bytes) -> diagram.Diagram:
    """A template with a place for each of its parts; what has a place in the file keeps it."""
    return with_places(diagram_of(template, data))


def _location(location: Element, data: bytes, initial: str) -> diagram.Location:
    kind = kind_of(location)
    name = location.first("name")
    texts, places = _labels(location, data, _LOCATION_KINDS)
    if name is not None and (place := _point(name)):
        places["name"] = place
    return diagram.Location(
        location.attributes.get("id", "").strip(),
        _text(name, data),
        "committed" if kind == "committed" else "urgent" if kind == "urgent" else "normal",
        initial=location.attributes.get("id", "").strip() == initial,
        position=_point(location),
        labels=places,
        **texts,
    )


def _edge(edge: Element, data: bytes) -> diagram.Edge:
    texts, places = _labels(edge, data, _EDGE_KINDS)
    nails = (_point(nail) for nail in edge.all("nail"))
    return diagram.Edge(
        end_of(edge, "source"),
        end_of(edge, "target"),
        controllable=edge.attributes.get("controllable", "true") == "true",
        nails=tuple(place for place in nails if place),
        labels=places,
        **texts,
    )


def _labels(
    part: Element, data: bytes, kinds: dict[str, diagram.LabelKind]
) -> tuple[dict[str, Any], dict[diagram.LabelKind, Point]]:
    texts: dict[str, Any] = {}
    places: dict[diagram.LabelKind, Point] = {}
    for label in part.all("label"):
        kind = kinds.get(label.attributes.get("kind", ""))
        if kind is not None and kind not in texts:
            texts[kind] = _text(label, data)
            if place := _point(label):
                places[kind] = place
    return texts, places


def _text(element: Element | None, data: bytes) -> str:
    return "" if element is None else content_of(data, element).text.strip()


def _point(element: Element) -> Point | None:
    place = place_of(element)
    return None if place is None else (place[0], place[1])
