"""A critical region as a simulated needle feels it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ntagen.scene import Region, Vector

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
