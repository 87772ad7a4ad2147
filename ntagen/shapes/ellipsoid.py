"""The ellipsoid: its distance is the root of an equation of degree six."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from ntagen.shapes.shape import UPRIGHT, Axes, Bounds, Centred, Points, Vector, around, own_points
from ntagen.values import dataclass

_LEAST_RATIO: Final = 1e-10
"""A point is moved away from the planes of symmetry by this share of the least radius."""

_MOST_STEPS: Final = 200
"""The first steps may only grow by half; from the least ratio these are 60, and then a few."""


@dataclass(frozen=True, slots=True)
class Ellipsoid(Centred):
    """An ellipsoid.

    Attributes:
        middle_mm: Its centre.
        radii_mm: Its radii along its own axes.
        axes: Its own axes in the world.
        rounding_mm: All points at most this far from the ellipsoid belong to the shape. If it is
            negative, the points at least so deep inside.
    """

    is_convex = True

    middle_mm: Vector
    radii_mm: Vector
    axes: Axes = UPRIGHT
    rounding_mm: float = 0.0

    @property
    def depth_mm(self) -> float:
        """The least radius, and the rounding."""
        return min(self.radii_mm) + self.rounding_mm

    @property
    def error_mm(self) -> float:
        """The error of moving a point away from the planes of symmetry, and of the iteration."""
        return 1e-9 * max(self.radii_mm)

    def distance_mm(self, points: Points) -> Points:
        """The signed distances of points.

        Source: D. Eberly, "Distance from a Point to an Ellipse, an Ellipsoid, or a
        Hyperellipsoid", Geometric Tools, section 3. The nearest point of ``y`` is
        ``r_i y_i / (u + r_i - 1)``, with the squared ratios ``r_i`` of the radii to the least one.
        The unknown ``u`` is the greatest root of an equation whose left side is convex and falls.
        The iteration of Newton from the left never passes the root. A point in a plane of symmetry
        is moved off it by a length far below `error_mm`, so it needs no case of its own.
        """
        import numpy as np

        least = min(self.radii_mm)
        radii = np.array(self.radii_mm) / least
        seen = np.abs(own_points(points, self.middle_mm, self.axes)) / least
        point = np.maximum(seen, _LEAST_RATIO)
        squares = radii**2
        weighted = radii * point
        # Each term alone is 1 at such a place, so their sum is at least 1 at the greatest of them.
        root = (weighted - (squares - 1.0)).max(axis=1)
        for _ in range(_MOST_STEPS):
            below = root[:, None] + (squares - 1.0)
            terms = (weighted / below) ** 2
            excess = terms.sum(axis=1) - 1.0
            step = excess / (2.0 * (terms / below).sum(axis=1))
            root = root + np.maximum(step, 0.0)
            if not np.any(step > 1e-15 * root):
                break
        nearest = squares * point / (root[:, None] + (squares - 1.0))
        length = np.sqrt(((nearest - point) ** 2).sum(axis=1))
        is_inside = ((point / radii) ** 2).sum(axis=1) <= 1.0
        return np.asarray(least * np.where(is_inside, -length, length) - self.rounding_mm)

    def bounds_mm(self) -> Bounds:
        """The bounds: the lengths of the rows of its matrix, and the rounding."""
        a, b, c = (
            math.hypot(*(r * own[i] for r, own in zip(self.radii_mm, self.axes, strict=True)))
            + self.rounding_mm
            for i in range(3)
        )
        return around(self.middle_mm, (a, b, c))

    def volume_mm3(self) -> float:
        """The volume; with a rounding by the formula of Steiner, to about eight digits.

        A negative rounding must be less than the least radius of curvature.
        """
        (a, b, c), r = self.radii_mm, self.rounding_mm
        volume = 4.0 / 3.0 * math.pi * a * b * c
        if r == 0.0:
            return volume
        # Both are integrals of such a root over the unit sphere (Minkowski; Cauchy).
        edges = _over_sphere(a * a, b * b, c * c)
        surface = a * b * c * _over_sphere(a**-2, b**-2, c**-2)
        return volume + r * (surface + r * (edges + r * 4.0 / 3.0 * math.pi))

    def grown(self, by_mm: float) -> Ellipsoid:
        """The ellipsoid with a greater rounding."""
        return replace(self, rounding_mm=self.rounding_mm + by_mm)

    def parts(self) -> Iterator[tuple[str, tuple[float, ...], bool]]:
        """Centre and radii."""
        yield "centre", self.middle_mm, False
        yield "radii", self.radii_mm, True
        yield "depth", (self.depth_mm,), True

    def reach_mm(self) -> float:
        """The greatest radius, and the rounding."""
        return max(self.radii_mm) + self.rounding_mm


def _over_sphere(p: float, q: float, s: float) -> float:
    """The integral of ``sqrt(p x^2 + q y^2 + s z^2)`` over the unit sphere."""
    import numpy as np

    heights, weights = np.polynomial.legendre.leggauss(200)
    turns = np.linspace(0.0, 2.0 * math.pi, 400, endpoint=False)
    aside = 1.0 - heights[:, None] ** 2
    flat = aside * (p * np.cos(turns) ** 2 + q * np.sin(turns) ** 2)
    means = np.sqrt(flat + s * heights[:, None] ** 2).mean(axis=1)
    return float(2.0 * math.pi * (weights @ means))
