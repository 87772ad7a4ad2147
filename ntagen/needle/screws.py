"""Screw motions of simulated needles: they are inserted and turned at once."""

from __future__ import annotations

import math
from typing import Final

TURN_RAD: Final = 2.0 * math.pi

STRAIGHT_MM: Final = 1e6
"""The radius of what is straight: formulas that divide by the curvature hold for it."""

_STEP_RAD: Final = math.radians(10.0)
"""A turn that is no whole one is divided into steps of this size."""

_WHOLE_RAD: Final = 0.02
"""A turn that differs by less from a whole one is a whole one; axes turn in steps."""


def is_whole(angle_rad: float) -> bool:
    """Whether a needle that turns by this angle, while it is inserted, goes straight.

    Its way is one turn of a helix, which is less than a hundredth of a millimetre wide, and is told
    as straight here.
    """
    turns = abs(angle_rad) / TURN_RAD
    return round(turns) >= 1 and abs(turns - round(turns)) * TURN_RAD <= _WHOLE_RAD


def steps_of(angle_rad: float) -> int:
    """In how many steps a turn is made that is no whole one."""
    return max(1, math.ceil(abs(angle_rad) / _STEP_RAD))
