"""Where a stage lies for a tracker, from poses of the stage and of a sensor on it.

The stage says how its carriage lies in the stage's frame: S_i. The tracker says how a sensor that
is fixed to the carriage lies in the tracker's frame: T_i. Two transforms do not change: X, from the
sensor to the carriage, and Y, from the tracker to the stage. For each pose

    S_i X = Y T_i,

so with the motions A = S_j S_i^-1 and B = T_j T_i^-1 of any two poses, A Y = Y B: the equation
AX = XB of hand-eye calibration. Y is the registration that `ntagen drive` reads.

The rotation of Y comes from the rotation vectors of all motions: log A = R_Y log B (Park and
Martin, "Robot sensor calibration: solving AX = XB on the Euclidean group", IEEE Transactions on
Robotics and Automation 10 (1994), section III). Their (M^T M)^(-1/2) M^T is the rotation of a
singular value decomposition. The translations then follow by least squares. We take R_Si t_X +
s_i = R_Y t_i + t_Y for each pose: the differences of two poses are the equations of Park and
Martin, and no motion has a greater weight because the tracker stands far away.

We chose this method before that of Daniilidis (1999), which finds both parts at once by dual
quaternions: there, errors of positions spoil the rotation, and a weight of mm against rad must be
chosen. Here, a rotation is as good as the tracker's rotations are.

All rotations about one axis leave open how the tracker is turned about that axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ntagen.errors import InputError
from ntagen.shapes import axes_of, vector_of
from ntagen.tracking.frames import Transform
from ntagen.tracking.pivot import find_rest, in_words, rms
from ntagen.tracking.poses import Poses, listed
from ntagen.tracking.registration import best_rotation

_Array = npt.NDArray[np.float64]

LEAST_POSES: Final = 4
"""Three determine the transforms; one more checks them."""

MOST_POSES: Final = 200
"""Pairs of them are compared; nobody moves a stage so often."""

LEAST_TURN_DEG: Final = 5.0
"""The motions must turn about two axes at right angles by so much, as a root mean square."""

_HINT: Final = (
    "turn the stage by 20 deg or more about two axes that are not parallel; if it has one axis or "
    "none, register it by points instead: `ntagen calibrate POINTS`"
)

_HALF_TURN: Final = math.radians(170.0)
"""The axis of a greater rotation may have either sign, because of the errors."""

_LARGEST_MISFIT: Final = 0.1
"""The largest root mean square, as a part of that of the motions; what is smaller than the next two
is never too much."""

_SMALL_MISFIT_DEG: Final = 1.0
_SMALL_MISFIT_MM: Final = 2.0

_CLEARLY: Final = 0.5
_ODD_RATIO: Final = 3.0
"""A pose of others that do not fit is odd if its motions differ by so many times the median."""

_SUSPECT_RATIO: Final = 1 / 3
_SUSPECT_MM: Final = 1.0
_SUSPECT_DEG: Final = 1.0
_LEAST_JUDGED: Final = 6
"""As in `ntagen.tracking.registration`: a pose is bad if the others fit much better without it."""


@dataclass(frozen=True, slots=True)
class HandEye:
    """Where a stage lies for a tracker, and the errors.

    Attributes:
        transform: From the tracker's frame to that of the stage (Y).
        sensor: From the sensor's frame to that of the carriage (X).
        names: The names of the poses.
        residuals_mm: For each pose, the distance between where stage and tracker put the sensor.
        residuals_deg: The angle between how they turn it.
        left_out_mm: The distance after a fit to all other poses, which is an honest test; nan where
            these do not determine one.
        left_out_deg: The same of the angle.
        turns_deg: The root mean square of the rotations between two poses about three axes at right
            angles, least first.
        suspect: The name of the one bad pose, if the others fit much better without it.
    """

    transform: Transform
    sensor: Transform
    names: tuple[str, ...]
    residuals_mm: tuple[float, ...]
    residuals_deg: tuple[float, ...]
    left_out_mm: tuple[float, ...]
    left_out_deg: tuple[float, ...]
    turns_deg: tuple[float, ...]
    suspect: str | None


@dataclass(frozen=True, slots=True)
class _Solution:
    """The rotations (3, 3) and translations (3) of X and Y."""

    x_rotation: _Array
    x_mm: _Array
    y_rotation: _Array
    y_mm: _Array

    def misfits(self, stage: Poses, tracker: Poses) -> tuple[_Array, _Array]:
        """For each pose, the distance in mm and the angle in deg between S_i X and Y T_i."""
        away = stage.rotations @ self.x_mm + stage.positions_mm
        away -= tracker.positions_mm @ self.y_rotation.T + self.y_mm
        turned = stage.rotations @ self.x_rotation
        offset = turned.transpose(0, 2, 1) @ self.y_rotation @ tracker.rotations
        angles = np.linalg.norm(rotation_vectors(offset), axis=1)
        return np.linalg.norm(away, axis=1), np.degrees(angles)


def find_stage(stage: Poses, tracker: Poses) -> HandEye:
    """Where a stage lies for a tracker.

    Args:
        stage: The poses of the carriage in the stage's frame.
        tracker: The poses of the sensor in the tracker's frame, pairwise with those of the stage.

    Raises:
        InputError: There are too few poses, they turn the stage too little or about one axis only,
            or stage and tracker did not move as one body.
    """
    count = len(stage)
    if count != len(tracker):
        raise ValueError(f"{count} poses of the stage, and {len(tracker)} of the tracker")
    if count < LEAST_POSES:
        raise InputError(
            f"{stage.path}: there are {count} poses, and {LEAST_POSES} or more are needed\n"
            f"hint: {_HINT}; twelve poses or more are a good choice"
        )
    motions = _motions(stage, tracker)
    turns_deg = _require_turns(stage, motions)
    solution = _solved(stage, tracker, motions)
    residuals_mm, residuals_deg = solution.misfits(stage, tracker)
    if not _fits(stage, tracker, motions, (rms(residuals_mm), rms(residuals_deg))):
        raise _no_fit(stage, tracker, motions, (rms(residuals_mm), rms(residuals_deg)))
    left_out = [_left_out(at, stage, tracker, motions) for at in range(count)]
    frames = (tracker.frame or "tracker", stage.frame or "stage")
    return HandEye(
        transform=_transform(frames, solution.y_rotation, solution.y_mm),
        sensor=_transform(("sensor", "carriage"), solution.x_rotation, solution.x_mm),
        names=stage.names,
        residuals_mm=tuple(map(float, residuals_mm)),
        residuals_deg=tuple(map(float, residuals_deg)),
        left_out_mm=tuple(one.own_mm for one in left_out),
        left_out_deg=tuple(one.own_deg for one in left_out),
        turns_deg=tuple(map(float, turns_deg)),
        suspect=_suspect(stage.names, left_out, rms(residuals_mm), rms(residuals_deg)),
    )


def _transform(frames: tuple[str, str], rotation: _Array, translation_mm: _Array) -> Transform:
    return Transform(*frames, axes_of(rotation), vector_of(translation_mm))


# The fit.


@dataclass(frozen=True, slots=True)
class _Motions:
    """The motions between all pairs of poses.

    Attributes:
        pairs: The indices of the two poses, (motions, 2).
        stage: The rotation vectors of R_j R_i^-1 of the stage, in rad: (motions, 3).
        tracker: The same of the tracker.
    """

    pairs: _Array
    stage: _Array
    tracker: _Array

    def without(self, at: int) -> _Motions:
        """The motions between all other poses."""
        return self.chosen((self.pairs != at).all(axis=1))

    def clear(self) -> _Motions:
        """Those that are no half turn."""
        angles = [np.linalg.norm(one, axis=1) for one in (self.stage, self.tracker)]
        return self.chosen(np.maximum(*angles) < _HALF_TURN)

    def chosen(self, are: _Array) -> _Motions:
        """Those for which a truth value is true."""
        return _Motions(self.pairs[are], self.stage[are], self.tracker[are])

    def turns(self) -> tuple[_Array, _Array]:
        """The root mean square of the stage's rotations about three axes, in deg, and the axes.

        Returns:
            The rotations, least first, (3), and the axes in the stage's frame as rows, (3, 3).
        """
        values, axes = np.linalg.eigh(self.stage.T @ self.stage / max(1, len(self.stage)))
        return np.degrees(np.sqrt(np.maximum(values, 0.0))), axes.T


def _motions(stage: Poses, tracker: Poses) -> _Motions:
    first, second = np.triu_indices(len(stage), 1)
    vectors = (
        rotation_vectors(poses.rotations[second] @ poses.rotations[first].transpose(0, 2, 1))
        for poses in (stage, tracker)
    )
    return _Motions(np.stack([first, second], axis=1), *vectors)


def _solved(stage: Poses, tracker: Poses, motions: _Motions) -> _Solution:
    """The transforms that fit all poses best."""
    clear = motions.clear()
    y_rotation = best_rotation(clear.tracker, clear.stage)
    # The rotations of X that the poses give, and the rotation nearest to their mean.
    each = stage.rotations.transpose(0, 2, 1) @ y_rotation @ tracker.rotations
    x_rotation = best_rotation(np.eye(3), each.mean(axis=0).T)
    rest = find_rest(stage.rotations, stage.positions_mm - tracker.positions_mm @ y_rotation.T)
    return _Solution(x_rotation, rest.own_mm, y_rotation, rest.place_mm)


def rotation_vectors(rotations: _Array) -> _Array:
    """The axis of each rotation, with its angle in rad as its length.

    Args:
        rotations: An array (n, 3, 3).

    Returns:
        An array (n, 3). The sign of half a turn is chance.
    """
    skew = rotations - rotations.transpose(0, 2, 1)
    sines = 0.5 * np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    lengths = np.linalg.norm(sines, axis=1)
    cosines = 0.5 * (np.trace(rotations, axis1=1, axis2=2) - 1.0)
    angles = np.arctan2(lengths, cosines)
    small = lengths < 1e-12
    found = sines * np.where(small, 1.0, angles / np.where(small, 1.0, lengths))[:, None]
    for at in np.flatnonzero(small & (cosines < 0.0)):
        # Half a turn is 2 a a^T - I, about the axis a.
        outer = 0.5 * (rotations[at] + np.eye(3))
        column = outer[:, np.argmax(np.diag(outer))]
        found[at] = math.pi * column / np.linalg.norm(column)
    return np.asarray(found)


# What was left out.


@dataclass(frozen=True, slots=True)
class _LeftOut:
    """A fit to all poses but one: how far that is from it, and how well it fits the others."""

    own_mm: float
    own_deg: float
    others_mm: float
    others_deg: float


def _left_out(at: int, stage: Poses, tracker: Poses, motions: _Motions) -> _LeftOut:
    kept = [other for other in range(len(stage)) if other != at]
    others = motions.without(at)
    turns_deg, _ = others.clear().turns()
    if turns_deg[1] < LEAST_TURN_DEG / 2.0:
        return _LeftOut(math.nan, math.nan, math.inf, math.inf)
    solution = _solved(stage.chosen(kept), tracker.chosen(kept), others)
    distances, angles = solution.misfits(stage, tracker)
    return _LeftOut(
        float(distances[at]), float(angles[at]), rms(distances[kept]), rms(angles[kept])
    )


def _suspect(
    names: tuple[str, ...], left_out: list[_LeftOut], rms_mm: float, rms_deg: float
) -> str | None:
    """The pose without which all others fit much better, if there is one."""
    if len(names) < _LEAST_JUDGED:
        return None
    by_mm = min(range(len(names)), key=lambda at: left_out[at].others_mm)
    by_deg = min(range(len(names)), key=lambda at: left_out[at].others_deg)
    one, other = left_out[by_mm], left_out[by_deg]
    if one.others_mm < _SUSPECT_RATIO * rms_mm and one.own_mm > _SUSPECT_MM:
        return names[by_mm]
    if other.others_deg < _SUSPECT_RATIO * rms_deg and other.own_deg > _SUSPECT_DEG:
        return names[by_deg]
    return None


# What is refused.


def _require_turns(stage: Poses, motions: _Motions) -> _Array:
    """The turns of the motions (`_Motions.turns`); refuses those that determine no rotation."""
    clear = motions.clear()
    if not len(clear.pairs):
        raise InputError(
            f"{stage.path}: all rotations between two poses are half turns, or nearly so, and the "
            "axis of a half turn may have either sign\n"
            "hint: add poses between these; rotations of 20 to 90 deg are a good choice"
        )
    turns_deg, axes = clear.turns()
    if turns_deg[1] >= LEAST_TURN_DEG:
        return turns_deg
    widest = math.degrees(float(np.linalg.norm(motions.stage, axis=1).max()))
    needed = f"and {LEAST_TURN_DEG:g} deg is needed (root mean square)"
    if turns_deg[2] < LEAST_TURN_DEG:
        raise InputError(
            f"{stage.path}: the rotations are too small: the poses cover {widest:.1f} deg, and "
            f"turn about no axis by more than {turns_deg[2]:.1f} deg, {needed}\nhint: {_HINT}"
        )
    axis = in_words(axes[2])
    raise InputError(
        f"{stage.path}: all rotations are about nearly one axis, {axis} in the stage's frame. The "
        f"poses cover {widest:.1f} deg, but turn about other axes by {turns_deg[1]:.1f} deg, "
        f"{needed}: nothing shows how the tracker is turned about that axis\nhint: {_HINT}"
    )


def _fits(stage: Poses, tracker: Poses, motions: _Motions, misfit: tuple[float, float]) -> bool:
    """Whether stage and sensor moved as one body, by their misfits in mm and deg."""
    way_mm = _way_mm(stage) + _way_mm(tracker)
    most_mm = max(_SMALL_MISFIT_MM, _LARGEST_MISFIT * way_mm)
    most_deg = max(_SMALL_MISFIT_DEG, _LARGEST_MISFIT * _turn_deg(motions))
    return misfit[0] <= most_mm and misfit[1] <= most_deg


def _no_fit(
    stage: Poses, tracker: Poses, motions: _Motions, misfit: tuple[float, float]
) -> InputError:
    """The error about a stage and a sensor that did not move as one body."""
    return InputError(
        f"{stage.path} and {tracker.path} do not fit: {misfit[1]:.3g} deg and {misfit[0]:.3g} mm "
        f"apart (root mean square), with rotations of {_turn_deg(motions):.3g} deg\n"
        f"hint: {_likely(stage, tracker, motions, misfit[1])}"
    )


def _likely(stage: Poses, tracker: Poses, motions: _Motions, rms_deg: float) -> str:
    """The likely mistake in poses that do not fit."""
    turned = replace(tracker, rotations=tracker.rotations.transpose(0, 2, 1))
    inverse = _solved(stage, turned, _motions(stage, turned))
    if rms(inverse.misfits(stage, turned)[1]) < _CLEARLY * rms_deg:
        return (
            "the inverse rotations of one file fit better: does it say how the frame lies in the "
            "body? then write the inverse poses"
        )
    # The same motion turns stage and tracker by the same angle, whatever X and Y are.
    angles = [np.linalg.norm(one, axis=1) for one in (motions.stage, motions.tracker)]
    differences = np.zeros((len(stage), len(stage)))
    differences[motions.pairs[:, 0], motions.pairs[:, 1]] = np.abs(angles[0] - angles[1])
    each = np.median(differences + differences.T, axis=1)
    limit = _ODD_RATIO * np.median(each)
    odd = [name for name, own in zip(stage.names, each, strict=True) if own > limit]
    named = f" Look at {listed(odd)} first." if 0 < len(odd) <= len(stage) // 3 else ""
    return (
        "does each line belong to the same moment in both files, and is the sensor fixed to the "
        f"carriage?{named}"
    )


def _turn_deg(motions: _Motions) -> float:
    """The root mean square of the stage's rotations."""
    return math.degrees(rms(np.linalg.norm(motions.stage, axis=1)))


def _way_mm(poses: Poses) -> float:
    """The root mean square distance of positions from their mean."""
    return rms(np.linalg.norm(poses.positions_mm - poses.positions_mm.mean(axis=0), axis=1))
