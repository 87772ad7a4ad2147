"""The one place where units are converted; everything else computes in mm, rad, s, N.

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

N_PER: Final[dict[str, float]] = {"mN": 1e-3, "N": 1.0}
"""Newtons in one unit of force."""

N_PER_MM: Final[dict[str, float]] = {
    f"{force}/{length}": newtons / millimetres
    for force, newtons in N_PER.items()
    for length, millimetres in MM_PER.items()
}
"""Newtons per millimetre in one unit of a rise."""

RAD_PER_S: Final[dict[str, float]] = {
    f"{angle}/{time}": radians / seconds
    for angle, radians in RAD_PER.items()
    for time, seconds in S_PER.items()
}
"""Radians per second in one unit of a turning speed."""

BYTES_PER: Final[dict[str, float]] = {
    "B": 1.0,
    "KiB": 2.0**10,
    "MiB": 2.0**20,
    "GiB": 2.0**30,
}
"""Bytes in one unit of size."""


def deg_from_rad(angle_rad: float) -> float:
    """Degrees of an angle in radians."""
    return angle_rad * 180.0 / math.pi


def rad_from_deg(angle_deg: float) -> float:
    """Radians of an angle in degrees."""
    return angle_deg * RAD_PER["deg"]
