"""The field of a mesh: signed distances at the points of a grid.

The surface is replaced by points: each triangle is cut into k^2 similar ones, and their corners are
taken. A point ``p`` that is nearest to ``q`` of a triangle has a corner ``s`` of the small triangle
(or of the small edge) around ``q`` at most ``e`` away from ``q`` and in the same plane (or on the
same edge), at right angles to ``p - q``. So ``d^2 <= |p - s|^2 <= d^2 + e^2``: the nearest of the
points is farther than the surface by at most ``e`` nearby, and ``e^2 / 2 d`` far away. Triangles
far from the grid need fewer points for the same error.

Inside or outside is asked by the winding number: along each row of the grid, the triangles that it
crosses count +1 where it leaves and -1 where it enters the solid. The rows are moved aside by a
millionth of a step, so that none runs through an edge; if the sums along a row do not come out even
all the same, another such length is tried.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Final

from ntagen.imaging.grid import Grid, Wish, grid_over
from ntagen.imaging.meshes import Mesh, inverted
from ntagen.imaging.mistakes import ImageError
from ntagen.shapes import SAMPLES_PER_MM, UPRIGHT, Field, Vector, vector_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Points = NDArray[np.float64]

_ERROR_RATIO: Final = 0.1
"""The points of the surface are farther than the surface by this share of a step, at most."""

_LEVELS: Final = (24.0, 6.0, 1.5, 0.0)
"""Distances in steps: what is farther away than one of them is asked of ever fewer points."""

_MOST_POINTS: Final = 3_000_000
_MOST_PAIRS: Final = 2_000_000
_SHIFTS: Final = ((1.37e-6, 2.71e-6), (-3.11e-6, 1.93e-6), (5.3e-6, -4.1e-6), (-7.7e-6, -6.1e-6))
_SHIFT_MM: Final = 1e-4
"""More than a row is moved aside, in mm."""


def field_of_mesh(mesh: Mesh, wish: Wish, name: str) -> Field:
    """The field of a mesh that is in mm in the frame of the scene.

    Args:
        mesh: The mesh.
        wish: What is said of the grid.
        name: Its file, for messages.

    Raises:
        ImageError: Parts of the mesh are inverted, or the grid would be too large.
    """
    import numpy as np

    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    grid = grid_over(UPRIGHT, (vector_of(low), vector_of(high)), wish)
    winding = _winding(mesh, grid, name)
    if (winding < 0).any():
        raise inverted(name)
    excess_mm, away = _distances(mesh, grid)
    distance = np.maximum(away - 0.5 * excess_mm, 0.0)
    signed = np.where(winding > 0, -distance, distance)
    return made_field(
        grid,
        signed,
        0.5 * excess_mm + _SHIFT_MM,
        (vector_of(low), vector_of(high)),
        mesh.vertices,
        mesh.volume,
        wish,
    )


def made_field(
    grid: Grid,
    signed: Points,
    doubt_mm: float,
    bounds: tuple[Vector, Vector],
    ends: Points,
    volume_mm3: float,
    wish: Wish,
) -> Field:
    """A field from signed distances on a grid.

    Args:
        grid: The grid.
        signed: The distances, with the shape of the grid.
        doubt_mm: How far they may be off.
        bounds: The bounds of the solid along the axes of the grid.
        ends: Points whose convex hull contains the solid, in the world.
        volume_mm3: The volume of the solid.
        wish: What is said of the grid.
    """
    import numpy as np

    axes = np.array(grid.axes)
    low = np.array(grid.low_mm)
    deepest = np.unravel_index(int(np.argmin(signed)), signed.shape)
    middle = (low + np.array(deepest) * np.array(grid.steps_mm)) @ axes
    units = np.clip(np.rint(signed * SAMPLES_PER_MM), -(2.0**31) + 1, 2.0**31 - 1)
    return Field(
        corner_mm=vector_of(low @ axes),
        axes=grid.axes,
        extent_mm=grid.extent_mm,
        counts=grid.counts,
        samples=units.astype("<i4").tobytes(),
        doubt_mm=doubt_mm,
        low_mm=vector_of(np.array(bounds[0]) - low),
        high_mm=vector_of(np.array(bounds[1]) - low),
        middle_mm=vector_of(middle),
        radius_mm=float(np.sqrt(((ends - middle) ** 2).sum(axis=1)).max()),
        deepest_mm=max(-float(signed[deepest]), 1.0 / SAMPLES_PER_MM),
        body_mm3=volume_mm3,
        is_inner=wish.is_inner,
    )


def _distances(mesh: Mesh, grid: Grid) -> tuple[float, Points]:
    """Distances of the points of the grid that are too great by a length at most; and that length.

    Few points of the surface are enough for what is far away from it, so the others are asked only
    about what is near.
    """
    import numpy as np

    excess = _excess(mesh, grid)
    places = np.stack(np.meshgrid(*map(grid.places, range(3)), indexing="ij"), axis=-1)
    places = places.reshape(-1, 3)
    away, open_ = np.full(len(places), np.inf), np.arange(len(places))
    for steps in _LEVELS:
        least = steps * max(grid.steps_mm)
        cuts = _cuts_for(mesh, grid, max(excess, math.sqrt(2.0 * excess * least)), excess)
        away[open_] = _nearest(_points(mesh, cuts), places[open_])
        open_ = open_[away[open_] < least + excess]
    return excess, away.reshape(grid.counts)


def _excess(mesh: Mesh, grid: Grid) -> float:
    """How much farther than the surface its points may be, so that there are not too many."""
    excess = _ERROR_RATIO * min(grid.steps_mm)
    while True:
        cuts = _cuts_for(mesh, grid, excess, excess)
        if ((cuts + 1) * (cuts + 2) // 2).sum() <= _MOST_POINTS or (cuts == 1).all():
            return excess
        excess *= 1.3


def _cuts_for(mesh: Mesh, grid: Grid, apart: float, excess: float) -> NDArray[np.int64]:
    """How fine to cut triangles so that points are at most this far apart, or farther far away."""
    import numpy as np

    corners = mesh.corners
    longest = np.sqrt(((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2)).max(axis=1)
    first = np.array(grid.low_mm)
    last = first + np.array(grid.extent_mm)
    beyond = np.maximum(first - corners.max(axis=1), corners.min(axis=1) - last)
    away = np.sqrt((np.maximum(beyond, 0.0) ** 2).sum(axis=1))
    allowed = np.maximum(apart, np.sqrt(2.0 * excess * away))
    # No point of a triangle is farther from all corners than the longest edge by root 3.
    cuts = np.ceil(longest / (math.sqrt(3.0) * allowed))
    return np.asarray(np.maximum(1, cuts).astype(np.int64))


def _points(mesh: Mesh, cuts: NDArray[np.int64]) -> Points:
    """The corners of the parts of all triangles."""
    import numpy as np

    corners = mesh.corners
    return np.concatenate([_cut(corners[cuts == k], int(k)) for k in np.unique(cuts)])


def _cut(corners: Points, k: int) -> Points:
    """The corners of the k^2 parts of each triangle."""
    import numpy as np

    shares = [(i / k, j / k) for i in range(k + 1) for j in range(k + 1 - i)]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    points = np.concatenate([a + s * (b - a) + t * (c - a) for s, t in shares])
    return np.unique(points, axis=0) if k == 1 else points


def _nearest(points: Points, places: Points) -> Points:
    """The distances from places to the nearest points."""
    import numpy as np
    from scipy.spatial import cKDTree  # type: ignore[import-untyped]

    return np.asarray(cKDTree(points).query(places)[0])


def _winding(mesh: Mesh, grid: Grid, name: str) -> NDArray[np.int64]:
    """The winding numbers of the points of the grid.

    Raises:
        ImageError: They cannot be found.
    """
    import numpy as np

    corners = (mesh.corners - np.array(grid.low_mm)) / np.array(grid.steps_mm)
    for shift in _SHIFTS:
        steps = _crossings(corners, grid, shift)
        if not steps.sum(axis=2).any():
            # What lies ahead of a point: the sum of all steps behind its place in the row.
            ahead = np.cumsum(steps[:, :, ::-1], axis=2)[:, :, ::-1]
            return np.moveaxis(ahead[:, :, 1:], 2, 0)
    raise ImageError(
        "mesh-not-closed",
        f"whether points lie in `{name}` cannot be told: its triangles are too thin",
        "make the mesh anew with more regular triangles (remesh)",
    )


def _crossings(corners: Points, grid: Grid, shift: tuple[float, float]) -> NDArray[np.int64]:
    """By row of the grid along x: how the winding number changes before each of its points."""
    import numpy as np

    n, rows, columns = grid.counts
    steps = np.zeros((rows, columns, n + 1), dtype=np.int64)
    flat = corners[:, :, 1:] - np.array(shift)
    first = np.maximum(np.ceil(flat.min(axis=1)), 0).astype(np.int64)
    last = np.minimum(np.floor(flat.max(axis=1)), np.array([rows, columns]) - 1).astype(np.int64)
    sizes = np.maximum(last - first + 1, 0)
    pairs = sizes.prod(axis=1)
    used = np.flatnonzero(pairs)
    for part in _parts(pairs[used]):
        owner = np.repeat(used[part], pairs[used[part]])
        start = np.concatenate([[0], np.cumsum(pairs[used[part]])[:-1]])
        number = np.arange(len(owner)) - np.repeat(start, pairs[used[part]])
        place = first[owner] + np.stack(np.divmod(number, sizes[owner, 1]), axis=1)
        a, b, c = np.moveaxis(flat[owner] - place[:, None, :], 1, 0)
        weights = np.stack([_area(b, c), _area(c, a), _area(a, b)], axis=1)
        whole = weights.sum(axis=1)
        is_in = ((weights > 0.0).all(axis=1) | (weights < 0.0).all(axis=1)) & (whole != 0.0)
        along = corners[owner[is_in], :, 0]
        at = (weights[is_in] * along).sum(axis=1) / whole[is_in]
        index = np.clip(np.ceil(at), 0, n).astype(np.int64)
        j, k = place[is_in].T
        np.add.at(steps, (j, k, index), np.where(whole[is_in] > 0.0, 1, -1))
    return steps


def _parts(counts: NDArray[np.int64]) -> list[slice]:
    """Ranges of entries whose counts add up to at most `_MOST_PAIRS`, or one entry alone."""
    import numpy as np

    if not len(counts):
        return []
    group = np.cumsum(counts) // _MOST_PAIRS
    bounds = [0, *(np.flatnonzero(np.diff(group)) + 1).tolist(), len(counts)]
    return [slice(a, b) for a, b in itertools.pairwise(bounds)]


def _area(one: Points, two: Points) -> Points:
    """The cross products of vectors in a plane."""
    return one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
