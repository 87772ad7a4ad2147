"""What is assumed of a needle before anything is measured."""

from __future__ import annotations

import math

from ntagen.values import dataclass

_LAG_DEPTH_MM = 100.0
"""The depth for which `Priors.lag_rad` is given."""


@dataclass(frozen=True, slots=True)
class Priors:
    """Standard deviations that are assumed before anything is measured.

    Attributes:
        position_mm: Each coordinate of the entry point.
        heading_rad: The entry's heading, about either transverse axis.
        bevel_rad: The bevel's angle about the shaft at the entry.
        curvature_ratio: The curvature, relative to the expected one.
        roll_rad: The error of each roll.
        noise_mm: Each coordinate of a measured position.
        direction_rad: A measured direction, if the sensor reports directions.
        curvature_drift: The change of the curvature over 10 mm, as a ratio; 0 for a curvature
            that stays the same.
        turn_drift_rad: The turn of the bend plane over 10 mm without a roll; 0 for none.
        lag_rad: A further error of each roll at a depth of 100 mm, since friction holds the shaft.
            It grows with the square of the depth (Reed et al., 2009).
        distortion_mm: A further error of each coordinate of a measured position that is about the
            same for all measurements on 10 mm of a channel, as of a distorted magnetic field. More
            measurements do not reduce it.
        first_ratio: By how much more the needle bends on the first 10 mm than deeper, as a ratio.
        bite_mm: A channel that leaves another one bends less at its beginning, as if so much of
            its length were straight.
        shape_spacing_mm: Places of one shape that are nearer to each other share their error
            (`ntagen.needle.shape`). About the length of a grating, and the distance of the slices
            of an image; ours.
    """

    position_mm: float = 0.2
    heading_rad: float = math.radians(1.0)
    bevel_rad: float = math.radians(2.0)
    curvature_ratio: float = 0.05
    roll_rad: float = math.radians(1.0)
    noise_mm: float = 0.1
    direction_rad: float = math.radians(1.0)
    curvature_drift: float = 0.0
    turn_drift_rad: float = 0.0
    lag_rad: float = 0.0
    distortion_mm: float = 0.0
    first_ratio: float = 0.0
    bite_mm: float = 0.0
    shape_spacing_mm: float = 5.0

    def roll_std_rad(self, depth_mm: float) -> float:
        """The standard deviation of the error of a roll at a depth."""
        return math.hypot(self.roll_rad, self.lag_rad * (depth_mm / _LAG_DEPTH_MM) ** 2)
