"""A model after instantiation, with its labels as trees: for formats without templates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NoReturn

from ntagen.convert.expressions import (
    Assign,
    Expr,
    Field,
    Index,
    Name,
    Number,
    names,
)
from ntagen.errors import InputError
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Variable:
    """An integer or truth value; a part of an array or struct by its own name."""

    name: str
    low: int
    high: int
    initial: int


@dataclass(frozen=True, slots=True)
class Array:
    """An array of integers or truth values; the names of its parts are those of variables."""

    name: str
    dimensions: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Place:
    """A location of a process."""

    name: str
    kind: str
    invariant: Expr
    rate: str


@dataclass(frozen=True, slots=True)
class Leg:
    """Where an edge leads: the location, the weight if there are more legs, and the updates."""

    target: int
    weight: Expr
    updates: tuple[Assign, ...]


@dataclass(frozen=True, slots=True)
class NetworkEdge:
    """An edge of a process, with values for its `select`.

    Attributes:
        place: Where it stands, for messages.
        source: The location that it leaves.
        guard: Its guard.
        channel: The channel of its synchronisation, or ``None``.
        sends: Whether it sends.
        legs: One, or those of its branch point.
        controllable: Whether the controller owns it.
    """

    place: str
    source: int
    guard: Expr
    channel: Expr | None
    sends: bool
    legs: tuple[Leg, ...]
    controllable: bool


@dataclass(frozen=True, slots=True)
class NetworkProcess:
    """A process."""

    name: str
    initial: int
    places: tuple[Place, ...]
    edges: tuple[NetworkEdge, ...]


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel, or one part of an array of channels."""

    name: str
    broadcast: bool


@dataclass(frozen=True, slots=True)
class Network:
    """A model after instantiation; all names in expressions are those of its parts."""

    clocks: tuple[str, ...]
    variables: Mapping[str, Variable]
    arrays: Mapping[str, Array]
    channels: Mapping[str, Channel]
    processes: tuple[NetworkProcess, ...]


def refuse(place: str, cause: str, way_out: str) -> NoReturn:
    """Raises the message about what another format cannot hold."""
    raise InputError(f"{place}: {cause}\nhint: {way_out}")


def part_name(expr: Expr) -> str | None:
    """The name of the variable that an expression without changing indexes denotes."""
    match expr:
        case Name(text):
            return text
        case Index(base, Number(value)):
            inner = part_name(base)
            return None if inner is None else f"{inner}[{value}]"
        case Field(base, name):
            inner = part_name(base)
            return None if inner is None else f"{inner}.{name}"
    return None


def part_names(base: str, dimensions: tuple[int, ...]) -> list[str]:
    """The names of the parts of an array, in order."""
    found = [base]
    for length in dimensions:
        found = [f"{one}[{number}]" for one in found for number in range(length)]
    return found


def has_clock(expr: Expr, clocks: frozenset[str]) -> bool:
    """Whether a clock stands in an expression."""
    return any(one in clocks or f"{one}[0]" in clocks for one in names(expr))
