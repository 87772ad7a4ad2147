"""The contents of a template's picture: its locations, branch points and edges.

Texts are as written in the model. Positions are in the units of UPPAAL's editor, x to the right and
y down.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

Point: TypeAlias = tuple[int, int]
"""x and y in the units of UPPAAL's editor."""

LocationKind = Literal["normal", "urgent", "committed"]

LabelKind = Literal["name", "invariant", "rate", "select", "guard", "sync", "update", "weight"]
"""The kind of a label: an attribute of `Location` or `Edge`."""


@dataclass(frozen=True, slots=True)
class Location:
    """A location of a template.

    Attributes:
        id: The id by which edges refer to it; in XTA its name.
        name: Its name; empty without one.
        kind: ``normal``, ``urgent`` or ``committed``.
        initial: Whether processes start here.
        invariant: As written; empty without one.
        rate: The exponential rate as written; empty without one.
        position: Where it is drawn; ``None`` if the file does not say.
        labels: Where its name, invariant and rate are drawn, if the file says so.
        color: ``#rrggbb``, or ``None`` for the usual colour.
    """

    id: str
    name: str = ""
    kind: LocationKind = "normal"
    initial: bool = False
    invariant: str = ""
    rate: str = ""
    position: Point | None = None
    labels: Mapping[LabelKind, Point] = field(default_factory=dict, hash=False)
    color: str | None = None


@dataclass(frozen=True, slots=True)
class BranchPoint:
    """A branch point of a template.

    Attributes:
        id: The id by which edges refer to it.
        position: Where it is drawn; ``None`` if the file does not say.
    """

    id: str
    position: Point | None = None


@dataclass(frozen=True, slots=True)
class Edge:
    """An edge of a template, the entry of a branch point, or a leg of one.

    Attributes:
        source: The id of the location or branch point that it leaves.
        target: The id of the location or branch point that it enters.
        controllable: Whether the controller owns it, and not the environment.
        select: The bindings as written. This text and the following ones may be empty.
        guard: As written.
        sync: The synchronisation, such as ``go[i]!``.
        update: As written.
        weight: The weight of a leg as written.
        nails: The bends of the arrow.
        labels: Where select, guard, sync, update and weight are drawn, if the file says so.
        color: ``#rrggbb``, or ``None`` for the usual colour.
    """

    source: str
    target: str
    controllable: bool = True
    select: str = ""
    guard: str = ""
    sync: str = ""
    update: str = ""
    weight: str = ""
    nails: tuple[Point, ...] = ()
    labels: Mapping[LabelKind, Point] = field(default_factory=dict, hash=False)
    color: str | None = None


@dataclass(frozen=True, slots=True)
class Diagram:
    """The contents of a template's picture.

    Attributes:
        name: The name of the template.
        parameters: Its parameters as texts, such as ``const id_t id``.
        locations: In the order of the file.
        branch_points: In the order of the file.
        edges: In the order of the file.
    """

    name: str
    parameters: tuple[str, ...]
    locations: tuple[Location, ...]
    branch_points: tuple[BranchPoint, ...]
    edges: tuple[Edge, ...]

    @property
    def nodes(self) -> tuple[Location | BranchPoint, ...]:
        """All that edges can lead to: the locations, then the branch points."""
        return (*self.locations, *self.branch_points)
