"""Expressions as trees: what is printed is read again, and what no format has is named."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.convert.expression_reader import (
    UnknownExpression,
    parse_expression,
    parse_tck_statements,
    parse_updates,
)
from ntagen.convert.expressions import (
    LEVELS,
    Binary,
    Choice,
    Expr,
    Index,
    Name,
    Number,
    Unary,
    shown,
    shown_update,
)
from ntagen.convert.intervals import interval, under

LEAVES = st.one_of(
    st.integers(0, 99).map(Number),
    st.sampled_from("abxyz").map(Name),
    st.integers(0, 3).map(lambda number: Index(Name("array"), Number(number))),
)


def larger(inner: st.SearchStrategy[Expr]) -> st.SearchStrategy[Expr]:
    operators = st.sampled_from(sorted(set(LEVELS) - {"**"}))
    return st.one_of(
        st.builds(Binary, operators, inner, inner),
        st.builds(Unary, st.just("!"), inner),
        st.builds(Choice, inner, inner, inner),
    )


@settings(max_examples=50, deadline=None)
@given(st.recursive(LEAVES, larger, max_leaves=12))
def test_what_is_printed_is_read_again(expr: Expr) -> None:
    assert parse_expression(shown(expr)) == expr


@pytest.mark.parametrize(
    ("text", "again"),
    [
        ("a and b or not c", "a && b || !c"),
        ("a - (b - c) - d", "a - (b - c) - d"),
        ("x /* clock */ >= -3 // late", "x >= -3"),
        ("x =< 3, y > 2", "x <= 3 && y > 2"),
        ("forall (i : int[0,3]) a[i] > 0", "forall (i : int [ 0 , 3 ]) a[i] > 0"),
        ("P(1).done imply s.a == f(2, b)", "P(1).done imply s.a == f(2, b)"),
        ("a ? b : c ? d : e", "a ? b : c ? d : e"),
        ("5 - -3", "5 - (-3)"),
    ],
)
def test_words_and_comments_become_signs(text: str, again: str) -> None:
    assert shown(parse_expression(text)) == again


@pytest.mark.parametrize(
    ("text", "again"),
    [
        ("x = 0, n++", "x = 0, n = n + 1"),
        ("a[i] += 2, --b", "a[i] = a[i] + 2, b = b - 1"),
        ("x := y := 3", "y = 3, x = y"),
        ("1", ""),
        ("", ""),
    ],
)
def test_updates_become_plain_assignments(text: str, again: str) -> None:
    assert shown_update(parse_updates(text)) == again


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x' == 0", "the rate of a clock"),
        ("1.5 * a", "the number `1.5`"),
        ("a = b", "an assignment inside an expression"),
        ('"text"', "the text"),
        ("9999999999", "more than 32 bits"),
        ("(a", "`the end` where `)` is expected"),
    ],
)
def test_what_no_format_has_is_named(text: str, words: str) -> None:
    with pytest.raises(UnknownExpression) as caught:
        parse_expression(text)
    assert words in str(caught.value)


def test_functions_with_effects_are_named() -> None:
    with pytest.raises(UnknownExpression, match="the function `reset`"):
        parse_updates("reset(), x = 0")


def test_tchecker_negates_comparisons_and_has_choices() -> None:
    # In UPPAAL, ! binds to the name alone.
    assert shown(parse_expression("!i == 1", tck=True)) == "!(i == 1)"
    assert shown(parse_expression("!i == 1")) == "!i == 1"
    text = "P.x = (if i < 2 && j then 3 else 4); nop; j = 1;"
    assert shown_update(parse_tck_statements(text)) == "P.x = i < 2 && j ? 3 : 4, j = 1"


@settings(max_examples=50, deadline=None)
@given(st.recursive(LEAVES.filter(lambda one: not isinstance(one, Index)), larger, max_leaves=8))
def test_a_value_lies_in_its_interval(expr: Expr) -> None:
    values = dict.fromkeys("abxyz", 3)
    low, high = interval(expr, dict.fromkeys(values, (1, 4)))
    value = evaluated(expr, values)
    assert value is None or low <= value <= high


def evaluated(expr: Expr, values: dict[str, int]) -> int | None:
    """The value of arithmetic and comparisons; ``None`` for the rest."""
    match expr:
        case Number(value):
            return value
        case Name(text):
            return values[text]
        case Binary(operator, left, right):
            first, second = evaluated(left, values), evaluated(right, values)
            if first is None or second is None:
                return None
            if operator in ("/", "%"):
                if second == 0:
                    return None
                quotient = abs(first) // abs(second)
                quotient = quotient if (first < 0) == (second < 0) else -quotient
                return quotient if operator == "/" else first - quotient * second
            results = {
                "+": first + second,
                "-": first - second,
                "*": first * second,
                "<": first < second,
                "==": first == second,
            }
            return int(results[operator]) if operator in results else None
        case Choice(condition, then, other):
            chosen = evaluated(condition, values)
            return None if chosen is None else evaluated(then if chosen else other, values)
    return None


def test_a_guard_tightens_bounds() -> None:
    guard = parse_expression("i < 5 && 2 <= i && j == 3 && x > 1")
    assert under(guard, {"i": (0, 9), "j": (0, 9)}) == {"i": (2, 4), "j": (3, 3)}
