"""Distances to solids by brute force: from points of their surfaces, made denser where it matters.

A solid is some patches, each a function of two numbers from 0 to 1. All patches are sampled on a
grid; from the sample that is nearest to a point, a smaller and smaller grid follows the distance
down. Whether a point lies inside is asked of a definition of the solid. Nothing here is taken from
`ntagen.shapes`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]
Patch = Callable[[Array, Array], Array]

_GRID = 100
_ZOOMS = 45
_SHRINK = 0.62


@dataclass(frozen=True)
class Solid:
    """Its surface, and whether points lie in it."""

    patches: tuple[Patch, ...]
    contains: Callable[[Array], NDArray[np.bool_]]

    def distance_mm(self, points: Array) -> Array:
        """The signed distances; those of the surface are off by less than 1e-6 mm."""
        steps = (np.arange(_GRID) + 0.5) / _GRID
        u, v = (part.ravel() for part in np.meshgrid(steps, steps))
        best = np.full(len(points), np.inf)
        for patch in self.patches:
            _, index = cKDTree(patch(u, v)).query(points)
            best = np.minimum(best, _refined(patch, points, u[index], v[index]))
        return np.where(self.contains(points), -best, best)


def _refined(patch: Patch, points: Array, u: Array, v: Array) -> Array:
    """The least distance to a patch near the given parameters."""
    width = 1.0 / _GRID
    least = np.full(len(points), np.inf)
    offsets = [(a, b) for a in (-1.0, 0.0, 1.0) for b in (-1.0, 0.0, 1.0)]
    for _ in range(_ZOOMS):
        next_u, next_v = u, v
        for a, b in offsets:
            try_u, try_v = np.clip(u + a * width, 0, 1), np.clip(v + b * width, 0, 1)
            found = np.linalg.norm(points - patch(try_u, try_v), axis=1)
            is_less = found < least
            least = np.where(is_less, found, least)
            next_u, next_v = np.where(is_less, try_u, next_u), np.where(is_less, try_v, next_v)
        u, v = next_u, next_v
        width *= _SHRINK
    return least


def box(center: Array, size: Array, axes: Array) -> Solid:
    """A cuboid; the rows of `axes` are its own axes."""

    def face(axis: int, side: float) -> Patch:
        def patch(u: Array, v: Array) -> Array:
            own = np.empty((len(u), 3))
            own[:, axis] = side * size[axis] / 2
            own[:, (axis + 1) % 3] = (u - 0.5) * size[(axis + 1) % 3]
            own[:, (axis + 2) % 3] = (v - 0.5) * size[(axis + 2) % 3]
            return center + own @ axes

        return patch

    def contains(points: Array) -> NDArray[np.bool_]:
        corner = center - 0.5 * size @ axes
        shares = (points - corner) @ axes.T
        return np.asarray(((shares >= 0) & (shares <= size)).all(axis=1))

    return Solid(tuple(face(axis, side) for axis in range(3) for side in (-1.0, 1.0)), contains)


def ellipsoid(center: Array, radii: Array, axes: Array) -> Solid:
    """An ellipsoid; six patches, so that none has a pole."""

    def face(axis: int, side: float) -> Patch:
        def patch(u: Array, v: Array) -> Array:
            cube = np.empty((len(u), 3))
            cube[:, axis] = side
            cube[:, (axis + 1) % 3], cube[:, (axis + 2) % 3] = 2 * u - 1, 2 * v - 1
            return center + (radii * cube / np.linalg.norm(cube, axis=1)[:, None]) @ axes

        return patch

    def contains(points: Array) -> NDArray[np.bool_]:
        matrix = axes.T @ np.diag(radii**-2) @ axes
        seen = points - center
        return np.asarray(np.einsum("ni,ij,nj->n", seen, matrix, seen) <= 1.0)

    return Solid(tuple(face(axis, side) for axis in range(3) for side in (-1.0, 1.0)), contains)


def _revolved(start: Array, end: Array, profile: Callable[[Array], Array]) -> Patch:
    """The surface of a profile (place along the axis, distance from it) about an axis."""
    axis = (end - start) / np.linalg.norm(end - start)
    other = np.eye(3)[np.argmin(np.abs(axis))]
    side = np.cross(axis, other) / np.linalg.norm(np.cross(axis, other))
    third = np.cross(axis, side)

    def patch(u: Array, v: Array) -> Array:
        place = profile(u)
        # Two rounds, so that a search is never stopped by the seam of the angle.
        angle = 4.0 * math.pi * v
        around = np.outer(np.cos(angle), side) + np.outer(np.sin(angle), third)
        return start + np.outer(place[:, 0], axis) + place[:, 1:] * around

    return patch


def cylinder(start: Array, end: Array, radius: float) -> Solid:
    """A cylinder with flat ends."""
    length = float(np.linalg.norm(end - start))
    profiles: list[Callable[[Array], Array]] = [
        lambda u: np.column_stack([u * length, np.full(len(u), radius)]),
        lambda u: np.column_stack([np.zeros(len(u)), u * radius]),
        lambda u: np.column_stack([np.full(len(u), length), u * radius]),
    ]

    def contains(points: Array) -> NDArray[np.bool_]:
        seen = points - start
        ahead = seen @ (end - start) / length
        aside = np.linalg.norm(np.cross(seen, (end - start) / length), axis=1)
        return np.asarray((ahead >= 0) & (ahead <= length) & (aside <= radius))

    return Solid(tuple(_revolved(start, end, p) for p in profiles), contains)


def capsule(start: Array, end: Array, first: float, second: float) -> Solid:
    """The convex hull of two balls, neither of which contains the other."""
    length = float(np.linalg.norm(end - start))
    # The normal of the cone, from the axis: there both balls reach equally far.
    tilt = math.acos((first - second) / length)

    def arc(middle: float, radius: float, low: float, high: float) -> Callable[[Array], Array]:
        def profile(u: Array) -> Array:
            angle = low + u * (high - low)
            return np.column_stack([middle + radius * np.cos(angle), radius * np.sin(angle)])

        return profile

    def cone(u: Array) -> Array:
        middles, radii = u * length, first + u * (second - first)
        return np.column_stack([middles + radii * math.cos(tilt), radii * math.sin(tilt)])

    def contains(points: Array) -> NDArray[np.bool_]:
        # Many balls in place of all.
        shares = np.linspace(0.0, 1.0, 2001)
        middles, radii = start + np.outer(shares, end - start), first + shares * (second - first)
        inside = np.zeros(len(points), dtype=bool)
        for part in np.array_split(np.arange(len(points)), max(1, len(points) // 1000)):
            squares = ((points[part, None, :] - middles) ** 2).sum(axis=2)
            inside[part] = (squares <= radii**2).any(axis=1)
        return inside

    profiles = [arc(length, second, 0.0, tilt), cone, arc(0.0, first, tilt, math.pi)]
    return Solid(tuple(_revolved(start, end, p) for p in profiles), contains)


def half_space(point: Array, towards: Array) -> Solid:
    """A half-space; its plane is as large as the points need."""
    other = np.eye(3)[np.argmin(np.abs(towards))]
    side = np.cross(towards, other) / np.linalg.norm(np.cross(towards, other))
    third = np.cross(towards, side)

    def patch(u: Array, v: Array) -> Array:
        return point + np.outer(400 * (u - 0.5), side) + np.outer(400 * (v - 0.5), third)

    return Solid((patch,), lambda points: np.asarray((points - point) @ towards >= 0.0))
