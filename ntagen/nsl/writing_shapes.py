"""Numbers, shapes and motions as an environment file says them.

A file says by an angle and an axis, or by a margin, what a value has as axes or as a larger shape.
Here these are found again: the short ones that a person writes are tried first, and one that gives
back each digit wins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from ntagen.motion import Motion
from ntagen.nsl.vectors import dot, minus, times, unit
from ntagen.scene import Region, Vector
from ntagen.shapes import (
    UPRIGHT,
    Axes,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Field,
    HalfSpace,
    Shape,
    Sphere,
    turning,
)
from ntagen.units import deg_from_rad, rad_from_deg

_DIGITS: Final = (0, 3, 6, 9)
_LAST_DIGITS: Final = 1e-15
_MULTIPLES: Final = 12
"""The components of an axis are tried as whole numbers up to this one."""


class CannotSayError(Exception):
    """The language has no words for a shape; the text goes behind the name of the region."""


def number(value: float) -> str:
    """A number with all its digits, and without a fraction of 0."""
    return repr(value).removesuffix(".0")


def vector(value: Vector) -> str:
    """Three numbers in parentheses."""
    return f"({', '.join(map(number, value))})"


def angle(value_rad: float) -> str:
    """An angle in degrees, or in rad if that alone keeps its digits."""
    for digits in _DIGITS:
        degrees = round(deg_from_rad(value_rad), digits)
        if rad_from_deg(degrees) == value_rad:
            return f"{number(degrees)} deg"
    return f"{number(value_rad)} rad"


def region_text(region: Region, inner: Region | None) -> str:
    """The statement of a region.

    Args:
        region: The region.
        inner: The critical region around which it lies; None if there is none.

    Raises:
        CannotSayError: Its shape has no words.
    """
    if region.around is not None:
        margin_mm = 1.0 if inner is None else _margin_mm(region.shape, inner.shape)
        text = f"around {region.around} margin {number(margin_mm)} mm"
    else:
        text = _shape(region.shape)
    # A shell moves with what it lies around.
    is_moved = inner is not None and inner.motion == region.motion
    moves = "" if region.motion is None or is_moved else f" {_moves(region.motion)}"
    return f"{region.kind} {region.name} {text}{moves}"


def _shape(shape: Shape) -> str:
    match shape:
        case Sphere(middle_mm=middle, radius_mm=radius):
            return f"sphere {vector(middle)} mm radius {number(radius)} mm"
        case Box(middle_mm=middle, size_mm=size, axes=axes):
            return f"box {vector(middle)} mm size {vector(size)} mm{_turned(axes)}"
        case Ellipsoid(middle_mm=middle, radii_mm=radii, axes=axes):
            return f"ellipsoid {vector(middle)} mm radii {vector(radii)} mm{_turned(axes)}"
        case Capsule(start_mm=start, end_mm=end, start_radius_mm=first, end_radius_mm=last):
            second = "" if first == last else f" to {number(last)} mm"
            ends = f"{vector(start)} mm to {vector(end)} mm"
            return f"capsule {ends} radius {number(first)} mm{second}"
        case Cylinder(start_mm=start, end_mm=end, radius_mm=radius):
            return f"cylinder {vector(start)} mm to {vector(end)} mm radius {number(radius)} mm"
        case HalfSpace(point_mm=point, towards=towards):
            return f"halfspace {vector(point)} mm towards {vector(towards)}"
        case Field():
            raise CannotSayError(
                "is the shape of a mesh or segmentation, of which a scene has the samples and not "
                "the file\nhint: keep the environment file that names it, or give it another shape"
            )
    raise CannotSayError(
        f"is a {type(shape).__name__}, for which the language has no words\n"
        "hint: give it a shape of `ntagen.shapes`"
    )


def _margin_mm(outer: Shape, inner: Shape) -> float:
    """The margin by which a shape is larger than another one; if it is not, any number."""
    wish = 1.0
    if isinstance(outer, HalfSpace) and isinstance(inner, HalfSpace):
        wish = dot(minus(inner.point_mm, outer.point_mm), inner.towards)
    for measure in ("radius_mm", "start_radius_mm", "rounding_mm"):
        if hasattr(outer, measure) and hasattr(inner, measure):
            wish = getattr(outer, measure) - getattr(inner, measure)
    tried = [*(round(wish, digits) for digits in _DIGITS), wish]
    return next((one for one in tried if one > 0.0 and inner.grown(one) == outer), wish)


def _turned(axes: Axes) -> str:
    """The clause that turns a shape; empty if it is not turned."""
    if axes == UPRIGHT:
        return ""
    turn_rad, axis = _turn(axes)
    tried = [(*one, turning(unit(one[1]), one[0])) for one in _short_turns(turn_rad, axis)]
    found = next((one for one in tried if one[2] == axes), None)
    # Else the first short one whose axes differ in their last digits only.
    found = found or next((one for one in tried if _apart(one[2], axes) <= _LAST_DIGITS), None)
    found = found or (turn_rad, axis, axes)
    return f" turned {angle(found[0])} about {vector(found[1])}"


def _apart(first: Axes, second: Axes) -> float:
    """The greatest difference of two components."""
    pairs = zip(first, second, strict=True)
    return max(abs(a - b) for one, other in pairs for a, b in zip(one, other, strict=True))


def _short_turns(turn_rad: float, axis: Vector) -> Iterator[tuple[float, Vector]]:
    """Turns near one, as a person would write them."""
    largest = max(map(abs, axis))
    scaled = times(1.0 / largest, axis)
    other_side = (math.tau - turn_rad, times(-1.0, scaled))
    for about_rad, towards in ((turn_rad, scaled), other_side):
        angles = [rad_from_deg(round(deg_from_rad(about_rad), digits)) for digits in _DIGITS]
        for multiple in range(1, _MULTIPLES + 1):
            x, y, z = (round(multiple * component, 9) + 0.0 for component in towards)
            yield from ((one, (x, y, z)) for one in (*angles, about_rad))


def _turn(axes: Axes) -> tuple[float, Vector]:
    """The angle and the axis of a turn, from 0 to half a turn, by way of its quaternion.

    Source: S. W. Shepperd, "Quaternion from rotation matrix" (1978): the largest part comes first,
    so that nothing is divided by a small number.
    """
    (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = axes
    squares = (1.0 + xx + yy + zz, 1.0 + xx - yy - zz, 1.0 - xx + yy - zz, 1.0 - xx - yy + zz)
    largest = max(range(4), key=lambda index: squares[index])
    w, x, y, z = (
        (squares[0], zy - yz, xz - zx, yx - xy),
        (zy - yz, squares[1], yx + xy, xz + zx),
        (xz - zx, yx + xy, squares[2], zy + yz),
        (yx - xy, xz + zx, zy + yz, squares[3]),
    )[largest]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    length = math.hypot(x, y, z)
    if length == 0.0:
        return 0.0, (0.0, 0.0, 1.0)
    return 2.0 * math.atan2(length, w), (x / length, y / length, z / length)


def _moves(motion: Motion) -> str:
    """The clause of a motion."""
    every = f"every {number(motion.period_s)} s"
    if motion.table:
        places = (f"{vector(place)} mm after {number(time)} s" for time, place in motion.table)
        return f"moves through {', '.join(places)} {every}"
    way_mm, towards = _way(motion.way_mm)
    phase = f" phase {angle(motion.phase_rad)}" if motion.phase_rad else ""
    return f"moves {number(way_mm)} mm along {vector(towards)} {every}{phase}"


def _way(way_mm: Vector) -> tuple[float, Vector]:
    """The length and the direction of a way."""
    length_mm = math.hypot(*way_mm)
    if length_mm == 0.0:
        return 0.0, (0.0, 0.0, 1.0)
    for digits in _DIGITS:
        for towards in (times(1.0 / max(map(abs, way_mm)), way_mm), way_mm):
            for multiple in range(1, _MULTIPLES + 1):
                x, y, z = (round(multiple * component, digits) + 0.0 for component in towards)
                short = round(length_mm, digits)
                if (x or y or z) and times(short, unit((x, y, z))) == way_mm:
                    return short, (x, y, z)
    return length_mm, times(1.0 / length_mm, way_mm)
