"""Shapes with edges: box and cylinder. Grown ones have round edges, so they keep a rounding."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from ntagen.shapes.shape import (
    UPRIGHT,
    Axes,
    Bounds,
    Centred,
    Points,
    Shape,
    Vector,
    around,
    between,
    own_point,
    own_points,
    vector_of,
)
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Box(Centred):
    """A cuboid.

    Attributes:
        middle_mm: Its centre.
        size_mm: The lengths of its edges along its own axes.
        axes: Its own axes in the world.
        rounding_mm: All points at most this far from the cuboid belong to the shape.
    """

    is_convex = True

    middle_mm: Vector
    size_mm: Vector
    axes: Axes = UPRIGHT
    rounding_mm: float = 0.0

    @property
    def depth_mm(self) -> float:
        """Half of the least edge, and the rounding."""
        return 0.5 * min(self.size_mm) + self.rounding_mm

    def distance_mm(self, points: Points) -> Points:
        """The signed distances of points, in closed form."""
        import numpy as np

        seen = own_points(points, self.middle_mm, self.axes)
        return _beyond(np.abs(seen) - 0.5 * np.array(self.size_mm)) - self.rounding_mm

    def distance_at_mm(self, point_mm: Vector) -> float:
        """The signed distance of one point; the same formula as for many."""
        seen = own_point(point_mm, self.middle_mm, self.axes)
        excess = (abs(s) - 0.5 * edge for s, edge in zip(seen, self.size_mm, strict=True))
        return _one_beyond(*excess) - self.rounding_mm

    def bounds_mm(self) -> Bounds:
        """The bounds of its eight corners, and the rounding."""
        a, b, c = (
            0.5 * sum(s * abs(own[i]) for s, own in zip(self.size_mm, self.axes, strict=True))
            + self.rounding_mm
            for i in range(3)
        )
        return around(self.middle_mm, (a, b, c))

    def volume_mm3(self) -> float:
        """The volume; with a rounding by the formula of Steiner."""
        (a, b, c), r = self.size_mm, self.rounding_mm
        surface, edges = 2.0 * (a * b + b * c + c * a), math.pi * (a + b + c)
        return a * b * c + r * (surface + r * (edges + r * 4.0 / 3.0 * math.pi))

    def grown(self, by_mm: float) -> Box:
        """The box with a greater rounding; a smaller one loses its rounding first."""
        rounding_mm = self.rounding_mm + by_mm
        if rounding_mm >= 0.0:
            return replace(self, rounding_mm=rounding_mm)
        a, b, c = (edge + 2.0 * rounding_mm for edge in self.size_mm)
        return replace(self, size_mm=(a, b, c), rounding_mm=0.0)

    def parts(self) -> Iterator[tuple[str, tuple[float, ...], bool]]:
        """Centre and edges."""
        yield "centre", self.middle_mm, False
        yield "size", self.size_mm, True
        yield "rounding", (self.rounding_mm,), False

    def reach_mm(self) -> float:
        """Half of the diagonal, and the rounding."""
        return 0.5 * math.hypot(*self.size_mm) + self.rounding_mm


@dataclass(frozen=True, slots=True)
class Cylinder(Shape):
    """A straight cylinder with flat ends.

    Attributes:
        start_mm: The centre of one end.
        end_mm: The centre of the other.
        radius_mm: Its radius.
        rounding_mm: All points at most this far from the cylinder belong to the shape.
    """

    is_convex = True
    places = ("start_mm", "end_mm")

    start_mm: Vector
    end_mm: Vector
    radius_mm: float
    rounding_mm: float = 0.0

    @property
    def length_mm(self) -> float:
        """From one end to the other."""
        return math.dist(self.start_mm, self.end_mm)

    @property
    def center_mm(self) -> Vector:
        """The middle between its ends."""
        return vector_of(0.5 * (a + b) for a, b in zip(self.start_mm, self.end_mm, strict=True))

    @property
    def depth_mm(self) -> float:
        """The radius or half of the length, and the rounding."""
        return min(self.radius_mm, 0.5 * self.length_mm) + self.rounding_mm

    def distance_mm(self, points: Points) -> Points:
        """The signed distances of points, in closed form."""
        import numpy as np

        length = self.length_mm
        axis = (np.array(self.end_mm) - np.array(self.start_mm)) / length
        seen = np.asarray(points, dtype=float) - np.array(self.center_mm)
        ahead = seen @ axis
        aside = np.sqrt(((seen - ahead[:, None] * axis) ** 2).sum(axis=1))
        beyond = np.column_stack([aside - self.radius_mm, np.abs(ahead) - 0.5 * length])
        return _beyond(beyond) - self.rounding_mm

    def distance_at_mm(self, point_mm: Vector) -> float:
        """The signed distance of one point; the same formula as for many."""
        length = self.length_mm
        (a, b, c), (d, e, f), (m, n, o) = self.start_mm, self.end_mm, self.center_mm
        u, v, w = (d - a) / length, (e - b) / length, (f - c) / length
        x, y, z = point_mm[0] - m, point_mm[1] - n, point_mm[2] - o
        ahead = x * u + y * v + z * w
        aside = math.hypot(x - ahead * u, y - ahead * v, z - ahead * w)
        return _one_beyond(aside - self.radius_mm, abs(ahead) - 0.5 * length) - self.rounding_mm

    def bounds_mm(self) -> Bounds:
        """The bounds of its two discs, and the rounding."""
        length = self.length_mm
        low, high = [], []
        for a, b in zip(self.start_mm, self.end_mm, strict=True):
            cosine = (b - a) / length
            reach = self.radius_mm * math.sqrt(max(0.0, 1.0 - cosine**2)) + self.rounding_mm
            low.append(min(a, b) - reach)
            high.append(max(a, b) + reach)
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    def volume_mm3(self) -> float:
        """The volume; with a rounding by the formula of Steiner."""
        radius, height, r = self.radius_mm, self.length_mm, self.rounding_mm
        surface = 2.0 * math.pi * radius * (radius + height)
        edges = math.pi * (height + math.pi * radius)
        return math.pi * radius**2 * height + r * (surface + r * (edges + r * 4 / 3 * math.pi))

    def grown(self, by_mm: float) -> Cylinder:
        """The cylinder with a greater rounding; a smaller one loses its rounding first."""
        rounding_mm = self.rounding_mm + by_mm
        if rounding_mm >= 0.0:
            return replace(self, rounding_mm=rounding_mm)
        # A cylinder that is too short to lose so much keeps no length, and has no depth.
        share = min(0.5, -rounding_mm / self.length_mm)
        return Cylinder(
            between(self.start_mm, self.end_mm, share),
            between(self.end_mm, self.start_mm, share),
            self.radius_mm + rounding_mm,
        )

    def parts(self) -> Iterator[tuple[str, tuple[float, ...], bool]]:
        """Ends, length and radius."""
        yield "start", self.start_mm, False
        yield "end", self.end_mm, False
        yield "length", (self.length_mm,), True
        yield "radius", (self.radius_mm,), True
        yield "rounding", (self.rounding_mm,), False

    def reach_mm(self) -> float:
        """From the middle to the edge of an end, and the rounding."""
        return math.hypot(self.radius_mm, 0.5 * self.length_mm) + self.rounding_mm


def _beyond(excess: Points) -> Points:
    """The signed distance from how far a point lies beyond each face; negative before it."""
    import numpy as np

    outside = np.sqrt((np.maximum(excess, 0.0) ** 2).sum(axis=1))
    return np.asarray(outside + np.minimum(excess.max(axis=1), 0.0))


def _one_beyond(*excess: float) -> float:
    """The same for one point."""
    outside = math.hypot(*(max(one, 0.0) for one in excess))
    return outside + min(max(excess), 0.0)
