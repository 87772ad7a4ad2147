"""Small vector algebra on tuples of three floats.

For three numbers, plain tuples are faster than arrays; they can be compared, hashed and put into
frozen dataclasses. Arrays are used for many points (`ntagen.needle.estimate`).
"""

from __future__ import annotations

import math

from ntagen.scene import Vector


def add(a: Vector, b: Vector) -> Vector:
    """The sum."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector, b: Vector) -> Vector:
    """The difference `a - b`."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(factor: float, a: Vector) -> Vector:
    """The vector `factor * a`."""
    return (factor * a[0], factor * a[1], factor * a[2])


def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product `a x b`."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a: Vector) -> float:
    """The Euclidean length."""
    return math.hypot(*a)


def distance(a: Vector, b: Vector) -> float:
    """The Euclidean distance between two points."""
    return math.dist(a, b)


def unit(a: Vector) -> Vector:
    """The vector of length 1 in the same direction.

    Raises:
        ValueError: The vector is zero or not finite: it has no direction.
    """
    length = norm(a)
    if not 0.0 < length < math.inf:
        raise ValueError(f"vector {a} has no direction")
    return scale(1.0 / length, a)


def rotate(a: Vector, axis: Vector, angle_rad: float) -> Vector:
    """The vector turned about a unit axis, right-handed (Rodrigues' formula)."""
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    along = scale(dot(axis, a) * (1.0 - cosine), axis)
    return add(add(scale(cosine, a), scale(sine, cross(axis, a))), along)


def combine(p: float, a: Vector, q: float, b: Vector) -> Vector:
    """The linear combination `p * a + q * b`."""
    return (p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2])
