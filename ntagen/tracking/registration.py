"""Rigid registration from pairs of points, with its errors.

The rotation and translation with the least sum of squared distances come from a singular value
decomposition (Arun, Huang and Blostein, 1987, with the sign of Umeyama, 1991). Words and formulae
of the errors are those of Fitzpatrick, West and Maurer, "Predicting error in rigid-body point-based
registration", IEEE Transactions on Medical Imaging 17 (1998):

* FLE, the fiducial localisation error: how far a measured point is from the true one.
* FRE, the fiducial registration error: the root mean square distance between pairs after the fit.
  It says how well the points fit, not how good the registration is elsewhere.
* TRE, the target registration error: the expected distance, at some other point, between where the
  registration puts it and where it is. With N points, <FRE^2> = (1 - 2/N) <FLE^2>, and

      <TRE^2>(r) = <FLE^2> / N * (1 + 1/3 * sum over k of d_k^2 / f_k^2),

  where d_k is the distance of r, and f_k the root mean square distance of the points, from the k-th
  principal axis of the points.

A fit always gives numbers, also for points that make no sense. So sets whose result would be wrong
or chance are refused, with the likely mistake.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ntagen.errors import InputError
from ntagen.scene import Vector
from ntagen.shapes import axes_of, vector_of
from ntagen.tracking.frames import Transform

_Array = npt.NDArray[np.float64]

LEAST_POINTS: Final = 3

MOST_POINTS: Final = 200
"""Pairs of them are compared; nobody measures so many."""

_FLAT_RATIO: Final = 0.05
"""Points are on a line, or in a plane, if they extend less than this part of the extent beyond."""

_LEAST_EXTENT_MM: Final = 1.0
_SAME_MM: Final = 0.1
_LARGEST_SCALE: Final = 1.1
"""Sets whose sizes differ by more than this factor are not the same points in the same unit."""

_UNIT_TOLERANCE: Final = 1.15
_UNITS: Final = ((1000.0, "metres"), (10.0, "centimetres"), (25.4, "inches"))
_LARGEST_MISFIT: Final = 0.1
"""The largest FRE, as a part of the extent of the points."""

_SUSPECT_RATIO: Final = 1 / 3
"""A point is bad if the FRE of the others is less than this part of that of all."""

_SUSPECT_MM: Final = 1.0
_LEAST_JUDGED: Final = 5
"""Of fewer points, three others fit almost always."""

_CLEARLY: Final = 0.5
"""A mirrored or exchanged set is named if it fits better by this factor."""


@dataclass(frozen=True, slots=True)
class Pairs:
    """The same points in two frames, one line a point.

    Attributes:
        names: The points' names.
        source: The frame of the first positions.
        target: The frame of the second positions.
        source_mm: The first positions.
        target_mm: The second positions.
    """

    names: tuple[str, ...]
    source: str
    target: str
    source_mm: tuple[Vector, ...]
    target_mm: tuple[Vector, ...]


@dataclass(frozen=True, slots=True)
class Fit:
    """A registration and its errors.

    Attributes:
        transform: The registration.
        names: The points' names.
        residuals_mm: The distance between each pair after the fit.
        left_out_mm: The same for each point after a fit to all others, which is an honest test;
            `None` where the others do not determine a fit.
        fre_mm: The FRE.
        fle_mm: The FLE that follows from it.
        suspect: The name of the one bad point, if the others fit much better without it.
        is_flat: Whether the points lie in a plane. Then a mirrored set looks like a turned one.
        center_mm: The centre of the points in the target frame.
        axes: Their principal axes there, as rows.
        spread_mm: Their root mean square distances from these axes (f_k above).
    """

    transform: Transform
    names: tuple[str, ...]
    residuals_mm: tuple[float, ...]
    left_out_mm: tuple[float | None, ...]
    fre_mm: float
    fle_mm: float
    suspect: str | None
    is_flat: bool
    center_mm: Vector
    axes: tuple[Vector, Vector, Vector]
    spread_mm: Vector

    def tre_mm(self, point_mm: Vector) -> float:
        """The expected TRE (its root mean square) at a point in the target frame."""
        offset = np.array(point_mm) - np.array(self.center_mm)
        along = np.array(self.axes) @ offset
        distances2 = offset @ offset - along**2
        ratio = float(np.sum(distances2 / np.array(self.spread_mm) ** 2)) / 3.0
        return self.fle_mm * math.sqrt((1.0 + ratio) / len(self.names))


def register(pairs: Pairs) -> Fit:
    """The registration that fits pairs of points best.

    Raises:
        InputError: The pairs do not determine one, or something is wrong with them: too few, no
            numbers, on a line, mirrored, exchanged, in different units.
    """
    source, target = np.array(pairs.source_mm), np.array(pairs.target_mm)
    _require_points(pairs, source, target)
    _require_scale(pairs, source, target)
    for frame, points in ((pairs.source, source), (pairs.target, target)):
        _require_extent(frame, points)
    rotation, translation = best_motion(source, target)
    residuals = _residuals(rotation, translation, source, target)
    is_flat = any(
        _extents(points)[2] < _FLAT_RATIO * _extents(points)[0] for points in (source, target)
    )
    if not is_flat:
        _require_same_hand(residuals, source, target)
    _require_fit(pairs, residuals, source, target)
    count, fre_mm = len(pairs.names), _rms(residuals)
    moved = source @ rotation.T + translation
    center, axes, spread = _shape(moved)
    left_out = [_left_out(i, source, target) for i in range(count)]
    return Fit(
        transform=Transform(pairs.source, pairs.target, axes_of(rotation), vector_of(translation)),
        names=pairs.names,
        residuals_mm=tuple(float(one) for one in residuals),
        left_out_mm=tuple(one[0] if one else None for one in left_out),
        fre_mm=fre_mm,
        fle_mm=fre_mm / math.sqrt(1.0 - 2.0 / count),
        suspect=_suspect(pairs.names, left_out, fre_mm),
        is_flat=is_flat,
        center_mm=vector_of(center),
        axes=axes_of(axes),
        spread_mm=vector_of(spread),
    )


# The fit.


def best_motion(source: _Array, target: _Array, *, mirrored: bool = False) -> tuple[_Array, _Array]:
    """The rotation and the translation that bring points nearest to others, by least squares.

    With `mirrored`, the best reflection instead of the rotation.
    """
    source_mean, target_mean = source.mean(axis=0), target.mean(axis=0)
    rotation = best_rotation(source - source_mean, target - target_mean, mirrored=mirrored)
    return rotation, target_mean - rotation @ source_mean


def best_rotation(source: _Array, target: _Array, *, mirrored: bool = False) -> _Array:
    """The rotation about the origin that brings points nearest to others; see `best_motion`."""
    left, _, right = np.linalg.svd(target.T @ source)
    hand = np.linalg.det(left @ right) * (-1.0 if mirrored else 1.0)
    return np.asarray(left @ np.diag([1.0, 1.0, math.copysign(1.0, hand)]) @ right)


def _residuals(rotation: _Array, translation: _Array, source: _Array, target: _Array) -> _Array:
    return np.asarray(np.linalg.norm(source @ rotation.T + translation - target, axis=1))


def _left_out(index: int, source: _Array, target: _Array) -> tuple[float, float] | None:
    """The distance of a pair after a fit to the others, and the FRE of the others."""
    others = np.arange(len(source)) != index
    if np.count_nonzero(others) < LEAST_POINTS:
        return None
    if any(_is_line(points[others]) for points in (source, target)):
        return None
    rotation, translation = best_motion(source[others], target[others])
    distances = _residuals(rotation, translation, source, target)
    return float(distances[index]), _rms(distances[others])


def _suspect(
    names: Sequence[str], left_out: Sequence[tuple[float, float] | None], fre_mm: float
) -> str | None:
    """The point without which all others fit much better, if there is one."""
    if len(names) < _LEAST_JUDGED:
        return None
    found = [(one[1], one[0], name) for name, one in zip(names, left_out, strict=True) if one]
    if not found:
        return None
    others_mm, own_mm, name = min(found)
    is_bad = others_mm < _SUSPECT_RATIO * fre_mm and own_mm > _SUSPECT_MM
    return name if is_bad else None


def _shape(points: _Array) -> tuple[_Array, _Array, _Array]:
    """Centre, principal axes as rows, and the points' root mean square distances from the axes."""
    center = points.mean(axis=0)
    offsets = points - center
    _, _, axes = np.linalg.svd(offsets)
    along2 = np.mean((offsets @ axes.T) ** 2, axis=0)
    return center, axes, np.sqrt(along2.sum() - along2)


