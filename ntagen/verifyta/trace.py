"""A model and its symbolic traces by numbers, as UPPAAL's files count.

Processes, locations, edges, clocks and variables have numbers.

Invariants: edges are numbered from 0 in each process, in the order of the file. The legs of a
branch point are edges of their own, one after the other, because the files know no branch points.
Clock 0 is the reference clock.
"""

from __future__ import annotations

import json
import re
from functools import cached_property
from itertools import accumulate
from typing import TYPE_CHECKING, Any, Final

from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model

REFERENCE_CLOCK: Final = "t(0)"


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable, or a part of an array or struct: an integer, truth value or scalar."""

    name: str
    low: int
    high: int
    initial: int
    meta: bool


@dataclass(frozen=True, slots=True)
class Location:
    """A location; `kind` is ``normal``, ``urgent`` or ``committed``."""

    name: str
    kind: str
    invariant: str


@dataclass(frozen=True, slots=True)
class Edge:
    """An edge, or a leg of a branch point with the labels of its edge; labels may be empty."""

    source: int
    target: int
    select: tuple[str, ...]
    guard: str
    sync: str
    update: str


@dataclass(frozen=True)
class Process:
    """A process.

    Attributes:
        name: Its name.
        initial: Its initial location.
        locations: Its locations.
        legs: Of each edge of the engine, the edges of the files.
    """

    name: str
    initial: int
    locations: tuple[Location, ...]
    legs: tuple[tuple[Edge, ...], ...]

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """The edges in the order of their numbers."""
        return tuple(leg for legs in self.legs for leg in legs)

    @cached_property
    def _first_numbers(self) -> list[int]:
        return [0, *accumulate(len(legs) for legs in self.legs)]

    def number(self, edge: int, leg: int) -> int:
        """The number of an edge in the files, by the engine's numbers of edge and leg."""
        return self._first_numbers[edge] + leg

    @cached_property
    def location_numbers(self) -> dict[str, int]:
        """The numbers of the locations by their names."""
        return {location.name: number for number, location in enumerate(self.locations)}


@dataclass(frozen=True)
class Network:
    """A model by numbers.

    Attributes:
        clocks: The names of the clocks; the first is the reference clock.
        variables: The variables without doubles, which UPPAAL's files do not have either.
        processes: The processes.
    """

    clocks: tuple[str, ...]
    variables: tuple[Variable, ...]
    processes: tuple[Process, ...]

    @cached_property
    def process_numbers(self) -> dict[str, int]:
        """The numbers of the processes by their names."""
        return {process.name: number for number, process in enumerate(self.processes)}


def network_of(model: Model) -> Network:
    """The network of a model."""
    raw = json.loads(model.network_json())
    labels = ("guard", "sync", "update")
    processes = []
    for process in raw["processes"]:
        legs = tuple(
            tuple(
                Edge(
                    edge["source"], target, tuple(edge["select"]), *(edge[name] for name in labels)
                )
                for target in edge["targets"]
            )
            for edge in process["edges"]
        )
        locations = tuple(Location(**location) for location in process["locations"])
        processes.append(Process(process["name"], process["initial"], locations, legs))
    return Network(
        clocks=(REFERENCE_CLOCK, *raw["clocks"]),
        variables=tuple(Variable(**variable) for variable in raw["variables"]),
        processes=tuple(processes),
    )


Matrix = list[list[tuple[int, bool] | None]]
"""A closed difference bound matrix: clock i minus clock j is at most the number in row i and column
j, or less if the truth value says strict; ``None`` is no bound."""


@dataclass(frozen=True, slots=True)
class State:
    """A symbolic state: the location of each process, the values of the variables, the zone."""

    locations: tuple[int, ...]
    values: tuple[int, ...]
    zone: Matrix


@dataclass(frozen=True, slots=True)
class Part:
    """An edge that is taken, with the values of its select bindings."""

    process: int
    edge: int
    select: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Trace:
    """A symbolic trace; there is one transition less than states."""

    states: tuple[State, ...]
    transitions: tuple[tuple[Part, ...], ...]


def trace_of(answer: Answer, network: Network) -> Trace | None:
    """The first trace of an answer; ``None`` if it has none."""
    text = answer.trace_json()
    if text is None:
        return None
    raw = json.loads(text)
    first = raw["traces"][0] if "traces" in raw else raw
    zones = answer.trace_zones()[0]
    states = (
        State(
            locations=tuple(
                process.location_numbers[state["locations"][process.name]]
                for process in network.processes
            ),
            values=tuple(state["variables"][one.name] for one in network.variables),
            zone=zone,
        )
        for state, zone in zip(first["states"], zones, strict=True)
    )
    transitions = (
        tuple(_part(network, part) for part in transition) for transition in first["transitions"]
    )
    return Trace(tuple(states), tuple(transitions))


def _part(network: Network, raw: dict[str, Any]) -> Part:
    number = network.process_numbers[raw["process"]]
    process = network.processes[number]
    edge = process.number(raw["edge"], raw["branch"])
    names = process.edges[edge].select
    return Part(number, edge, tuple(raw["select"][name] for name in names))


_ASSIGNMENT: Final = re.compile(r"\s*(?<![=!<>:+\-*/%&|^])=(?!=)\s*")


def as_assigned(update: str) -> str:
    """An update with ``:=`` for the assignments that the model writes with ``=``."""
    return _ASSIGNMENT.sub(" := ", update)


def numbered(model: Model, answer: Answer) -> tuple[Network, Trace] | None:
    """A model and the first trace of an answer; ``None`` if it has none."""
    network = network_of(model)
    trace = trace_of(answer, network)
    return None if trace is None else (network, trace)
