"""The surface of a field, as points and triangles: for pictures, and to ask what lies in what.

Source: S. Gibson, "Constrained Elastic Surface Nets", MICCAI 1998, without the relaxation. A cell
with samples on both sides has a point, the mean of where the surface crosses its edges. An edge of
the grid that the surface crosses has four cells around it, whose points make two triangles.
"""

from __future__ import annotations

import functools
import itertools
from typing import TYPE_CHECKING, Final

from ntagen.shapes.field import SAMPLES_PER_MM, Field
from ntagen.shapes.shape import Points

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_MOST_POINTS: Final = 12_000
"""Surfaces with more points are made from every second sample, or every third, and so on."""


@functools.lru_cache(maxsize=64)
def skin(field: Field) -> tuple[Points, NDArray[np.int64]]:
    """Points of the surface, and triangles between them as rows of three of their numbers.

    The part of the solid outside of the grid has no surface here. All triangles are turned the same
    way round, seen from outside. A field that nothing crosses has none.
    """
    import numpy as np

    values = field.values() / SAMPLES_PER_MM - field.rounding_mm
    for stride in itertools.count(1):
        places, triangles = _net(values[::stride, ::stride, ::stride])
        if len(places) <= _MOST_POINTS:
            break
    own = places * stride * np.array(field.steps_mm)
    return np.array(field.corner_mm) + own @ np.array(field.axes), triangles


def _net(values: Points) -> tuple[Points, NDArray[np.int64]]:
    """The surface net of some samples, in units of the grid."""
    import numpy as np

    if min(values.shape) < 2:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    cells = tuple(n - 1 for n in values.shape)
    sums, counts = np.zeros((*cells, 3)), np.zeros(cells)
    crossings = []
    for axis in range(3):
        one = np.moveaxis(values, axis, 0)[:-1]
        two = np.moveaxis(values, axis, 0)[1:]
        is_crossed = np.moveaxis((one <= 0.0) != (two <= 0.0), 0, axis)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.moveaxis(one / (one - two), 0, axis)
        first, second = (a for a in range(3) if a != axis)
        place = np.argwhere(is_crossed)
        at = place.astype(float)
        at[:, axis] += share[is_crossed]
        for back in itertools.product((0, 1), repeat=2):
            cell = place.copy()
            cell[:, first] -= back[0]
            cell[:, second] -= back[1]
            is_cell = ((cell >= 0) & (cell < np.array(cells))).all(axis=1)
            index = tuple(cell[is_cell].T)
            np.add.at(sums, index, at[is_cell])
            np.add.at(counts, index, 1.0)
        crossings.append((axis, first, second, place, values[tuple(place.T)] <= 0.0))
    is_used = counts > 0.0
    numbers = np.full(cells, -1, dtype=np.int64)
    numbers[is_used] = np.arange(int(is_used.sum()))
    points = sums[is_used] / counts[is_used][:, None]
    triangles = [_quads(numbers, *crossing) for crossing in crossings]
    return points, np.concatenate(triangles)


def _quads(
    numbers: NDArray[np.int64],
    axis: int,
    first: int,
    second: int,
    place: NDArray[np.int64],
    starts_inside: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """The two triangles around each crossed edge along an axis that has four cells around it."""
    import numpy as np

    cells = np.array(numbers.shape)
    has_all = np.ones(len(place), dtype=bool)
    for other in (first, second):
        has_all &= (place[:, other] >= 1) & (place[:, other] < cells[other])
    place, starts_inside = place[has_all], starts_inside[has_all]
    around = []
    for back in ((0, 0), (1, 0), (1, 1), (0, 1)):
        cell = place.copy()
        cell[:, first] -= back[0]
        cell[:, second] -= back[1]
        around.append(numbers[tuple(cell.T)])
    a, b, c, d = around
    # Of the axes x, y, z, the second is the one that leaves a left-handed pair.
    is_turned = starts_inside == (axis != 1)
    one = np.where(is_turned[:, None], np.stack([a, b, c], 1), np.stack([a, c, b], 1))
    two = np.where(is_turned[:, None], np.stack([a, c, d], 1), np.stack([a, d, c], 1))
    return np.concatenate([one, two])
