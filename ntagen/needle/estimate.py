"""Estimates where the needle is and how it bends, from all commands and measurements.

The measured positions alone tell little about the direction in which a needle will bend: on the
first 5 mm of a circle of 30 mm the tip moves 0.4 mm sideways, and the noise of a tracker is 0.1 mm.
But the commands are known. The estimator replays them (pushes, rolls and pulls) on the tree of all
channels that were cut, with a few unknowns:

* the entry pose (three for the position, three small rotations),
* the curvature, as a factor of the expected one,
* the error of each roll, since a shaft does not turn its tip exactly as it is turned at its base.

Non-linear least squares finds the unknowns with the greatest posterior density. The noise weighs
each measurement, and the prior weighs each unknown. Measurements in a channel that the needle has
left still count: they tell about the entry, the curvature and the rolls.

Cost: about 0.3 ms for one residual vector of 200 measurements; an estimate needs ten to forty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.optimize  # type: ignore[import-untyped]
from numpy.typing import NDArray

from ntagen.needle.circle import CurvaturePrior, fit_circle
from ntagen.needle.kinematics import bending_axis, orthonormal, push, roll
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.needle.vectors import add, rotate
from ntagen.scene import Pose, Vector

_Array = NDArray[np.float64]

_ENTRY = -1
"""The index of the entry in the tree of channels."""

_POSE_UNKNOWNS = 7
"""Position (3), rotations (3) and curvature (1) come before the rolls."""


@dataclass(frozen=True, slots=True)
class Priors:
    """Standard deviations that are assumed before anything is measured.

    Attributes:
        position_mm: Each coordinate of the entry point.
        heading_rad: The entry's heading, about either transverse axis.
        bevel_rad: The bevel's angle about the shaft at the entry.
        curvature_ratio: The curvature, relative to the expected one.
        roll_rad: The error of each roll.
        noise_mm: Each coordinate of a measured position.
        direction_rad: A measured direction, if the sensor reports directions.
    """

    position_mm: float = 0.2
    heading_rad: float = math.radians(1.0)
    bevel_rad: float = math.radians(2.0)
    curvature_ratio: float = 0.05
    roll_rad: float = math.radians(1.0)
    noise_mm: float = 0.1
    direction_rad: float = math.radians(1.0)


@dataclass(frozen=True, slots=True)
class Estimate:
    """An estimate.

    Attributes:
        path: The estimated channel in which the needle lies now; its end is the tip.
        radius_mm: The radius of the motion circle.
        radius_std_mm: Its standard deviation.
        rms_mm: Root mean square of the distances between measured and estimated positions.
    """

    path: Path
    radius_mm: float
    radius_std_mm: float
    rms_mm: float

    @property
    def tip(self) -> Pose:
        """The pose of the tip."""
        return orthonormal(self.path.tip)


@dataclass(slots=True)
class _Channel:
    """An arc of the tree: where it leaves its parent, and the rolls made there."""

    parent: int
    offset_mm: float
    roll_rad: float
    rolls: tuple[int, ...]


@dataclass(slots=True)
class _Reading:
    channel: int
    offset_mm: float
    measurement: Measurement


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
        self._channels: list[_Channel] = []
        self._inserted: list[tuple[int, float]] = []
        self._pending_rad = 0.0
        self._pending_rolls: tuple[int, ...] = ()
        self._roll_count = 0
        self._readings: list[_Reading] = []
        self._solution = np.zeros(_POSE_UNKNOWNS)

    @property
    def depth_mm(self) -> float:
        """The insertion depth that was commanded."""
        return sum(length_mm for _, length_mm in self._inserted)

    def push(self, length_mm: float) -> None:
        """Notes a push."""
        if length_mm <= 0.0:
            return
        channel, inserted_mm = self._inserted[-1] if self._inserted else (_ENTRY, 0.0)
        if channel != _ENTRY and not self._pending_rolls:
            self._inserted[-1] = (channel, inserted_mm + length_mm)
            return
        self._channels.append(
            _Channel(channel, inserted_mm, self._pending_rad, self._pending_rolls)
        )
        self._inserted.append((len(self._channels) - 1, length_mm))
        self._pending_rad, self._pending_rolls = 0.0, ()

    def roll(self, angle_rad: float) -> None:
        """Notes a roll."""
        self._pending_rad += angle_rad
        self._pending_rolls += (self._roll_count,)
        self._roll_count += 1

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
        channel, inserted_mm = self._inserted[-1] if self._inserted else (_ENTRY, 0.0)
        self._readings.append(_Reading(channel, inserted_mm, measurement))

    def estimate(self) -> Estimate:
        """The best estimate from everything noted so far; deterministic."""
        unknown_count = _POSE_UNKNOWNS + self._roll_count
        start = np.zeros(unknown_count)
        start[: len(self._solution)] = self._solution
        places = _Places(self._readings, len(self._channels))
        weights = self._prior_weights(unknown_count)

        def residuals(unknowns: _Array) -> _Array:
            starts, curvature = self._starts(unknowns)
            return np.concatenate(
                [places.residuals(starts, curvature, self._priors), unknowns / weights]
            )

        # Unknowns are in units of their standard deviations, so that one step size fits all.
        result = scipy.optimize.least_squares(residuals, start, method="lm", x_scale=weights)
        self._solution = result.x
        starts, curvature = self._starts(result.x)
        covariance = np.linalg.pinv(result.jac.T @ result.jac)
        radius_mm = 1.0 / curvature
        return Estimate(
            path=self._path(result.x, starts[_ENTRY], radius_mm),
            radius_mm=radius_mm,
            radius_std_mm=float(radius_mm * math.sqrt(covariance[6, 6])),
            rms_mm=places.rms_mm(starts, curvature),
        )

    def _prior_weights(self, unknown_count: int) -> _Array:
        priors = self._priors
        rolls = [priors.roll_rad] * (unknown_count - _POSE_UNKNOWNS)
        return np.array(
            [priors.position_mm] * 3
            + [priors.bevel_rad, priors.heading_rad, priors.heading_rad, priors.curvature_ratio]
            + rolls
        )

    def _starts(self, unknowns: _Array) -> tuple[dict[int, Pose], float]:
        """The pose at the start of each channel, and the curvature."""
        values = [float(value) for value in unknowns]
        curvature = math.exp(values[6]) / self._radius_mm
        starts = {_ENTRY: self._entry_pose(values)}
        for index, channel in enumerate(self._channels):
            parent = starts[channel.parent]
            there = push(parent, 1.0 / curvature, channel.offset_mm)
            errors_rad = sum(values[_POSE_UNKNOWNS + i] for i in channel.rolls)
            starts[index] = roll(there, channel.roll_rad + errors_rad)
        return starts, curvature

    def _entry_pose(self, values: list[float]) -> Pose:
        entry = self._entry
        heading, bevel = entry.heading, entry.bevel
        for axis, angle_rad in (
            (entry.heading, values[3]),
            (entry.bevel, values[4]),
            (bending_axis(entry), values[5]),
        ):
            heading, bevel = rotate(heading, axis, angle_rad), rotate(bevel, axis, angle_rad)
        moved: Vector = (values[0], values[1], values[2])
        return Pose(add(entry.position_mm, moved), heading, bevel)

    def _path(self, unknowns: _Array, entry: Pose, radius_mm: float) -> Path:
        """The channel in which the needle lies now, with the estimated errors of its rolls."""

        def turned_rad(nominal_rad: float, rolls: tuple[int, ...]) -> float:
            return nominal_rad + sum(float(unknowns[_POSE_UNKNOWNS + i]) for i in rolls)

        path = Path(entry)
        for index, length_mm in self._inserted:
            channel = self._channels[index]
            if channel.rolls:
                path = path.roll(turned_rad(channel.roll_rad, channel.rolls))
            path = path.push(radius_mm, length_mm)
        if self._pending_rolls:
            path = path.roll(turned_rad(self._pending_rad, self._pending_rolls))
        return path


class _Places:
    """The measurements as arrays, by the channel in which they were taken."""

    def __init__(self, readings: list[_Reading], channel_count: int) -> None:
        self._groups: list[tuple[int, _Array, _Array]] = []
        for channel in range(_ENTRY, channel_count):
            here = [r for r in readings if r.channel == channel]
            if here:
                offsets = np.array([r.offset_mm for r in here])
                positions = np.array([r.measurement.position_mm for r in here])
                self._groups.append((channel, offsets, positions))
        self._directed = [r for r in readings if r.measurement.heading is not None]

    def residuals(self, starts: dict[int, Pose], curvature: float, priors: Priors) -> _Array:
        """Measured minus predicted, in standard deviations."""
        parts = [part.ravel() / priors.noise_mm for part in self._errors(starts, curvature)]
        for reading in self._directed:
            predicted = push(starts[reading.channel], 1.0 / curvature, reading.offset_mm)
            measured = (reading.measurement.heading, reading.measurement.bevel)
            for seen, expected in zip(measured, (predicted.heading, predicted.bevel), strict=True):
                if seen is not None:
                    parts.append((np.array(seen) - np.array(expected)) / priors.direction_rad)
        return np.concatenate(parts) if parts else np.zeros(0)

    def rms_mm(self, starts: dict[int, Pose], curvature: float) -> float:
        """Root mean square of the distances between measured and predicted positions."""
        errors = self._errors(starts, curvature)
        if not errors:
            return 0.0
        return float(np.sqrt(np.mean(np.sum(np.concatenate(errors) ** 2, axis=1))))

    def _errors(self, starts: dict[int, Pose], curvature: float) -> list[_Array]:
        return [
            positions - _positions(starts[channel], curvature, offsets)
            for channel, offsets, positions in self._groups
        ]


def _positions(start: Pose, curvature: float, offsets_mm: _Array) -> _Array:
    """The positions on the circle at these arc lengths (`ntagen.needle.kinematics.push`)."""
    half = 0.5 * curvature * offsets_mm
    chord = offsets_mm * np.sinc(half / math.pi)
    heading, bevel = np.array(start.heading), np.array(start.bevel)
    along = (chord * np.cos(half))[:, None] * heading
    return np.asarray(np.array(start.position_mm) + along - (chord * np.sin(half))[:, None] * bevel)


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
