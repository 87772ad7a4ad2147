"""A symbolic trace in the numbers of the network."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any, Final

from ntagen.values import dataclass
from ntagen.verifyta.network import Network

if TYPE_CHECKING:
    from ntagen.checker import Answer

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
