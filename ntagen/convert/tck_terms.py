"""Expressions and updates of a network in TChecker's language.

Its conditions are conjunctions of comparisons. All else is an integer term there, by choices:
``a || b`` is ``(if a then 1 else (if b then 1 else 0))``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

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
    conjuncts,
    names,
    shown,
)
from ntagen.convert.network import Network, has_clock, part_name, part_names, refuse
from ntagen.values import dataclass

_NEGATED: Final = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
_MIRRORED: Final = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "==", "!=": "!="}
_ARITHMETIC: Final = ("+", "-", "*", "/", "%")


@dataclass(frozen=True, slots=True)
class Terms:
    """Writes expressions of a network.

    Attributes:
        network: The network.
        parts: What each variable and clock is called, by its name in the network.
        arrays: What an array is called that is declared as one.
    """

    network: Network
    parts: Mapping[str, str]
    arrays: Mapping[str, str]

    def guard(self, place: str, expr: Expr) -> str:
        """A guard or invariant; empty for one that always holds.

        Raises:
            InputError: Clocks are used as TChecker cannot.
        """
        clocks = frozenset(self.network.clocks)
        return " && ".join(
            self._clock_condition(place, one)
            if has_clock(one, clocks)
            else self.condition(place, one)
            for one in conjuncts(expr)
        )

    def statements(self, place: str, updates: tuple[Assign, ...]) -> str:
        """Updates as statements, in order."""
        return "; ".join(one for update in updates for one in self._statement(place, update))

    def condition(self, place: str, expr: Expr) -> str:
        """A condition without clocks."""
        match expr:
            case Binary("&&", left, right):
                return f"{self.condition(place, left)} && {self.condition(place, right)}"
            case Binary(operator, left, right) if operator in COMPARISONS:
                return f"{self.term(place, left)} {operator} {self.term(place, right)}"
            case Unary("!", Binary(operator, left, right)) if operator in COMPARISONS:
                return self.condition(place, Binary(_NEGATED[operator], left, right))
            case Unary("!", Unary("!", inner)):
                return self.condition(place, inner)
        return self.term(place, expr)

    def term(self, place: str, expr: Expr, *, outermost: bool = False) -> str:
        """An integer term; in brackets unless it is outermost or a name."""
        match expr:
            case Number(value):
                return f"{value}" if value >= 0 or outermost else f"({value})"
            case Name() | Index() | Field():
                return self._read(place, expr)
            case Unary("-", operand):
                return f"(-{self.term(place, operand)})"
            case Unary("!", operand):
                return self._choice(place, operand, "0", "1")
            case Binary(operator, left, right) if operator in _ARITHMETIC:
                text = f"{self.term(place, left)} {operator} {self.term(place, right)}"
                return text if outermost else f"({text})"
        return self._choices(place, expr)

    def _choices(self, place: str, expr: Expr) -> str:
        """An expression that TChecker writes as a choice."""
        match expr:
            case Binary("<?", left, right):
                return self.term(place, Choice(Binary("<", left, right), left, right))
            case Binary(">?", left, right):
                return self.term(place, Choice(Binary("<", left, right), right, left))
            case Binary("||", left, right):
                return self._choice(place, left, "1", self._truth(place, right))
            case Binary("imply", left, right):
                return self._choice(place, left, self._truth(place, right), "1")
            case Binary("xor", left, right):
                negated = self._choice(place, right, "0", "1")
                return self._choice(place, left, negated, self._truth(place, right))
            case Binary(operator) if operator in ("&&", *COMPARISONS):
                return self._truth(place, expr)
            case Choice(condition, then, other):
                branches = self.term(place, then), self.term(place, other)
                return self._choice(place, condition, *branches)
        refuse(
            place,
            f"TChecker has no counterpart of `{shown(expr)}`",
            "write it with comparisons, + - * / % and choices",
        )

    def _truth(self, place: str, expr: Expr) -> str:
        return self._choice(place, expr, "1", "0")

    def _choice(self, place: str, condition: Expr, then: str, other: str) -> str:
        return f"(if {self.condition(place, condition)} then {then} else {other})"

    def _read(self, place: str, expr: Expr) -> str:
        """A variable, or the part of an array."""
        name = part_name(expr)
        if name is not None and name in self.parts:
            return self.parts[name]
        base, index, size = self._indexed(place, expr)
        position = self.term(place, index, outermost=True)
        if base in self.arrays:
            return f"{self.arrays[base]}[{position}]"
        text = self.parts[self._part(base, size - 1)]
        for number in reversed(range(size - 1)):
            inner = self.parts[self._part(base, number)]
            text = f"(if {self.term(place, index)} == {number} then {inner} else {text})"
        return text

    def _statement(self, place: str, update: Assign) -> Iterator[str]:
        name = part_name(update.target)
        if name is not None and name in self.network.clocks:
            yield f"{self.parts[name]} = {self._clock_value(place, update.value)}"
            return
        value = self.term(place, update.value, outermost=True)
        if name is not None and name in self.parts:
            yield f"{self.parts[name]} = {value}"
            return
        base, index, size = self._indexed(place, update.target)
        if base in self.arrays:
            yield f"{self.arrays[base]}[{self.term(place, index, outermost=True)}] = {value}"
            return
        if base in names(index):
            refuse(
                place,
                f"the index of `{shown(update.target)}` has the array itself",
                "give all parts of the array the same first value, or keep the index in a variable",
            )
        # One statement a part, of which all but one change nothing.
        for number in range(size):
            part = self.parts[self._part(base, number)]
            yield f"{part} = (if {self.term(place, index)} == {number} then {value} else {part})"

    def _clock_value(self, place: str, expr: Expr) -> str:
        """An integer, or the sum of an integer and a clock, which comes last."""
        clocks = frozenset(self.network.clocks)
        if not has_clock(expr, clocks):
            return self.term(place, expr, outermost=True)
        match expr:
            case Binary("+", left, right) if part_name(left) in clocks:
                clock, offset = left, right
            case Binary("+", left, right):
                clock, offset = right, left
            case Binary("-", left, right):
                clock, offset = left, Unary("-", right)
            case _:
                clock, offset = expr, Number(0)
        if part_name(clock) not in clocks or has_clock(offset, clocks):
            refuse(
                place,
                f"TChecker cannot set a clock to `{shown(expr)}`",
                "set it to an integer, or to another clock plus an integer",
            )
        return f"{self.term(place, offset)} + {self._read(place, clock)}"

    def _indexed(self, place: str, expr: Expr) -> tuple[str, Expr, int]:
        """The array of an expression, the number of the part among all, and how many there are."""
        indexes: list[Expr] = []
        inner = expr
        while isinstance(inner, Index):
            indexes.insert(0, inner.index)
            inner = inner.base
        base = part_name(inner)
        array = self.network.arrays.get(base or "")
        if base is None or array is None or len(array.dimensions) != len(indexes):
            refuse(
                place,
                f"TChecker has no counterpart of `{shown(expr)}`",
                "use arrays of integers, and structs and arrays of clocks with fixed indexes",
            )
        position, size = indexes[0], array.dimensions[0]
        for index, length in zip(indexes[1:], array.dimensions[1:], strict=True):
            position = Binary("+", Binary("*", position, Number(length)), index)
            size *= length
        return base, position, size

    def _part(self, base: str, number: int) -> str:
        """The name in the network of the part of an array with this number among all."""
        return part_names(base, self.network.arrays[base].dimensions)[number]

    def _clock_condition(self, place: str, expr: Expr) -> str:
        """A comparison of a clock, or of the difference of two, with an integer."""
        clocks = frozenset(self.network.clocks)
        match expr:
            case Unary("!", Binary(operator, left, right)) if operator in _NEGATED:
                return self._clock_condition(place, Binary(_NEGATED[operator], left, right))
            case Binary(operator, left, right) if operator in COMPARISONS and operator != "!=":
                if not has_clock(left, clocks):
                    left, right, operator = right, left, _MIRRORED[operator]
                difference = isinstance(left, Binary) and left.operator == "-"
                if part_name(left) in clocks and part_name(right) in clocks:
                    pair = f"{self._read(place, left)} - {self._read(place, right)}"
                    return f"{pair} {operator} 0"
                if not has_clock(right, clocks):
                    bound = self.term(place, right)
                    if part_name(left) in clocks:
                        return f"{self._read(place, left)} {operator} {bound}"
                    if (
                        difference
                        and isinstance(left, Binary)
                        and part_name(left.left) in clocks
                        and part_name(left.right) in clocks
                    ):
                        pair = f"{self._read(place, left.left)} - {self._read(place, left.right)}"
                        return f"{pair} {operator} {bound}"
        refuse(
            place,
            f"TChecker cannot compare clocks as in `{shown(expr)}`",
            "compare a clock, or the difference of two, with an integer; write one edge for each "
            "operand of `||`",
        )
