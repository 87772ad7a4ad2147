"""The parts of a model as dataclasses that can be changed.

Two parts are equal if they say the same: places, labels' places and nails do not count, so that a
model without places equals the same model read from its file. Edges hold the very locations that
they join, not copies; `copy.deepcopy` of a template or model keeps that so.

`extra` and `attributes` hold what this module has no word for, such as settings of other tools:
child elements (and XML comments) as XML texts, and further attributes. They are written as they
were read.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias

Point: TypeAlias = tuple[float, float]
"""x and y in the units of UPPAAL's editor, x to the right and y down."""

LabelKind = Literal[
    "name",
    "parameters",
    "invariant",
    "rate",
    "select",
    "guard",
    "sync",
    "update",
    "weight",
    "comment",
]


def places() -> dict[LabelKind, Point]:
    """No places of labels yet."""
    return {}


@dataclass(slots=True, repr=False)
class Location:
    """A location of a template; `Template.location` makes one.

    Attributes:
        name: Its name; empty without one.
        invariant: For example ``x <= 20``.
        rate: The exponential rate.
        urgent: Whether no time passes in it.
        committed: Whether no time passes in it, and a committed location moves next.
        comment: The comment of the editor.
        id: What edges in the file call it; once in its template.
        position: Where it is drawn; ``None`` to have it laid out.
        labels: Where its name, invariant, rate and comment are drawn.
        color: ``#rrggbb``, or ``None`` for the usual colour.
        attributes: Further attributes of the element.
        extra: Further elements in it, as XML.
    """

    name: str = ""
    invariant: str = ""
    rate: str = ""
    urgent: bool = False
    committed: bool = False
    comment: str = ""
    id: str = ""
    position: Point | None = field(default=None, compare=False)
    labels: dict[LabelKind, Point] = field(default_factory=places, compare=False)
    color: str | None = None
    attributes: dict[str, str] = field(default_factory=dict)
    extra: list[str] = field(default_factory=list)

    @property
    def shown_name(self) -> str:
        """Its name in messages: the id if it has none."""
        return self.name or self.id

    def __repr__(self) -> str:
        names = ("invariant", "rate", "urgent", "committed", "comment", "position", "color")
        return shown(self, repr(self.shown_name), names)


@dataclass(slots=True, repr=False)
class BranchPoint:
    """A branch point of a template; `Template.branch_point` makes one.

    Attributes:
        id: What edges in the file call it; once in its template.
        position: Where it is drawn; ``None`` to have it laid out.
        color: ``#rrggbb``, or ``None`` for the usual colour.
        attributes: Further attributes of the element.
        extra: Further elements in it, as XML.
    """

    id: str = ""
    position: Point | None = field(default=None, compare=False)
    color: str | None = None
    attributes: dict[str, str] = field(default_factory=dict)
    extra: list[str] = field(default_factory=list)

    @property
    def shown_name(self) -> str:
        """Its name in messages."""
        return self.id

    def __repr__(self) -> str:
        return shown(self, repr(self.id), ("position", "color"))


Node: TypeAlias = Location | BranchPoint


@dataclass(slots=True, repr=False)
class Edge:
    """An edge of a template, the way into a branch point, or a leg of one.

    Attributes:
        source: The location or branch point that it leaves.
        target: The location or branch point that it enters.
        select: For example ``i : int[0,3]``.
        guard: For example ``x >= 3 && i == id``.
        sync: For example ``go[i]!``.
        update: For example ``x = 0, n++``.
        weight: The weight of a leg.
        controllable: Whether the controller owns it, and not the environment.
        comment: The comment of the editor.
        nails: The bends of the arrow.
        labels: Where its texts are drawn.
        color: ``#rrggbb``, or ``None`` for the usual colour.
        attributes: Further attributes of the element.
        extra: Further elements in it, as XML.
    """

    source: Node
    target: Node
    select: str = ""
    guard: str = ""
    sync: str = ""
    update: str = ""
    weight: str = ""
    controllable: bool = True
    comment: str = ""
    nails: list[Point] = field(default_factory=list, compare=False)
    labels: dict[LabelKind, Point] = field(default_factory=places, compare=False)
    color: str | None = None
    attributes: dict[str, str] = field(default_factory=dict)
    extra: list[str] = field(default_factory=list)

    @property
    def shown_name(self) -> str:
        """Its name in messages: the names of its ends."""
        return " → ".join(
            one.shown_name if isinstance(one, Location | BranchPoint) else repr(one)
            for one in (self.source, self.target)
        )

    def __repr__(self) -> str:
        names = ("select", "guard", "sync", "update", "weight", "comment", "color")
        text = shown(self, self.shown_name, names)
        return text if self.controllable else f"{text[:-1]}, controllable=False)"


def shown(part: object, head: str, names: tuple[str, ...]) -> str:
    """A short text: the class, what identifies the part, and what is not as usual."""
    given = [(name, getattr(part, name)) for name in names]
    shown = [
        head,
        *(f"{name}={value!r}" for name, value in given if value not in ("", None, False)),
    ]
    return f"{type(part).__name__}({', '.join(shown)})"


# The names that UPPAAL's XML has for the labels of locations and edges.

LOCATION_LABELS: Final[dict[str, LabelKind]] = {
    "invariant": "invariant",
    "exponentialrate": "rate",
    "comments": "comment",
}

EDGE_LABELS: Final[dict[str, LabelKind]] = {
    "select": "select",
    "guard": "guard",
    "synchronisation": "sync",
    "assignment": "update",
    "probability": "weight",
    "comments": "comment",
}
