"""Constraints on clocks, such as ``x-y <= 3``, as exact zones over the clocks that are drawn."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import product
from typing import Final

from ntagen.checker.picture.halves import Axes, Half

_CONSTRAINT: Final = re.compile(r"(.+?) (<=|<|>=|>|==) (-?[0-9]+)")

_ROOM: Final = Fraction(3, 20)
"""The part of an axis beyond the greatest constant."""

_SAME_SCALE: Final = 3
"""Both axes have one scale, unless one is this many times longer."""

Bound = tuple[Fraction, bool]
"""A bound, and whether it is strict."""


def bounds_of(zone: Sequence[str], clocks: Sequence[str]) -> dict[tuple[str, str], Bound]:
    """The constraints of a zone as bounds on differences; the empty name is the number 0."""
    found: dict[tuple[str, str], Bound] = {}
    for text in zone:
        match = _CONSTRAINT.fullmatch(text)
        if match is None:
            raise ValueError(f"not a constraint on clocks: {text}")
        left, right = _difference(match[1], clocks)
        value, strict = Fraction(match[3]), match[2] in ("<", ">")
        if match[2] != ">" and match[2] != ">=":
            _tighten(found, (left, right), (value, strict))
        if match[2] not in ("<", "<="):
            _tighten(found, (right, left), (-value, strict))
    return found


def _difference(text: str, clocks: Sequence[str]) -> tuple[str, str]:
    """The clocks of ``x`` or ``x-y``; names may contain a minus: ``Train(-1).x``."""
    if text in clocks:
        return text, ""
    for at, character in enumerate(text):
        if character == "-" and text[:at] in clocks and text[at + 1 :] in clocks:
            return text[:at], text[at + 1 :]
    raise ValueError(f"not a difference of clocks: {text}")


def _tighten(bounds: dict[tuple[str, str], Bound], pair: tuple[str, str], bound: Bound) -> None:
    """Keeps the smaller bound; of equal ones the strict one."""
    old = bounds.get(pair)
    if old is None or (bound[0], not bound[1]) < (old[0], not old[1]):
        bounds[pair] = bound


def halves_of(
    zone: Mapping[tuple[str, str], Bound],
    drawn: tuple[str, str | None],
    fixed: Mapping[str, Fraction],
) -> tuple[Half, ...]:
    """The zone on the axes: with the fixed clocks at their values, and without all others.

    Returns:
        All bounds on the axes, none of which can be tightened; none if nothing is left of the zone.
    """
    bounds = dict(zone)
    for clock, value in fixed.items():
        _tighten(bounds, (clock, ""), (value, False))
        _tighten(bounds, ("", clock), (-value, False))
    names = {name for pair in bounds for name in pair} | {name for name in drawn if name} | {""}
    for name in names - {""}:
        _tighten(bounds, ("", name), (Fraction(0), False))
    # Closed by the algorithm of Floyd and Warshall, all rows but those of the axes can go.
    for over, left, right in product(names, repeat=3):
        first, second = bounds.get((left, over)), bounds.get((over, right))
        if first is not None and second is not None:
            _tighten(bounds, (left, right), (first[0] + second[0], first[1] or second[1]))
    along = {"": (0, 0), drawn[0]: (1, 0)} | ({} if drawn[1] is None else {drawn[1]: (0, 1)})
    halves = []
    for (left, right), (value, strict) in bounds.items():
        if left == right and (value < 0 or (value == 0 and strict)):
            return ()
        if left != right and left in along and right in along:
            (a, b), (c, d) = along[left], along[right]
            halves.append(Half(a - c, b - d, value, strict))
    return tuple(halves)


def axes_around(halves: Sequence[Half], x: str, y: str | None) -> Axes:
    """Axes that show all constants of zones, and a little more."""
    longest = {
        axis: max(
            (abs(half.bound) for half in halves if (half.along_x, half.along_y)[axis]),
            default=Fraction(0),
        )
        for axis in (0, 1)
    }
    ends = [longest[axis] * (1 + _ROOM) or Fraction(1) for axis in (0, 1)]
    if y is None:
        ends[1] = Fraction(1)
    elif max(ends) <= _SAME_SCALE * min(ends):
        ends = [max(ends)] * 2
    return Axes(x, y, *ends)
