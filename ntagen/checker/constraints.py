"""Constraints on clocks, such as ``x-y <= 3``, as exact zones over the clocks that are drawn."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from fractions import Fraction
from itertools import product
from math import lcm
from typing import Final

from ntagen.checker.picture.halves import Axes, Half

_CONSTRAINT: Final = re.compile(r"(.+?) (<=|<|>=|>|==) (-?[0-9]+)")

_ROOM: Final = Fraction(3, 20)
"""The part of an axis beyond the greatest constant."""

_SAME_SCALE: Final = 3
"""Both axes have one scale, unless one is this many times longer."""

Bound = tuple[Fraction, bool]
"""A bound, and whether it is strict."""


def bounds_of(zone: Sequence[str], clocks: Collection[str]) -> dict[tuple[str, str], Bound]:
    """The constraints of a zone as bounds on differences; the empty name is the number 0."""
    found: dict[tuple[str, str], Bound] = {}
    clocks = set(clocks)
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


def _difference(text: str, clocks: Collection[str]) -> tuple[str, str]:
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
    closed = _closed(bounds, sorted(names))
    if closed is None:
        return ()
    along = {"": (0, 0), drawn[0]: (1, 0)} | ({} if drawn[1] is None else {drawn[1]: (0, 1)})
    halves = []
    for left, right in product(along, repeat=2):
        if left != right and (bound := closed(left, right)) is not None:
            (a, b), (c, d) = along[left], along[right]
            halves.append(Half(a - c, b - d, *bound))
    return tuple(halves)


def _closed(
    bounds: Mapping[tuple[str, str], Bound], names: Sequence[str]
) -> Callable[[str, str], Bound | None] | None:
    """Tightens bounds by the algorithm of Floyd and Warshall, all at a time for a clock between.

    A bound is a whole number: twice its value in the unit of all values, and one more if it is not
    strict.

    Returns:
        The tightest bound on the difference of two clocks, ``None`` for none; or ``None`` if the
        zone is empty.
    """
    # Imported here: few need it, and it takes a tenth of a second.
    import numpy as np

    at = {name: number for number, name in enumerate(names)}
    unit = lcm(*(value.denominator for value, _ in bounds.values()))
    whole = {pair: 2 * int(one * unit) + (not strict) for pair, (one, strict) in bounds.items()}
    # More than any sum of bounds. Numbers that 64 bits do not hold are those of Python.
    no_bound = 4 * (len(names) + 1) * (max(map(abs, whole.values()), default=0) + 1)
    matrix = np.full((len(names), len(names)), no_bound, np.int64 if no_bound < 2**61 else object)
    np.fill_diagonal(matrix, 1)
    for (left, right), bound in whole.items():
        matrix[at[left], at[right]] = min(matrix[at[left], at[right]], bound)
    for over in range(len(names)):
        first, second = matrix[:, over, None], matrix[None, over, :]
        sums = (first & ~1) + (second & ~1) + (first & second & 1)
        sums[(first == no_bound) | (second == no_bound)] = no_bound
        np.minimum(matrix, sums, out=matrix)
    if (matrix.diagonal() < 1).any():
        return None

    def between(left: str, right: str) -> Bound | None:
        found = int(matrix[at[left], at[right]])
        return None if found == no_bound else (Fraction(found >> 1, unit), not found & 1)

    return between


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
