"""Queries as properties of JANI."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from ntagen.convert.expression_reader import (
    UnknownExpression,
    parse_expression,
)
from ntagen.convert.expressions import (
    Binary,
    Call,
    Expr,
    Field,
    Name,
    Number,
    Unary,
    mapped,
    parts,
    shown,
)
from ntagen.convert.jani_terms import JaniTerms, Json
from ntagen.convert.network import Network, part_name
from ntagen.errors import InputError
from ntagen.values import dataclass

_SYMBOLIC: Final = re.compile(r"\s*(E<>|A\[\])\s*(.*)", re.DOTALL)
_CHANCE: Final = re.compile(r"\s*Pr\s*\[\s*(#?)\s*<=\s*(\d+)\s*\]\s*\(\s*<>(.*)\)\s*", re.DOTALL)


_BEST: Final = re.compile(r"\s*(max|min)Pr\s*\[\s*#\s*<=\s*(\d+)\s*\]\s*:\s*<>(.*)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class _Asked:
    """A property: its operator, its path, what it says, and the processes whose places it needs."""

    operators: tuple[str, ...]
    path: Json
    comment: str
    processes: frozenset[str]


def properties_of(
    queries: Sequence[str], network: Network, terms: JaniTerms, class_: str
) -> tuple[list[Json], set[str], list[str]]:
    """The properties, the processes whose locations they need as variables, and notes.

    ``E<> p`` is satisfied if the greatest probability of p is more than 0, ``A[] p`` if that of its
    negation is 0. ``Pr[#<=N](<> p)`` counts transitions, which are the steps of a DTMC or MDP; in
    ``Pr[<=T](<> p)`` time passes, which it does in a CTMC and, with open delays, in a PTA.
    ``maxPr[#<=N]: <> p`` is the greatest probability where only one process chooses.
    """
    found: list[Json] = []
    processes: set[str] = set()
    notes: list[str] = []
    for number, query in enumerate(queries, 1):
        words = " ".join(query.split())
        asked = _asked(query, network, terms, class_)
        if asked is None:
            notes.append(f"query {number} is left out, for JANI cannot ask it: {words}")
            continue
        processes |= asked.processes
        for operator in asked.operators:
            name = f"query{number}"
            if len(asked.operators) > 1:
                name += "_least" if operator == "Pmin" else "_greatest"
            values = {"op": operator, "exp": asked.path}
            found.append(
                {
                    "name": name,
                    "expression": {
                        "op": "filter",
                        "fun": "max" if operator == "Pmax" else "min",
                        "values": values,
                        "states": {"op": "initial"},
                    },
                    "comment": f"{words}: {asked.comment}",
                }
            )
    return found, processes, notes


def _asked(query: str, network: Network, terms: JaniTerms, class_: str) -> _Asked | None:
    """The property for a query; ``None`` if JANI has none."""
    both = ("Pmax",) if class_ in ("dtmc", "ctmc") else ("Pmin", "Pmax")
    if match := _SYMBOLIC.fullmatch(query):
        goal = _predicate(match[2], network)
        if goal is None or class_ == "ctmc":
            return None
        if match[1] == "E<>":
            return _made(("Pmax",), goal, terms, {}, "satisfied if more than 0")
        negated = Unary("!", goal)
        return _made(("Pmax",), negated, terms, {}, "satisfied if 0")
    if match := _CHANCE.fullmatch(query):
        goal = _predicate(match[3], network)
        if goal is None:
            return None
        bound: Json = {"upper": int(match[2])}
        if match[1] and class_ in ("dtmc", "mdp"):
            comment = "the probability" if len(both) == 1 else "over all choices"
            return _made(both, goal, terms, {"step-bounds": bound}, comment)
        if not match[1] and class_ == "ctmc":
            return _made(both, goal, terms, {"time-bounds": bound}, "the probability")
        if not match[1] and class_ == "pta":
            comment = "over all delays and choices; UPPAAL's answer lies between"
            return _made(both, goal, terms, {"time-bounds": bound}, comment)
    if (match := _BEST.fullmatch(query)) and class_ in ("dtmc", "mdp"):
        goal = _predicate(match[3], network)
        # Of several processes, chance decides which moves next, and here it does not.
        if goal is None or len(network.processes) > 1:
            return None
        best: Json = {"step-bounds": {"upper": int(match[2])}}
        return _made((f"P{match[1]}",), goal, terms, best, "the best probability")
    return None


def _made(
    operators: tuple[str, ...], goal: Expr, terms: JaniTerms, bounds: Json, comment: str
) -> _Asked | None:
    processes = frozenset(
        one.text[:-1] for one in parts(goal) if isinstance(one, Name) and one.text.endswith("@")
    )
    try:
        path = {"op": "F", "exp": terms.truth("query", goal), **bounds}
    except InputError:
        return None
    return _Asked(operators, path, comment, processes)


def _predicate(text: str, network: Network) -> Expr | None:
    """A state predicate with the names of the network; ``None`` if it has others."""
    try:
        expr = parse_expression(text)
    except UnknownExpression:
        return None
    found = {
        process.name: {place.name: number for number, place in enumerate(process.places)}
        for process in network.processes
    }
    bases = {one.partition("[")[0] for one in (*network.variables, *network.arrays)}

    def change(one: Expr) -> Expr | None:
        if isinstance(one, Field):
            process = _process_name(one.base)
            if one.name in found.get(process, ()):
                return Binary("==", Name(f"{process}@"), Number(found[process][one.name]))
            if process in found and f"{process}.{one.name}" in bases:
                return Name(f"{process}.{one.name}")
        return None

    resolved = mapped(expr, change)
    known = all(
        not isinstance(one, Name)
        or one.text.endswith("@")
        or one.text in bases
        or any(name.startswith(f"{one.text}.") for name in network.variables)
        for one in parts(resolved)
    )
    is_plain = not any(isinstance(one, Call) for one in parts(resolved))
    return resolved if known and is_plain and part_name(resolved) not in network.clocks else None


def _process_name(expr: Expr) -> str:
    match expr:
        case Name(text):
            return text
        case Call(function, arguments):
            return f"{function}({','.join(shown(one) for one in arguments)})"
    return ""
