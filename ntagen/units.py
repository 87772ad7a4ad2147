"""The one place where units are converted; everything else computes in mm, rad and s.

The names on the left are those that an environment file may write.
"""

from __future__ import annotations

import math
from typing import Final

MM_PER: Final[dict[str, float]] = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0}
"""Millimetres in one unit of length."""

RAD_PER: Final[dict[str, float]] = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0}
"""Radians in one unit of angle."""

S_PER: Final[dict[str, float]] = {"ms": 1e-3, "s": 1.0, "min": 60.0}
"""Seconds in one unit of time."""


def deg_from_rad(angle_rad: float) -> float:
    """Degrees of an angle in radians."""
    return angle_rad * 180.0 / math.pi


def rad_from_deg(angle_deg: float) -> float:
    """Radians of an angle in degrees."""
    return angle_deg * RAD_PER["deg"]
