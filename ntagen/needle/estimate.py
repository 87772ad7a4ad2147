"""Estimates where the needle is and how it bends, from all commands and measurements.

The measured positions alone tell little about the direction in which a needle will bend: on the
first 5 mm of a circle of 30 mm the tip moves 0.4 mm sideways, and the noise of a tracker is 0.1 mm.
But the commands are known. The estimator replays them (pushes, rolls and pulls) on the tree of all
channels that were cut (`ntagen.needle.channels`), with a few unknowns:

* the entry pose (three for the position, three small rotations),
* the curvature at the entry, as a factor of the expected one,
* the error of each roll, since a shaft does not turn its tip exactly as it is turned at its base,
* the changes of curvature and bend plane from one stretch of 5 mm to the next, if their priors
  are not 0: the turn of the bend plane is a random walk, and a change of the curvature fades over
  10 mm. So old measurements say less about the present curvature than new ones.

Non-linear least squares finds the unknowns with the greatest posterior density. The noise weighs
each measurement, and the prior weighs each unknown. Measurements in a channel that the needle has
left still count: they tell about the entry, the curvature and the rolls.

Cost and errors on phantom needles: `tests/benchmarks/predictions.py` measures them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.channels import ENTRY, MEMORY_MM, STRETCH_MM, Channel, Placed, Stretch, place
from ntagen.needle.circle import CurvaturePrior, fit_circle
from ntagen.needle.descent import least_squares
from ntagen.needle.kinematics import Arc, bending_axis, orthonormal, push, pushed_to
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.needle.path import Stretch as PathStretch
from ntagen.needle.priors import Priors as Priors
from ntagen.needle.residuals import Problem, Reading
from ntagen.needle.vectors import subtract
from ntagen.scene import Pose

_Array = NDArray[np.float64]

_POSE_UNKNOWNS = 7
"""Position (3), rotations (3) and curvature (1) come before all other unknowns."""

RECENT = 8
"""So many of the last measurements count for `Estimate.misfit_mm`; ours: those of a push of 2 mm in
pieces of 0.25 mm."""

_DRIFT_LENGTH_MM = 10.0
"""The length for which drifts are given; over another length, a random walk goes with its root."""

_AHEAD_MM = 30.0
"""Predictions are made for about this length: the usual one of a plan's rest."""

_STAYING_RATIO = 2.0 * (
    MEMORY_MM / _AHEAD_MM - (MEMORY_MM / _AHEAD_MM) ** 2 * (1.0 - math.exp(-_AHEAD_MM / MEMORY_MM))
)
"""The part of a change of curvature that would have the same effect on the position after
`_AHEAD_MM` if it did not fade: the mean of exp(-u / memory), weighted with the length left."""

