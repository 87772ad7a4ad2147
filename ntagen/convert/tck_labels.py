"""What TChecker can ask of a model: whether a state with some labels can be reached.

``E<> p``, and ``A[] p`` by its negation, if p is a conjunction of disjunctions of locations: each
disjunction is a label of its locations, and `tck-reach` looks for a state with all labels.
"""

from __future__ import annotations

import re
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
    Unary,
    shown,
)
from ntagen.convert.network import Network
from ntagen.values import dataclass

_FORM: Final = re.compile(r"\s*(E<>|A\[\])\s*(.*)", re.DOTALL)
_Clauses = list[list[tuple[str, str]]]


@dataclass(frozen=True, slots=True)
class Labels:
    """The labels for a query.

    Attributes:
        clauses: For each label the locations that have it, as process and name.
        expected: What `tck-reach` says if the query is satisfied: whether the state is reachable.
    """

    clauses: list[list[tuple[str, str]]]
    expected: bool


def labels_of(query: str, network: Network) -> Labels | None:
    """The labels for a query; ``None`` if labels cannot say what it asks."""
    match = _FORM.fullmatch(query)
    if match is None:
        return None
    try:
        expr = parse_expression(match[2])
    except UnknownExpression:
        return None
    is_exists = match[1] == "E<>"
    known = {process.name: {one.name for one in process.places} for process in network.processes}
    clauses = _conjunction(expr, is_exists, known)
    return None if clauses is None else Labels(clauses, is_exists)


def _conjunction(expr: Expr, positive: bool, known: dict[str, set[str]]) -> _Clauses | None:
    """The clauses of an expression, or of its negation; ``None`` if it is of another form."""
    match expr:
        case Unary("!", operand):
            return _conjunction(operand, not positive, known)
        case Binary("imply", left, right):
            return _conjunction(Binary("||", Unary("!", left), right), positive, known)
        case Binary(("&&" | "||") as sign, left, right):
            first, second = (_conjunction(one, positive, known) for one in (left, right))
            if first is None or second is None:
                return None
            if (sign == "&&") == positive:
                return first + second
            # A disjunction of conjunctions has no labels, unless each is one disjunction.
            return [first[0] + second[0]] if len(first) == len(second) == 1 else None
        case Field(process, location) if positive:
            name = _process_name(process)
            return [[(name, location)]] if location in known.get(name, ()) else None
    return None


def _process_name(expr: Expr) -> str:
    match expr:
        case Name(text):
            return text
        case Call(function, arguments):
            return f"{function}({','.join(shown(one) for one in arguments)})"
    return ""
