"""The least distance of a path to any shape, by subdivision, and where it enters a shape.

A signed distance changes by no more than the way along the path. So a piece of the path comes no
nearer than the distance of its middle minus half of its length. Pieces that cannot hold the nearest
place are dropped, and the others cut. For spheres there are closed forms
(`ntagen.needle.kinematics`), and numpy is imported for other shapes only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
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
    return Nearest(best_mm - TOLERANCE_MM - shape.excess_mm, best_at_mm)


def enters_at(arc: Arc, shape: Shape) -> float | None:
    """The arc length at which an arc first touches a shape; 0 inside, None if it never does.

    For a shape that is no sphere, a touch that is shorter than `TOLERANCE_MM` may be left out; for
    one whose distances are bounds, a touch that is shorter than 0.02 mm.
    """
    if isinstance(shape, Sphere):
        return arc.enters_at(shape.middle_mm, shape.radius_mm)
    if shape.distance_at_mm(arc.start.position_mm) <= 0.0:
        return 0.0
    if shape.error_mm > TOLERANCE_MM:
        return _enters_bound_at(arc, shape)
    waiting = [(0.5 * arc.length_mm, 0.5 * arc.length_mm)]
    while waiting:
        at_mm, half_mm = waiting.pop()
        away_mm = shape.distance_at_mm(arc.pose_at(at_mm).position_mm)
        if away_mm > half_mm:
            continue
        if half_mm <= 0.5 * TOLERANCE_MM:
            if away_mm <= 0.0:
                return at_mm
            continue
        # The earlier half is taken first.
        half_mm *= 0.5
        waiting += [(at_mm + half_mm, half_mm), (at_mm - half_mm, half_mm)]
    return arc.length_mm if shape.distance_at_mm(arc.end.position_mm) <= 0.0 else None


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

    starts = np.array([arc.start.position_mm for arc in arcs])[owners]
    headings = np.array([arc.start.heading for arc in arcs])[owners]
    bevels = np.array([arc.start.bevel for arc in arcs])[owners]
    half_turns = 0.5 * along / np.array([arc.radius_mm for arc in arcs])[owners]
    chords = along * np.sinc(half_turns / math.pi)
    ahead, aside = chords * np.cos(half_turns), chords * np.sin(half_turns)
    return np.asarray(starts + ahead[:, None] * headings - aside[:, None] * bevels)
