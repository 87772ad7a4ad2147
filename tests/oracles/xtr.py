"""A reader of ``.xtr`` traces with their compiled form (``.if``), after what is known of both.

It shares nothing with the writer: names come from the ``.if`` alone, zones are closed by Floyd and
Warshall, and bounds are fractions with a sign for "strict".
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

Bound = tuple[float, int]
"""A limit, and -1 if it is strict or 0; tuples compare and add as bounds do."""

UNBOUNDED: Bound = (math.inf, 0)


@dataclass
class ReadEdge:
    """An edge of the compiled form, in the words of the model."""

    process: str
    source: str
    target: str
    guard: str
    sync: str
    update: str


@dataclass
class Compiled:
    """What a compiled form says."""

    clocks: list[str]
    variables: list[str]
    initial: dict[str, int]
    ranges: dict[str, tuple[int, int]]
    processes: list[str]
    initial_locations: dict[str, str]
    locations: dict[str, list[str]]
    invariants: dict[str, dict[str, str]]
    kinds: dict[str, str]
    edges: dict[str, list[ReadEdge]]


@dataclass
class ReadState:
    """A state of a trace."""

    locations: dict[str, str]
    variables: dict[str, int]
    zone: dict[tuple[str, str], Bound]


@dataclass
class ReadTrace:
    """A trace: states, and of each transition the edges with their select values."""

    states: list[ReadState]
    transitions: list[list[tuple[ReadEdge, list[int]]]]


def read_compiled(text: str) -> Compiled:
    """Reads a compiled form."""
    sections: dict[str, list[str]] = {}
    current: list[str] = []
    for line in text.split("\n"):
        if line and ":" not in line and not line.startswith("#"):
            current = sections.setdefault(line, [])
        elif line and not line.startswith("#"):
            current.append(line)
    found = Compiled([], [], {}, {}, [], {}, {}, {}, {}, {})
    places: dict[int, str] = {}
    kinds: dict[int, str] = {}
    for line in sections["layout"]:
        index, kind, rest = line.split(":", 2)
        if kind == "clock":
            found.clocks.append(rest.split(":", 1)[1])
        elif kind in ("var", "meta"):
            low, high, initial, number, name = rest.split(":", 4)
            assert int(number) == len(found.variables)
            found.variables.append(name)
            found.initial[name] = int(initial)
            found.ranges[name] = (int(low), int(high))
        elif kind == "location":
            kinds[int(index)], places[int(index)] = rest.split(":", 1)
    texts = {}
    for line in sections["expressions"]:
        address, _reads, _writes, expression = line.split(":", 3)
        texts[int(address)] = expression
    for line in sections["processes"]:
        number, initial, name = line.split(":", 2)
        assert int(number) == len(found.processes)
        found.processes.append(name)
        found.initial_locations[name] = places[int(initial)]
        found.locations[name], found.invariants[name], found.edges[name] = [], {}, []
    for line in sections["locations"]:
        index, process, invariant = map(int, line.split(":"))
        name = found.processes[process]
        found.locations[name].append(places[index])
        found.invariants[name][places[index]] = texts[invariant]
        found.kinds[f"{name}.{places[index]}"] = kinds[index]
    for line in sections["edges"]:
        process, source, target, *labels = map(int, line.split(":"))
        name = found.processes[process]
        guard, sync, update = (texts[label] for label in labels)
        edge = ReadEdge(name, places[source], places[target], guard, sync, update)
        found.edges[name].append(edge)
    return found


def read_trace(text: str, compiled: Compiled) -> ReadTrace:
    """Reads a trace."""
    blocks = _blocks(text)
    states = [_state(blocks, compiled)]
    transitions = []
    while (locations := next(blocks)) != "":
        states.append(_state(blocks, compiled, locations))
        transitions.append(_transition(next(blocks), compiled))
    assert list(blocks) == []
    return ReadTrace(states, transitions)


def _blocks(text: str) -> Iterator[str]:
    """What stands before each dot."""
    assert text.endswith(".\n")
    for block in text.split(".")[:-1]:
        yield block.strip()


def _state(blocks: Iterator[str], compiled: Compiled, locations: str | None = None) -> ReadState:
    numbers = [int(word) for word in (next(blocks) if locations is None else locations).split()]
    names = {
        process: compiled.locations[process][number]
        for process, number in zip(compiled.processes, numbers, strict=True)
    }
    bounds: dict[tuple[int, int], Bound] = {}
    while (entry := next(blocks)) != "":
        left, right, raw = map(int, entry.split())
        bounds[left, right] = ((raw - 1) / 2, -1) if raw % 2 else (raw / 2, 0)
    values = [int(word) for word in next(blocks).split()]
    variables = dict(zip(compiled.variables, values, strict=True))
    return ReadState(names, variables, closed(bounds, compiled.clocks))


def _transition(block: str, compiled: Compiled) -> list[tuple[ReadEdge, list[int]]]:
    taken = []
    for entry in block.split(";")[:-1]:
        process, edge, *select = map(int, entry.split())
        taken.append((compiled.edges[compiled.processes[process]][edge], select))
    return taken


def closed(bounds: dict[tuple[int, int], Bound], clocks: list[str]) -> dict[tuple[str, str], Bound]:
    """The tightest bound on each difference of two clocks; clocks are not negative."""
    every = range(len(clocks))
    tight = {(one, other): UNBOUNDED for one in every for other in every}
    tight |= (
        {(0, one): (0.0, 0) for one in every} | bounds | {(one, one): (0.0, 0) for one in every}
    )
    for via in every:
        for one in every:
            for other in every:
                first, second = tight[one, via], tight[via, other]
                if UNBOUNDED not in (first, second):
                    way = (first[0] + second[0], min(first[1], second[1]))
                    tight[one, other] = min(tight[one, other], way)
    return {(clocks[one], clocks[other]): bound for (one, other), bound in tight.items()}
