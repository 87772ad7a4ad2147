"""A small interpreter of JANI, written from its specification alone: states and probabilities.

Clocks take whole values, which is exact for guards and invariants without strict bounds. Above
`CAP` all values of a clock are the same.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from typing import Any

CAP = 12

Json = Any
State = tuple[tuple[str, ...], tuple[tuple[str, Any], ...]]
Chances = dict[State, float]


class Jani:
    """A model in JANI."""

    def __init__(self, text: str) -> None:
        self.json = json.loads(text)
        self._automata = self.json["automata"]
        self._clocks = {one["name"] for one in self.json["variables"] if one["type"] == "clock"}
        self._bounds = {
            one["name"]: (one["type"]["lower-bound"], one["type"]["upper-bound"])
            for one in self.json["variables"]
            if one["type"] != "clock"
        }

    @property
    def initial(self) -> State:
        places = tuple(one["initial-locations"][0] for one in self._automata)
        return places, tuple((one["name"], one["initial-value"]) for one in self.json["variables"])

    def choices(self, state: State) -> Iterator[Chances]:
        """What may happen next: the passing of one unit of time, and all transitions."""
        if self._clocks and (later := self._later(state)):
            yield {later: 1.0}
        for _, chances in self.transitions(state):
            yield chances

    def transitions(self, state: State) -> Iterator[tuple[float, Chances]]:
        """The transitions, each with its rate and where it leads."""
        places, values = state[0], dict(state[1])
        enabled: list[list[Json]] = [
            [
                edge
                for edge in automaton["edges"]
                if edge["location"] == place and evaluated(edge.get("guard", TRUE)["exp"], values)
            ]
            for automaton, place in zip(self._automata, places, strict=True)
        ]
        for number, edges in enumerate(enabled):
            for edge in edges:
                if "action" not in edge:
                    yield self._taken(state, {number: edge})
        for vector in self.json["system"]["syncs"]:
            parts = {n: action for n, action in enumerate(vector["synchronise"]) if action}
            options = [[e for e in enabled[n] if e.get("action") == a] for n, a in parts.items()]
            for edges_taken in itertools.product(*options):
                yield self._taken(state, dict(zip(parts, edges_taken, strict=True)))

    def _taken(self, state: State, edges: dict[int, Json]) -> tuple[float, Chances]:
        values = dict(state[1])
        rate = 1.0
        for edge in edges.values():
            rate *= evaluated(edge.get("rate", {"exp": 1})["exp"], values)
        chances: Chances = {}
        for destinations in itertools.product(*(one["destinations"] for one in edges.values())):
            chance, places = 1.0, list(state[0])
            for number, one in zip(edges, destinations, strict=True):
                chance *= evaluated(one.get("probability", {"exp": 1})["exp"], values)
                places[number] = one["location"]
            target = tuple(places), self._assigned(values, destinations)
            chances[target] = chances.get(target, 0.0) + chance
        return rate, chances

    def _assigned(self, values: Json, destinations: Json) -> tuple[tuple[str, Any], ...]:
        now = dict(values)
        by_index: dict[int, list[Json]] = {}
        for one in destinations:
            for assignment in one["assignments"]:
                by_index.setdefault(assignment.get("index", 0), []).append(assignment)
        for _, group in sorted(by_index.items()):
            written = {one["ref"]: evaluated(one["value"], now) for one in group}
            assert len(written) == len(group), "a variable is assigned twice at once"
            now |= written
        for name, (low, high) in self._bounds.items():
            assert low <= now[name] <= high, name
        return tuple(now.items())

    def _later(self, state: State) -> State | None:
        values = {
            name: min(value + 1, CAP) if name in self._clocks else value for name, value in state[1]
        }
        for automaton, place in zip(self._automata, state[0], strict=True):
            for location in automaton["locations"]:
                if location["name"] == place and not evaluated(
                    location.get("time-progress", TRUE)["exp"], values
                ):
                    return None
        return state[0], tuple(values.items())

    def reached(self) -> set[State]:
        """All states that are reached."""
        found, waiting = {self.initial}, [self.initial]
        while waiting:
            for chances in self.choices(waiting.pop()):
                fresh = chances.keys() - found
                found |= fresh
                waiting += fresh
        return found

    def probability(self, name: str, rounds: int = 3000) -> float:
        """The value of a property of a DTMC or MDP, by value iteration."""
        asked = next(one for one in self.json["properties"] if one["name"] == name)
        values = asked["expression"]["values"]
        best = max if values["op"] == "Pmax" else min
        path = values["exp"]
        states = self.reached()
        goal = {one for one in states if evaluated(path["exp"], dict(one[1]))}
        choices = {one: list(self.choices(one)) for one in states}
        now = {one: float(one in goal) for one in states}
        for _ in range(path.get("step-bounds", {"upper": rounds})["upper"]):
            now = {
                one: 1.0
                if one in goal
                else best(
                    (sum(p * now[to] for to, p in chances.items()) for chances in choices[one]),
                    default=0.0,
                )
                for one in states
            }
        return now[self.initial]


TRUE: Json = {"exp": True}


def evaluated(expr: Json, values: dict[str, Any]) -> Any:  # noqa: ANN401, C901  a value of JANI
    """The value of an expression."""
    if isinstance(expr, str):
        return values[expr]
    if not isinstance(expr, dict):
        return expr
    if expr["op"] == "ite":
        return evaluated(expr["then" if evaluated(expr["if"], values) else "else"], values)
    if "exp" in expr:
        inner = evaluated(expr["exp"], values)
        return not inner if expr["op"] == "¬" else inner // 1
    left, right = (evaluated(expr[side], values) for side in ("left", "right"))
    match expr["op"]:
        case "∧":
            return left and right
        case "\N{LOGICAL OR}":
            return left or right
        case "⇒":
            return not left or right
        case "=":
            return left == right
        case "≤":
            return left <= right
        case "<":
            return left < right
        case "≥":
            return left >= right
        case ">":
            return left > right
        case "+":
            return left + right
        case "-":
            return left - right
        case "*":
            return left * right
        case "/":
            return left / right
        case "%":
            return left % right
        case "min":
            return min(left, right)
        case "max":
            return max(left, right)
    raise AssertionError(expr["op"])
