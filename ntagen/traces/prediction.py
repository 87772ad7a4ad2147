"""The prediction of a trace from its first part.

A match of the first part, which sees nothing of the rest, is pushed on without a further roll. Its
deviation is the distance from what was measured later.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ntagen.needle.path import nearest_on_all
from ntagen.plan.actions import Plan, Push
from ntagen.scene import Scene, Vector
from ntagen.shapes import vector_of
from ntagen.traces.matching import Match, Options, match_trace
from ntagen.traces.trace import Trace, first_part

FROM_MM: Final = (20.0, 30.0, 40.0)
AHEAD_MM: Final = (10.0, 20.0, 40.0)

_BEYOND_MM: Final = 10.0
"""The predicted path goes on so far beyond the last point, so that its end is never the nearest."""


@dataclass(frozen=True, slots=True)
class Ahead:
    """How well a stretch after the first part was predicted.

    Attributes:
        ahead_mm: Its length.
        at_mm: The deviation at its end.
        max_mm: The greatest deviation on it.
    """

    ahead_mm: float
    at_mm: float
    max_mm: float


@dataclass(frozen=True, slots=True)
class Prediction:
    """A prediction from a first part.

    Attributes:
        from_mm: The length of the first part.
        match: The match of the first part.
        ahead: The deviations; those lengths are left out for which the trace is too short.
    """

    from_mm: float
    match: Match
    ahead: tuple[Ahead, ...]


def predict(
    scene: Scene,
    trace: Trace,
    options: Options | None = None,
    from_mm: tuple[float, ...] = FROM_MM,
    ahead_mm: tuple[float, ...] = AHEAD_MM,
) -> list[Prediction]:
    """Predictions of a trace from first parts of it.

    First parts that leave nothing to predict are left out.

    Args:
        scene: The needle, and the rolls that are possible.
        trace: The trace.
        options: How the first parts are matched. A number of rolls is the greatest number, since
            some may come later.
        from_mm: The lengths of the first parts.
        ahead_mm: How far is predicted.
    """
    options = options or Options()
    options = replace(options, rolls=None, most_rolls=options.rolls)
    found = []
    for length_mm in from_mm:
        if trace.length_mm < length_mm + min(ahead_mm):
            continue
        part, end_mm = first_part(trace, length_mm)
        match = match_trace(scene, part, options)
        found.append(Prediction(length_mm, match, _deviations(match, trace, end_mm, ahead_mm)))
    return found


def _deviations(
    match: Match, trace: Trace, end_mm: float, ahead_mm: tuple[float, ...]
) -> tuple[Ahead, ...]:
    longest_mm = max(ahead_mm) + _BEYOND_MM
    plan = Plan.of([*match.plan.actions, Push(longest_mm)])
    arcs, entry = plan.arcs(match.needle), match.needle.tip.position_mm
    found = []
    for length_mm in ahead_mm:
        until_mm = end_mm + length_mm
        if trace.length_mm < until_mm:
            continue
        on_way = (trace.depths_mm > end_mm) & (trace.depths_mm <= until_mm)
        measured = [*map(vector_of, trace.points_mm[on_way]), _measured_at(trace, until_mm)]
        away_mm = [one.distance_mm for one in nearest_on_all(arcs, entry, measured)]
        found.append(Ahead(length_mm, away_mm[-1], max(away_mm)))
    return tuple(found)


def _measured_at(trace: Trace, depth_mm: float) -> Vector:
    """Where the tip was at a depth, on the straight line between two points."""
    columns = (np.interp(depth_mm, trace.depths_mm, column) for column in trace.points_mm.T)
    return vector_of(columns)
