"""Strategies of games under partial observation: machines that react to observations.

A machine begins in its state 0. In each state it proposes an action; when the observation changes,
it goes to another state.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ntagen.errors import UndecidedError

__all__ = ["Belief", "Machine", "MachineState"]

Observation = tuple[bool, ...]
"""The values of the observed predicates, in the order of the query."""


@dataclass(frozen=True, slots=True)
class Belief:
    """A discrete state in which play may be when the machine enters one of its states."""

    locations: dict[str, str]
    variables: dict[str, int | float]
    zones: tuple[tuple[str, ...], ...]
    """The clock values are in one of these zones, each a list of constraints that all hold."""


@dataclass(frozen=True, slots=True)
class MachineState:
    """What a machine does while the observation stays the same."""

    observation: Observation
    channel: str | None
    """The channel that is proposed."""
    edge: dict[str, Any] | None
    """The edge without a channel that is proposed; with neither, the machine waits."""
    next: dict[Observation, int]
    """The index of the next state, by the next observation."""
    beliefs: tuple[Belief, ...]
    """The states from which the machine wins on entry, among them all in which play may be."""

    def __str__(self) -> str:
        if self.channel is not None:
            return f"propose {self.channel}"
        if self.edge is not None:
            source, target = self.edge["source"], self.edge["target"]
            return f"propose {self.edge['process']}.{source} -> {target}"
        return "wait"


@dataclass(frozen=True, slots=True)
class Machine:
    """The controller's strategy in a game in which it sees only some predicates.

    ``machine[0]`` is its first state. It has no states if play is won before it begins.
    """

    query: str
    observations: tuple[str, ...]
    """The observed predicates, as the query has them."""
    states: tuple[MachineState, ...] = field(repr=False)

    @staticmethod
    def from_json(text: str) -> Machine:
        """Reads a machine of the format that ``docs/observations.md`` describes."""
        whole = json.loads(text)
        return Machine(
            whole["query"],
            tuple(whole["observations"]),
            tuple(_state(state) for state in whole["states"]),
        )

    def __len__(self) -> int:
        return len(self.states)

    def __iter__(self) -> Iterator[MachineState]:
        return iter(self.states)

    def __getitem__(self, index: int) -> MachineState:
        return self.states[index]

    def after(self, state: int, observation: Sequence[bool]) -> int:
        """The index of the state in which the machine is after an observation.

        Args:
            state: The index of its state before.
            observation: The values of the predicates, in the order of `observations`.

        Raises:
            UndecidedError: The machine never observes this in `state` before the game is won.
        """
        seen = tuple(bool(value) for value in observation)
        if seen == self.states[state].observation:
            return state
        found = self.states[state].next.get(seen)
        if found is None:
            shown = ", ".join(str(value).lower() for value in seen)
            raise UndecidedError(f"the machine has no next state after {state} for ({shown})")
        return found


def _state(entry: Mapping[str, Any]) -> MachineState:
    action = entry["action"] or {}
    return MachineState(
        observation=tuple(entry["observation"]),
        channel=action.get("channel"),
        edge=action.get("edge"),
        next={tuple(one["observation"]): one["state"] for one in entry["next"]},
        beliefs=tuple(
            Belief(one["locations"], one["variables"], tuple(tuple(zone) for zone in one["zones"]))
            for one in entry["knowledge"]
        ),
    )
