"""The least distance of a path to any shape, by subdivision, and where it enters a shape.

A signed distance changes by no more than the way along the path. So a piece of the path comes no
nearer than the distance of its middle minus half of its length. Pieces that cannot hold the nearest
place are dropped, and the others cut.

The distance of a convex body is a convex function `f`. Along a circle of radius `r` it bends down
by no more than the circle does: `g(x) = f(x) + x^2 / 2 r` is convex. So a line through two places
of `g` lies below `g` but for what is between them. With the slope in its middle, a piece is dropped
much sooner than without, and few places are needed: they are computed one by one, without numpy,
whose import takes longer than the certificate of a plan. For spheres there are closed forms
(`ntagen.needle.kinematics`). Other shapes are computed with numpy: fields, and ellipsoids, whose
iterated distances give no good slopes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from heapq import heappop, heappush
from typing import TYPE_CHECKING, Final

from ntagen.needle.kinematics import Arc, Nearest
from ntagen.needle.path import nearest_on
from ntagen.scene import Vector
from ntagen.shapes import Shape, Sphere

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    _Array = NDArray[np.float64]

TOLERANCE_MM: Final = 1e-3
"""A distance to a shape that is no sphere is at most this much too small, and never too great."""

SLOPE_MM: Final = 0.25 * TOLERANCE_MM
"""A slope is that between two places so far from each other."""

_FIRST_PIECE_MM: Final = 4.0
_PARTS: Final = 8
"""A piece is cut into so many: fewer rounds cost less than more places in each."""

_SAMPLE_MM: Final = 0.02


def nearest_to(arcs: Sequence[Arc], entry_mm: Vector, shape: Shape) -> Nearest:
    """The least distance of a chain of arcs to the surface of a shape; negative inside.

    Args:
        arcs: The arcs; without any, the distance is that of the entry.
        entry_mm: Where they begin.
        shape: Any shape. If it is a sphere, the distance is exact.

    Returns:
        The distance, at most `TOLERANCE_MM` too small, and where it is along the arcs.
    """
    if isinstance(shape, Sphere):
        found = nearest_on(tuple(arcs), entry_mm, shape.middle_mm)
        return Nearest(found.distance_mm - shape.radius_mm, found.at_mm)
    find = _nearest_to_convex if is_smooth(shape) else _nearest_by_pieces
    found = find(arcs, entry_mm, shape)
    return Nearest(found.distance_mm - TOLERANCE_MM - shape.excess_mm, found.at_mm)


def is_smooth(shape: Shape) -> bool:
    """Whether it is no sphere, and slopes of its distance tell where an arc comes nearest."""
    return not isinstance(shape, Sphere) and shape.is_convex and shape.error_mm == 0.0


def _nearest_to_convex(arcs: Sequence[Arc], entry_mm: Vector, shape: Shape) -> Nearest:
    """A place of the path that is at most `TOLERANCE_MM` farther than the nearest.

    The piece that can come nearest is looked at first. It ends when none can come nearer by half of
    the tolerance. The other half is for what is between the places of a slope, and for rounding.
    """
    best_mm, best_at_mm = shape.distance_at_mm(entry_mm), 0.0
    # The least distance that a piece can have, its arc, the start of that, its middle and its half.
    waiting: list[tuple[float, int, float, float, float]] = []
    start_mm = 0.0
    for number, arc in enumerate(arcs):
        half_mm = 0.5 * arc.length_mm
        waiting.append((-math.inf, number, start_mm, half_mm, half_mm))
        start_mm += arc.length_mm
    while waiting:
        least_mm, number, start_mm, at_mm, half_mm = heappop(waiting)
        if least_mm >= best_mm - 0.5 * TOLERANCE_MM:
            break
        arc = arcs[number]
        away_mm = shape.distance_at_mm(arc.position_at(at_mm))
        if away_mm < best_mm:
            best_mm, best_at_mm = away_mm, start_mm + at_mm
        if away_mm - half_mm >= best_mm - 0.5 * TOLERANCE_MM:
            continue
        next_mm = shape.distance_at_mm(arc.position_at(at_mm + SLOPE_MM))
        slope = (next_mm - away_mm) / SLOPE_MM + 0.5 * SLOPE_MM / arc.radius_mm
        bend_mm = 0.5 * half_mm**2 / arc.radius_mm
        quarter_mm = 0.5 * half_mm
        for side in (-1.0, 1.0):
            least_mm = away_mm - min(half_mm, bend_mm - side * slope * half_mm)
            if least_mm < best_mm - 0.5 * TOLERANCE_MM:
                middle_mm = at_mm + side * quarter_mm
                heappush(waiting, (least_mm, number, start_mm, middle_mm, quarter_mm))
    return Nearest(best_mm, best_at_mm)


def _nearest_by_pieces(arcs: Sequence[Arc], entry_mm: Vector, shape: Shape) -> Nearest:
    """The same for any shape, with many places at once."""
    import numpy as np

    best_mm, best_at_mm = shape.distance_at_mm(entry_mm), 0.0
    pieces, halves, owners, offsets = _pieces(arcs)
    places = (2.0 * np.arange(_PARTS) + 1.0) / _PARTS - 1.0
    while len(pieces):
        distances = shape.distance_mm(places_on(arcs, owners, pieces))
        least = int(np.argmin(distances))
        if distances[least] < best_mm:
            best_mm = float(distances[least])
            best_at_mm = float(offsets[least] + pieces[least])
        is_open = distances - halves < best_mm - TOLERANCE_MM
        pieces = (pieces[is_open, None] + halves[is_open, None] * places).ravel()
        halves = np.repeat(halves[is_open] / _PARTS, _PARTS)
        owners, offsets = np.repeat(owners[is_open], _PARTS), np.repeat(offsets[is_open], _PARTS)
    return Nearest(best_mm, best_at_mm)


def enters_at(arc: Arc, shape: Shape) -> float | None:
    """The arc length at which an arc first touches a shape; 0 inside, None if it never does.

    For a shape that is no sphere, a touch that is shorter than `TOLERANCE_MM` may be left out; for
    one whose distances are bounds, a touch that is shorter than 0.02 mm.
    """
    if isinstance(shape, Sphere):
        return arc.enters_at(shape.middle_mm, shape.radius_mm)
    if shape.error_mm > TOLERANCE_MM:
        return _enters_bound_at(arc, shape)
    return first_within(
        lambda at_mm: shape.distance_at_mm(arc.position_at(at_mm)), 0.0, arc.length_mm
    )


def first_within(
    away_mm: Callable[[float], float],
    start: float,
    end: float,
    speed: float = 1.0,
    slack_mm: float = 0.0,
    least_mm: float = 0.5 * TOLERANCE_MM,
) -> float | None:
    """The first place or time at which a distance is 0 or less; None if it never is.

    Args:
        away_mm: The distance at a place or a time.
        start: Where to begin.
        end: Where to end.
        speed: The distance changes by at most this for each unit of the place or the time.
        slack_mm: And by this much besides.
        least_mm: What takes the distance less than this far is looked at in its middle only.
    """
    if away_mm(start) <= 0.0:
        return start
    waiting = [(0.5 * (start + end), 0.5 * (end - start))]
    while waiting:
        at, half = waiting.pop()
        found_mm = away_mm(at)
        if found_mm > half * speed + slack_mm:
            continue
        if half * speed <= least_mm:
            if found_mm <= 0.0:
                return at
            continue
        # The earlier half is taken first.
        half *= 0.5
        waiting += [(at + half, half), (at - half, half)]
    return end if away_mm(end) <= 0.0 else None


def _enters_bound_at(arc: Arc, shape: Shape) -> float | None:
    """The same for a shape whose distance is a bound, which may change faster than the place."""
    import numpy as np

    count = max(1, math.ceil(arc.length_mm / _SAMPLE_MM))
    along = np.linspace(0.0, arc.length_mm, count + 1)
    owners = np.zeros(count + 1, dtype=np.intp)
    touched = np.flatnonzero(shape.distance_mm(places_on([arc], owners, along)) <= 0.0)
    return float(along[touched[0]]) if len(touched) else None


def _pieces(arcs: Sequence[Arc]) -> tuple[_Array, _Array, NDArray[np.intp], _Array]:
    """The middles of pieces, from the start of their arcs; half lengths, arcs and their starts."""
    import numpy as np

    middles, halves, owners, offsets = [], [], [], []
    start_mm = 0.0
    for number, arc in enumerate(arcs):
        count = max(1, math.ceil(arc.length_mm / _FIRST_PIECE_MM))
        half_mm = 0.5 * arc.length_mm / count
        middles += [(2 * i + 1) * half_mm for i in range(count)]
        halves += [half_mm] * count
        owners += [number] * count
        offsets += [start_mm] * count
        start_mm += arc.length_mm
    return np.array(middles), np.array(halves), np.array(owners, dtype=np.intp), np.array(offsets)


def places_on(arcs: Sequence[Arc], owners: NDArray[np.intp], along: _Array) -> _Array:
    """The places at some lengths along their arcs, as in `ntagen.needle.kinematics.push`."""
    import numpy as np

    from ntagen.needle.poses import Poses

    radii = np.array([arc.radius_mm for arc in arcs])[owners]
    return Poses.of(arc.start for arc in arcs).at(owners).places(radii, along)
