"""Changes of texts: declarations, names, labels, formulas."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ntagen.checker.picture import diagram
from ntagen.checker.picture.layout import placed
from ntagen.document.content import Change, content_of
from ntagen.document.drawing import DRAWN_KINDS, diagram_of
from ntagen.document.elements import Element
from ntagen.document.markup import New, inserted, quoted
from ntagen.document.outline import Outline, place_of


def text_set(outline: Outline, address: str, text: str) -> list[Change]:
    """A text is another one. An empty one that the file does not have is not written.

    Raises:
        InputError: There is no such text.
    """
    part, name = outline.owner(address)
    element = outline.text_element(address)
    if element is not None and element.close != element.end:
        change = content_of(outline.data, element).replaced(text, outline.form)
        return [] if change is None else [change]
    if not text:
        return []
    if element is not None:
        fresh = b">" + outline.form.escaped(text) + f"</{element.tag}>".encode()
        return [Change(element.open_end - 2, element.end, fresh)]
    is_label = part.tag in ("location", "transition") and name != "name"
    tag = f"label kind={quoted(name)}" if is_label else name
    tag += at(_place_of_label(outline, part, name, text))
    order = "label" if is_label else name
    if part.tag == "template" and name == "declaration":
        order = "template declaration"
    return [inserted(outline.data, part, New(tag, outline.form.escaped(text)), order)]


def text_rewritten(outline: Outline, address: str, text: str) -> list[Change]:
    """The same, where the whole text is written anew.

    Raises:
        InputError: There is no such text.
    """
    element = outline.text_element(address)
    if element is None or element.close == element.end:
        return text_set(outline, address, text)
    return [content_of(outline.data, element).rewritten(text, outline.form)]


def at(place: diagram.Point | None) -> str:
    """The attributes that say where something is drawn."""
    return "" if place is None else f' x="{place[0]}" y="{place[1]}"'


def _place_of_label(outline: Outline, part: Element, name: str, text: str) -> diagram.Point | None:
    """Where a new label is drawn; ``None`` if the file does not say where its part is."""
    kind, template = DRAWN_KINDS.get(name), part.parent
    if kind is None or template is None or part.tag not in ("location", "transition"):
        return None
    nodes = (*template.all("location"), *template.all("branchpoint"))
    if any(place_of(node) is None for node in nodes):
        return None
    drawn = diagram_of(template, outline.data)
    number = template.all(part.tag).index(part)
    fresh: dict[str, Any] = {kind: text}
    if part.tag == "transition":
        edge = replace(drawn.edges[number], **fresh)
        found = placed(replace(drawn, edges=(edge,)))
        return found.edges[0].labels.get(kind)
    location = replace(drawn.locations[number], **fresh)
    found = placed(replace(drawn, locations=(location,), edges=()))
    return found.locations[0].labels.get(kind)
