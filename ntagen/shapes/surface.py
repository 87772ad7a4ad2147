"""Points of the surfaces of shapes, for pictures, and for the question what lies in what."""

from __future__ import annotations

import functools
import math
from typing import Final

from ntagen.shapes.field import Field
from ntagen.shapes.round import Sphere
from ntagen.shapes.shape import Points, Shape, Vector
from ntagen.shapes.skin import skin

_HALVINGS: Final = 50
_MOST_MM: Final = 100.0
"""A ray that does not leave its shape, as in a half-space, ends here."""

_ROWS, _COLUMNS = 13, 24


def surface_mm(shape: Shape, directions: Points) -> Points:
    """Where rays from the middle of a shape leave it.

    Args:
        shape: A convex shape; its middle lies inside, or on its surface.
        directions: Unit vectors, with the shape (n, 3).
    """
    import numpy as np

    middle = np.array(shape.center_mm)
    low = np.zeros(len(directions))
    high = np.full(len(directions), min(_MOST_MM, shape.reach_mm()))
    for _ in range(_HALVINGS):
        half = 0.5 * (low + high)
        is_inside = shape.distance_mm(middle + half[:, None] * directions) <= 0.0
        low, high = np.where(is_inside, half, low), np.where(is_inside, high, half)
    return np.asarray(middle + high[:, None] * directions)


def outline_mm(shape: Shape, directions: Points) -> Points:
    """The points of the surface that are nearest to points around the shape, in these directions.

    So ends, edges and corners have many points, and flat sides few: what a picture of a convex
    shape needs, and where another convex shape is least deep around it. The nearest point follows
    from the slope of the distance. A half-space has no points around; see `surface_mm`.
    """
    import numpy as np

    if not math.isfinite(shape.reach_mm()):
        return surface_mm(shape, directions)
    away_mm = _AROUND_RATIO * shape.reach_mm()
    points = np.array(shape.center_mm) + away_mm * directions
    step = 1e-4 * away_mm * np.eye(3)
    rises = [shape.distance_mm(points + one) - shape.distance_mm(points - one) for one in step]
    slope = np.stack(rises, axis=1)
    slope /= np.linalg.norm(slope, axis=1)[:, None]
    # The second and third time correct the slope's rounding.
    for _ in range(3):
        points = points - shape.distance_mm(points)[:, None] * slope
    return np.asarray(points)


def directions() -> Points:
    """Unit vectors all around, as a grid of rows from pole to pole: (rows, columns, 3)."""
    import numpy as np

    over = np.linspace(0.0, np.pi, _ROWS)[:, None]
    around = np.linspace(0.0, 2.0 * np.pi, _COLUMNS + 1)[None, :]
    grid = [np.cos(around) * np.sin(over), np.sin(around) * np.sin(over), np.cos(over)]
    return np.stack([part + 0.0 * around for part in grid], axis=-1)


def triangles(shape: Shape) -> tuple[Points, list[int]]:
    """Points of the surface, and for each triangle between them three of their numbers."""
    if isinstance(shape, Field):
        points, rows = skin(shape)
        return points, rows.reshape(-1).tolist()
    grid = directions()
    rows, columns, _ = grid.shape
    indices: list[int] = []
    for row in range(rows - 1):
        for column in range(columns - 1):
            one = row * columns + column
            two = one + columns
            indices += [one, two, one + 1, one + 1, two, two + 1]
    return outline_mm(shape, grid.reshape(-1, 3)), indices


def _skin_mm(shape: Shape) -> Points:
    """Some hundred points of the surface of a convex shape, or all that a field has."""
    import numpy as np

    if isinstance(shape, Field):
        points, _ = skin(shape)
        return points if len(points) else np.array([shape.middle_mm])
    return outline_mm(shape, directions().reshape(-1, 3))


def is_in(shape: Shape, point_mm: Vector) -> bool:
    """Whether a point lies in a shape; most that do not are seen by the bounds."""
    low, high = shape.bounds_mm()
    if any(not a <= p <= b for a, p, b in zip(low, point_mm, high, strict=True)):
        return False
    return shape.distance_at_mm(point_mm) <= 0.0


def overlap(one: Shape, two: Shape) -> bool:
    """Whether two shapes have more than their surfaces in common.

    Exact for spheres; else some hundred points of both surfaces are taken, and both middles.
    """
    if math.dist(one.center_mm, two.center_mm) >= one.reach_mm() + two.reach_mm():
        return False
    (low, high), (least, most) = one.bounds_mm(), two.bounds_mm()
    if any(b <= c or d <= a for a, b, c, d in zip(low, high, least, most, strict=True)):
        return False
    # The distance of the middle of a sphere says all.
    if isinstance(one, Sphere):
        return two.distance_at_mm(one.middle_mm) < one.radius_mm
    if isinstance(two, Sphere):
        return one.distance_at_mm(two.middle_mm) < two.radius_mm
    if is_in(one, two.center_mm) or is_in(two, one.center_mm):
        return True
    return any(
        bool((other.distance_mm(_around_mm(shape)) < -other.error_mm).any())
        for shape, other in ((one, two), (two, one))
    )


def _around_mm(shape: Shape) -> Points:
    """Points of the surface for the question whether something else is in it."""
    if isinstance(shape, Field):
        return _skin_mm(shape)
    return surface_mm(shape, directions().reshape(-1, 3))


def thickness_mm(outer: Shape, inner: Shape) -> float:
    """The least depth in one shape of the surface of another; negative if it is not inside.

    It is exact for a sphere inside, and for a grown shape around the one that it was made of. Else
    the depth of some hundred points of the surface is taken. Their places are right to 1e-7 mm, and
    those of the surface of a field to its error.
    """
    if isinstance(outer, Field) and isinstance(inner, Field):
        rounding_mm = outer.rounding_mm - inner.rounding_mm
        if inner.grown(rounding_mm) == outer:
            return rounding_mm
    if isinstance(inner, Sphere):
        return -(outer.distance_at_mm(inner.middle_mm) + inner.radius_mm)
    (low, high), (least, most) = inner.bounds_mm(), outer.bounds_mm()
    ends = [(c - a) for a, c in zip(low, least, strict=True) if math.isfinite(c)]
    ends += [(b - d) for b, d in zip(high, most, strict=True) if math.isfinite(d)]
    outside_mm = max(ends, default=-math.inf)
    return -outside_mm if outside_mm > _TOUCH_MM else _thickness_mm(outer, inner)


@functools.lru_cache(maxsize=4096)
def _thickness_mm(outer: Shape, inner: Shape) -> float:
    """The same for shapes whose bounds say nothing; a driver asks for the same ones often."""
    return float(-outer.distance_mm(_skin_mm(inner)).max())


_AROUND_RATIO: Final = 3.0
_TOUCH_MM: Final = 1e-6
