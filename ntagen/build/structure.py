"""What must be right before a model can be written: names, ends of edges, initial locations.

What the texts mean is not looked at: the engine judges that when it loads the model.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from typing import Final
from xml.etree import ElementTree

from ntagen.build.model import Model, Outcome, Query
from ntagen.build.parts import BranchPoint, Edge, Location, Node
from ntagen.build.template import Template, stranger
from ntagen.errors import InputError

_NOT_IN_XML: Final = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
_NAME: Final = re.compile(r"[A-Za-z_:][\w:.-]*")

_TEXTS: Final[dict[type, tuple[str, ...]]] = {
    Model: ("declarations", "system", "instantiations"),
    Template: ("name", "parameters", "declarations"),
    Location: ("name", "invariant", "rate", "comment", "id"),
    BranchPoint: ("id",),
    Edge: ("select", "guard", "sync", "update", "weight", "comment"),
    Query: ("formula", "comment"),
    Outcome: ("outcome", "type", "value"),
}

Part = Model | Template | Node | Edge | Query | Outcome


def require_structure(model: Model) -> None:
    """Refuses a model whose structure is wrong.

    Raises:
        InputError: The message names all mistakes, each with its place and how to fix it.
    """
    if found := list(_mistakes(model)):
        raise InputError("\n".join(found))


def _mistakes(model: Model) -> Iterator[str]:
    yield from _wrong_texts(model, "the model")
    if isinstance(model.system, str) and not model.system.strip():
        known = ", ".join(str(one.name) for one in model.templates) or "P, Q"
        yield f'the model has no system line\nhint: model.system = "system {known};"'
    names = [template.name for template in model.templates]
    for name in _doubles(names):
        yield f"the model has two templates {name}\nhint: give one of them another name"
    for template in model.templates:
        yield from _mistakes_in(template)
    for number, query in enumerate(model.queries, 1):
        place = f"query {number}"
        yield from _wrong_texts(query, place)
        for name in ("expect", "result"):
            outcome = getattr(query, name)
            if isinstance(outcome, Outcome):
                yield from _wrong_texts(outcome, f"{place}, {name}")
            elif outcome is not None:
                yield (
                    f"{place}: {name} is {outcome!r}, not an outcome\n"
                    f"hint: query.{name} = build.outcome_of({outcome!r})"
                )


def _mistakes_in(template: Template) -> Iterator[str]:
    place = f"template {template.name}"
    yield from _wrong_texts(template, place)
    if template.name == "":
        yield 'a template has no name\nhint: template.name = "P"'
    nodes = template.nodes
    for number, node in enumerate(nodes):
        kind = "location" if isinstance(node, Location) else "branch point"
        yield from _wrong_texts(node, f"{place}, {kind} {node.shown_name}")
        if not node.id:
            yield f"{place}: {kind} {number} has no id\nhint: make it with the template's methods"
        if any(node is other for other in nodes[:number]):
            yield f"{place}: {kind} {node.shown_name} is listed twice\nhint: list it once"
    for name in _doubles([one.name for one in template.locations if one.name]):
        yield f"{place}: two locations are called {name}\nhint: give one of them another name"
    for name in _doubles([one.id for one in nodes if one.id]):
        yield f"{place}: two locations have the id {name}\nhint: give one of them another id"
    known = {id(node) for node in nodes}
    if template.initial is None:
        yield (
            f"{place} has no initial location\n"
            "hint: template.initial = one of its locations, or location(…, initial=True)"
        )
    elif id(template.initial) not in known:
        name = getattr(template.initial, "shown_name", repr(template.initial))
        yield (
            f"{place}: the initial location {name} is not in this template\n"
            "hint: template.initial = one of its own locations"
        )
    for edge in template.edges:
        yield from _wrong_texts(edge, f"{place}, edge {edge.shown_name}")
        for end in (edge.source, edge.target):
            if id(end) not in known:
                yield stranger(template, edge, end)


def _wrong_texts(part: Part, place: str) -> Iterator[str]:
    """Values that cannot be written."""
    texts = {name: getattr(part, name) for name in _TEXTS[type(part)]}
    color = getattr(part, "color", None)
    texts |= {} if color is None else {"color": color}
    texts |= {f"attribute {name}": text for name, text in part.attributes.items()}
    for name, text in texts.items():
        if not isinstance(text, str):
            yield f'{place}: {name} is {text!r}, not a text\nhint: write "{text}" in quotes'
        elif found := _NOT_IN_XML.search(text):
            yield (
                f"{place}: {name} has the character U+{ord(found[0]):04X}, which XML cannot hold\n"
                "hint: delete it"
            )
    for name in part.attributes:
        if not _NAME.fullmatch(name):
            yield f"{place}: {name!r} cannot name an attribute\nhint: use letters and digits"
    for text in part.extra:
        try:
            ElementTree.fromstring(f"<x>{text}</x>")
        except (ElementTree.ParseError, ValueError):
            yield f"{place}: extra has {text[:40]!r}, which is not XML\nhint: write <a>…</a>"
    for name, point in _places(part):
        if not _is_point(point):
            yield f"{place}: {name} is {point!r}, not a place\nhint: write two numbers: (x, y)"


def _places(part: Part) -> Iterator[tuple[str, object]]:
    """All places of a part, with their names."""
    if getattr(part, "position", None) is not None:
        yield "position", part.position  # type: ignore[union-attr]
    for kind, point in getattr(part, "labels", {}).items():
        yield f"the place of {kind}", point
    for point in getattr(part, "nails", ()):
        yield "a nail", point


def _is_point(point: object) -> bool:
    return (
        isinstance(point, tuple | list)
        and len(point) == 2
        and all(isinstance(one, int | float) and math.isfinite(one) for one in point)
    )


def _doubles(names: list[str]) -> list[str]:
    """The names that are given more than once, each once."""
    return [name for name, count in Counter(names).items() if count > 1]
