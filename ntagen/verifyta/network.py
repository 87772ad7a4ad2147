"""The model by numbers: processes, locations, edges, clocks and variables as UPPAAL's files count.

Invariants: edges are numbered from 0 in each process, in the order of the file. The legs of a
branch point are edges of their own, one after the other, because the files know no branch points.
Clock 0 is the reference clock.
"""

from __future__ import annotations

import json
from functools import cached_property
from itertools import accumulate
from typing import TYPE_CHECKING, Final

from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Model

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
    processes = []
    for process in raw["processes"]:
        legs = tuple(
            tuple(
                Edge(
                    source=edge["source"],
                    target=target,
                    select=tuple(edge["select"]),
                    guard=edge["guard"],
                    sync=edge["sync"],
                    update=edge["update"],
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
