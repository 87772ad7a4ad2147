"""Between which values an integer expression lies, by the bounds of variables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, TypeAlias

from ntagen.convert.expressions import (
    COMPARISONS,
    Binary,
    Choice,
    Expr,
    Index,
    Name,
    Number,
    Unary,
    conjuncts,
)

Interval: TypeAlias = tuple[int, int]

_ALL: Final = (-(2**31), 2**31 - 1)
_MIRRORED: Final = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "=="}


def interval(expr: Expr, bounds: Mapping[str, Interval]) -> Interval:
    """The least and the greatest value that an expression can have.

    Args:
        expr: The expression; what is not known may have any value of 32 bits.
        bounds: Those of variables, and of the parts of arrays, by name.
    """
    match expr:
        case Number(value):
            return value, value
        case Name(text) | Index(Name(text), _):
            return bounds.get(text, _ALL)
        case Unary("-", operand):
            low, high = interval(operand, bounds)
            return -high, -low
        case Unary("!", _):
            return 0, 1
        case Choice(_, then, other):
            first, second = interval(then, bounds), interval(other, bounds)
            return min(first[0], second[0]), max(first[1], second[1])
        case Binary(operator, _, _) if operator in (*COMPARISONS, "&&", "||"):
            return 0, 1
        case Binary(operator, left, right):
            return _combined(operator, interval(left, bounds), interval(right, bounds))
    return _ALL


def _combined(operator: str, left: Interval, right: Interval) -> Interval:
    if operator == "+":
        return left[0] + right[0], left[1] + right[1]
    if operator == "-":
        return left[0] - right[1], left[1] - right[0]
    if operator == "*":
        products = [a * b for a in left for b in right]
        return min(products), max(products)
    if operator == "%" and right[0] > 0:
        most = right[1] - 1
        return (0 if left[0] >= 0 else -most), most
    if operator == "/" and right[0] > 0:
        # Division rounds towards zero, so its result is nearest to zero for the greatest divisor.
        quotients = [abs(a) // b * (1 if a >= 0 else -1) for a in left for b in right]
        return min(quotients), max(quotients)
    return _ALL


def under(guard: Expr, bounds: Mapping[str, Interval]) -> dict[str, Interval]:
    """The bounds of variables where a guard holds: comparisons with numbers make them tighter."""
    found = dict(bounds)
    for one in conjuncts(guard):
        match one:
            case Binary(operator, Name(text), right) if operator in _MIRRORED:
                _tighten(found, text, operator, interval(right, bounds))
            case Binary(operator, left, Name(text)) if operator in _MIRRORED:
                _tighten(found, text, _MIRRORED[operator], interval(left, bounds))
    return found


def _tighten(bounds: dict[str, Interval], name: str, operator: str, other: Interval) -> None:
    if name not in bounds:
        return
    low, high = bounds[name]
    if operator in ("<", "<=", "=="):
        high = min(high, other[1] - (operator == "<"))
    if operator in (">", ">=", "=="):
        low = max(low, other[0] + (operator == ">"))
    if low <= high:
        bounds[name] = low, high
