"""Expressions of models as trees, and how they are printed in UPPAAL's language."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final, TypeAlias

from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Number:
    """An integer; truth values are 0 and 1."""

    value: int


@dataclass(frozen=True, slots=True)
class Name:
    """A name: of a variable, a clock, a constant or a bound value."""

    text: str


@dataclass(frozen=True, slots=True)
class Index:
    """A part of an array."""

    base: Expr
    index: Expr


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a struct, or a part of a process in a query."""

    base: Expr
    name: str


@dataclass(frozen=True, slots=True)
class Unary:
    """``-a``, ``!a``."""

    operator: str
    operand: Expr


@dataclass(frozen=True, slots=True)
class Binary:
    """``a + b``, ``a && b``, …; words such as ``and`` have become signs."""

    operator: str
    left: Expr
    right: Expr


@dataclass(frozen=True, slots=True)
class Choice:
    """``a ? b : c``."""

    condition: Expr
    then: Expr
    other: Expr


@dataclass(frozen=True, slots=True)
class Call:
    """The call of a function; as the name of a process with arguments it stands in queries."""

    function: str
    arguments: tuple[Expr, ...]


@dataclass(frozen=True, slots=True)
class Quantified:
    """``forall (i : T) body``, ``exists (i : T) body``, ``sum (i : T) body``."""

    kind: str
    name: str
    type: str
    body: Expr


Expr: TypeAlias = Number | Name | Index | Field | Unary | Binary | Choice | Call | Quantified


@dataclass(frozen=True, slots=True)
class Assign:
    """``target = value``; compound assignments have become plain ones."""

    target: Expr
    value: Expr


LEVELS: Final = {
    **dict.fromkeys(("||", "imply", "xor"), 3),
    "&&": 4,
    "|": 5,
    "^": 6,
    "&": 7,
    **dict.fromkeys(("==", "!="), 8),
    **dict.fromkeys(("<", "<=", ">", ">="), 9),
    **dict.fromkeys(("<?", ">?"), 10),
    **dict.fromkeys(("<<", ">>"), 11),
    **dict.fromkeys(("+", "-"), 12),
    **dict.fromkeys(("*", "/", "%"), 13),
    "**": 14,
}
"""How tight operators bind, as in the engine (`checker/src/syntax/expressions.rs`)."""

PREFIX: Final = 15
"""How tight prefix operators bind."""

COMPARISONS: Final = ("==", "!=", "<", "<=", ">", ">=")
"""The operators of comparisons."""


def mapped(expr: Expr, change: Callable[[Expr], Expr | None]) -> Expr:
    """The expression with parts replaced, from the top.

    Args:
        expr: The expression.
        change: What stands for a part; ``None`` to look into it.
    """
    changed = change(expr)
    if changed is not None:
        return changed
    match expr:
        case Index(base, index):
            return Index(mapped(base, change), mapped(index, change))
        case Field(base, name):
            return Field(mapped(base, change), name)
        case Unary(operator, operand):
            return Unary(operator, mapped(operand, change))
        case Binary(operator, left, right):
            return Binary(operator, mapped(left, change), mapped(right, change))
        case Choice(condition, then, other):
            return Choice(*(mapped(one, change) for one in (condition, then, other)))
        case Call(function, arguments):
            return Call(function, tuple(mapped(one, change) for one in arguments))
        case Quantified(kind, name, type_, body):
            return Quantified(kind, name, type_, mapped(body, change))
    return expr


def parts(expr: Expr) -> Iterator[Expr]:
    """The expression and all below it."""
    yield expr
    match expr:
        case Index(base, index):
            below: tuple[Expr, ...] = (base, index)
        case Field(base, _) | Unary(_, base) | Quantified(_, _, _, base):
            below = (base,)
        case Binary(_, left, right):
            below = (left, right)
        case Choice(condition, then, other):
            below = (condition, then, other)
        case Call(_, arguments):
            below = arguments
        case _:
            below = ()
    for one in below:
        yield from parts(one)


def names(expr: Expr) -> set[str]:
    """The names that stand in an expression."""
    return {one.text for one in parts(expr) if isinstance(one, Name)}


def conjuncts(expr: Expr) -> list[Expr]:
    """The operands of a conjunction; 1 is none."""
    if isinstance(expr, Binary) and expr.operator == "&&":
        return conjuncts(expr.left) + conjuncts(expr.right)
    return [] if expr == Number(1) else [expr]


def conjunction(operands: list[Expr]) -> Expr:
    """Expressions joined by ``&&``; 1 of none."""
    found: Expr | None = None
    for one in operands:
        found = one if found is None else Binary("&&", found, one)
    return Number(1) if found is None else found


def shown(expr: Expr) -> str:
    """The text of an expression in UPPAAL's language, with as few brackets as it needs."""
    return _printed(expr, 0)


def shown_update(updates: list[Assign]) -> str:
    """The text of updates in UPPAAL's language."""
    return ", ".join(f"{shown(one.target)} = {shown(one.value)}" for one in updates)


def _printed(expr: Expr, least: int) -> str:
    match expr:
        case Number(value):
            return f"{value}" if value >= 0 or least <= PREFIX - 4 else f"({value})"
        case Name(text):
            return text
        case Index(base, index):
            return f"{_printed(base, PREFIX)}[{shown(index)}]"
        case Field(base, name):
            return f"{_printed(base, PREFIX)}.{name}"
        case Call(function, arguments):
            return f"{function}({', '.join(shown(one) for one in arguments)})"
        case Unary(operator, operand):
            text, level = f"{operator}{_printed(operand, PREFIX + 1)}", PREFIX
        case Binary(operator, left, right):
            level = LEVELS[operator]
            text = f"{_printed(left, level)} {operator} {_printed(right, level + 1)}"
        case Choice(condition, then, other):
            text = f"{_printed(condition, 3)} ? {_printed(then, 3)} : {_printed(other, 2)}"
            level = 2
        case Quantified(kind, name, type_, body):
            text, level = f"{kind} ({name} : {type_}) {shown(body)}", 1
    return f"({text})" if level < least else text