_STRETCH_RATIO = math.sqrt(STRETCH_MM / _DRIFT_LENGTH_MM)
"""The drift over one stretch, relative to that over `_DRIFT_LENGTH_MM`."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """An estimate.

    Attributes:
        path: The estimated channel in which the needle lies now; its end is the tip.
        radius_mm: The expected radius of the motion circle over the next 30 mm: of the present
            change of the curvature, only a part stays. Without drift it is that of the whole path.
        radius_std_mm: Its standard deviation.
        rms_mm: Root mean square of the distances between measured and estimated positions.
        misfit_mm: The length of the mean difference between the last measured positions and the
            estimated ones (`RECENT` of them): what no needle explains that was moved as commanded.
            0 while there are fewer.
        covariance: Of the tip, in seven rows: position (x, y, z in mm), rotation vector (about x,
            y, z in rad), logarithm of the expected curvature.
        curvature_drift: `Priors.curvature_drift`, for predictions.
        turn_drift_rad: `Priors.turn_drift_rad`, for predictions.
    """

    path: Path
    radius_mm: float
    radius_std_mm: float
    rms_mm: float
    covariance: tuple[tuple[float, ...], ...]
    curvature_drift: float = 0.0
    turn_drift_rad: float = 0.0
    misfit_mm: float = 0.0

    @property
    def tip(self) -> Pose:
        """The pose of the tip."""
        return orthonormal(self.path.tip)

    def position_covariance_mm2(self, length_mm: float) -> _Array:
        """The covariance of the tip's position after a further push, along x, y and z, in mm².

        It contains what the estimator knows of its own errors: those of the tip's position,
        direction and bend plane and of the curvature, with their correlations, and the drift of
        curvature and bend plane during the push (`Priors`). It does not contain the noise of a
        measurement at that place, nor the error of a roll that is made before the push, nor what
        the priors do not say (layers, a moving target).

        A drift that begins ``u`` mm before the end of the push displaces the end by ``k u^2 / 2``
        times its size, to the side or out of the plane. For a random walk of variance ``q`` per mm
        over ``s`` mm this gives the variance ``k^2 q s^5 / 20``. The curvature's changes fade, so
        for them this is a little too much.

        Args:
            length_mm: The length of the push, at least 0.
        """
        tip, curvature = self.tip, 1.0 / self.radius_mm
        ahead = Placed(tip, curvature, np.zeros((3, 7)), np.zeros((3, 7)), np.zeros(7))
        ahead.rotation[:, 3:6] = np.eye(3)
        ahead.shift[:, :3] = np.eye(3)
        x, y, z = tip.position_mm
        # The rotation is about the tip, not about the origin.
        ahead.shift[:, 3:6] = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        ahead.growth[6] = 1.0
        slopes = ahead.positions(np.array([length_mm]))[1][0]
        covariance = slopes @ np.array(self.covariance) @ slopes.T
        end = push(tip, self.radius_mm, length_mm)
        spread_mm2 = curvature**2 * length_mm**5 / (20.0 * _DRIFT_LENGTH_MM)
        for drift, direction in (
            (self.curvature_drift, np.array(end.bevel)),
            (self.turn_drift_rad, np.array(bending_axis(end))),
        ):
            covariance += drift**2 * spread_mm2 * np.outer(direction, direction)
        return np.asarray(covariance)

    def position_std_mm(self, length_mm: float) -> float:
        """The standard deviation of the tip's position after a further push, in mm.

        This is the largest one of all directions: the square root of the greatest eigenvalue of
        `position_covariance_mm2`, which says what it contains. It has no noise of a measurement: a
        measured position has the variance ``position_std_mm(s)^2 + noise_mm^2``.

        Args:
            length_mm: The length of the push from the present tip; 0 for the tip itself.
        """
        largest = np.linalg.eigvalsh(self.position_covariance_mm2(length_mm))[-1]
        return math.sqrt(max(0.0, float(largest)))


class Estimator:
    """Collects commands and measurements; gives an estimate at any time.

    Args:
        entry: The expected pose at depth 0.
        radius_mm: The expected radius of the motion circle.
        priors: The standard deviations of these expectations.
    """

    def __init__(self, entry: Pose, radius_mm: float, priors: Priors) -> None:
        self._entry = entry
        self._radius_mm = radius_mm
        self._priors = priors
        self._channels: list[Channel] = []
        self._inserted: list[tuple[int, float]] = []
        self._pending_rad = 0.0
        self._pending_rolls: tuple[int, ...] = ()
        self._readings: list[Reading] = []
        self._solution = np.zeros(_POSE_UNKNOWNS)
        self._stds = [priors.position_mm] * 3
        self._stds += [priors.bevel_rad, priors.heading_rad, priors.heading_rad]
        self._stds += [priors.curvature_ratio]

    @property
    def depth_mm(self) -> float:
        """The insertion depth that was commanded."""
        return sum(length_mm for _, length_mm in self._inserted)

    def push(self, length_mm: float) -> None:
        """Notes a push."""
        if length_mm <= 0.0:
            return
        channel, inserted_mm = self._inserted[-1] if self._inserted else (ENTRY, 0.0)
        if channel != ENTRY and not self._pending_rolls:
            self._inserted[-1] = (channel, inserted_mm + length_mm)
            self._extend(self._channels[channel], inserted_mm + length_mm)
            return
        depth_mm = self.depth_mm
        self._channels.append(
            Channel(channel, inserted_mm, depth_mm, self._pending_rad, self._pending_rolls)
        )
        self._inserted.append((len(self._channels) - 1, length_mm))
        self._pending_rad, self._pending_rolls = 0.0, ()
        self._extend(self._channels[-1], length_mm)

    def roll(self, angle_rad: float) -> None:
        """Notes a roll."""
        self._pending_rad += angle_rad
        self._pending_rolls += (self._unknown(self._priors.roll_std_rad(self.depth_mm)),)

    def pull(self, length_mm: float) -> None:
        """Notes a pull along the channel; the shaft keeps its rolls (see `ntagen.needle.path`)."""
        left_mm = length_mm
        while self._inserted and left_mm > 0.0:
            channel, inserted_mm = self._inserted.pop()
            if inserted_mm - left_mm > 1e-9:
                self._inserted.append((channel, inserted_mm - left_mm))
                return
            left_mm -= inserted_mm
            passed = self._channels[channel]
            self._pending_rad += passed.roll_rad
            self._pending_rolls = passed.rolls + self._pending_rolls

    def measure(self, measurement: Measurement) -> None:
        """Notes a measurement at the present place."""
        channel, inserted_mm = self._inserted[-1] if self._inserted else (ENTRY, 0.0)
        self._readings.append(Reading(channel, inserted_mm, measurement))

    def estimate(self) -> Estimate:
        """The best estimate from everything noted so far; deterministic."""
        stds = np.array(self._stds)
        start = np.zeros(len(stds))
        start[: len(self._solution)] = self._solution
        problem = Problem(self._readings, self._channels, self._priors, stds)
        expected = (self._entry, 1.0 / self._radius_mm)

        self._solution, residuals, unknowns_covariance = least_squares(
            lambda unknowns: problem.at(unknowns, *expected), start, stds
        )
        begin, placed = place(self._channels, *expected, self._solution)
        path, present = self._path(self._solution, begin, placed)
        tip = present.faded(_STAYING_RATIO, begin)
        to_tip = _slopes_of(tip)
        covariance = to_tip @ unknowns_covariance @ to_tip.T
        return Estimate(
            path=path,
            radius_mm=tip.radius_mm,
            radius_std_mm=float(tip.radius_mm * math.sqrt(covariance[6, 6])),
            rms_mm=problem.rms_mm(residuals),
            covariance=tuple(tuple(float(value) for value in row) for row in covariance),
            curvature_drift=self._priors.curvature_drift,
            turn_drift_rad=self._priors.turn_drift_rad,
            misfit_mm=self._misfit_mm(begin, placed),
        )

    def _misfit_mm(self, begin: Placed, placed: list[list[Placed]]) -> float:
        """See `Estimate.misfit_mm`; 0 while there are fewer measurements."""
        if len(self._readings) < RECENT:
            return 0.0
        differences = []
        for reading in self._readings[-RECENT:]:
            part, along_mm = begin, reading.offset_mm
            if reading.channel != ENTRY:
                channel = self._channels[reading.channel]
                number = channel.stretch_at(along_mm)
                part = placed[reading.channel][number]
                along_mm -= channel.stretches[number].offset_mm
            expected_mm = pushed_to(part.start, part.radius_mm, along_mm)
            differences.append(subtract(reading.measurement.position_mm, expected_mm))
        return float(np.linalg.norm(np.mean(differences, axis=0)))

    def _unknown(self, std: float) -> int:
        """The index of a new unknown with this standard deviation."""
        self._stds.append(std)
        return len(self._stds) - 1

    def _extend(self, channel: Channel, extent_mm: float) -> None:
        """Notes how far a channel was cut; new stretches get their unknowns."""
        if extent_mm <= channel.extent_mm:
            return
        drift = _STRETCH_RATIO * self._priors.curvature_drift
        turn_rad = _STRETCH_RATIO * self._priors.turn_drift_rad
        if drift > 0.0 or turn_rad > 0.0:
            for offset_mm in channel.new_boundaries(extent_mm):
                channel.stretches.append(
                    Stretch(
                        offset_mm,
                        curvature=self._unknown(drift) if drift > 0.0 else None,
                        turn=self._unknown(turn_rad) if turn_rad > 0.0 else None,
                    )
                )
        channel.extent_mm = extent_mm

    def _path(
        self, unknowns: _Array, entry: Placed, placed: list[list[Placed]]
    ) -> tuple[Path, Placed]:
        """The channel in which the needle lies now, and what would begin at the tip.

        The estimated errors of rolls count as rolls of the shaft: to undo a roll is to undo its
        error too. The turns of the bend plane do not: they belong to the tissue at their places.
        """
        stretches: list[PathStretch] = []
        tip = entry
        for index, length_mm in self._inserted:
            channel = self._channels[index]
            roll_rad = channel.roll_rad + sum(float(unknowns[i]) for i in channel.rolls)
            for number in range(channel.stretch_at(length_mm) + 1):
                part = placed[index][number]
                offset_mm = channel.stretches[number].offset_mm
                end_mm = length_mm
                if number + 1 < len(channel.stretches):
                    end_mm = min(end_mm, channel.stretches[number + 1].offset_mm)
                arc = Arc(part.start, part.radius_mm, end_mm - offset_mm)
                stretches.append(PathStretch(arc, roll_rad if number == 0 else 0.0))
                tip = part.beyond(end_mm - offset_mm)
        pending_rad = self._pending_rad
        pending_rad += sum(float(unknowns[i]) for i in self._pending_rolls)
        if self._pending_rolls:
            tip = tip.rolled(pending_rad, self._pending_rolls)
        return Path(entry.start, tuple(stretches), pending_rad), tip


def _slopes_of(tip: Placed) -> _Array:
    """The derivatives of position, rotation vector and curvature at the tip by the unknowns."""
    slopes = tip.positions(np.zeros(1))[1][0]
    return np.vstack([slopes, tip.rotation, tip.growth])


def pose_from_points(
    points_mm: _Array, noise_mm: float, prior: CurvaturePrior | None = None
) -> tuple[Pose, float]:
    """The pose and the radius that follow from the points of one push, without the entry.

    The position is that of the circle nearest to the last point, the heading the tangent there.

    Raises:
        ValueError: The points are not an arc (`ntagen.needle.circle.fit_circle`).
    """
    fit = fit_circle(points_mm, noise_mm, prior)
    last = points_mm[-1]
    return fit.pose_at((float(last[0]), float(last[1]), float(last[2]))), fit.radius_mm
