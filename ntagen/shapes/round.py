"""Shapes whose offset is a shape of the same kind: sphere, capsule and half-space."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from ntagen.shapes.shape import (
    Axes,
    Bounds,
    Centred,
    Points,
    Shape,
    Vector,
    along,
    around,
    between,
    moved,
    vector_of,
)
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Sphere(Centred):
    """All points at most `radius_mm` from `middle_mm`."""

    is_convex = True

    middle_mm: Vector
    radius_mm: float

    @property
    def depth_mm(self) -> float:
        """The radius."""
        return self.radius_mm

    def distance_mm(self, points: Points) -> Points:
        """The signed distances of points."""
        import numpy as np

        seen = np.asarray(points, dtype=float) - np.array(self.middle_mm)
        return np.asarray(np.sqrt((seen**2).sum(axis=1)) - self.radius_mm)

    def distance_at_mm(self, point_mm: Vector) -> float:
        """The signed distance of one point."""
        return math.dist(point_mm, self.middle_mm) - self.radius_mm

    def bounds_mm(self) -> Bounds:
        """The bounds."""
        return around(self.middle_mm, (self.radius_mm,) * 3)

    def volume_mm3(self) -> float:
        """The volume."""
        return 4.0 / 3.0 * math.pi * self.radius_mm**3

    def grown(self, by_mm: float) -> Sphere:
        """The sphere with a greater radius."""
        return Sphere(self.middle_mm, self.radius_mm + by_mm)

    def parts(self) -> Iterator[tuple[str, tuple[float, ...], bool]]:
        """Centre and radius."""
        yield "centre", self.middle_mm, False
        yield "radius", (self.radius_mm,), True

    def reach_mm(self) -> float:
        """The radius."""
        return self.radius_mm


@dataclass(frozen=True, slots=True)
class Capsule(Shape):
    """Two balls and all that lies between them: their convex hull; a piece of a vessel.

    Attributes:
        start_mm: The centre of the first ball.
        end_mm: The centre of the second.
        start_radius_mm: The radius of the first.
        end_radius_mm: The radius of the second.
    """

    is_convex = True
    places = ("start_mm", "end_mm")

    start_mm: Vector
    end_mm: Vector
    start_radius_mm: float
    end_radius_mm: float

    @property
    def length_mm(self) -> float:
        """From one centre to the other."""
        return math.dist(self.start_mm, self.end_mm)

    @property
    def center_mm(self) -> Vector:
        """The point of its axis in the middle between its ends."""
        length = self.length_mm
        ahead = 0.5 * (length + self.end_radius_mm - self.start_radius_mm)
        share = min(1.0, max(0.0, ahead / length)) if length > 0.0 else 0.0
        return between(self.start_mm, self.end_mm, share)

    @property
    def depth_mm(self) -> float:
        """The greater radius."""
        return max(self.start_radius_mm, self.end_radius_mm)

    def distance_mm(self, points: Points) -> Points:
        """The signed distances of points, in closed form.

        The body is the union of balls on the axis, whose radius changes with the slope ``s``. The
        nearest ball of a point at ``x`` along the axis and ``y`` beside it stands at
        ``x - s y / sqrt(1 - s^2)``, since the distance to a ball is convex in its place. If the
        slope is 1 or more, one of the two balls contains the other and is the whole body.
        """
        import numpy as np

        length = self.length_mm
        fall = self.start_radius_mm - self.end_radius_mm
        if abs(fall) >= length:
            is_start = fall >= 0.0
            middle_mm = self.start_mm if is_start else self.end_mm
            return Sphere(middle_mm, self.depth_mm).distance_mm(points)
        slope = fall / length
        start = np.array(self.start_mm)
        axis = (np.array(self.end_mm) - start) / length
        seen = np.asarray(points, dtype=float) - start
        ahead = seen @ axis
        aside = np.sqrt(((seen - ahead[:, None] * axis) ** 2).sum(axis=1))
        at = np.clip(ahead - aside * slope / math.sqrt(1.0 - slope**2), 0.0, length)
        return np.asarray(np.hypot(ahead - at, aside) - (self.start_radius_mm - slope * at))

    def distance_at_mm(self, point_mm: Vector) -> float:
        """The signed distance of one point; the same formula as for many."""
        length = self.length_mm
        fall = self.start_radius_mm - self.end_radius_mm
        if abs(fall) >= length:
            middle_mm = self.start_mm if fall >= 0.0 else self.end_mm
            return math.dist(point_mm, middle_mm) - self.depth_mm
        slope = fall / length
        (a, b, c), (d, e, f), (x, y, z) = self.start_mm, self.end_mm, point_mm
        u, v, w = (d - a) / length, (e - b) / length, (f - c) / length
        x, y, z = x - a, y - b, z - c
        ahead = x * u + y * v + z * w
        aside = math.hypot(x - ahead * u, y - ahead * v, z - ahead * w)
        at = min(length, max(0.0, ahead - aside * slope / math.sqrt(1.0 - slope**2)))
        return math.hypot(ahead - at, aside) - (self.start_radius_mm - slope * at)

    def bounds_mm(self) -> Bounds:
        """The bounds of its two balls."""
        one = around(self.start_mm, (self.start_radius_mm,) * 3)
        two = around(self.end_mm, (self.end_radius_mm,) * 3)
        a, b, c = map(min, zip(one[0], two[0], strict=True))
        d, e, f = map(max, zip(one[1], two[1], strict=True))
        return (a, b, c), (d, e, f)

    def volume_mm3(self) -> float:
        """The volume: a cone that touches both balls, and what is left of them."""
        length, big, small = self.length_mm, self.start_radius_mm, self.end_radius_mm
        if big < small:
            big, small = small, big
        if big - small >= length:
            return 4.0 / 3.0 * math.pi * big**3
        # The circles in which the cone touches lie this share of a radius before the centres.
        share = (big - small) / length
        wide, narrow = big * math.sqrt(1.0 - share**2), small * math.sqrt(1.0 - share**2)
        height = length - share * (big - small)
        frustum = math.pi * height / 3.0 * (wide**2 + wide * narrow + narrow**2)
        return frustum + _cap(big, big * (1.0 + share)) + _cap(small, small * (1.0 - share))

    def grown(self, by_mm: float) -> Capsule:
        """The capsule with greater radii; one that would be smaller than 0 cuts it shorter."""
        start, end = self.start_radius_mm + by_mm, self.end_radius_mm + by_mm
        if min(start, end) >= 0.0 or max(start, end) <= 0.0:
            return replace(self, start_radius_mm=start, end_radius_mm=end)
        # What is left ends where the radius has fallen to 0.
        share = start / (start - end)
        tip_mm = between(self.start_mm, self.end_mm, share)
        if start < 0.0:
            return Capsule(tip_mm, self.end_mm, 0.0, end)
        return Capsule(self.start_mm, tip_mm, start, 0.0)

    def parts(self) -> Iterator[tuple[str, tuple[float, ...], bool]]:
        """Ends and radii."""
        yield "start", self.start_mm, False
        yield "end", self.end_mm, False
        yield "radius", (self.depth_mm,), True
        yield "smaller radius", (min(self.start_radius_mm, self.end_radius_mm),), False

    def reach_mm(self) -> float:
        """From the middle to the farther end."""
        middle_mm = self.center_mm
        return max(
            math.dist(middle_mm, self.start_mm) + self.start_radius_mm,
            math.dist(middle_mm, self.end_mm) + self.end_radius_mm,
        )


@dataclass(frozen=True, slots=True)
class HalfSpace(Shape):
    """All points on one side of a plane.

    Attributes:
        point_mm: A point of the plane.
        towards: The unit vector from the plane into the half-space.
    """

    is_convex = True

    point_mm: Vector
    towards: Vector

    @property
    def center_mm(self) -> Vector:
        """The given point of the plane."""
        return self.point_mm

    @property
    def depth_mm(self) -> float:
        """Infinite."""
        return math.inf

    def distance_mm(self, points: Points) -> Points:
        """The signed distances of points."""
        import numpy as np

        seen = np.asarray(points, dtype=float) - np.array(self.point_mm)
        return np.asarray(-(seen @ np.array(self.towards)))

    def distance_at_mm(self, point_mm: Vector) -> float:
        """The signed distance of one point."""
        (x, y, z), (a, b, c), (u, v, w) = point_mm, self.point_mm, self.towards
        return (a - x) * u + (b - y) * v + (c - z) * w

    def bounds_mm(self) -> Bounds:
        """Infinite, but for a plane at right angles to an axis of the world."""
        low, high = [-math.inf] * 3, [math.inf] * 3
        for axis in range(3):
            if all(self.towards[other] == 0.0 for other in range(3) if other != axis):
                bound = low if self.towards[axis] > 0.0 else high
                bound[axis] = self.point_mm[axis]
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    def volume_mm3(self) -> float:
        """Infinite."""
        return math.inf

    def placed(self, axes: Axes, shift_mm: Vector) -> HalfSpace:
        """The half-space at another place."""
        return HalfSpace(moved(axes, shift_mm, self.point_mm), along(axes, self.towards))

    def grown(self, by_mm: float) -> HalfSpace:
        """The half-space with its plane moved outwards."""
        pairs = zip(self.point_mm, self.towards, strict=True)
        return replace(self, point_mm=vector_of(p - by_mm * t for p, t in pairs))

    def parts(self) -> Iterator[tuple[str, tuple[float, ...], bool]]:
        """Point and direction."""
        yield "point", self.point_mm, False
        yield "direction", self.towards, False

    def reach_mm(self) -> float:
        """Infinite."""
        return math.inf


def _cap(radius_mm: float, height_mm: float) -> float:
    """The volume of the part of a ball below a plane at this height."""
    return math.pi * height_mm**2 * (3.0 * radius_mm - height_mm) / 3.0
