"""Expressions of a network as JANI's, which are JSON.

JANI tells truth values from integers. A variable that is a truth value in UPPAAL is an integer from
0 to 1 here. Parts of arrays are variables of their own; an index that changes is a choice among
them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final, NoReturn

from ntagen.convert.expressions import (
    COMPARISONS,
    Assign,
    Binary,
    Choice,
    Expr,
    Field,
    Index,
    Name,
    Number,
    Unary,
    shown,
)
from ntagen.convert.intervals import interval
from ntagen.convert.network import Network, has_clock, part_name, part_names, refuse
from ntagen.values import dataclass

Json = Any
"""What `json` writes."""

_SIGNS: Final = {"==": "=", "<=": "≤", ">=": "≥", "<": "<", ">": ">"}
_JOINED: Final = {"&&": "∧", "||": "\N{LOGICAL OR}", "imply": "⇒"}


@dataclass(frozen=True, slots=True)
class JaniTerms:
    """Writes expressions of a network.

    Attributes:
        network: The network.
        names: What variables and clocks are called, by their names in the network.
    """

    network: Network
    names: Mapping[str, str]

    def truth(self, place: str, expr: Expr) -> Json:
        """An expression as a truth value."""
        match expr:
            case Number(value):
                return value != 0
            case Unary("!", operand):
                return {"op": "¬", "exp": self.truth(place, operand)}
            case Binary(sign, left, right) if sign in _JOINED:
                return _binary(_JOINED[sign], self.truth(place, left), self.truth(place, right))
            case Binary("xor", left, right):
                return _unequal(self.truth(place, left), self.truth(place, right))
            case Binary("!=", left, right):
                return _unequal(self.value(place, left), self.value(place, right))
            case Binary(sign, left, right) if sign in COMPARISONS:
                return _binary(_SIGNS[sign], self.value(place, left), self.value(place, right))
            case Choice(condition, then, other):
                branches = self.truth(place, then), self.truth(place, other)
                return _choice(self.truth(place, condition), *branches)
        return _unequal(self.value(place, expr), 0)

    def value(self, place: str, expr: Expr) -> Json:
        """An expression as an integer, or as a clock."""
        match expr:
            case Number(value):
                return value
            case Name() | Index() | Field():
                return self._read(place, expr)
            case Unary("-", operand):
                return _binary("-", 0, self.value(place, operand))
            case Binary(("+" | "-" | "*") as sign, left, right):
                return _binary(sign, self.value(place, left), self.value(place, right))
            case Binary(("/" | "%") as sign, left, right):
                self._require_positive(place, expr, left, right)
                pair = self.value(place, left), self.value(place, right)
                if sign == "%":
                    return _binary("%", *pair)
                return {"op": "floor", "exp": _binary("/", *pair)}
            case Binary("<?", left, right):
                return _binary("min", self.value(place, left), self.value(place, right))
            case Binary(">?", left, right):
                return _binary("max", self.value(place, left), self.value(place, right))
            case Choice(condition, then, other):
                branches = self.value(place, then), self.value(place, other)
                return _choice(self.truth(place, condition), *branches)
            case Unary("!") | Binary():
                if isinstance(expr, Binary) and expr.operator not in (
                    *COMPARISONS,
                    *_JOINED,
                    "xor",
                ):
                    self._refuse(place, expr)
                return _choice(self.truth(place, expr), 1, 0)
        self._refuse(place, expr)

    def assignments(self, place: str, updates: tuple[Assign, ...]) -> Iterator[tuple[str, Json]]:
        """The variables that updates write, with their values, in order."""
        for one in updates:
            name = part_name(one.target)
            clocks = frozenset(self.network.clocks)
            if name in clocks and has_clock(one.value, clocks):
                refuse(
                    place,
                    f"JANI cannot set a clock to `{shown(one.value)}`",
                    "set it to an integer",
                )
            if name is not None and name in self.names:
                yield self.names[name], self.value(place, one.value)
                continue
            parts, position = self._indexed(place, one.target)
            for number, part in enumerate(parts):
                # The value is of the time before all of these assignments.
                chosen = Binary("==", position, Number(number))
                yield self.names[part], self.value(place, Choice(chosen, one.value, Name(part)))

    def _read(self, place: str, expr: Expr) -> Json:
        name = part_name(expr)
        if name is not None and name in self.names:
            return self.names[name]
        parts, position = self._indexed(place, expr)
        found: Json = self.names[parts[-1]]
        index = self.value(place, position)
        for number in reversed(range(len(parts) - 1)):
            found = _choice(_binary("=", index, number), self.names[parts[number]], found)
        return found

    def _indexed(self, place: str, expr: Expr) -> tuple[list[str], Expr]:
        """The parts of the array of an expression, and the number of the one it denotes."""
        indexes: list[Expr] = []
        inner = expr
        while isinstance(inner, Index):
            indexes.insert(0, inner.index)
            inner = inner.base
        array = self.network.arrays.get(part_name(inner) or "")
        if array is None or len(array.dimensions) != len(indexes):
            self._refuse(place, expr)
        position = indexes[0]
        for index, length in zip(indexes[1:], array.dimensions[1:], strict=True):
            position = Binary("+", Binary("*", position, Number(length)), index)
        return part_names(array.name, array.dimensions), position

    def _require_positive(self, place: str, expr: Expr, left: Expr, right: Expr) -> None:
        """JANI rounds the quotients of negative numbers in another way than UPPAAL."""
        bounds = {one.name: (one.low, one.high) for one in self.network.variables.values()}
        for array in self.network.arrays.values():
            members = [bounds[one] for one in part_names(array.name, array.dimensions)]
            bounds[array.name] = (min(a for a, _ in members), max(b for _, b in members))
        if interval(left, bounds)[0] < 0 or interval(right, bounds)[0] < 1:
            refuse(
                place,
                f"`{shown(expr)}` may divide negative numbers, or by 0, as JANI does not",
                "give its variables ranges from 0, and the divisor one from 1",
            )

    def _refuse(self, place: str, expr: Expr) -> NoReturn:
        refuse(
            place,
            f"JANI has no counterpart of `{shown(expr)}`",
            "write it with comparisons, + - * / % and choices",
        )


def _binary(sign: str, left: Json, right: Json) -> Json:
    return {"op": sign, "left": left, "right": right}


def _unequal(left: Json, right: Json) -> Json:
    """``≠`` in other words: Momba 0.6 takes it for ``=``."""
    return {"op": "¬", "exp": _binary("=", left, right)}


def _choice(condition: Json, then: Json, other: Json) -> Json:
    return {"op": "ite", "if": condition, "then": then, "else": other}
