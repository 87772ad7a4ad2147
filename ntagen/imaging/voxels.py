"""The field of a part of a segmentation: signed distances to a union of boxes.

Each voxel is a box about its centre. The square of the distance of a point to a box is a sum over
the three axes of ``max(0, |x - c| - h / 2)^2``, so the least over all boxes is found axis by axis
(P. Felzenszwalb, D. Huttenlocher, "Distance Transforms of Sampled Functions", 2012, with this cost
in place of the square). It is exact, at any points of a grid along the axes of the voxels. The
lower envelope of their paper is not used: all pairs along an axis are, which numpy does fast, and
which is as exact for any cost.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Final

from ntagen.imaging.grid import Wish, grid_over
from ntagen.imaging.segmentations import Mask
from ntagen.imaging.space import Rigid
from ntagen.imaging.surfaces import made_field
from ntagen.shapes import Field, vector_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Values = NDArray[np.float64]

_ROUNDING_MM: Final = 1e-6
_SLAB: Final = 2**22
"""So many numbers of a table are computed at once."""
_FINEST_SHARE: Final = 0.5
"""A grid that is not said is not finer than this share of the least edge of a voxel."""


def field_of_mask(mask: Mask, motion: Rigid, unit_mm: float, wish: Wish) -> Field:
    """The field of a part.

    Args:
        mask: The part.
        motion: From the space of the file, in mm, to the frame of the scene.
        unit_mm: How many mm one unit of the file is.
        wish: What is said of the grid.

    Raises:
        ImageError: The grid would be too large.
    """
    import numpy as np

    spacing = np.array(mask.spacing) * unit_mm
    shift = vector_of(unit_mm * number for number in mask.frame.shift_mm)
    frame = motion.after(Rigid(mask.frame.axes, shift))
    axes = np.array(frame.axes)
    first = axes @ np.array(frame.shift_mm)
    low = first - 0.5 * spacing
    high = low + np.array(mask.voxels.shape) * spacing
    bounds = (vector_of(low), vector_of(high))
    grid = grid_over(frame.axes, bounds, wish, _FINEST_SHARE * float(spacing.min()))
    # In units of voxels, with a layer of other voxels around the part.
    places = [(grid.places(i) - first[i]) / spacing[i] + 1.0 for i in range(3)]
    away = np.sqrt(_squares(mask.voxels, True, places, spacing))
    depth = np.sqrt(_squares(mask.voxels, False, places, spacing))
    # Beyond the layer there is more of the same.
    signed = np.where(away > 0.0, away, -depth)
    corners = list(itertools.product(*zip(low, high, strict=True)))
    doubt_mm = _ROUNDING_MM + mask.doubt * unit_mm
    volume_mm3 = float(mask.voxels.sum()) * math.prod(map(float, spacing))
    return made_field(grid, signed, doubt_mm, bounds, np.array(corners) @ axes, volume_mm3, wish)


def _squares(
    mask: NDArray[np.bool_], is_part: bool, places: list[Values], spacing: Values
) -> Values:
    """The squares of the distances of the points of a grid to the nearest of some voxels.

    The axis that has the fewest points for its voxels comes first, so that no table on the way is
    larger than the voxels or the grid; what is larger than a slab is never in memory.

    Args:
        mask: The voxels of a part, without the layer around it.
        is_part: Whether the nearest voxel of the part is meant, or of what is around.
        places: The places of the grid along each axis, in voxels of the layer.
        spacing: The edges of a voxel.
    """
    import numpy as np

    sizes = [size + 2 for size in mask.shape]
    a, b, c = order = sorted(range(3), key=lambda axis: len(places[axis]) / sizes[axis])
    turned = mask.transpose(order)
    found = np.empty((len(places[a]), len(places[b]), sizes[c]))
    slab = min(_SLAB // (len(places[a]) * sizes[b]), _SLAB // 4 // sizes[a])
    for start in range(0, sizes[c], max(1, slab)):
        part = slice(start, min(sizes[c], start + max(1, slab)))
        first = _first(turned, is_part, part, places[a], float(spacing[a]))
        found[:, :, part] = _along(first, 1, places[b], float(spacing[b]))
    found = _along(found, 2, places[c], float(spacing[c]))
    return found.transpose([order.index(axis) for axis in range(3)])


def _first(
    mask: NDArray[np.bool_], is_part: bool, slab: slice, places: Values, spacing_mm: float
) -> Values:
    """The squares of the distances along the first axis, for a slab of the third."""
    import numpy as np

    n, columns, count = mask.shape[0] + 2, mask.shape[1] + 2, slab.stop - slab.start
    at = np.clip(np.floor(places).astype(int), 0, n - 1)
    then = np.clip(np.ceil(places).astype(int), 0, n - 1)
    x, numbers = places[:, None, None], np.arange(n, dtype=float)[:, None, None]
    inside = slice(max(slab.start, 1), min(slab.stop, mask.shape[2] + 1))
    found = np.empty((len(places), columns, count))
    width = max(1, _SLAB // 4 // (max(n, len(places)) * count))
    for start in range(0, columns, width):
        stop = min(columns, start + width)
        voxels = np.zeros((n, stop - start, count), dtype=np.bool_)
        low, high = max(start, 1), min(stop, columns - 1)
        own = slice(inside.start - slab.start, inside.stop - slab.start)
        voxels[1:-1, low - start : high - start, own] = mask[
            :, low - 1 : high - 1, inside.start - 1 : inside.stop - 1
        ]
        voxels = voxels if is_part else ~voxels
        before = np.maximum.accumulate(np.where(voxels, numbers, -np.inf), axis=0)
        behind = np.minimum.accumulate(np.where(voxels, numbers, np.inf)[::-1], axis=0)[::-1]
        # A place beyond an end sees the nearest voxel on the other side.
        near = np.minimum(np.abs(x - before[at]), np.abs(x - before[then]))
        near = np.minimum(near, np.minimum(np.abs(x - behind[at]), np.abs(x - behind[then])))
        found[:, start:stop] = _cost(near, spacing_mm)
    return found


def _cost(offset: Values, spacing_mm: float) -> Values:
    """The square of the distance along an axis to a box at this offset, in voxels."""
    import numpy as np

    return np.asarray((np.maximum(np.abs(offset) - 0.5, 0.0) * spacing_mm) ** 2)


def _along(values: Values, axis: int, places: Values, spacing_mm: float) -> Values:
    """The least of values and costs along an axis, at these places."""
    import numpy as np

    rows = np.moveaxis(values, axis, 0)
    flat = rows.reshape(len(rows), -1)
    numbers = np.arange(len(rows))
    result = np.empty((len(places), flat.shape[1]))
    for i, place in enumerate(places):
        cost = _cost(place - numbers, spacing_mm)
        # Rows whose cost alone is more than what the nearest row gives need not be looked at.
        nearest = int(np.clip(round(float(place)), 0, len(rows) - 1))
        best = flat[nearest] + cost[nearest]
        most = float(best.max())
        for k in np.flatnonzero(cost < most):
            if k != nearest:
                np.minimum(best, flat[k] + cost[k], out=best)
        result[i] = best
    return np.moveaxis(result.reshape(len(places), *rows.shape[1:]), 0, axis)
