"""Changes that add parts to a model: templates, locations, branch points, edges, queries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from ntagen.checker.picture import diagram
from ntagen.checker.picture.layout import placed
from ntagen.document.content import Change
from ntagen.document.drawing import DRAWN_KINDS, placed_diagram
from ntagen.document.elements import Element
from ntagen.document.markup import New, inserted, quoted
from ntagen.document.moving import arranged, in_range
from ntagen.document.outline import EDGE_LABELS, LOCATION_KINDS, Outline, nodes_of
from ntagen.document.texts import at
from ntagen.errors import InputError

_STEP: Final = 136
"""The distance of a new location from the one beside it, in the units of UPPAAL's editor."""

Place = tuple[int, int]


def template_added(outline: Outline, name: str) -> list[Change]:
    """A template with one location, in which it starts."""
    first = _fresh_id(outline)
    inner = [
        New("name", outline.form.escaped(name)),
        New(f'location id={quoted(first)} x="0" y="0"', b""),
        New.referring("init", first),
    ]
    return [inserted(outline.data, outline.root, New("template", None, inner), "template")]


def location_added(
    outline: Outline, address: str, name: str, kind: str, place: Place | None
) -> list[Change]:
    """A location; without a place it stands beside the others. The first one is the initial one.

    Raises:
        InputError: The template or the kind is unknown.
    """
    template = outline.template(address)
    if kind not in LOCATION_KINDS:
        raise InputError(f"a location is {', '.join(LOCATION_KINDS)}, not {kind[:80]!r}")
    identity = _fresh_id(outline)
    x, y = _checked(place) or _free_place(outline, template)
    inner = [New("name" + at((x - 10, y - 34)), outline.form.escaped(name))] if name else []
    inner += [New(kind)] if kind != "normal" else []
    tag = f"location id={quoted(identity)}" + at((x, y))
    changes = arranged(outline, address)
    new = New(tag, None if inner else b"", inner)
    changes.append(inserted(outline.data, template, new, "location"))
    if template.first("init") is None:
        start = New.referring("init", identity)
        changes.append(inserted(outline.data, template, start, "init"))
    return changes


def branch_point_added(outline: Outline, address: str, place: Place | None) -> list[Change]:
    """A branch point; without a place it stands beside the others.

    Raises:
        InputError: The template is unknown.
    """
    template = outline.template(address)
    place = _checked(place) or _free_place(outline, template)
    new = New(f"branchpoint id={quoted(_fresh_id(outline))}" + at(place), b"")
    return [*arranged(outline, address), inserted(outline.data, template, new, "branchpoint")]


def edge_added(
    outline: Outline,
    address: str,
    ends: tuple[str, str],
    texts: Mapping[str, str],
    *,
    controllable: bool,
) -> list[Change]:
    """An edge between two locations or branch points of a template.

    Raises:
        InputError: An end or a kind of label is unknown.
    """
    template = outline.template(address)
    known = {one.attributes.get("id", "").strip() for one in nodes_of(template)}
    for end in ends:
        if end not in known:
            raise InputError(f"the template has no location {end[:80]!r}\nhint: choose another one")
    if unknown := texts.keys() - set(EDGE_LABELS):
        raise InputError(f"an edge has no {min(unknown)[:80]}")
    given = {kind: texts[kind] for kind in EDGE_LABELS if texts.get(kind, "").strip()}
    drawn: dict[str, Any] = {DRAWN_KINDS[one]: given[one] for one in given if one in DRAWN_KINDS}
    before = placed_diagram(template, outline.data)
    after = placed(replace(before, edges=(diagram.Edge(*ends, **drawn),)))
    inner = [New.referring("source", ends[0]), New.referring("target", ends[1])]
    for kind, text in given.items():
        place = after.edges[0].labels.get(DRAWN_KINDS[kind]) if kind in DRAWN_KINDS else None
        tag = f"label kind={quoted(kind)}" + at(place)
        inner.append(New(tag, outline.form.escaped(text)))
    inner += [New("nail" + at(nail)) for nail in after.edges[0].nails]
    tag = "transition" if controllable else 'transition controllable="false"'
    new = inserted(outline.data, template, New(tag, None, inner), "transition")
    return [*arranged(outline, address), new]


def query_added(outline: Outline, formula: str, comment: str) -> list[Change]:
    """A query behind the others."""
    inner = [
        New("formula", outline.form.escaped(formula)),
        New("comment", outline.form.escaped(comment)),
    ]
    query, root = New("query", None, inner), outline.root
    holder = root.first("queries")
    if holder is None:
        return [inserted(outline.data, root, New("queries", None, [query]), "queries")]
    return [inserted(outline.data, holder, query, "query")]


def _checked(place: Place | None) -> Place | None:
    return None if place is None else (in_range(place[0]), in_range(place[1]))


def _free_place(outline: Outline, template: Element) -> Place:
    """A place right of the last location, where nothing is."""
    drawn = placed_diagram(template, outline.data)
    taken = [node.position for node in drawn.nodes if node.position is not None]
    x, y = taken[-1] if taken else (-_STEP, 0)
    while any(abs(x + _STEP - a) < _STEP / 2 and abs(y - b) < _STEP / 2 for a, b in taken):
        x += _STEP
    return x + _STEP, y


def _fresh_id(outline: Outline) -> str:
    """An id that no part of the model has, of the form that UPPAAL gives."""
    numbers = [-1]
    for one in outline.root.within():
        name = one.attributes.get("id", "").strip()
        if name.startswith("id") and name[2:].isdecimal() and len(name) < 12:
            numbers.append(int(name[2:]))
    return f"id{max(numbers) + 1}"
