"""How near the arcs that a needle has cut come to regions that stand still.

What was cut stays cut, so each piece of an arc is looked at once, when the needle has just made it.
A distance changes by no more than the way along the path: a region that is farther from the start
of a piece than the piece is long, and the least distance so far, is left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from ntagen.needle.kinematics import Arc
from ntagen.needle.nearest import TOLERANCE_MM, nearest_to
from ntagen.scene import Pose, Vector
from ntagen.shapes import Shape

_SAFE_MM: Final = 2.0 * TOLERANCE_MM
"""Distances to shapes may be too small by the tolerance."""


class CutClearance:
    """The least distance of all that was cut to some shapes.

    Args:
        entry_mm: Where the needle enters; it counts as cut.
        shapes: The shapes.
    """

    def __init__(self, entry_mm: Vector, shapes: Sequence[Shape]) -> None:
        self._entry_mm = entry_mm
        self._shapes = shapes
        self._least_mm = self._nearest_mm((), shapes)
        # The lengths that were looked at, by where an arc starts and its radius.
        self._seen_mm: dict[tuple[Pose, float], float] = {}

    def of(self, arcs: Sequence[Arc]) -> float:
        """The least distance in mm when these arcs are all that was ever cut.

        Infinite without shapes, negative if one was pierced.
        """
        for arc in arcs:
            circle = (arc.start, arc.radius_mm)
            seen_mm = self._seen_mm.get(circle, 0.0)
            if arc.length_mm > seen_mm:
                self._seen_mm[circle] = arc.length_mm
                self._look_at(Arc(arc.pose_at(seen_mm), arc.radius_mm, arc.length_mm - seen_mm))
        return self._least_mm

    def _look_at(self, piece: Arc) -> None:
        reach_mm = self._least_mm + piece.length_mm + _SAFE_MM
        near = [one for one in self._shapes if _distance_mm(one, piece) < reach_mm]
        self._least_mm = min(self._least_mm, self._nearest_mm((piece,), near))

    def _nearest_mm(self, arcs: tuple[Arc, ...], shapes: Sequence[Shape]) -> float:
        start_mm = arcs[0].start.position_mm if arcs else self._entry_mm
        return min(
            (nearest_to(arcs, start_mm, one).distance_mm for one in shapes), default=math.inf
        )


def _distance_mm(shape: Shape, piece: Arc) -> float:
    """The least distance that a shape can have from where a piece starts."""
    if shape.error_mm > 0.0:
        # Its distance is a bound, which may change faster than the place.
        return -math.inf
    return shape.distance_at_mm(piece.start.position_mm) - shape.excess_mm
