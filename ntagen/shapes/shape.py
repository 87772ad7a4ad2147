"""What every shape can do, and the small algebra of its frame.

A signed distance is negative inside and 0 on the surface. It is 1-Lipschitz: it never changes by
more than the way between two points. So the least distance of a curve follows by subdivision, and
what a distance allows is free.

numpy is imported when many points are asked for, not before: a command that only reads a scene is
faster without it.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Points = NDArray[np.float64]
else:
    Points = object

Vector = tuple[float, float, float]
"""Three numbers along the axes x, y, z."""

Axes = tuple[Vector, Vector, Vector]
"""The own axes of a shape in the world: unit vectors at right angles, right-handed."""

Bounds = tuple[Vector, Vector]
"""The least and the greatest coordinates."""

UPRIGHT: Final[Axes] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""The axes of a shape that is not turned."""


class Shape(ABC):
    """A solid body in space; all lengths are in mm."""

    __slots__ = ()

    is_convex: ClassVar[bool] = False
    """Whether it contains all straight ways between its points; then its distance is a convex
    function, inside too, and the least one along an arc is found sooner."""

    places: ClassVar[tuple[str, ...]]
    """The names of the fields that are points in the world."""

    @property
    @abstractmethod
    def center_mm(self) -> Vector:
        """The middle of the shape; for a half-space, a point of its surface."""

    @property
    @abstractmethod
    def depth_mm(self) -> float:
        """The greatest depth of a point inside: half of the least width."""

    @property
    def error_mm(self) -> float:
        """How far a distance may be off, besides the rounding of double precision."""
        return 0.0

    @property
    def excess_mm(self) -> float:
        """How far a distance may be too favourable: what a certificate takes off for safety."""
        return self.error_mm

    @abstractmethod
    def distance_mm(self, points: Points) -> Points:
        """The signed distances of points with the shape (n, 3) to the surface; negative inside."""

    def distance_at_mm(self, point_mm: Vector) -> float:
        """The signed distance of one point to the surface; negative inside.

        A shape with a closed form writes it twice, without numpy here: one number is computed
        sooner, and many commands need no numpy at all. A test compares both.
        """
        import numpy as np

        return float(self.distance_mm(np.array([point_mm]))[0])

    @abstractmethod
    def bounds_mm(self) -> Bounds:
        """The smallest box along the axes of the world that contains the shape."""

    @abstractmethod
    def volume_mm3(self) -> float:
        """The volume in mm^3."""

    def placed(self, axes: Axes, shift_mm: Vector) -> Self:
        """The shape turned about the origin, so that x, y, z become these axes, and then moved."""
        shape: Any = self
        changed = {name: moved(axes, shift_mm, getattr(shape, name)) for name in self.places}
        own = {"axes": turned(axes, shape.axes)} if hasattr(shape, "axes") else {}
        made: Self = replace(shape, **changed, **own)
        return made

    @abstractmethod
    def grown(self, by_mm: float) -> Shape:
        """All points at most this far from the shape; its corners become round.

        A negative length makes it smaller: what is left are the points at least so deep inside. A
        shape that vanishes has a `depth_mm` of 0 or less.
        """

    @abstractmethod
    def parts(self) -> Iterator[tuple[str, tuple[float, ...], bool]]:
        """Its measures: their names, their numbers, and whether these must be greater than 0."""

    @abstractmethod
    def reach_mm(self) -> float:
        """The radius of a ball about `center_mm` that contains the shape."""


class Centred(Shape):
    """A shape about a point of its own."""

    __slots__ = ()

    places: ClassVar[tuple[str, ...]] = ("middle_mm",)
    middle_mm: Vector
    """The point."""

    @property
    def center_mm(self) -> Vector:
        """The point."""
        return self.middle_mm


def vector_of(numbers: Iterable[float]) -> Vector:
    """Three numbers, such as those of an array, as a vector."""
    x, y, z = map(float, numbers)
    return (x, y, z)


def axes_of(rows: Iterable[Iterable[float]]) -> Axes:
    """Three vectors, such as the rows of an array."""
    x, y, z = map(vector_of, rows)
    return (x, y, z)


def between(start_mm: Vector, end_mm: Vector, share: float) -> Vector:
    """The point at a share of the way."""
    return vector_of(a + share * (b - a) for a, b in zip(start_mm, end_mm, strict=True))


def along(axes: Axes, own: Vector) -> Vector:
    """A vector in the world, from its components along own axes."""
    x, y, z = axes
    return (
        own[0] * x[0] + own[1] * y[0] + own[2] * z[0],
        own[0] * x[1] + own[1] * y[1] + own[2] * z[1],
        own[0] * x[2] + own[1] * y[2] + own[2] * z[2],
    )


def moved(axes: Axes, shift_mm: Vector, point_mm: Vector) -> Vector:
    """A point after it was turned about the origin and moved."""
    x, y, z = along(axes, point_mm)
    return (x + shift_mm[0], y + shift_mm[1], z + shift_mm[2])


def turned(axes: Axes, own: Axes) -> Axes:
    """The axes of a shape after it was turned."""
    return (along(axes, own[0]), along(axes, own[1]), along(axes, own[2]))


def turning(axis: Vector, angle_rad: float) -> Axes:
    """What becomes of x, y, z in a right-handed turn about a direction (formula of Rodrigues).

    Right angles are exact, as they are written in files: a quarter of a turn gives zeros and ones.

    Raises:
        ValueError: The axis is zero or not finite: it has no direction.
    """
    length = math.hypot(*axis)
    if not 0.0 < length < math.inf:
        raise ValueError(f"vector {axis} has no direction")
    x, y, z = (component / length for component in axis)
    quarters = angle_rad / (0.5 * math.pi)
    if abs(quarters - round(quarters)) < 1e-12:
        cosine, sine = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
    else:
        cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    rest = 1.0 - cosine
    return (
        (cosine + x * x * rest, y * x * rest + z * sine, z * x * rest - y * sine),
        (x * y * rest - z * sine, cosine + y * y * rest, z * y * rest + x * sine),
        (x * z * rest + y * sine, y * z * rest - x * sine, cosine + z * z * rest),
    )


def own_point(point_mm: Vector, center_mm: Vector, axes: Axes) -> Vector:
    """A point seen from a centre along own axes."""
    seen = tuple(p - c for p, c in zip(point_mm, center_mm, strict=True))
    return vector_of(sum(s * a for s, a in zip(seen, axis, strict=True)) for axis in axes)


def own_points(points: Points, center_mm: Vector, axes: Axes) -> Points:
    """Points seen from a centre along own axes."""
    import numpy as np

    seen = np.asarray(points, dtype=float) - np.array(center_mm)
    return np.asarray(seen if axes == UPRIGHT else seen @ np.array(axes).T)


def around(center_mm: Vector, half_mm: Vector) -> Bounds:
    """The bounds of a box about a centre, from half of its edges."""
    x, y, z = center_mm
    a, b, c = half_mm
    return (x - a, y - b, z - c), (x + a, y + b, z + c)
