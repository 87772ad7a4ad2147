"""Traces in UPPAAL's format ``.xtr``: numbers, which the compiled form (``.if``) explains.

A state is three blocks that end with a line ``.``: the locations; the constraints of the zone,
each with a ``.`` of its own; the values of the variables. The first state comes first. Then each
transition comes *after* the state that it leads to. A last ``.`` ends the trace. A constraint
``i j b`` says that clock i minus clock j is at most b / 2, or less than (b - 1) / 2 if b is odd.
The constraints are the fewest that make the zone.

Source of the fewest constraints: K. G. Larsen, F. Larsson, P. Pettersson, W. Yi, "Efficient
Verification of Real-Time Systems: Compact Data Structure and State-Space Reduction", RTSS 1997,
section 3. Here "clocks are not negative" is a constraint like any other, because UPPAAL writes it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ntagen.verifyta.trace import Matrix, Part, State, Trace, numbered

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model

_Bound = tuple[int, bool] | None


def _xtr(trace: Trace) -> Iterator[str]:
    """The file in pieces."""
    yield _state(trace.states[0])
    for state, transition in zip(trace.states[1:], trace.transitions, strict=True):
        yield _state(state)
        yield "".join(_part(part) for part in transition) + ".\n"
    yield ".\n"


def xtr_text(model: Model, answer: Answer) -> str | None:
    """The first trace of an answer as the text of a file; ``None`` if it has none."""
    found = numbered(model, answer)
    return None if found is None else "".join(_xtr(found[1]))


def _state(state: State) -> str:
    lines = [_numbers(state.locations), "."]
    for left, right, (value, is_strict) in fewest_constraints(state.zone):
        lines += [f"{left} {right} {2 * value + is_strict}", "."]
    lines += [".", _numbers(state.values), "."]
    return "".join(f"{line}\n" for line in lines)


def _numbers(numbers: tuple[int, ...]) -> str:
    return "".join(f"{number} " for number in numbers)


def _part(part: Part) -> str:
    return f"{part.process} {part.edge} {_numbers(part.select)}; "


def fewest_constraints(zone: Matrix) -> Iterator[tuple[int, int, tuple[int, bool]]]:
    """The fewest entries of a closed matrix that give it back by closing: row, column, bound."""
    clocks = range(len(zone))
    classes: dict[int, list[int]] = {}
    for clock in clocks:
        tied = (first for first in classes if _is_tied(zone, first, clock))
        classes.setdefault(next(tied, clock), []).append(clock)
    successors: dict[int, int] = {}
    for members in classes.values():
        if len(members) > 1:
            successors |= dict(zip(members, [*members[1:], members[0]], strict=True))
    for left in clocks:
        for right in clocks:
            bound = zone[left][right]
            if left == right or bound is None:
                continue
            is_between = left in classes and right in classes
            if successors.get(left) == right or (
                is_between and not _is_implied(zone, left, right, bound, classes)
            ):
                yield left, right, bound


def _is_tied(zone: Matrix, left: int, right: int) -> bool:
    """Whether two clocks have a fixed distance."""
    return _sum(zone[left][right], zone[right][left]) == (0, False)


def _is_implied(
    zone: Matrix, left: int, right: int, bound: tuple[int, bool], between: dict[int, list[int]]
) -> bool:
    """Whether a bound is the sum of two others by way of one of these clocks."""
    for via in between:
        if via not in (left, right):
            way = _sum(zone[left][via], zone[via][right])
            if way is not None and _key(way) <= _key(bound):
                return True
    return False


def _sum(one: _Bound, other: _Bound) -> _Bound:
    if one is None or other is None:
        return None
    return one[0] + other[0], one[1] or other[1]


def _key(bound: tuple[int, bool]) -> tuple[int, bool]:
    """Bounds in their order: the tightest first."""
    return bound[0], not bound[1]
