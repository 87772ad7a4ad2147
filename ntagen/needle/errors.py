"""The errors of the virtual needle: what a run is told of them, apart from the needle itself."""

from __future__ import annotations

from dataclasses import replace

from ntagen.needle.kinematics import orthonormal, roll
from ntagen.scene import Needle
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Errors:
    """The errors of the virtual needle.

    Attributes:
        noise_mm: The standard deviation of each coordinate of a measured position.
        roll_rad: The standard deviation of each roll.
        radius_mm: The true radius of the motion circle; None if it is that of the scene.
        bevel_rad: The angle about the heading from the bevel of the scene to the true one.
    """

    noise_mm: float = 0.0
    roll_rad: float = 0.0
    radius_mm: float | None = None
    bevel_rad: float = 0.0

    def true_needle(self, needle: Needle) -> Needle:
        """The true needle, if this is the one that the scene describes."""
        tip = orthonormal(roll(needle.tip, self.bevel_rad)) if self.bevel_rad else needle.tip
        radius_mm = needle.radius_mm if self.radius_mm is None else self.radius_mm
        return replace(needle, tip=tip, radius_mm=radius_mm)
