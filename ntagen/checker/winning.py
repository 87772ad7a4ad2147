"""What a strategy does over two clocks, in one state, as a picture.

Decisions name their zones by constraints, such as ``x-y <= 3``. A clock that is not drawn either
has a value, then the picture is the plane at that value, or it has none, then it is the shadow of
the zones: what is done for some value of that clock. Both are exact: a zone is closed as a
difference bound matrix, and its rows of other clocks are left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

from ntagen.checker.constraints import axes_around, bounds_of, halves_of
from ntagen.checker.decisions import StrategyState
from ntagen.checker.picture.page import WAIT, Svg
from ntagen.checker.picture.zones import Area, zones_picture
from ntagen.errors import InputError


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
    zones = [[bounds_of(zone, clocks) for zone in one.zones] for one in state.decisions]
    named = {clock for found in zones for zone in found for pair in zone for clock in pair if clock}
    x, y = _chosen(clocks, drawn, named)
    rest = [clock for clock in clocks if clock in named and clock not in (x, y)]
    fixed = {clock: values[clock] for clock in rest if clock in values}
    areas = [
        Area(
            ", ".join(map(str, decision.edges)) or WAIT,
            tuple(filter(None, (halves_of(zone, (x, y), fixed) for zone in found))),
            f"{decision}; rank {decision.rank}" if decision.rank else str(decision),
        )
        for decision, found in zip(state.decisions, zones, strict=True)
    ]
    if state.is_goal:
        whole = halves_of({}, (x, y), {})
        areas = [Area("nothing: play is over, and won", (whole,), "the goal holds here")]
    free = [clock for clock in rest if clock not in fixed]
    places = " ".join(f"{process}.{place}" for process, place in state.locations.items())
    variables = "".join(f" {name}={value}" for name, value in state.variables.items())
    return zones_picture(
        areas,
        axes_around([half for area in areas for zone in area.zones for half in zone], x, y),
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
