"""Edges and transitions as the engine numbers them, in the words of the model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field

from ntagen.values import dataclass

RawEdge = tuple[str, str, list[str], list[str], str, bool]
"""The fields of `EdgeEntry`, as the engine gives them."""


@dataclass(frozen=True, slots=True)
class EngineEdge:
    """An edge as it is taken in a plan.

    Attributes:
        process: The process, for example ``User``.
        source: The location that it leaves.
        target: The location that it enters.
        sync: The synchronisation as written, for example ``do_push!``; empty for an internal edge.
        select: The values of the select bindings.
    """

    process: str
    source: str
    target: str
    sync: str
    select: dict[str, int] = field(hash=False)


@dataclass(frozen=True, slots=True)
class EngineStep:
    """A transition of a plan: the edges that are taken together, the sender's first."""

    edges: tuple[EngineEdge, ...]


@dataclass(frozen=True, slots=True)
class EnginePlan:
    """A winning sequence: the transitions that leave a state without committed locations."""

    steps: tuple[EngineStep, ...]


@dataclass(frozen=True, slots=True)
class EdgeEntry:
    """An edge of the model."""

    process: str
    source: str
    targets: list[str]
    selects: list[str]
    sync: str
    controllable: bool

    def taken(self, branch: int, values: list[int]) -> EngineEdge:
        """The edge with this leg of its branch point and these values of its selects."""
        select = dict(zip(self.selects, values, strict=True))
        return EngineEdge(self.process, self.source, self.targets[branch], self.sync, select)


class EdgeTable(dict[int, list[EdgeEntry]]):
    """The edges of a model, by process. Those of a process are asked for when they are needed."""

    def __init__(self, of_process: Callable[[int], list[RawEdge]]) -> None:
        super().__init__()
        self._of_process = of_process

    def __missing__(self, process: int) -> list[EdgeEntry]:
        self[process] = [EdgeEntry(*entry) for entry in self._of_process(process)]
        return self[process]


def step_of(edges: EdgeTable, step: list[tuple[int, int, int, list[int]]]) -> EngineStep:
    """A transition from the numbers of its edges."""
    taken = (edges[process][edge].taken(branch, values) for process, edge, branch, values in step)
    return EngineStep(tuple(taken))
