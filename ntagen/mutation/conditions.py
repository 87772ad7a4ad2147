"""Guards and invariants as tokens: what comparisons they have, and how these are changed.

Only what is sure is changed: a comparison ends at a connective, a comma or a bracket around it, and
its right side gets brackets before a number is added. Whether a changed text has a meaning, the
engine decides.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

_TOKEN: Final = re.compile(
    r"//[^\n]*|/\*.*?\*/|\s+|[A-Za-z_]\w*|\d+(?:\.\d+)?|<\?=?|>\?=?|<<=?|>>=?|<=|>=|==|!=|&&|\|\||->"
    r"|:=|.",
    re.DOTALL,
)
_COMPARISONS: Final = ("<", "<=", ">", ">=", "==", "!=")
_ENDS: Final = (*_COMPARISONS, "&&", "||", "and", "or", "imply", "not", "!", ",", ";", "?", ":")
_OPPOSITE: Final = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
_PAIRS: Final = {")": "(", "]": "[", "}": "{"}


@dataclass(frozen=True, slots=True)
class Comparison:
    """A comparison in a text.

    Attributes:
        left: Where its left side is: start and end.
        sign: Where its sign is.
        right: Where its right side is.
    """

    left: tuple[int, int]
    sign: tuple[int, int]
    right: tuple[int, int]


def comparisons(text: str) -> list[Comparison]:
    """The comparisons in a text, from left to right."""
    tokens = [(one[0], one.start(), one.end()) for one in _TOKEN.finditer(text)]
    tokens = [one for one in tokens if not re.match(r"\s|//|/\*", one[0])]
    found = []
    for index, (sign, start, end) in enumerate(tokens):
        if sign not in _COMPARISONS:
            continue
        first, last = _reach(tokens, index, -1), _reach(tokens, index, 1)
        if first == index or last == index:
            continue
        left, right = (tokens[first][1], tokens[index - 1][2]), (end, tokens[last][2])
        right = (tokens[index + 1][1], right[1])
        # The rate of a clock, x' == 0, is no bound; a chain of comparisons has no sure sides.
        is_rate = text[slice(*left)].endswith("'")
        neighbours = {tokens[i][0] for i in (first - 1, last + 1) if 0 <= i < len(tokens)}
        if not is_rate and not neighbours & {*_COMPARISONS, "?"}:
            found.append(Comparison(left, (start, end), right))
    return found


def _reach(tokens: list[tuple[str, int, int]], index: int, step: int) -> int:
    """How far a side goes from the sign: to what ends it, at the same depth of brackets."""
    opening = set(_PAIRS.values()) if step > 0 else set(_PAIRS)
    closing = set(_PAIRS) if step > 0 else set(_PAIRS.values())
    depth, at = 0, index
    while 0 <= at + step < len(tokens):
        token = tokens[at + step][0]
        if depth == 0 and (token in closing or token in _ENDS):
            break
        depth += (token in opening) - (token in closing)
        at += step
    return at


def with_sign(text: str, one: Comparison, sign: str) -> str:
    """The text with another sign in a comparison."""
    start, end = one.sign
    return text[:start] + sign + text[end:]


def with_bound(text: str, one: Comparison, change: int, clocks: Collection[str]) -> str:
    """The text with a bound that is greater by `change`: the side that is no clock."""
    right = text[slice(*one.right)]
    side = one.left if re.sub(r"\[.*\]", "", right).strip() in clocks else one.right
    old = text[slice(*side)]
    if re.fullmatch(r"\d+", old):
        new = str(int(old) + change) if int(old) + change >= 0 else f"({old} - {-change})"
    else:
        new = f"({old}) {'+' if change > 0 else '-'} {abs(change)}"
    return text[: side[0]] + new + text[side[1] :]


def parts(text: str, *signs: str) -> list[str]:
    """The parts of a text between these signs, outside of all brackets."""
    found, start, depth = [], 0, 0
    for one in _TOKEN.finditer(text):
        depth += (one[0] in _PAIRS.values()) - (one[0] in _PAIRS)
        if depth == 0 and one[0] in signs:
            found.append(text[start : one.start()])
            start = one.end()
    return [*found, text[start:]]


def without_comments(text: str) -> str:
    """The text with a space for each comment."""
    return "".join(" " if one[0][:2] in ("//", "/*") else one[0] for one in _TOKEN.finditer(text))


def negations(guard: str, clocks: Collection[str]) -> list[str]:
    """Guards that together are the opposite of a guard: what they allow, it forbids.

    Conditions of clocks cannot be negated as a whole in UPPAAL, so a conjunction has a guard for
    each of its parts: those before it hold, and it does not.
    """
    guard = without_comments(guard).strip()
    if len(parts(guard, "||", "or", "imply", "?")) > 1:
        return [f"!({guard})"]
    conjuncts = [part.strip() for part in parts(guard, "&&", "and", ",")]
    found = []
    for index, part in enumerate(conjuncts):
        for opposite in _opposites(part, clocks):
            found.append(" && ".join([*conjuncts[:index], opposite]))
    return found


def _opposites(part: str, clocks: Collection[str]) -> list[str]:
    known = comparisons(part)
    if re.match(r"(forall|exists|sum)\b", part):
        return [f"!({part})"]
    if len(known) != 1 or (known[0].left[0], known[0].right[1]) != (0, len(part)):
        return [f"!({part})"]
    sign = part[slice(*known[0].sign)]
    names = set(re.findall(r"[A-Za-z_]\w*", part))
    if sign == "==" and names & set(clocks):
        return [with_sign(part, known[0], "<"), with_sign(part, known[0], ">")]
    return [with_sign(part, known[0], _OPPOSITE[sign])]


def other_signs(sign: str) -> tuple[str, ...]:
    """The signs that a sign is replaced by: the one that differs in the bound, and the opposite."""
    strict = {"<": ("<=",), "<=": ("<",), ">": (">=",), ">=": (">",)}
    return (*strict.get(sign, ()), _OPPOSITE[sign])
