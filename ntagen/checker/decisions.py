"""What a strategy does in a state: decisions, each with the zones in which it applies."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from ntagen.checker.runs import Edge, edges_of


@dataclass(frozen=True, slots=True)
class Decision:
    """What a strategy does in some zones of a state.

    Attributes:
        zones: It applies in each of these zones. A zone is a list of constraints, such as
            ``x <= 3``, that all hold; the empty list always holds.
        edges: The edges that are taken together, the sender's first; empty means to wait. If an
            edge of the controller leads to a branch point, this is one leg; the environment picks
            any.
        rank: As in `Advice`.
    """

    zones: tuple[tuple[str, ...], ...]
    edges: tuple[Edge, ...]
    rank: int

    def __str__(self) -> str:
        zones = " or ".join(" && ".join(zone) or "true" for zone in self.zones)
        return f"{zones}: {', '.join(map(str, self.edges)) or 'wait'}"


@dataclass(frozen=True, slots=True)
class StrategyState:
    """The decisions of a strategy for some locations and variables.

    Attributes:
        locations: The location of each process.
        variables: The value of each variable.
        is_goal: Whether play has ended here, won, for all clock values.
        decisions: What to do. The first decision that applies counts; in a permissive strategy
            each one that applies is allowed.
        legs: In a strategy of the environment, the legs that it picks for moves of the controller:
            for each move the first that applies.
    """

    locations: dict[str, str] = field(hash=False)
    variables: dict[str, int | float] = field(hash=False)
    is_goal: bool
    decisions: tuple[Decision, ...]
    legs: tuple[Decision, ...] = ()


def state_of(raw: dict[str, Any]) -> StrategyState:
    """The decisions in a state from the engine's JSON."""
    return StrategyState(
        raw["locations"],
        raw["variables"],
        raw["goal"],
        _decisions(raw["decisions"]),
        _decisions(raw.get("legs", ())),
    )


def _decisions(raw: Iterable[dict[str, Any]]) -> tuple[Decision, ...]:
    return tuple(
        Decision(
            zones=tuple(map(tuple, one["zones"])), edges=edges_of(one["action"]), rank=one["rank"]
        )
        for one in raw
    )
