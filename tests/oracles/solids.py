"""Signed distances to meshes and to voxels by brute force: every triangle and every box is asked.

Nothing here is taken from `ntagen`. The distance to a triangle is the least of those to its plane,
if the foot lies in it, and to its three edges. Inside is asked by the solid angle of all triangles
(A. van Oosterom, J. Strackee, "The Solid Angle of a Plane Triangle", 1983).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_PAIRS = 2_000_000


def mesh_distance(points: Array, corners: Array) -> Array:
    """Signed distances to a closed mesh, given by the corners of its triangles (n, 3, 3)."""
    rows = max(1, _PAIRS // len(corners))
    pieces = [_of_mesh(points[i : i + rows], corners) for i in range(0, len(points), rows)]
    return np.concatenate(pieces)


def _of_mesh(points: Array, corners: Array) -> Array:
    seen = corners[None] - points[:, None, None]
    a, b, c = seen[:, :, 0], seen[:, :, 1], seen[:, :, 2]
    least = np.minimum(_edge(a, b), np.minimum(_edge(b, c), _edge(c, a)))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    unit = normal / length[:, None]
    sides = [
        np.einsum("pti,ti->pt", np.cross(one, two), unit) for one, two in ((a, b), (b, c), (c, a))
    ]
    height = np.abs(np.einsum("pti,ti->pt", a, unit))
    is_over = np.all([side >= 0.0 for side in sides], axis=0)
    least = np.where(is_over, np.minimum(least, height), least).min(axis=1)
    x, y, z = (np.linalg.norm(one, axis=2) for one in (a, b, c))
    top = np.einsum("pti,pti->pt", a, np.cross(b, c))
    below = (
        x * y * z
        + np.einsum("pti,pti->pt", a, b) * z
        + np.einsum("pti,pti->pt", b, c) * x
        + np.einsum("pti,pti->pt", c, a) * y
    )
    turns = 2.0 * np.arctan2(top, below).sum(axis=1) / (4.0 * np.pi)
    return np.where(turns > 0.5, -least, least)


def _edge(one: Array, two: Array) -> Array:
    """The distances of the origin to edges."""
    way = two - one
    share = -np.einsum("pti,pti->pt", one, way) / np.einsum("pti,pti->pt", way, way)
    return np.linalg.norm(one + np.clip(share, 0.0, 1.0)[..., None] * way, axis=2)


def voxel_distance(points: Array, voxels: NDArray[np.bool_], spacing: Array) -> Array:
    """Signed distances to a union of boxes about whole multiples of the spacing."""
    filled = np.argwhere(np.pad(voxels, 1)) - 1
    empty = np.argwhere(~np.pad(voxels, 1)) - 1
    away = _boxes(points, filled * spacing, 0.5 * spacing)
    depth = _boxes(points, empty * spacing, 0.5 * spacing)
    return np.where(away > 0.0, away, -depth)


def _boxes(points: Array, centers: Array, half: Array) -> Array:
    rows = max(1, _PAIRS // len(centers))
    found = []
    for i in range(0, len(points), rows):
        beyond = np.abs(points[i : i + rows, None] - centers[None]) - half
        found.append(np.sqrt((np.maximum(beyond, 0.0) ** 2).sum(axis=2)).min(axis=1))
    return np.concatenate(found)
