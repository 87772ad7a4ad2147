"""Changes of where parts are drawn."""

from __future__ import annotations

from typing import Final

from ntagen.document.content import Change
from ntagen.document.drawing import placed_diagram
from ntagen.document.elements import Element
from ntagen.document.markup import New, attribute_set, inserted, removed
from ntagen.document.outline import Outline, end_of, nodes_of, place_of
from ntagen.document.texts import at
from ntagen.errors import InputError

_MOST: Final = 1_000_000


def in_range(value: int) -> int:
    """A coordinate.

    Raises:
        InputError: It is too large.
    """
    if abs(value) > _MOST:
        raise InputError(f"{value} is too far away: at most {_MOST}")
    return value


def moved(outline: Outline, address: str, x: int, y: int) -> list[Change]:
    """A location or branch point is drawn elsewhere, with its labels and loops.

    Raises:
        InputError: There is no such part.
    """
    part = outline.part(address)
    template = part.parent
    if part.tag not in ("location", "branchpoint") or template is None:
        raise InputError("only locations, branch points and bends can be moved")
    place = place_of(part)
    if place is None:
        return arranged(outline, address.rsplit("/", 2)[0], part) + _at(outline, part, x, y)
    identity = part.attributes.get("id", "").strip()
    along = [part, *part.all("name"), *part.all("label")]
    for edge in template.all("transition"):
        if end_of(edge, "source") == end_of(edge, "target") == identity:
            along += [*edge.all("label"), *edge.all("nail")]
    return [
        change
        for one in along
        if (old := place_of(one)) is not None
        for change in _at(outline, one, old[0] + x - place[0], old[1] + y - place[1])
    ]


def nail_moved(outline: Outline, address: str, number: int, x: int, y: int) -> list[Change]:
    """A bend of an edge is drawn elsewhere; the one behind the last is new.

    Raises:
        InputError: There is no such edge or bend.
    """
    nails = _nails(outline, address)
    if number == len(nails):
        new = New("nail" + at((in_range(x), in_range(y))))
        return [inserted(outline.data, outline.part(address), new, "nail")]
    return _at(outline, _one_of(nails, number), x, y)


def nail_removed(outline: Outline, address: str, number: int) -> list[Change]:
    """An edge has a bend less.

    Raises:
        InputError: There is no such edge or bend.
    """
    return [removed(outline.data, _one_of(_nails(outline, address), number))]


def arranged(outline: Outline, address: str, but: Element | None = None) -> list[Change]:
    """Each location and branch point of a template that has no place gets one; `but` does not.

    Raises:
        InputError: There is no such template.
    """
    template = outline.template(address)
    nodes = nodes_of(template)
    if all(place_of(one) is not None for one in nodes):
        return []
    drawn = placed_diagram(template, outline.data)
    return [
        change
        for node, part in zip(nodes, drawn.nodes, strict=True)
        if place_of(node) is None and part.position is not None and node is not but
        for change in _at(outline, node, *part.position)
    ]


def _nails(outline: Outline, address: str) -> list[Element]:
    edge = outline.part(address)
    if edge.tag != "transition":
        raise InputError("only edges have bends")
    return edge.all("nail")


def _one_of(nails: list[Element], number: int) -> Element:
    if not 0 <= number < len(nails):
        raise InputError("the edge has no such bend\nhint: reload the page")
    return nails[number]


def _at(outline: Outline, element: Element, x: int, y: int) -> list[Change]:
    """The changes of the attributes that say where an element is drawn."""
    values = {"x": str(in_range(x)), "y": str(in_range(y))}
    return [
        attribute_set(outline.data, element, name, value)
        for name, value in values.items()
        if element.attributes.get(name) != value
    ]
