"""A solid of any form, as a grid of distances: a mesh, or a part of a segmentation.

Between the samples of a grid the distance is not known, but two bounds on it are.

* It is 1-Lipschitz. With the weights ``w`` of a trilinear interpolation at ``p``, and the samples
  ``d`` at the corners ``c`` of the cell, it is at least ``sum w d - sum w |p - c|``.
* The square of the distance to a set, minus ``|p|^2``, is concave: it is the least of functions
  ``|q|^2 - 2 p q``, one for each point ``q`` of the set. So outside the solid the square of the
  distance is at least ``sum w max(d, 0)^2 - v``, where ``v = sum w |p - c|^2`` is the sum of
  ``h^2 t (1 - t)`` over the three axes (spacing ``h``, place ``t`` in the cell from 0 to 1).

The second one is sharp: far from the solid it loses ``3 h^2 / (8 d)``. `Field` takes the greater of
the two, so its distance is never above the true one. Around a target the question is the other one,
whether a point is inside for sure: there the distance is never below the true one (`is_inner`); it
is that of the outside of the solid, with its sign turned.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from ntagen.shapes.shape import (
    Axes,
    Bounds,
    Centred,
    Points,
    Vector,
    along,
    moved,
    own_points,
    vector_of,
)
from ntagen.values import dataclass

SAMPLES_PER_MM: Final = 1000
"""The unit of a sample, which is an integer of 32 bits."""

_PIECE: Final = 2**16
"""So many points are computed together, so that memory stays small."""


@dataclass(frozen=True, slots=True)
class Field(Centred):
    """A solid, as signed distances at the points of a grid.

    Attributes:
        corner_mm: The first point of the grid.
        axes: The axes of the grid in the world.
        extent_mm: From the first point to the last, along these axes.
        counts: How many points there are along each axis, at least 2.
        samples: The distances at the points, in micrometres, as integers of 32 bits with the least
            significant byte first; the last axis runs fastest.
        doubt_mm: A sample is off by at most this, besides its rounding to a micrometre.
        low_mm: The least coordinates of the solid along the axes, seen from the first point.
        high_mm: The greatest ones. The solid may be larger than the grid.
        middle_mm: A point deep inside.
        radius_mm: All of the solid is at most this far from there.
        deepest_mm: The depth of that point.
        body_mm3: The volume of the solid.
        is_inner: Whether distances are never below the true ones, as for targets, instead of never
            above them.
        rounding_mm: All points at most this far from the solid belong to the shape. If it is
            negative, the points at least so deep inside.
    """

    places = ("corner_mm", "middle_mm")

    corner_mm: Vector
    axes: Axes
    extent_mm: Vector
    counts: tuple[int, int, int]
    samples: bytes
    doubt_mm: float
    low_mm: Vector
    high_mm: Vector
    middle_mm: Vector
    radius_mm: float
    deepest_mm: float
    body_mm3: float
    is_inner: bool = False
    rounding_mm: float = 0.0

    @property
    def depth_mm(self) -> float:
        """The depth of that point."""
        return self.deepest_mm + self.rounding_mm

    @property
    def steps_mm(self) -> Vector:
        """The distances between neighbours of the grid along its axes."""
        return vector_of(e / (n - 1) for e, n in zip(self.extent_mm, self.counts, strict=True))

    @property
    def sample_doubt_mm(self) -> float:
        """How far a sample may be off, with its rounding."""
        return self.doubt_mm + 0.5 / SAMPLES_PER_MM

    @property
    def error_mm(self) -> float:
        """How far a distance in the grid may be off, to one side: the diagonal of a cell.

        The interpolation errs by less than half of a diagonal to both sides, and the bound goes to
        the end of that. Where the surface is smooth and far away, the error is much smaller.
        """
        return math.hypot(*self.steps_mm) + 2.0 * self.sample_doubt_mm

    @property
    def excess_mm(self) -> float:
        """None: distances are bounds already."""
        return 0.0

    def values(self) -> Points:
        """The samples in micrometres, with the shape `counts`."""
        import numpy as np

        return np.frombuffer(self.samples, dtype="<i4").reshape(self.counts)

    def distance_mm(self, points: Points) -> Points:
        """Bounds on the signed distances of points; see the top of the module."""
        import numpy as np

        own = own_points(points, self.corner_mm, self.axes)
        pieces = [self._bound(own[i : i + _PIECE]) for i in range(0, len(own), _PIECE)]
        bound = np.concatenate(pieces) if pieces else np.zeros(0)
        return np.asarray((-bound if self.is_inner else bound) - self.rounding_mm)

    def _bound(self, own: Points) -> Points:
        """The lower bound on the distance, or on the depth, of points along the own axes."""
        import numpy as np

        sign = -1.0 if self.is_inner else 1.0
        mean, square, spread, beyond = self._cells(own, sign, self.sample_doubt_mm)
        square = np.maximum(square - spread, 0.0)
        bound = mean - np.sqrt(spread)
        bound = np.where(square > 0.0, np.maximum(bound, np.sqrt(square)), bound) - beyond
        if self.is_inner:
            return np.asarray(bound)
        # All of the solid is in its box, so outside of that the distance to the box is a bound too.
        out = np.maximum(np.maximum(np.array(self.low_mm) - own, own - np.array(self.high_mm)), 0.0)
        from_box = np.sqrt((out**2).sum(axis=1))
        return np.asarray(np.where(from_box > 0.0, np.maximum(bound, from_box), bound))

    def _cells(
        self, own: Points, sign: float, doubt_mm: float
    ) -> tuple[Points, Points, Points, Points]:
        """The sums over the corners of cells.

        Args:
            own: Points along the own axes.
            sign: -1 for depths in place of distances.
            doubt_mm: What is taken off the samples.

        Returns:
            The interpolated sample, the interpolated square of the positive samples, the sum ``v``
            of the squares of the ways to the corners, and how far points are beyond the grid.
        """
        import numpy as np

        extent, steps = np.array(self.extent_mm), np.array(self.steps_mm)
        inside = np.clip(own, 0.0, extent)
        beyond = np.sqrt(((own - inside) ** 2).sum(axis=1))
        cell = np.minimum((inside / steps).astype(np.int64), np.array(self.counts) - 2)
        share = inside / steps - cell
        spread = (steps**2 * share * (1.0 - share)).sum(axis=1)
        mean, square = np.zeros(len(own)), np.zeros(len(own))
        table = self.values().reshape(-1)
        for corner in np.ndindex(2, 2, 2):
            weight = np.where(corner, share, 1.0 - share).prod(axis=1)
            at = np.ravel_multi_index(tuple((cell + corner).T), self.counts)
            sample = sign * table[at] / SAMPLES_PER_MM - doubt_mm
            mean += weight * sample
            square += weight * np.maximum(sample, 0.0) ** 2
        return mean, square, spread, beyond

    def interpolated_mm(self, points: Points) -> Points:
        """The interpolated distances of points: no bounds, but nearer to the truth, for pictures.

        Beyond the grid the way to it is added.
        """
        import numpy as np

        own = own_points(points, self.corner_mm, self.axes)
        mean, _, _, beyond = self._cells(own, 1.0, 0.0)
        return np.asarray(mean + beyond - self.rounding_mm)

    def bounds_mm(self) -> Bounds:
        """The bounds of its box along its own axes, with the rounding on each side."""
        r = self.rounding_mm
        sides = [(a - r, b + r) for a, b in zip(self.low_mm, self.high_mm, strict=True)]
        corners = map(vector_of, itertools.product(*sides))
        ends = [moved(self.axes, self.corner_mm, corner) for corner in corners]
        columns = list(zip(*ends, strict=True))
        return vector_of(map(min, columns)), vector_of(map(max, columns))

    def volume_mm3(self) -> float:
        """The volume; what a rounding adds is counted in the grid, to a few percent."""
        import numpy as np

        if self.rounding_mm == 0.0:
            return self.body_mm3
        step = min(self.steps_mm)
        depth = -self.values() / SAMPLES_PER_MM

        def filled(by_mm: float) -> float:
            return float(np.clip(0.5 + (depth + by_mm) / step, 0.0, 1.0).sum())

        cell_mm3 = math.prod(self.steps_mm)
        return max(0.0, self.body_mm3 + cell_mm3 * (filled(self.rounding_mm) - filled(0.0)))

    def grown(self, by_mm: float) -> Field:
        """The field with a greater rounding."""
        return replace(self, rounding_mm=self.rounding_mm + by_mm)

    def parts(self) -> Iterator[tuple[str, tuple[float, ...], bool]]:
        """Where it is, and how wide."""
        yield "corner", self.corner_mm, False
        yield "middle", self.middle_mm, False
        yield "extent", self.extent_mm, True
        yield "radius", (self.radius_mm + self.rounding_mm,), True
        yield "depth", (self.depth_mm,), True

    def reach_mm(self) -> float:
        """From the middle to its farthest point."""
        return self.radius_mm + self.rounding_mm

    def point_mm(self, place: tuple[int, int, int]) -> Vector:
        """Where a point of the grid is."""
        x, y, z = (n * step for n, step in zip(place, self.steps_mm, strict=True))
        offset = along(self.axes, (x, y, z))
        return vector_of(p + q for p, q in zip(self.corner_mm, offset, strict=True))
