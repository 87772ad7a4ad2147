"""The parts of a UPPAAL model as frozen values.

They are made of the engine's object ``ntagen-model`` (see ``checker/src/engine/facts.rs``, and
``ntagen info --json``), one class a kind of part. Templates are as written; processes, variables,
clocks and channels are those of the network that is left when all templates are instantiated.
Positions are in the units of UPPAAL's editor, x to the right and y down.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

Point: TypeAlias = tuple[int, int]
"""x and y in the units of UPPAAL's editor."""

LocationKind = Literal["normal", "urgent", "committed"]

LabelKind = Literal["name", "invariant", "rate", "select", "guard", "sync", "update", "weight"]
"""What a label says: its attribute of `Location` or `Edge`."""


@dataclass(frozen=True, slots=True)
class Location:
    """A location of a template.

    Attributes:
        id: What edges refer to it by; in XTA its name.
        name: Its name; empty without one.
        kind: ``normal``, ``urgent`` or ``committed``.
        initial: Whether processes start here.
        invariant: As written; empty without one.
        rate: The exponential rate as written; empty without one.
        position: Where it is drawn; ``None`` if the file does not say.
        labels: Where its name, invariant and rate are drawn, as far as the file says so.
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
        id: What edges refer to it by.
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
        select: The bindings as written; this and the following are empty where there is nothing.
        guard: As written.
        sync: The synchronisation, such as ``go[i]!``.
        update: As written.
        weight: The weight of a leg as written.
        nails: The bends of the arrow.
        labels: Where select, guard, sync, update and weight are drawn, as far as the file says so.
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
class Template:
    """A template; a notebook shows it as a picture.

    Attributes:
        name: Its name.
        parameters: The parameters as texts, such as ``const id_t id``.
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
        """What edges lead to: the locations, then the branch points."""
        return (*self.locations, *self.branch_points)

    def svg(self) -> str:
        """The template drawn as in UPPAAL's editor.

        Places come from the file. A template without them, as in XTA, is laid out in layers.

        Returns:
            An SVG document.
        """
        from ntagen.model.svg import draw

        return draw(self)

    def _repr_svg_(self) -> str:
        return self.svg()


@dataclass(frozen=True, slots=True)
class Process:
    """A process of the system.

    Attributes:
        name: For example ``Gate`` or ``Train(3)``.
        template: The name of its template.
        priority: Its level in the system line; greater is more urgent.
        location_count: How many locations it has.
        edge_count: How many edges it has; the legs of a branch point are one.
    """

    name: str
    template: str
    priority: int
    location_count: int
    edge_count: int


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable.

    Attributes:
        name: For example ``len`` or ``Gate.list``.
        process: The process it is local to; ``None`` if it is global.
        type: The type of its parts, such as ``int[0,5]``.
        dimensions: The sizes of an array; empty for a single value.
        meta: Whether it is ``meta``, and so does not tell states apart.
        words: How many 32-bit words it takes in a state.
    """

    name: str
    process: str | None
    type: str
    dimensions: tuple[int, ...]
    meta: bool
    words: int


@dataclass(frozen=True, slots=True)
class Clock:
    """A clock, or one part of an array of clocks.

    Attributes:
        name: For example ``x`` or ``Train(1).x``.
        process: The process it is local to; ``None`` if it is global.
        hybrid: Whether it is abstracted away in symbolic and game queries.
    """

    name: str
    process: str | None
    hybrid: bool


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel, or one part of an array of channels.

    Attributes:
        name: For example ``go[2]``.
        broadcast: Whether every receiver that can take part does.
        urgent: Whether no time passes while a synchronisation on it is possible.
        priority: Its level in ``chan priority``; greater is more urgent.
    """

    name: str
    broadcast: bool
    urgent: bool
    priority: int


@dataclass(frozen=True, slots=True)
class StateSize:
    """The size of the discrete part of a state, in 32-bit words.

    Attributes:
        words: All.
        location_words: One for each process.
        variable_words: Those of variables that tell states apart.
        meta_words: Those of ``meta`` variables.
    """

    words: int
    location_words: int
    variable_words: int
    meta_words: int


@dataclass(frozen=True, slots=True)
class Query:
    """A query of a file.

    Attributes:
        text: Its formula.
        comment: The comment beside it.
        expect: The verdict that the file states, the number that ``sup`` or ``inf`` should give, or
            ``None``.
    """

    text: str
    comment: str
    expect: str | float | None = None


@dataclass(frozen=True, slots=True)
class ScalarSet:
    """A scalar set.

    Attributes:
        size: How many members it has.
        reduced: Whether states that differ only by exchanged members are one for symmetry
            reduction.
        obstacle: Why not, or ``None``.
        place: Where what tells its members apart stands, as ``file:line:column``, or ``None``.
        at: The text there, or ``None``.
    """

    size: int
    reduced: bool
    obstacle: str | None = None
    place: str | None = None
    at: str | None = None


@dataclass(frozen=True, slots=True)
class Facts:
    """All that is in a model.

    Attributes:
        templates: As written, those that no process uses included.
        processes: In the order of the system line.
        variables: In the order of their words.
        clocks: Without the reference clock.
        channels: In the order of their declarations.
        features: Names of what the model uses beyond plain timed automata.
        scalar_sets: In the order of their declarations.
        state: How large a state is.
        queries: Those of the file.
    """

    templates: tuple[Template, ...]
    processes: tuple[Process, ...]
    variables: tuple[Variable, ...]
    clocks: tuple[Clock, ...]
    channels: tuple[Channel, ...]
    features: tuple[str, ...]
    scalar_sets: tuple[ScalarSet, ...]
    state: StateSize
    queries: tuple[Query, ...]

    @classmethod
    def from_object(cls, found: dict[str, Any]) -> Facts:
        """Makes the values of the engine's object ``ntagen-model``."""
        return cls(
            templates=tuple(_template(entry) for entry in found["templates"]),
            processes=tuple(
                Process(
                    entry["name"],
                    entry["template"],
                    entry["priority"],
                    location_count=entry["locations"],
                    edge_count=entry["edges"],
                )
                for entry in found["processes"]
            ),
            variables=tuple(
                Variable(**{**entry, "dimensions": tuple(entry["dimensions"])})
                for entry in found["variables"]
            ),
            clocks=tuple(Clock(**entry) for entry in found["clocks"]),
            channels=tuple(Channel(**entry) for entry in found["channels"]),
            features=tuple(found["features"]),
            scalar_sets=tuple(ScalarSet(**entry) for entry in found["scalar_sets"]),
            state=StateSize(**found["state"]),
            queries=queries_from(found["queries"]),
        )


def queries_from(entries: list[dict[str, Any]]) -> tuple[Query, ...]:
    """The values of the engine's list of queries."""
    return tuple(Query(**entry) for entry in entries)


def _template(entry: dict[str, Any]) -> Template:
    return Template(
        entry["name"],
        tuple(entry["parameters"]),
        tuple(Location(**_drawn(location)) for location in entry["locations"]),
        tuple(BranchPoint(**_drawn(point)) for point in entry["branch_points"]),
        tuple(Edge(**_drawn(edge)) for edge in entry["edges"]),
    )


def _drawn(entry: dict[str, Any]) -> dict[str, Any]:
    """The attributes of a part, its places as pairs."""
    values = dict(entry)
    if values.get("position") is not None:
        values["position"] = tuple(values["position"])
    if "nails" in values:
        values["nails"] = tuple(tuple(nail) for nail in values["nails"])
    if "labels" in values:
        values["labels"] = {kind: tuple(point) for kind, point in values["labels"].items()}
    return values
