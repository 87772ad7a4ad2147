"""Curves over time as shapes of SVG: where lines, ticks and their numbers are, in pixels.

The page draws them in its own colours, so that they are readable in the light and in the dark.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

WIDTH: Final = 900
HEIGHT: Final = 190
LEFT: Final = 62
RIGHT: Final = WIDTH - 14
TOP: Final = 26
BOTTOM: Final = HEIGHT - 36
"""The size of a chart, and where the frame of its curve is, in pixels."""

_MOST_TICKS: Final = 9
_MOST_LEVELS: Final = 5
_STEPS: Final = (1.0, 2.0, 5.0, 10.0)

_LONGEST_S: Final = 2.0
"""Pieces of a push, rolls and syntheses take less; pulling back, without a look, takes more."""

_MOST_POINTS: Final = 1200
"""A curve with more points is thinned: more are not seen on a page."""


@dataclass(frozen=True, slots=True)
class Tick:
    """A tick: its place along its axis, in pixels, and its number."""

    at: float
    text: str


@dataclass(frozen=True, slots=True)
class Chart:
    """A curve over time.

    Attributes:
        name: What is shown, with its unit.
        about: The same in a sentence, for readers who do not see it.
        path: The curve, as the steps of an SVG path.
        times: The ticks of the time.
        levels: The ticks of the value.
        marks: Where the needle was stopped, along the time.
        limit: The height of the limit of the value; None without one.
        limit_text: What it is.
    """

    name: str
    about: str
    path: str
    times: tuple[Tick, ...]
    levels: tuple[Tick, ...]
    marks: tuple[float, ...]
    limit: float | None = None
    limit_text: str = ""


@dataclass(frozen=True, slots=True)
class Curve:
    """What a chart shows.

    Attributes:
        name: The value in words.
        unit: Its unit.
        times_s: When it was measured.
        values: What was measured then.
        longest_s: The curve has a gap where nothing was measured for longer than this.
        limit: A limit of the value; None without one.
        limit_text: What it is.
    """

    name: str
    unit: str
    times_s: Sequence[float]
    values: Sequence[float]
    longest_s: float = _LONGEST_S
    limit: float | None = None
    limit_text: str = ""


def chart_of(curve: Curve, end_s: float, marks_s: Iterable[float]) -> Chart:
    """The chart of a curve from the time 0 to the end of a run.

    Args:
        curve: The curve, with one point at least.
        end_s: The end of the time.
        marks_s: Times at which something happened.
    """
    shown = [*curve.values, 0.0] + ([] if curve.limit is None else [curve.limit])
    levels = ticks(min(shown), max(shown), _MOST_LEVELS)
    low, high = min(levels[0], *shown), max(levels[-1], *shown)
    end_s = max(end_s, 1e-3)
    moments = ticks(0.0, end_s, _MOST_TICKS)

    def across(time_s: float) -> float:
        part = min(1.0, max(0.0, time_s / end_s))
        return round(LEFT + part * (RIGHT - LEFT), 1)

    def up(value: float) -> float:
        part = (value - low) / (high - low)
        return round(BOTTOM - part * (BOTTOM - TOP), 1)

    points = thinned(list(zip(curve.times_s, curve.values, strict=True)), _MOST_POINTS)
    # Thinned points are farther apart.
    longest_s = max(curve.longest_s, 3.0 * end_s / max(1, len(points)))
    before_s, steps = -math.inf, list[str]()
    for time_s, value in points:
        letter = "M" if not steps or time_s - before_s > longest_s else "L"
        steps.append(f"{letter}{across(time_s):g} {up(value):g}")
        before_s = time_s
    greatest = max(curve.values)
    return Chart(
        name=f"{curve.name} [{curve.unit}]",
        about=f"{curve.name} over time; the greatest is {greatest:.3g} {curve.unit}",
        path=" ".join(steps),
        times=tuple(Tick(across(one), f"{one:g}") for one in moments if one <= end_s),
        levels=tuple(Tick(up(one), f"{one:g}") for one in levels),
        marks=tuple(sorted({across(one) for one in marks_s})),
        limit=None if curve.limit is None else up(curve.limit),
        limit_text=curve.limit_text,
    )


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers from one at most `low` to one at least `high`, about `most` at most."""
    span = max(high - low, 1e-9)
    rough = span / (most - 1)
    size = 10.0 ** math.floor(math.log10(rough))
    step = next(size * one for one in _STEPS if size * one >= rough * (1.0 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    # Multiples of a step such as 0.1 are not exact.
    return [round(number * step, 12) + 0.0 for number in range(first, max(last, first + 1) + 1)]


def thinned(points: list[tuple[float, float]], most: int) -> list[tuple[float, float]]:
    """At most about `most` points: of each group of neighbours the least and the greatest value."""
    if len(points) <= most:
        return points
    size = math.ceil(2.0 * len(points) / most)
    kept = []
    for start in range(0, len(points), size):
        group = points[start : start + size]
        ends = {min(group, key=lambda one: one[1]), max(group, key=lambda one: one[1])}
        kept += sorted(ends)
    return kept
