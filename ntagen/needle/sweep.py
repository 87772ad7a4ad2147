"""The smallest distance of a path to regions, by dense sampling.

The driver's own distances are closed forms (`ntagen.needle.kinematics`) or found by subdivision
(`ntagen.needle.nearest`). The truth about a simulated run must not share their mistakes, so this
module shares no code with them; of a shape that is no sphere it takes the distance of a point.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ntagen.scene import Pose, Region, Vector
from ntagen.shapes import Sphere

_Array = NDArray[np.float64]

SPACING_MM = 0.02
"""The greatest distance between two samples along the path."""

BOUND_MM = 0.5 * SPACING_MM
"""Every point of the path is at most this far from a sample, so a distance errs by no more."""


class Sweep:
    """Follows a path and keeps its smallest distance to the surfaces of regions.

    Args:
        regions: The regions.
        start_mm: Where the path begins.
    """

    def __init__(self, regions: Sequence[Region], start_mm: Vector) -> None:
        balls = [one.shape for one in regions if isinstance(one.shape, Sphere)]
        self._shapes = [one.shape for one in regions if not isinstance(one.shape, Sphere)]
        self._centers = np.array([ball.middle_mm for ball in balls]).reshape(-1, 3)
        self._radii = np.array([ball.radius_mm for ball in balls])
        self._least_mm = math.inf
        self._look(np.array([start_mm]))

    def follow(self, start: Pose, curvature_per_mm: float, from_mm: float, to_mm: float) -> None:
        """Adds the part of an arc between two lengths from its start."""
        if not len(self._radii) and not self._shapes:
            return
        count = max(1, math.ceil((to_mm - from_mm) / SPACING_MM))
        along = np.linspace(from_mm, to_mm, count + 1)
        angle = curvature_per_mm * along
        # The bevel points away from the centre.
        ahead = np.sin(angle) / curvature_per_mm
        aside = (1.0 - np.cos(angle)) / curvature_per_mm
        self._look(
            np.array(start.position_mm)
            + np.outer(ahead, np.array(start.heading))
            - np.outer(aside, np.array(start.bevel))
        )

    def clearance_mm(self) -> float:
        """The smallest distance to a surface: never too great, at most `2 BOUND_MM` too small.

        It is negative if a region was entered, and infinite without regions.
        """
        return self._least_mm - BOUND_MM

    def _look(self, points: _Array) -> None:
        if len(self._radii):
            between = points[:, None, :] - self._centers[None, :, :]
            distances = np.sqrt((between**2).sum(axis=2)) - self._radii
            self._least_mm = min(self._least_mm, float(distances.min()))
        for shape in self._shapes:
            least_mm = float(shape.distance_mm(points).min()) - shape.excess_mm
            self._least_mm = min(self._least_mm, least_mm)
