"""What a page wishes to change, as JSON, checked before anything is done."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from ntagen.document.adding import (
    branch_point_added,
    edge_added,
    location_added,
    query_added,
    template_added,
)
from ntagen.document.content import Change, require_characters
from ntagen.document.document import Document
from ntagen.document.moving import arranged, moved, nail_moved, nail_removed
from ntagen.document.outline import EDGE_LABELS, Outline
from ntagen.document.parts import controllable_set, end_set, initial_set, kind_set, part_removed
from ntagen.errors import InputError

_Wish = Mapping[str, Any]


def fulfil(document: Document, wish: _Wish) -> str:
    """Changes a model.

    Args:
        document: The model.
        wish: ``do`` says what: a key of the tables below, ``text``, ``undo`` or ``redo``. It
            concerns what has the ``address``.

    Returns:
        The address where the change is to be seen; that of a new part is its own.

    Raises:
        InputError: The wish cannot be fulfilled.
    """
    action = text_of(wish, "do")
    if action == "undo":
        return document.undo() or ""
    if action == "redo":
        return document.redo() or ""
    address = text_of(wish, "address")
    if action == "text":
        document.set_text(address, text_of(wish, "text"), join=wish.get("join") is True)
        return address
    if action in _ADDING:
        kind, added = _ADDING[action]
        document.edit(address, lambda outline: added(outline, address, wish))
        return _newest(document.outline, address, kind)
    if action in _CHANGING:
        changed = _CHANGING[action]
        join = wish.get("join") is True
        document.edit(address, lambda outline: changed(outline, address, wish), join=join)
        return address
    raise InputError("this is nothing that can be done with a model")


def text_of(wish: _Wish, name: str) -> str:
    """A text of a wish.

    Raises:
        InputError: It is none.
    """
    value = wish.get(name, "")
    if not isinstance(value, str):
        raise InputError(f"{name} is no text")
    require_characters(value)
    return value


def number_of(wish: _Wish, name: str) -> int:
    """A whole number of a wish.

    Raises:
        InputError: It is none.
    """
    value = wish.get(name)
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{name} is no whole number")
    return value


def _place(wish: _Wish) -> tuple[int, int] | None:
    if wish.get("x") is None:
        return None
    return number_of(wish, "x"), number_of(wish, "y")


def _template(outline: Outline, _: str, wish: _Wish) -> list[Change]:
    name = text_of(wish, "name").strip()
    if not name:
        raise InputError("a template has a name\nhint: write one, such as Gate")
    return template_added(outline, name)


def _location(outline: Outline, address: str, wish: _Wish) -> list[Change]:
    kind = text_of(wish, "kind") or "normal"
    return location_added(outline, address, text_of(wish, "name").strip(), kind, _place(wish))


def _branch_point(outline: Outline, address: str, wish: _Wish) -> list[Change]:
    return branch_point_added(outline, address, _place(wish))


def _edge(outline: Outline, address: str, wish: _Wish) -> list[Change]:
    texts = {kind: text_of(wish, kind) for kind in EDGE_LABELS}
    ends = text_of(wish, "source"), text_of(wish, "target")
    is_controllable = wish.get("controllable") is not False
    return edge_added(outline, address, ends, texts, controllable=is_controllable)


def _query(outline: Outline, _: str, wish: _Wish) -> list[Change]:
    return query_added(outline, text_of(wish, "formula"), text_of(wish, "comment"))


def _newest(outline: Outline, address: str, kind: str) -> str:
    """The address of the last part of a kind."""
    around = f"{address}/" if address else ""
    parts = {
        "templates": outline.templates,
        "queries": outline.queries,
    }
    if kind not in parts:
        tags = {"locations": "location", "branch_points": "branchpoint", "edges": "transition"}
        parts[kind] = outline.template(address).all(tags[kind])
    return f"{around}{kind}/{len(parts[kind]) - 1}"


_Doing = Callable[[Outline, str, _Wish], list[Change]]

_ADDING: Final[dict[str, tuple[str, _Doing]]] = {
    "add-template": ("templates", _template),
    "add-location": ("locations", _location),
    "add-branch-point": ("branch_points", _branch_point),
    "add-edge": ("edges", _edge),
    "add-query": ("queries", _query),
}
_CHANGING: Final[dict[str, _Doing]] = {
    "remove": lambda outline, address, _: part_removed(outline, address),
    "move": lambda outline, address, wish: moved(
        outline, address, number_of(wish, "x"), number_of(wish, "y")
    ),
    "move-bend": lambda outline, address, wish: nail_moved(
        outline, address, number_of(wish, "number"), number_of(wish, "x"), number_of(wish, "y")
    ),
    "remove-bend": lambda outline, address, wish: nail_removed(
        outline, address, number_of(wish, "number")
    ),
    "initial": lambda outline, address, _: initial_set(outline, address),
    "kind": lambda outline, address, wish: kind_set(outline, address, text_of(wish, "kind")),
    "end": lambda outline, address, wish: end_set(
        outline, address, text_of(wish, "end"), text_of(wish, "to")
    ),
    "controllable": lambda outline, address, wish: controllable_set(
        outline, address, controllable=wish.get("controllable") is not False
    ),
    "arrange": lambda outline, address, _: arranged(outline, address),
}
