"""How the value of learned strategies changed from iteration to iteration, as a chart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Final

import matplotlib as mpl

from ntagen.checker.picture.chart import BAND, BLUE, DARK, SERIES, picture, tiled
from ntagen.checker.picture.figure import CHART_STYLE

if TYPE_CHECKING:
    from ntagen.checker.picture.page import Svg

_SIZE: Final = (640, 285)
_UNIFORM: Final = SERIES[1]
_ANSWER: Final = SERIES[2]


@dataclass(frozen=True, slots=True)
class Point:
    """What an iteration came to.

    Attributes:
        runs: How many runs were made until its end.
        resets: How often all had been forgotten before.
        value: The value of its strategy.
        error: The standard error of the value.
    """

    runs: int
    resets: int
    value: float
    error: float


@dataclass(frozen=True, slots=True)
class Level:
    """A value with the ends of its interval, as far as they are known."""

    value: float
    lower: float | None
    upper: float | None


@mpl.rc_context(CHART_STYLE)
def learning_picture(
    points: Sequence[Point],
    answer: Level | None,
    uniform: Level | None,
    *,
    maximises: bool,
    heading: str,
) -> Svg:
    """Draws what iterations came to.

    Args:
        points: The iterations, in their order; there is one at least.
        answer: What the best strategy is worth, by runs that learning has not seen.
        uniform: What runs are worth in which all is chosen uniformly.
        maximises: Whether the greatest value is the best.
        heading: The heading.
    """
    runs, values = [one.runs for one in points], [one.value for one in points]
    best = list(accumulate(values, max if maximises else min))
    count = "1 iteration" if len(points) == 1 else f"{len(points)} iterations"
    figure, (plane,) = tiled(heading, _SIZE, 1, 1)
    plane.set_title(f"{count}, {runs[-1]:,} runs", pad=6.0, color="#404040")
    plane.set_xlabel("runs made until then")
    plane.set_ylabel("value")
    plane.xaxis.set_major_formatter("{x:,.0f}")
    plane.errorbar(
        runs,
        values,
        [one.error for one in points],
        fmt="o",
        color=BLUE,
        markersize=4.0,
        elinewidth=1.0,
        capsize=2.5,
        label="the strategy of an iteration, with its standard error",
    )
    plane.step(runs, best, where="post", color=DARK, linewidth=1.4, label="the best one until then")
    for number, (before, after) in enumerate(pairwise(points)):
        if after.resets > before.resets:
            middle = (before.runs + after.runs) / 2.0
            label = "" if any(one.resets for one in points[: number + 1]) else "all was forgotten"
            plane.axvline(
                middle, color="#5a6270", linewidth=0.9, linestyle=":", label=label or None
            )
    for level, color, label in (
        (answer, _ANSWER, "the answer, by runs that learning has not seen"),
        (uniform, _UNIFORM, "the uniform choice"),
    ):
        if level is None:
            continue
        plane.axhline(level.value, color=color, linewidth=1.2, linestyle="--", label=label)
        if level.lower is not None and level.upper is not None:
            plane.axhspan(level.lower, level.upper, color=color, alpha=BAND, linewidth=0.0)
    plane.margins(x=0.03, y=0.08)
    plane.set_xlim(left=0.0)
    return picture(figure)
