"""Arithmetic of the vectors in a file. Directions along an axis stay exact."""

from __future__ import annotations

import math
from typing import Final

from ntagen.scene import Vector

ROUNDING: Final = 1e-15
"""A length or a scalar product of unit vectors that is off by no more than this is exact."""


def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return math.fsum(p * q for p, q in zip(a, b, strict=True))


def minus(a: Vector, b: Vector) -> Vector:
    """The difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def times(factor: float, a: Vector) -> Vector:
    """The multiple."""
    return factor * a[0], factor * a[1], factor * a[2]


def unit(a: Vector) -> Vector:
    """The vector of length 1 in the same direction; exact for directions along an axis.

    One that has this length but for rounding stays as it is: what was written out comes back.
    """
    if abs(math.hypot(*a) - 1.0) <= ROUNDING:
        return a[0] + 0.0, a[1] + 0.0, a[2] + 0.0
    # Scaling first keeps the squares of very large and very small components in range.
    largest = max(map(abs, a))
    scaled = (a[0] / largest, a[1] / largest, a[2] / largest)
    length = math.hypot(*scaled)
    # Adding 0.0 turns a negative zero into a positive one.
    return scaled[0] / length + 0.0, scaled[1] / length + 0.0, scaled[2] / length + 0.0
