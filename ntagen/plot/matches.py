"""The picture of matched traces: one row each, in the frame of the match's start.

The first two columns show the trace and the plan's path along the first heading, seen onto the
first bend plane and from its side, both with the same scale on all axes. The third one shows the
deviation over the depth, with the rolls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ntagen.needle.path import sample_poses
from ntagen.needle.vectors import cross, scale
from ntagen.plan.actions import Plan, Push
from ntagen.plot.colours import MEASURED, NEEDLE, OTHER
from ntagen.plot.picture import add_legend
from ntagen.scene import Pose, Vector
from ntagen.shapes import vector_of
from ntagen.traces.matching import Match
from ntagen.traces.prediction import Prediction
from ntagen.units import deg_from_rad

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_ROWS: Final = 24
"""More rows are too many for one picture."""

_SPACING_MM: Final = 0.5
_DASHES: Final = ((0, (1, 1.5)), (0, (4, 2)), (0, (8, 2)))


@dataclass(frozen=True, slots=True)
class MatchRow:
    """What a row of the picture shows.

    Attributes:
        name: The name of the trace.
        match: Its match.
        predictions: Predictions from first parts of it.
    """

    name: str
    match: Match
    predictions: Sequence[Prediction] = ()


def draw_matches(rows: Sequence[MatchRow], title: str) -> Figure:
    """The figure; the caller saves it (`ntagen.plot.save`)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 0.7 + 3.1 * len(rows)), dpi=130, layout="constrained")
    grid = figure.subplots(len(rows), 3, squeeze=False, width_ratios=(1.0, 1.0, 1.1))
    for axes, row in zip(grid, rows, strict=True):
        _draw_row(axes, row)
    add_legend(figure, grid[:, 0], place="outside lower center")
    figure.suptitle(title, fontsize=11)
    return figure


def _draw_row(axes: Any, row: MatchRow) -> None:  # noqa: ANN401  matplotlib leaves axes open
    match, start = row.match, row.match.needle.tip
    measured = _local(start, [vector_of(point) for point in match.trace.points_mm])
    path = _local(start, _curve(match, match.plan))
    turns = _local(start, [arc.start.position_mm for arc in match.plan.arcs(match.needle)[1:]])
    predicted = [_local(start, _predicted(one)) for one in row.predictions]
    for one, across, label in ((axes[0], 1, "to the first bend"), (axes[1], 2, "aside from it")):
        one.plot(measured[:, 0], measured[:, across], ".", color=MEASURED, ms=4, label="measured")
        one.plot(path[:, 0], path[:, across], color=NEEDLE, lw=1.4, label="plan's path")
        one.plot(turns[:, 0], turns[:, across], "o", color=NEEDLE, mfc="white", ms=6, label="roll")
        for curve, prediction, dash in zip(predicted, row.predictions, _DASHES, strict=False):
            text = f"predicted from {prediction.from_mm:g} mm"
            one.plot(curve[:, 0], curve[:, across], color=OTHER, lw=1.3, ls=dash, label=text)
        one.set_aspect("equal", adjustable="datalim")
        one.set_xlabel("along the first heading [mm]", fontsize=8)
        one.set_ylabel(f"{label} [mm]", fontsize=8)
    axes[0].set_title(f"{row.name}, radius {match.needle.radius_mm:.4g} mm", fontsize=9)
    rolls = match.rolls_in_words
    axes[1].set_title(f"rolls: {rolls}" if rolls else "no roll", fontsize=9)
    _draw_deviation(axes[2], match)
    for one in axes:
        one.grid(True, color="#e6e8ec", linewidth=0.6)
        one.set_axisbelow(True)
        one.tick_params(labelsize=8)


def _draw_deviation(axes: Any, match: Match) -> None:  # noqa: ANN401
    axes.plot(match.at_mm, match.distances_mm, ".-", color=MEASURED, lw=0.6, ms=4)
    axes.axhline(match.avg_mm, color=NEEDLE, lw=1.0)
    top = 1.15 * max(match.max_mm, 1e-3)
    for depth_mm, angle_rad in match.rolls:
        axes.axvline(depth_mm, color=OTHER, lw=1.0, ls="--")
        text = f" roll {deg_from_rad(angle_rad):.4g} deg"
        axes.text(depth_mm, 0.97 * top, text, fontsize=7, va="top", rotation=90, ha="right")
    axes.set_ylim(0.0, top)
    axes.set_xlabel("depth [mm]", fontsize=8)
    axes.set_ylabel("deviation [mm]", fontsize=8)
    numbers = f"{match.min_mm:.2f}, {match.avg_mm:.2f}, {match.max_mm:.2f} mm"
    axes.set_title(f"deviation (min, avg, max): {numbers}", fontsize=9)


def _curve(match: Match, plan: Plan) -> list[Vector]:
    return [pose.position_mm for pose in sample_poses(plan.arcs(match.needle), _SPACING_MM)]


def _predicted(prediction: Prediction) -> list[Vector]:
    """The predicted path as far as there is something to compare it with."""
    match = prediction.match
    ahead_mm = max((one.ahead_mm for one in prediction.ahead), default=0.0)
    longer = Plan.of([*match.plan.actions, Push(ahead_mm)])
    return _curve(match, longer)


def _local(start: Pose, points: Sequence[Vector]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Points along the heading, towards the centre of the first arc, and across both."""
    axes = (start.heading, scale(-1.0, start.bevel), cross(start.heading, start.bevel))
    return np.asarray((np.reshape(points, (-1, 3)) - start.position_mm) @ np.array(axes).T)
