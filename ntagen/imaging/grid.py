"""Which grid a field gets: where the solid is and the needle can come, and how fine it is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from ntagen.imaging.mistakes import ImageError
from ntagen.shapes import Axes, Bounds, Vector, vector_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

USUAL_ENTRIES: Final = 2**17
"""A grid that is not said has about so many points (50 along each axis)."""

MOST_ENTRIES: Final = 2**21
"""A grid may have so many points: 128 along each axis."""

LEAST_STEP_MM: Final = 0.1
"""No grid that is not said is finer."""


@dataclass(frozen=True, slots=True)
class Workspace:
    """Where the tip can come: half of a ball about its start, up to a depth.

    Attributes:
        start_mm: Where the tip is.
        heading: The direction of insertion, of length 1.
        length_mm: How much of the needle can be inserted.
        depth_mm: How deep along the heading anything is of interest.
    """

    start_mm: Vector
    heading: Vector
    length_mm: float
    depth_mm: float = math.inf

    def along(self, axis: Vector) -> tuple[float, float]:
        """The least and the greatest coordinate along an axis of length 1."""
        start = _dot(self.start_mm, axis)
        ahead = max(-1.0, min(1.0, _dot(self.heading, axis)))
        aside = math.sqrt(1.0 - ahead * ahead)
        most = self.length_mm * (1.0 if ahead >= 0.0 else aside)
        least = self.length_mm * (1.0 if ahead <= 0.0 else aside)
        # In the slab up to the depth, nothing is farther along the axis than this.
        reach = min(self.depth_mm, self.length_mm) * abs(ahead) + self.length_mm * aside
        if ahead > 0.0:
            most = min(most, reach)
        elif ahead < 0.0:
            least = min(least, reach)
        return start - least, start + most


@dataclass(frozen=True, slots=True)
class Grid:
    """Points in rows along three axes.

    Attributes:
        axes: The axes in the world.
        low_mm: The coordinates of the first point along the axes, seen from the world's origin.
        extent_mm: From there to the last point.
        counts: How many points there are along each axis.
    """

    axes: Axes
    low_mm: Vector
    extent_mm: Vector
    counts: tuple[int, int, int]

    @property
    def steps_mm(self) -> Vector:
        """The distances between neighbours."""
        return vector_of(e / (n - 1) for e, n in zip(self.extent_mm, self.counts, strict=True))

    def places(self, axis: int) -> NDArray[np.float64]:
        """The coordinates of the points along an axis."""
        import numpy as np

        low = self.low_mm[axis]
        return np.linspace(low, low + self.extent_mm[axis], self.counts[axis])


@dataclass(frozen=True, slots=True)
class Wish:
    """What the description says of a grid.

    Attributes:
        workspace: Where the tip can come.
        margin_mm: How far around the solid distances matter.
        step_mm: The greatest distance of neighbours; none is as fine as is usual.
        is_inner: Whether the field asks what is inside for sure, as for a target.
    """

    workspace: Workspace
    margin_mm: float = 5.0
    step_mm: float | None = None
    is_inner: bool = False


def grid_over(axes: Axes, bounds: Bounds, wish: Wish, finest_mm: float = LEAST_STEP_MM) -> Grid:
    """The grid over the part of a solid that the needle can come near to.

    Args:
        axes: The axes of the grid.
        bounds: The bounds of the solid along these axes.
        wish: What the description says of the grid.
        finest_mm: A finer grid would say no more.

    Raises:
        ImageError: The grid would have too many points.
    """
    low, high = [], []
    for axis, a, b in zip(axes, *bounds, strict=True):
        least, most = wish.workspace.along(axis)
        # What is out of reach still needs a grid; two points along each axis are enough.
        start, end = max(a, least) - wish.margin_mm, min(b, most) + wish.margin_mm
        if end <= start:
            start, end = a - wish.margin_mm, b + wish.margin_mm
        low.append(start)
        high.append(end)
    extent = [b - a for a, b in zip(low, high, strict=True)]
    step_mm = wish.step_mm
    if step_mm is None:
        step_mm = max(finest_mm, (math.prod(extent) / USUAL_ENTRIES) ** (1.0 / 3.0))
    counts = [max(2, math.ceil(min(e / step_mm, 1e9)) + 1) for e in extent]
    if math.prod(counts) > (MOST_ENTRIES if wish.step_mm is not None else 2 * USUAL_ENTRIES):
        coarse = (math.prod(extent) / MOST_ENTRIES) ** (1.0 / 3.0)
        raise ImageError(
            "image-too-large",
            f"a grid of {step_mm:.3g} mm has {math.prod(counts):,} points here, "
            f"more than {MOST_ENTRIES:,}",
            f"write for example `grid {math.ceil(12.0 * coarse) / 10.0:g} mm`, "
            "or a shorter `length` of the needle",
        )
    x, y, z = counts
    return Grid(axes, vector_of(low), vector_of(extent), (x, y, z))


def _dot(one: Vector, two: Vector) -> float:
    return math.fsum(a * b for a, b in zip(one, two, strict=True))
