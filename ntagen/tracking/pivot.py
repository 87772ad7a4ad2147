"""The tip of a tool, from poses of its sensor while the tip rests in a divot.

The tip stays at one place of the tool and at one place of the tracker's frame. So each pose, with
the rotation R_i and the position p_i of the sensor, gives three linear equations for both:

    R_i t_tip + p_i = t_pivot.

They are solved together by least squares: the algebraic one-step method, with the matrix of the
stacked rows (R_i, -I) (Yaniv, "Which pivot calibration?", Proc. SPIE 9415, 2015, section 2). Yaniv
finds it as good as the iterative methods and better than fits of a sphere.

What the poses determine follows from the mean R of the rotations alone. A direction v of the sensor
is turned about its mean direction by an angle a_i with mean(sin^2 a_i) about 1 - |R v|^2. Along v,
the error of the tip is that of a measurement divided by sqrt(n (1 - |R v|^2)) for n poses. If that
turn is small, as for the axis of a tool that is only spun, nothing shows how long the tool is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ntagen.errors import InputError
from ntagen.scene import Vector
from ntagen.shapes import vector_of
from ntagen.tracking.poses import Poses, listed
from ntagen.units import deg_from_rad

_Array = npt.NDArray[np.float64]

LEAST_POSES: Final = 6
"""Three determine a tip; twice as many show whether one of them is bad."""

MOST_POSES: Final = 20_000
"""Ten minutes of a fast tracker."""

LEAST_TURN_DEG: Final = 5.0
"""Each direction of the sensor must be turned by so much, as a root mean square."""

_HINT: Final = "tilt the tool by 30 deg to all sides while its tip rests in the divot"

_OUTLIER_RATIO: Final = 5.5
_FEW: Final = 13.0
"""A pose is bad if it is farther from the others than `_OUTLIER_RATIO` standard deviations of a
pose; of n poses, by 1 + `_FEW` / (3 n - 9) as many. So a good one is bad by chance once in a
million, by the quantiles of F(3, 3 n - 9)."""

_OUTLIER_MM: Final = 1.0
_MOST_OUTLIERS: Final = 0.25
"""If more than this part of the poses is bad, none is named: it is not clear which fit."""

_MOST_ROUNDS: Final = 20

_MEDIAN_LENGTH: Final = 1.5382
"""The median length of a vector of three normal numbers (the root of that of chi^2 with 3)."""

_LARGEST_MISFIT: Final = 0.1
"""The largest root mean square, as a part of that of the sensor's way; less than
`_SMALL_MISFIT_MM` is never too much, since a sensor in the tip itself does not move."""

_SMALL_MISFIT_MM: Final = 2.0
_SINGULAR: Final = 1e-9


@dataclass(frozen=True, slots=True)
class Rest:
    """A place of a body that rests, by least squares.

    Attributes:
        own_mm: The place in the body's own frame, an array (3).
        place_mm: Where it rests, an array (3).
        misfits_mm: Where each pose puts it, from `place_mm`, an array (poses, 3).
        left_out_mm: The same from a fit to all other poses, an array (poses, 3); nan where these do
            not determine one.
        lengths_mm: The length of each misfit, of which poses with a great weight have less, made
            equal: an array (poses).
        covariance: The covariance of `own_mm` for errors of 1 mm in each coordinate, (3, 3).
    """

    own_mm: _Array
    place_mm: _Array
    misfits_mm: _Array
    left_out_mm: _Array
    lengths_mm: _Array
    covariance: _Array


@dataclass(frozen=True, slots=True)
class Pivot:
    """The tip of a tool, and its errors.

    Attributes:
        names: The names of the poses.
        frame: The tracker's frame.
        tip_mm: The tip in the sensor's frame.
        divot_mm: The divot in the tracker's frame.
        residuals_mm: For each pose, the distance from the divot to where the pose puts the tip.
        left_out_mm: The same after a fit to all other poses, which is an honest test.
        rms_mm: The root mean square of the residuals.
        left_out_rms_mm: The root mean square of the others.
        tip_error_mm: The expected error of the tip (its root mean square), if the errors of the
            poses have nothing to do with each other.
        turns_deg: How far the poses turn three directions of the sensor at right angles, least
            first (root mean square).
        least_turned: The first of these directions: along it, the tip is known worst.
    """

    names: tuple[str, ...]
    frame: str
    tip_mm: Vector
    divot_mm: Vector
    residuals_mm: tuple[float, ...]
    left_out_mm: tuple[float, ...]
    rms_mm: float
    left_out_rms_mm: float
    tip_error_mm: float
    turns_deg: Vector
    least_turned: Vector


def find_tip(poses: Poses) -> Pivot:
    """The tip of a tool whose tip rests in a divot.

    Args:
        poses: The poses of its sensor.

    Raises:
        InputError: There are too few poses, they turn the tool too little, some of them do not fit
            the others, or the tip did not rest at all.
    """
    count = len(poses)
    if count < LEAST_POSES:
        raise InputError(
            f"{poses.path}: there are {count} poses, and {LEAST_POSES} or more are needed\n"
            f"hint: {_HINT}; thirty poses or more are a good choice"
        )
    turns_deg, directions = turns_of(poses.rotations)
    _require_turns(poses, turns_deg, directions)
    rest = find_rest(poses.rotations, poses.positions_mm)
    _require_fit(poses, rest)
    residuals_mm, left_out_mm = (
        np.linalg.norm(one, axis=1) for one in (rest.misfits_mm, rest.left_out_mm)
    )
    # Three equations a pose, six unknowns.
    variance_mm2 = float(np.sum(residuals_mm**2)) / (3 * count - 6)
    return Pivot(
        names=poses.names,
        frame=poses.frame,
        tip_mm=vector_of(rest.own_mm),
        divot_mm=vector_of(rest.place_mm),
        residuals_mm=tuple(map(float, residuals_mm)),
        left_out_mm=tuple(map(float, left_out_mm)),
        rms_mm=rms(residuals_mm),
        left_out_rms_mm=rms(left_out_mm),
        tip_error_mm=math.sqrt(variance_mm2 * float(np.trace(rest.covariance))),
        turns_deg=vector_of(turns_deg),
        least_turned=vector_of(directions[0]),
    )


# The fit.


def find_rest(rotations: _Array, positions_mm: _Array) -> Rest:
    """The place of a body that rests best while the body moves.

    What is left out is not fitted again. With the rows A_i of a pose and its residual e_i, the
    residual after a fit to all others is (I - A_i (A^T A)^-1 A_i^T)^-1 e_i, exactly (Cook and
    Weisberg, "Residuals and Influence in Regression", 1982, section 2.2, with blocks of rows).

    Args:
        rotations: The rotations of the poses, an array (poses, 3, 3).
        positions_mm: Their positions, an array (poses, 3).
    """
    count = len(rotations)
    rows = rows_of(rotations)
    # Far from the origin, differences are exact to fewer digits.
    middle_mm = positions_mm.mean(axis=0)
    right = (middle_mm - positions_mm).reshape(-1)
    solution, *_ = np.linalg.lstsq(rows.reshape(-1, 6), right, rcond=None)
    misfits = rows @ solution - right.reshape(-1, 3)
    inverse = _inverse(rows)
    kept = np.eye(3) - rows @ inverse @ rows.transpose(0, 2, 1)
    is_known = np.linalg.eigvalsh(kept)[:, 0] > _SINGULAR
    left_out = np.full((count, 3), math.nan)
    left_out[is_known] = np.linalg.solve(kept[is_known], misfits[is_known, :, None])[..., 0]
    lengths = np.sqrt(np.maximum(0.0, np.sum(misfits * left_out, axis=1)))
    return Rest(
        own_mm=solution[:3],
        place_mm=solution[3:] + middle_mm,
        misfits_mm=misfits,
        left_out_mm=left_out,
        lengths_mm=np.where(is_known, lengths, math.inf),
        covariance=inverse[:3, :3],
    )


def rows_of(rotations: _Array) -> _Array:
    """The rows (R_i, -I) of poses, an array (poses, 3, 6)."""
    return np.concatenate([rotations, np.broadcast_to(-np.eye(3), rotations.shape)], axis=2)


def _inverse(rows: _Array) -> _Array:
    """The covariance of the unknowns for errors of 1 mm, (6, 6)."""
    matrix = rows.reshape(-1, 6)
    return np.asarray(np.linalg.pinv(matrix.T @ matrix, hermitian=True))


def turns_of(rotations: _Array) -> tuple[_Array, _Array]:
    """How far rotations turn directions of a body from their mean (root mean square), in deg.

    Args:
        rotations: An array (poses, 3, 3).

    Returns:
        The turns of three directions at right angles, least first: an array (3); and the
        directions in the body's own frame, as rows: an array (3, 3).
    """
    # 1 - |R v|^2 is the mean of |(R_i - R) v|^2, which does not lose the small ones.
    offsets = (rotations - rotations.mean(axis=0)).reshape(-1, 3)
    _, values, directions = np.linalg.svd(offsets, full_matrices=False)
    sines = np.minimum(1.0, values / math.sqrt(len(rotations)))
    return np.degrees(np.arcsin(sines))[::-1], directions[::-1]


def rms(values: npt.ArrayLike) -> float:
    """The root mean square of numbers; nan if one of them is nan."""
    return float(np.sqrt(np.mean(np.square(values))))


# What is refused.


def _require_turns(poses: Poses, turns_deg: _Array, directions: _Array) -> None:
    """Refuses poses that do not determine the tip in some direction."""
    if turns_deg[0] >= LEAST_TURN_DEG:
        return
    needed = f"and {LEAST_TURN_DEG:g} deg is needed (root mean square)"
    covered = deg_from_rad(_widest_rad(poses.rotations))
    if turns_deg[1] < LEAST_TURN_DEG:
        raise InputError(
            f"{poses.path}: the poses cover {covered:.1f} deg in all. They turn no two directions "
            f"of the tool by more than {turns_deg[1]:.1f} deg, {needed}: the tip is not determined "
            f"in any direction\nhint: {_HINT}"
        )
    direction = in_words(directions[0])
    raise InputError(
        f"{poses.path}: the tip is not determined along {direction} of the sensor's frame: the "
        f"poses turn this direction by {turns_deg[0]:.1f} deg, {needed}. In all, they cover "
        f"{covered:.1f} deg\n"
        f"hint: to turn the tool about this direction alone is not enough; {_HINT}"
    )


def _widest_rad(rotations: _Array) -> float:
    """Twice the greatest rotation from the mean one: the range that rotations cover."""
    left, _, right = np.linalg.svd(rotations.mean(axis=0))
    hand = math.copysign(1.0, np.linalg.det(left @ right))
    middle = left @ np.diag([1.0, 1.0, hand]) @ right
    cosines = (np.einsum("nij,ij->n", rotations, middle) - 1.0) / 2.0
    return 2.0 * float(np.arccos(np.clip(cosines.min(), -1.0, 1.0)))


def in_words(direction: _Array) -> str:
    """A direction for a message. Its greatest part is positive: it is a line as well."""
    signed = direction * math.copysign(1.0, direction[np.argmax(np.abs(direction))])
    return "({})".format(", ".join(f"{round(part, 2) + 0.0:.2f}" for part in signed))


def _require_fit(poses: Poses, rest: Rest) -> None:
    """Refuses poses of which some do not fit the others, or all do not fit."""
    bad, kept = _outliers(poses, rest)
    if len(bad) > _MOST_OUTLIERS * len(poses):
        bad, kept = [], list(range(len(poses)))
    others = find_rest(poses.rotations[kept], poses.positions_mm[kept])
    rms_mm = rms(np.linalg.norm(others.misfits_mm, axis=1))
    way = poses.positions_mm - poses.positions_mm.mean(axis=0)
    way_mm = rms(np.linalg.norm(way, axis=1))
    if rms_mm > max(_SMALL_MISFIT_MM, _LARGEST_MISFIT * way_mm):
        turned = find_rest(poses.rotations.transpose(0, 2, 1), poses.positions_mm)
        is_turned = rms(turned.misfits_mm) < 0.5 * rms(rest.misfits_mm)
        raise InputError(
            f"{poses.path}: the tip did not rest: the poses put it {rms_mm:.3g} mm from one place "
            f"(root mean square), while the sensor moved by {way_mm:.3g} mm\nhint: "
            + (
                "the inverse rotations fit better: change the signs of qx, qy, qz"
                if is_turned
                else "hold the tip in a divot that it fits, and record only while it rests"
            )
        )
    if bad:
        away = poses.rotations[bad] @ others.own_mm + poses.positions_mm[bad] - others.place_mm
        told = [
            f"{poses.names[at]} ({mm:.2f} mm)"
            for at, mm in zip(bad, np.linalg.norm(away, axis=1), strict=True)
        ]
        raise InputError(
            f"{poses.path}: {len(bad)} of {len(poses)} poses do not fit the others, which fit to "
            f"{rms_mm:.2g} mm (root mean square): {listed(told)}\n"
            "hint: did the tip slip, or did the tracker see the tool badly? delete these lines"
        )


def _outliers(poses: Poses, rest: Rest) -> tuple[list[int], list[int]]:
    """The indices of the poses that do not fit the others, and of the others.

    A bad pose spoils the fit and so hides others. So the worst ones are left out first, whatever
    their size. Then all poses that fit the rest come back, until nothing changes. Poses without
    which the others do not determine the tip are not left out: nothing could judge them.
    """
    count = len(poses)
    kept = np.arange(count)
    core, worst = rest, int(count * _MOST_OUTLIERS)
    step = max(1, worst // 10)
    for left in range(worst, 0, -step):
        order = np.argsort(core.lengths_mm)
        kept = np.sort(kept[order[: len(kept) - min(step, left)]])
        core = find_rest(poses.rotations[kept], poses.positions_mm[kept])
    if not _determine(poses.rotations[kept]):
        kept, core = np.arange(count), rest
    is_good = np.zeros(count, dtype=bool)
    for _ in range(_MOST_ROUNDS):
        lengths_mm = _lengths_mm(poses, kept, core)
        sigma_mm = float(np.median(lengths_mm)) / _MEDIAN_LENGTH
        ratio = _OUTLIER_RATIO * (1.0 + _FEW / (3 * count - 9))
        before, is_good = is_good, lengths_mm <= max(_OUTLIER_MM, ratio * sigma_mm)
        if (before == is_good).all():
            break
        kept = np.flatnonzero(is_good)
        if not _determine(poses.rotations[kept]):
            return [], list(range(count))
        core = find_rest(poses.rotations[kept], poses.positions_mm[kept])
    return list(np.flatnonzero(~is_good)), list(np.flatnonzero(is_good))


def _determine(rotations: _Array) -> bool:
    """Whether rotations determine the tip well enough to judge other poses."""
    return len(rotations) > 2 and turns_of(rotations)[0][0] >= LEAST_TURN_DEG / 2.0


def _lengths_mm(poses: Poses, kept: npt.NDArray[np.intp], core: Rest) -> _Array:
    """Of all poses: how far each is from a fit to some, in lengths with the same expectation."""
    away = poses.rotations @ core.own_mm + poses.positions_mm - core.place_mm
    rows = rows_of(poses.rotations)
    inverse = _inverse(rows[kept])
    # A pose that is not in the fit is as far as the errors of both.
    spread = np.eye(3) + rows @ inverse @ rows.transpose(0, 2, 1)
    scaled = np.linalg.solve(spread, away[..., None])[..., 0]
    lengths = np.sqrt(np.maximum(0.0, np.sum(away * scaled, axis=1)))
    lengths[kept] = core.lengths_mm
    return np.asarray(lengths)
