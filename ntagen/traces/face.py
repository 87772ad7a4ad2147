"""`ntagen.match`: the match of a trace in one call, for scripts and notebooks."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ntagen.errors import InputError
from ntagen.scene import Scene
from ntagen.traces.matching import FIRST_MM, Match, Options, RadiusWay, StartWay, match_trace
from ntagen.traces.reading import Columns, read_samples
from ntagen.traces.trace import Samples, trace_of


def match(
    scene: Scene | str | Path,
    points: ArrayLike | str | Path,
    *,
    start: StartWay = "free",
    radius: RadiusWay = "scene",
    rolls: int | None = None,
    first_mm: float = FIRST_MM,
    until_mm: float = math.inf,
    from_mm: float = 0.0,
    columns: str | None = None,
) -> Match:
    """The pushes, rolls and start of a needle that explain a measured trace of its tip best.

    Args:
        scene: The needle and its possible rolls: a scene, or the path of an environment (``.nsl``).
        points: The positions in mm in the order of time, one a row, or the path of a file that
            ``ntagen match`` reads.
        start: What is known of the start; see `ntagen.traces.matching.Options`.
        radius: Whether the radius is the scene's or fitted.
        rolls: The number of rolls; None for as many as explain much more.
        first_mm: The length of the first part that gives the start, unless it is free.
        until_mm: The trace is matched up to this depth.
        from_mm: The trace is matched from this depth on; all other depths are counted from there.
        columns: Which columns of a file are x, y and z.

    Returns:
        The match. `Match.plan` has the actions, `Match.needle` the start and the radius, and
        `Match.min_mm`, `Match.avg_mm` and `Match.max_mm` say how far the trace is from the plan.

    Raises:
        InputError: The environment or the trace is wrong.
    """
    if not isinstance(scene, Scene):
        from ntagen.nsl import load

        scene = load(scene)
    if isinstance(points, str | Path):
        samples = read_samples(Path(points), Columns(columns))
    else:
        samples = samples_of(points)
    options = Options(start=start, radius=radius, rolls=rolls, first_mm=first_mm)
    return match_trace(scene, trace_of(samples, until_mm, from_mm), options)


def samples_of(points_mm: ArrayLike) -> Samples:
    """Positions as the samples of a trace.

    Raises:
        InputError: They are not rows of three numbers.
    """
    try:
        points = np.asarray(points_mm, dtype=np.float64)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(
            f"the trace has the shape {points.shape}\nhint: give one row of x, y, z a position"
        )
    return Samples("the trace", points, tuple(range(1, len(points) + 1)), word="row")
