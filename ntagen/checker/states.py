"""Symbolic states: all that are reachable, or one after the other in a walk."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field

import ntagen._checker as _checker
from ntagen.checker.edges import EdgeTable, EngineStep, step_of
from ntagen.checker.errors import failing

ReachedEntry = tuple[
    str,
    list[str],
    list[list[tuple[int, bool] | None]],
    tuple[int, list[tuple[int, int, int, list[int]]]] | None,
]
"""A state as the engine gives it."""


@dataclass(frozen=True, slots=True)
class SymbolicState:
    """A reachable symbolic state: discrete values, and a convex set of clock values.

    Attributes:
        index: Its position in the list of states, from 0.
        locations: The location of each process.
        variables: The value of each variable; parts of arrays and structs by names such as
            ``a[2].x``.
        zone: The fewest constraints on the clocks, such as ``x-y == 2`` and ``x <= 3``, in units
            of the model's time; equalities first. "Clocks are not negative" is left out.
        predecessor: The index of the state before it; ``None`` for the initial one.
        step: The transition from the state before it; ``None`` for the initial one.
    """

    index: int
    locations: dict[str, str] = field(hash=False)
    variables: dict[str, int | float] = field(hash=False)
    zone: tuple[str, ...]
    predecessor: int | None
    step: EngineStep | None
    _bounds: tuple[tuple[tuple[int, bool] | None, ...], ...] = field(repr=False)

    def dbm(self) -> tuple[tuple[tuple[int, bool] | None, ...], ...]:
        """The zone as a closed difference bound matrix.

        Returns:
            Rows. The entry in row i and column j is ``(bound, strict)``: clock i minus clock j is
            at most `bound`, or less than `bound` if `strict`. ``None`` is no bound. Bounds are in
            units of the model's time. Clock 0 is the number 0, clock i is
            ``model.clocks[i - 1]``.
        """
        return self._bounds


def symbolic_states(found: list[ReachedEntry], edges: EdgeTable) -> Iterator[SymbolicState]:
    """The states that the engine has reached; `edges` are the model's edges, by process."""
    for index, (discrete, zone, bounds, origin) in enumerate(found):
        raw = json.loads(discrete)
        yield SymbolicState(
            index=index,
            locations=raw["locations"],
            variables=raw["variables"],
            zone=tuple(zone),
            predecessor=None if origin is None else origin[0],
            step=None if origin is None else step_of(edges, origin[1]),
            _bounds=tuple(map(tuple, bounds)),
        )


class Simulation:
    """A walk through a model: a state, its moves, and the state after one of them.

    States are symbolic: `zone` holds all clock values that the moves so far allow.
    """

    def __init__(self, raw: _checker.Simulation, edges: EdgeTable) -> None:
        self._raw = raw
        self._edges = edges

    @property
    def locations(self) -> dict[str, str]:
        """The location of each process."""
        return dict(self._raw.locations())

    @property
    def variables(self) -> dict[str, int | float]:
        """The value of each variable; parts of arrays and structs by names such as ``a[2].x``."""
        return dict(self._raw.variables())

    @property
    def zone(self) -> tuple[str, ...]:
        """The constraints on the clocks, such as ``x <= 3``."""
        return tuple(self._raw.zone())

    def moves(self) -> tuple[EngineStep, ...]:
        """The moves of the state, in a fixed order.

        Raises:
            ModelError: The model fails in computing one.
        """
        with failing():
            return tuple(step_of(self._edges, step) for step in self._raw.moves())

    def numbered_moves(self) -> list[list[tuple[int, int, int, list[int]]]]:
        """The moves in the same order: process, edge, leg and select values of each edge.

        The numbers are those of ``Model.network_json``.

        Raises:
            ModelError: The model fails in computing one.
        """
        with failing():
            return self._raw.moves()

    def take(self, index: int) -> None:
        """Takes the move with this index.

        Raises:
            IndexError: There is no such move.
            ModelError: The model fails in computing one.
        """
        with failing():
            self._raw.take(index)

    def settle(self) -> None:
        """Takes moves as long as time cannot pass and there is exactly one.

        Raises:
            ModelError: The model has a run-time error.
        """
        with failing():
            self._raw.settle()
