"""The truth about moving regions in a simulation: how near they come to a needle, by dense samples.

Certificates find such distances by subdivision (`ntagen.needle.timeline`). The truth about a
simulated run must not share their mistakes, so this module shares no code with them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ntagen.needle.kinematics import Arc
from ntagen.scene import Region, Vector

SPACING_MM: Final = 0.25
"""The distance between samples of the shaft, and about how far regions move between two samples."""


class BreathWitness:
    """Follows a needle in time, and keeps the smallest distance of its shaft to moving regions.

    Args:
        obstacles: The actual critical regions; those that keep still are left out.
    """

    def __init__(self, obstacles: Sequence[Obstacle]) -> None:
        self._moving = [one for one in obstacles if one.region.motion is not None]
        self._least_mm = math.inf
        self._seen_s = 0.0

    def note(self, arcs: Sequence[Arc], now_s: float) -> None:
        """Notes where the needle lies, from the last note until now.

        Args:
            arcs: The arcs in which it lies now.
            now_s: The time on its clock.
        """
        since_s, self._seen_s = self._seen_s, now_s
        if not self._moving or not arcs:
            return
        points = np.concatenate([_samples(arc) for arc in arcs])
        for obstacle in self._moving:
            motion, shape = obstacle.region.motion, obstacle.region.shape
            if motion is None:
                continue
            # After a period, everything comes again.
            begin_s = max(since_s, now_s - motion.period_s)
            count = math.ceil((now_s - begin_s) * motion.speed_mm_per_s / SPACING_MM) + 2
            for time_s in np.linspace(begin_s, now_s, count):
                shift = np.array(motion.at_mm(obstacle.clock_s + float(time_s)))
                found_mm = float(shape.distance_mm(points - shift).min()) - shape.error_mm
                self._least_mm = min(self._least_mm, found_mm)

    def clearance_mm(self) -> float:
        """The smallest distance: never too great, and at most `2 SPACING_MM` too small.

        Infinite without moving regions.
        """
        return self._least_mm - SPACING_MM


def _samples(arc: Arc) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    count = max(1, math.ceil(arc.length_mm / SPACING_MM))
    along = np.linspace(0.0, arc.length_mm, count + 1)
    return np.array([arc.pose_at(float(at_mm)).position_mm for at_mm in along])


FORCE_N_PER_MM: Final = 1.0
"""The rise of the force in the sensing margin; our choice, since no source gives a value."""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """An actual critical region, and the distance from its surface at which it is felt.

    Attributes:
        region: The region.
        margin_mm: The distance.
        clock_s: The time of the breath when the needle's clock is at 0.
    """

    region: Region
    margin_mm: float
    clock_s: float = 0.0

    def force_n(self, point_mm: Vector, now_s: float = 0.0) -> float:
        """The force on a tip at a point, at a time of the needle's clock."""
        return FORCE_N_PER_MM * self.depth_in_margin_mm(point_mm, now_s)

    def depth_in_margin_mm(self, point_mm: Vector, now_s: float = 0.0) -> float:
        """How deep a point lies in the margin; 0 outside."""
        away_mm = self.region.distance_at_mm(point_mm, self.clock_s + now_s)
        return max(0.0, self.margin_mm - away_mm)