def _extents(points: _Array) -> _Array:
    """The root mean square extents along the principal axes, largest first."""
    offsets = points - points.mean(axis=0)
    found = np.zeros(3)
    values = np.linalg.svd(offsets, compute_uv=False)
    found[: len(values)] = values
    return np.asarray(found / math.sqrt(len(points)))


# What is refused.


def _require_points(pairs: Pairs, source: _Array, target: _Array) -> None:
    count = len(pairs.names)
    if count < LEAST_POINTS:
        raise InputError(
            f"there are {count} pairs of points, and a registration needs {LEAST_POINTS} or more\n"
            "hint: six points around the target are a good choice"
        )
    if count > MOST_POINTS:
        raise InputError(
            f"there are {count} pairs of points, and {MOST_POINTS} are allowed\n"
            "hint: six points around the target are a good choice"
        )
    for frame, points in ((pairs.source, source), (pairs.target, target)):
        for name, point in zip(pairs.names, points, strict=True):
            if not np.all(np.isfinite(point)):
                raise InputError(f"the point {name} has no position in the frame {frame}")
        least_mm = _same_mm(points)
        for i in range(count - 1):
            near = np.flatnonzero(np.linalg.norm(points[i + 1 :] - points[i], axis=1) < least_mm)
            if len(near):
                other = pairs.names[i + 1 + near[0]]
                raise InputError(
                    f"{pairs.names[i]} and {other} are the same place in the frame {frame}\n"
                    f"hint: measure each point once, and leave out the others"
                )


