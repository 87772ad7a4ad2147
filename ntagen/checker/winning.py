"""What a strategy does over two clocks, in one state, as a picture.

Decisions name their zones by constraints, such as ``x-y <= 3``. A clock that is not drawn either
has a value, then the picture is the plane at that value, or it has none, then it is the shadow of
the zones: what is done for some value of that clock. Both are exact: a zone is closed as a
difference bound matrix, and its rows of other clocks are left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from itertools import product
from typing import Final

from ntagen.checker.decisions import StrategyState
from ntagen.checker.picture.page import WAIT, Svg
from ntagen.checker.picture.zones import Area, Axes, Half, zones_picture
from ntagen.errors import InputError

_CONSTRAINT: Final = re.compile(r"(.+?) (<=|<|>=|>|==) (-?[0-9]+)")

_ROOM: Final = Fraction(3, 20)
"""The part of an axis beyond the greatest constant."""

_SAME_SCALE: Final = 3
"""Both axes have one scale, unless one is this many times longer."""

Bound = tuple[Fraction, bool]
"""A bound, and whether it is strict."""


def zones_chart(
    state: StrategyState,
    clocks: Sequence[str],
    drawn: tuple[str | None, str | None],
    values: Mapping[str, Fraction],
    *,
    owner: str,
    is_permissive: bool,
) -> Svg:
    """See `ntagen.checker.strategy.Strategy.zones`.

    Args:
        state: The decisions.
        clocks: All clocks of the strategy, in the order of the model.
        drawn: The clocks of the axes, as far as they were chosen.
        values: The values of other clocks.
        owner: Whose strategy it is.
        is_permissive: Whether all decisions that apply are allowed.
    """
    zones = [[_bounds(zone, clocks) for zone in one.zones] for one in state.decisions]
    named = {clock for found in zones for zone in found for pair in zone for clock in pair if clock}
    x, y = _chosen(clocks, drawn, named)
    rest = [clock for clock in clocks if clock in named and clock not in (x, y)]
    fixed = {clock: values[clock] for clock in rest if clock in values}
    areas = [
        Area(
            ", ".join(map(str, decision.edges)) or WAIT,
            tuple(filter(None, (_halves(zone, (x, y), fixed) for zone in found))),
            f"{decision}; rank {decision.rank}" if decision.rank else str(decision),
        )
        for decision, found in zip(state.decisions, zones, strict=True)
    ]
    if state.is_goal:
        whole = _halves({}, (x, y), {})
        areas = [Area("nothing: play is over, and won", (whole,), "the goal holds here")]
    free = [clock for clock in rest if clock not in fixed]
    places = " ".join(f"{process}.{place}" for process, place in state.locations.items())
    variables = "".join(f" {name}={value}" for name, value in state.variables.items())
    return zones_picture(
        areas,
        _axes(areas, x, y),
        f"What the {owner} does in ( {places} ){variables}",
        _notes(areas, fixed, free, is_permissive=is_permissive),
        striped=is_permissive or bool(free),
    )


def _notes(
    areas: Sequence[Area],
    fixed: Mapping[str, Fraction],
    free: Sequence[str],
    *,
    is_permissive: bool,
) -> list[str]:
    notes: list[str] = []
    if fixed:
        notes.append("where " + ", ".join(f"{clock} = {value}" for clock, value in fixed.items()))
    if free:
        some = "some value" if len(free) == 1 else "some values"
        notes.append(f"for {some} of {', '.join(free)}; give values to see a plane")
    if is_permissive:
        notes.append("where areas overlap, the strategy allows all of them")
    if not any(area.zones for area in areas):
        notes.append("there is no decision here" if fixed else "there is no decision in this state")
    notes.append(
        "blank: no decision; play does not get there, or its owner does not win from there"
    )
    return notes


def _chosen(
    clocks: Sequence[str], drawn: tuple[str | None, str | None], named: Iterable[str]
) -> tuple[str, str | None]:
    """The clocks of both axes; those of the decisions first, unless they are chosen."""
    if not clocks:
        raise InputError("the model has no clocks, so there are no zones to draw")
    for clock in drawn:
        if clock is not None and clock not in clocks:
            raise InputError(f"the strategy has no clock {clock}\n{_clocks_hint(clocks)}")
    if drawn[0] is not None and drawn[0] == drawn[1]:
        raise InputError(
            f"both axes are the clock {drawn[0]}\nhint: choose two clocks, or one and no second"
        )
    order = sorted(clocks, key=lambda clock: clock not in set(named))
    left = [clock for clock in order if clock not in drawn]
    x = drawn[0] if drawn[0] is not None else left.pop(0)
    y = drawn[1] if drawn[1] is not None else next(iter(left), None)
    return x, y


def _clocks_hint(clocks: Sequence[str]) -> str:
    return f"hint: the clocks are {', '.join(clocks)}"


def _bounds(zone: Sequence[str], clocks: Sequence[str]) -> dict[tuple[str, str], Bound]:
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


def _halves(
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


def _axes(areas: Sequence[Area], x: str, y: str | None) -> Axes:
    """Axes that show all constants, and a little more."""
    halves = [half for area in areas for zone in area.zones for half in zone]
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
