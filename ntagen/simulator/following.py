"""Histories that follow moves: those of a trace, or of a history of another kind.

Moves without times get exact times by a search. It first takes each move as early as it can. If a
later move is not possible then, it lets some moves be later: one of them, then two, and so on
(limited discrepancy search, after Harvey and Ginsberg, 1995). It may give up where there are times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import combinations, product
from typing import Final

from ntagen.checker.play import Window
from ntagen.errors import InputError, ModelError
from ntagen.simulator.courses import Course, matching
from ntagen.simulator.history import History
from ntagen.simulator.network import Network, Parts

_MOST_STEPS_TRIED: Final = 20_000
"""The search for times makes at most so many steps; fewer if there are many processes, whose steps
take longer."""

_FEW_PROCESSES: Final = 5

_MOST_LATE: Final = 3
"""At most so many moves are later than they could be."""

_LATER: Final = tuple(map(Fraction, (1, 2, 3, 5, 8, 13, 21, 34, 55, 89)))
"""By how much a move is made later, if it can be made at any later time."""

Begin = Callable[[], Course]

Timed = tuple[Parts, Fraction | None]
"""A move with the delay before it; ``None`` without exact times."""


def merged(history: History) -> list[Timed]:
    """The moves of a history; waits without a move count for the next one."""
    steps: list[Timed] = []
    waited: Fraction | None = None
    for done in (one.done for one in history.entries):
        if done is None:
            continue
        if done.delay is not None:
            waited = done.delay + (waited or 0)
        if done.parts:
            steps.append((done.parts, waited))
            waited = None
    return steps


def followed(begin: Begin, network: Network, steps: Sequence[Timed]) -> History:
    """The history of a course that takes these moves, with their delays if they have some.

    Raises:
        InputError: A move is not possible.
        ModelError: The model fails in one.
    """
    history = History(begin)
    # Moves may look the same: one of which urgent edges make two parts of time. If the first one
    # does not lead to the end, another one may.
    others: list[tuple[int, list[int]]] = []
    refusal: InputError | None = None
    number = 0
    while number < len(steps):
        parts, delay = steps[number]
        found = matching(history.offer().moves, parts)
        if not found:
            refusal = refusal or InputError(
                f"step {number + 1} is not possible in this model: {network.told(parts)}\n"
                "hint: load a trace of this model, in the version that it was made for"
            )
            if not others:
                raise refusal
            number, found = others.pop()
            history.go(number)
        if len(found) > 1:
            others.append((number, found[1:]))
        try:
            history.do({"move": found[0], "delay": None if delay is None else str(delay)})
        except InputError as error:
            raise InputError(f"step {number + 1}: {error}") from None
        number += 1
    return history


def timed(begin: Begin, network: Network, moves: Sequence[Parts]) -> list[Fraction] | None:
    """Delays with which the moves can be made; ``None`` if none were found.

    Args:
        begin: Makes a course with exact times, in the initial state.
        network: The model's processes.
        moves: The moves.
    """
    most = _MOST_STEPS_TRIED // (1 + len(network.processes) // _FEW_PROCESSES)
    search = _Search(begin, moves, most)
    failed = search.tries({})
    for count in range(1, _MOST_LATE + 1):
        if failed is None or search.is_over:
            break
        failed = search.with_late(count, failed)
    return search.delays if failed is None else None


class _Search:
    """The search; `delays` are those of the last try."""

    def __init__(self, begin: Begin, moves: Sequence[Parts], most: int) -> None:
        self._begin = begin
        self._moves = moves
        self._left = most
        self.delays: list[Fraction] = []

    @property
    def is_over(self) -> bool:
        """Whether no more is tried."""
        return self._left <= 0

    def with_late(self, count: int, failed: int) -> int | None:
        """Tries with so many late moves; the furthest move that was not possible, if any."""
        furthest = failed
        # Most often, one of the last moves before the failure came too early.
        for late in combinations(range(failed - 1, -1, -1), count):
            for how in product(range(len(_LATER)), repeat=count):
                if self.is_over:
                    return furthest
                at = self.tries(dict(zip(late, how, strict=True)))
                if at is None:
                    return None
                furthest = max(furthest, at)
        return furthest

    def tries(self, late: Mapping[int, int]) -> int | None:
        """Makes the moves; the index of the first that is not possible."""
        course = self._begin()
        self.delays = []
        for number, parts in enumerate(self._moves):
            self._left -= 1
            try:
                moves = course.offer().moves
                found = matching(moves, parts)
                if not found:
                    return number
                delay = _delay(moves[found[0]].windows or (), late.get(number))
                if delay is None:
                    return number
                course.do({"move": found[0], "delay": str(delay)})
            except (InputError, ModelError):
                return number
            self.delays.append(delay)
        return None


def _delay(windows: Sequence[Window], late: int | None) -> Fraction | None:
    """The first delay, or a later one; ``None`` if there are no more of these."""
    if late is None:
        return windows[0].soon()
    candidates = list(_later(windows))
    return candidates[late] if late < len(candidates) else None


def _later(windows: Sequence[Window]) -> Iterator[Fraction]:
    first = windows[0].soon()
    ends = {one.last for one in windows if one.last is not None and one.last in one}
    starts = {one.soon() for one in windows}
    some = {first + more for more in _LATER if any(first + more in one for one in windows)}
    # The ends come first: a move as late as can be is the most different one.
    yield from sorted(ends - {first}, reverse=True)
    yield from sorted((starts | some) - ends - {first})