def _same_mm(points: _Array) -> float:
    """Points nearer to each other are one; less for sets that are much too small for mm."""
    return min(_SAME_MM, 1e-3 * float(_extents(points)[0]))


def _require_scale(pairs: Pairs, source: _Array, target: _Array) -> None:
    """Refuses sets of different sizes."""
    sizes = [float(np.linalg.norm(_extents(points))) for points in (source, target)]
    if min(sizes) == 0.0:
        raise InputError("all points are at the same place")
    ratio = max(sizes) / min(sizes)
    if ratio <= _LARGEST_SCALE:
        return
    small, large = (
        (pairs.source, pairs.target) if sizes[0] < sizes[1] else (pairs.target, pairs.source)
    )
    unit = next((u for f, u in _UNITS if max(ratio / f, f / ratio) < _UNIT_TOLERANCE), None)
    hint = (
        f"are the positions in {small} in {unit}? They must be in mm"
        if unit
        else "are they the same points, in the same order, and both in mm?"
    )
    raise InputError(
        f"the points are {ratio:.4g} times as far apart in the frame {large} as in {small}, and a "
        f"registration keeps distances\nhint: {hint}"
    )


def _is_line(points: _Array) -> bool:
    extents = _extents(points)
    return bool(extents[1] < max(_FLAT_RATIO * extents[0], _LEAST_EXTENT_MM))


def _require_extent(frame: str, points: _Array) -> None:
    extents = _extents(points)
    if extents[0] < _LEAST_EXTENT_MM:
        raise InputError(
            f"in the frame {frame}, all points are within {extents[0]:.2g} mm of their centre\n"
            "hint: are they in mm? Choose points around the target, some centimetres apart"
        )
    if _is_line(points):
        raise InputError(
            f"the points are on a line in the frame {frame}: within {extents[1]:.2g} mm beside it, "
            f"{extents[0]:.3g} mm along it\n"
            "hint: nothing shows how the frame is turned about the line; add a point beside it"
        )


def _require_same_hand(residuals: _Array, source: _Array, target: _Array) -> None:
    """Refuses sets of which one is the mirror image of the other."""
    mirror = _rms(_residuals(*best_motion(source, target, mirrored=True), source, target))
    if mirror < _CLEARLY * _rms(residuals):
        raise InputError(
            "one set of points is the mirror image of the other: a reflection fits to "
            f"{mirror:.3g} mm, a rotation to {_rms(residuals):.3g} mm\n"
            "hint: in one of them, the sign of one axis is wrong, or two axes are exchanged"
        )


def _require_fit(pairs: Pairs, residuals: _Array, source: _Array, target: _Array) -> None:
    """Refuses sets that are not the same points."""
    fre_mm, extent_mm = _rms(residuals), float(np.linalg.norm(_extents(target)))
    if fre_mm <= _LARGEST_MISFIT * extent_mm:
        return
    hint = "are they the same points, with the same names?"
    for i, j in itertools.combinations(range(len(pairs.names)), 2):
        order = list(range(len(pairs.names)))
        order[i], order[j] = j, i
        changed = target[order]
        if _rms(_residuals(*best_motion(source, changed), source, changed)) < _CLEARLY * fre_mm:
            hint = f"are {pairs.names[i]} and {pairs.names[j]} exchanged in one of the sets?"
            break
    raise InputError(
        f"the points do not fit: after the best registration they are {fre_mm:.3g} mm apart, with "
        f"an extent of {extent_mm:.3g} mm\nhint: {hint}"
    )


# Numbers.


def _rms(values: _Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
