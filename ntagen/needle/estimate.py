"""Estimates where the needle is and how it bends, from all commands and measurements.

The measured positions alone tell little about the direction in which a needle will bend: on the
first 5 mm of a circle of 30 mm the tip moves 0.4 mm sideways, and the noise of a tracker is 0.1 mm.
But the commands are known. The estimator replays them (pushes, rolls and pulls) on the tree of all
channels that were cut (`ntagen.needle.channels`), with a few unknowns:

* the entry pose (three for the position, three small rotations),
* the curvature at the entry, as a factor of the expected one; in a push with a spin the expected
  one is less by the spun part, and the factor is the same,
* the error of each roll, since a shaft does not turn its tip exactly as it is turned at its base,
* what curvature and bend plane do in each stretch of 5 mm, if their priors are not 0
  (`ntagen.needle.fluctuations`). So old measurements say less about the present than new ones.

Non-linear least squares finds the unknowns with the greatest posterior density. The noise weighs
each measurement, and the prior weighs each unknown. Measurements in a channel that the needle has
left still count: they tell about the entry, the curvature, the rolls and the tissue.

Cost and errors on phantom needles: `tests/benchmarks/predictions.py` measures them, and
`tests/benchmarks/filters.py` compares with recursive filters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ntagen.errors import DeviceError
from ntagen.needle.channels import (
    ENTRY,
    STRETCH_MM,
    Bite,
    Channel,
    Placed,
    Stretch,
    padded,
    place,
)
from ntagen.needle.descent import least_squares
from ntagen.needle.fluctuations import Process, fluctuating, turning
from ntagen.needle.kinematics import Arc, orthonormal, pushed_to
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.needle.path import Stretch as PathStretch
from ntagen.needle.priors import Priors as Priors
from ntagen.needle.residuals import Problem, Reading, differences_mm
from ntagen.needle.shaft import Shaft
from ntagen.needle.shape import thinned
from ntagen.scene import Pose

_Array = NDArray[np.float64]

_POSE_UNKNOWNS = 7
"""Position (3), rotations (3) and curvature (1) come before all other unknowns."""

_BEVEL, _GROWTH = 3, 6

RECENT = 8
"""So many of the last measurements count for `Estimate.misfit_mm`; ours: those of a push of 2 mm in
pieces of 0.25 mm."""

_FIRST_MM = 10.0
"""For so far from the entry, `Priors.first_ratio` holds."""

_AT_ENTRY_MM = 1.0
"""Noise makes a shape longer: what seems to be less outside of the tissue lies at the entry; ours.
"""

_NOTHING_MM = 1e-9

_BITE_RATIO = 0.5
"""The standard deviation of `Priors.bite_mm`, relative to it; ours."""

_AHEAD_MM = 30.0
"""Predictions are made for about this length: the usual one of a plan's rest."""

_STEP_MM = 5.0
_STEPS = 20
"""What lies ahead is divided into so many steps; the last one has no end."""


_PAIRS = np.triu_indices(6, 1)
"""Of six principal axes of what is not known ahead, two count together."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """An estimate.

    Attributes:
        path: The estimated channel in which the needle lies now; its end is the tip.
        radius_mm: The radius of the motion circle that is expected over the next 30 mm without a
            spin: the present curvature does not stay. Without drift it is that of the whole path.
        radius_std_mm: The standard deviation of the mean radius over these 30 mm.
        rms_mm: Root mean square of the distances between measured and estimated positions.
        misfit_mm: The length of the mean difference between the last measured positions and the
            estimated ones (`RECENT` of them): what no needle explains that was moved as commanded.
            0 while there are fewer.
        covariance: Of the tip, in seven rows: position (x, y, z in mm), rotation vector (about x,
            y, z in rad), logarithm of the mean curvature over the next 30 mm.
        ahead: What is known of the tissue ahead, for predictions.
    """

    path: Path
    radius_mm: float
    radius_std_mm: float
    rms_mm: float
    covariance: tuple[tuple[float, ...], ...]
    ahead: Ahead = field(compare=False, repr=False)
    misfit_mm: float = 0.0

    @property
    def tip(self) -> Pose:
        """The pose of the tip."""
        return orthonormal(self.path.tip)

    def position_covariance_mm2(self, length_mm: float) -> _Array:
        """The covariance of the tip's position after a further push, along x, y and z, in mm².

        It is that of the end of an arc of the expected circle. It contains what the estimator knows
        of its own errors: those of the tip's position and direction, and of curvature and bend
        plane all along the push, with their correlations. It does not contain the noise of a
        measurement at that place, nor the error of a roll that is made before the push, nor what
        the priors do not say (layers, a moving target).

        Args:
            length_mm: The length of the push, at least 0.
        """
        return self.ahead.position_covariance_mm2(self.tip, self.radius_mm, length_mm)

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

    def bend(self, length_mm: float) -> Bend:
        """How the needle may bend over a further push of this length, greater than 0, in mm."""
        return self.ahead.bend(self.tip, self.radius_mm, length_mm)


@dataclass(frozen=True, slots=True)
class Bend:
    """How a needle may bend over a push, and what that does not explain of where the push ends.

    Attributes:
        mean: The logarithm of the mean curvature, relative to that of the expected circle.
        std: Its standard deviation.
        rest_mm2: The second moments of the distance from the end of the circle that has the true
            mean curvature, along x, y and z.
    """

    mean: float
    std: float
    rest_mm2: _Array


@dataclass(frozen=True, slots=True)
class Ahead:
    """The tissue ahead of the tip, in steps, and how what is known of it depends on the pose.

    Attributes:
        covariance: Of the position, of the rotation vector of the tip without the turn of the bend
            plane, and in each step of the logarithm of the curvature and of the bend plane's turn.
        differences: How much more than on the expected circle the logarithm of the curvature and
            the turn of the bend plane are expected to be, in each step.
    """

    covariance: _Array
    differences: _Array

    def position_covariance_mm2(self, tip: Pose, radius_mm: float, length_mm: float) -> _Array:
        """The second moments of the error of a predicted position: `Estimate`.

        Along the principal axes of the errors the position is followed to one standard deviation on
        both sides, and along two of the greatest at a time. The differences give its covariance to
        second order (M. Nørgaard, N. K. Poulsen, O. Ravn, "New developments in state estimation for
        nonlinear systems", Automatica 36, 2000): on 30 mm of a bend the first is not enough.
        """
        if length_mm <= 0.0:
            return self.covariance[:3, :3]
        expected_mm = np.array(pushed_to(tip, radius_mm, length_mm))

        def off_mm(errors: _Array) -> _Array:
            return np.asarray(_ends(tip, radius_mm, length_mm, errors) - expected_mm)

        return self._moments_mm2(length_mm, off_mm)

    def bend(self, tip: Pose, radius_mm: float, length_mm: float) -> Bend:
        """See `Estimate.bend`."""
        used = self._used(length_mm)
        grown, weights = slice(6, 6 + used), _weights(length_mm)[:used]
        mean = float(weights @ self.differences[:used])
        variance = float(weights @ self.covariance[grown, grown] @ weights)

        def off_mm(errors: _Array) -> _Array:
            circles = np.zeros_like(errors)
            circles[:, grown] = (errors[:, grown] @ weights)[:, None]
            ends_mm = _ends(tip, radius_mm, length_mm, errors)
            return np.asarray(ends_mm - _ends(tip, radius_mm, length_mm, circles))

        return Bend(mean, math.sqrt(max(0.0, variance)), self._moments_mm2(length_mm, off_mm))

    def _used(self, length_mm: float) -> int:
        """The number of steps in which a push of this length lies."""
        steps = len(self.differences) // 2
        return min(steps, max(1, math.ceil(length_mm / _STEP_MM - 1e-9)))

    def _moments_mm2(self, length_mm: float, off_mm: Callable[[_Array], _Array]) -> _Array:
        """The second moments of what errors of a push do; one row of errors for each case."""
        steps, used = len(self.differences) // 2, self._used(length_mm)
        parts = [slice(6 + used), slice(6 + steps, 6 + steps + used)]
        near = np.concatenate([self.covariance[:, part] for part in parts], axis=1)
        variances, axes = np.linalg.eigh(np.concatenate([near[part] for part in parts]))
        moved = (axes * np.sqrt(np.maximum(0.0, variances))).T
        # The greatest come last.
        one, other = _PAIRS
        pairs = moved[-1 - one] + moved[-1 - other]
        errors = np.concatenate([np.zeros_like(moved[:1]), moved, -moved, pairs])
        errors[:, 6 : 6 + used] += self.differences[:used]
        errors[:, 6 + used :] += self.differences[steps : steps + used]
        middle, more, less, both = np.split(off_mm(errors), [1, 1 + len(moved), 1 + 2 * len(moved)])
        first, second = 0.5 * (more - less), 0.5 * (more + less) - middle
        mixed = both - more[-1 - one] - more[-1 - other] + middle
        mean_mm = (middle + second.sum(axis=0))[0]
        covariance = first.T @ first + 2.0 * second.T @ second + mixed.T @ mixed
        return np.asarray(covariance + np.outer(mean_mm, mean_mm))


def _ends(tip: Pose, radius_mm: float, length_mm: float, errors: _Array) -> _Array:
    """Where pushes end with these errors, as `Ahead` orders them; one row for each."""
    steps = (errors.shape[1] - 6) // 2
    rotations = errors[:, 3:6]
    angles = np.linalg.norm(rotations, axis=1)[:, None]
    sine, versine = np.sinc(angles / math.pi), 0.5 * np.sinc(0.5 * angles / math.pi) ** 2

    def rotated(direction: _Array) -> _Array:
        # This is w x (w x d), for a rotation w.
        twice = rotations * (rotations @ direction)[:, None] - angles**2 * direction
        return np.asarray(direction + sine * np.cross(rotations, direction) + versine * twice)

    places = np.array(tip.position_mm) + errors[:, :3]
    heading, bevel = rotated(np.array(tip.heading)), rotated(np.array(tip.bevel))
    side = np.cross(heading, bevel)
    turned = np.zeros((len(errors), 1))
    for step in range(steps):
        piece_mm = length_mm - step * _STEP_MM
        if step + 1 < steps:
            piece_mm = min(piece_mm, _STEP_MM)
        turn = errors[:, 6 + steps + step, None] - turned
        turned = turned + turn
        cosine, sine = np.cos(turn), np.sin(turn)
        bevel, side = cosine * bevel + sine * side, cosine * side - sine * bevel
        bend = piece_mm / radius_mm * np.exp(errors[:, 6 + step, None])
        half, chord_mm = 0.5 * bend, piece_mm * np.sinc(0.5 * bend / math.pi)
        places = places + chord_mm * (np.cos(half) * heading - np.sin(half) * bevel)
        cosine, sine = np.cos(bend), np.sin(bend)
        heading, bevel = cosine * heading - sine * bevel, cosine * bevel + sine * heading
    return np.asarray(places)


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
        self._pulled_from: list[tuple[int, float]] = []
        self._pending_rad = 0.0
        self._pending_rolls: tuple[int, ...] = ()
        self._readings: list[Reading] = []
        self._shaft = Shaft()
        self._solution = np.zeros(_POSE_UNKNOWNS)
        self._covariance = np.zeros((_POSE_UNKNOWNS, _POSE_UNKNOWNS))
        self._rolls: list[int] = []
        self._stds = [priors.position_mm] * 3
        self._stds += [priors.bevel_rad, priors.heading_rad, priors.heading_rad]
        self._stds += [priors.curvature_ratio]
        drift, turn_rad = priors.curvature_drift, priors.turn_drift_rad
        self._curvature = Process(fluctuating(drift)) if drift > 0.0 else None
        self._turn = Process(turning(turn_rad)) if turn_rad > 0.0 else None
        self._is_even = drift <= 0.0 and turn_rad <= 0.0 and priors.first_ratio <= 0.0

    @property
    def depth_mm(self) -> float:
        """The insertion depth that was commanded."""
        return sum(length_mm for _, length_mm in self._inserted)

    def push(self, length_mm: float, spin: float = 0.0) -> None:
        """Notes a push, in a part of which the needle may spin."""
        if length_mm <= 0.0:
            return
        channel, inserted_mm = self._inserted[-1] if self._inserted else (ENTRY, 0.0)
        # A tip that turns does not follow an old channel.
        old_mm = self._channels[channel].extent_mm - inserted_mm if channel != ENTRY else 0.0
        leaves = spin > 0.0 and old_mm > 1e-9
        if channel != ENTRY and not self._pending_rolls and not leaves:
            self._inserted[-1] = (channel, inserted_mm + length_mm)
            self._extend(channel, inserted_mm + length_mm, spin)
            return
        depth_mm = self.depth_mm
        new = Channel(channel, inserted_mm, depth_mm, self._pending_rad, self._pending_rolls)
        bite_mm = self._priors.bite_mm
        if channel != ENTRY and inserted_mm < self._channels[channel].extent_mm and bite_mm > 0.0:
            new.bite = Bite(bite_mm, _BITE_RATIO * bite_mm, self._unknown(1.0))
        self._channels.append(new)
        self._inserted.append((len(self._channels) - 1, length_mm))
        self._pending_rad, self._pending_rolls = 0.0, ()
        self._extend(len(self._channels) - 1, length_mm, spin)

    def roll(self, angle_rad: float) -> None:
        """Notes a roll."""
        self._pending_rad += angle_rad
        self._rolls.append(self._unknown(self._priors.roll_std_rad(self.depth_mm)))
        self._pending_rolls += (self._rolls[-1],)

    def pull(self, length_mm: float) -> None:
        """Notes a pull along the channel; the shaft keeps its rolls (see `ntagen.needle.path`)."""
        left_mm = length_mm
        self._pulled_from = list(self._inserted)
        while self._inserted and left_mm > 0.0:
            channel, inserted_mm = self._inserted.pop()
            if inserted_mm - left_mm > 1e-9:
                self._inserted.append((channel, inserted_mm - left_mm))
                return
            left_mm -= inserted_mm
            passed = self._channels[channel]
            self._pending_rad += passed.roll_rad
            self._pending_rolls = passed.rolls + self._pending_rolls

    def measure(self, measurement: Measurement, depth_mm: float | None = None) -> None:
        """Notes a measurement.

        Args:
            measurement: The measurement.
            depth_mm: The depth at which the tip was at its time, if it was another one than now: a
                tracker is late. A greater depth than now is one from before the last pull.
        """
        tip_mm = self.depth_mm if depth_mm is None else depth_mm
        way = self._inserted if tip_mm <= self.depth_mm + 1e-9 else self._pulled_from
        self._readings.append(Reading.at(self._channels, *_place_on(way, tip_mm), measurement))
        self._measure_shaft(way, tip_mm, measurement)

    def _measure_shaft(
        self, way: Sequence[tuple[int, float]], tip_mm: float, measurement: Measurement
    ) -> None:
        """Notes where the shaft lay when the tip was at a depth of a way."""
        if not measurement.shape:
            return
        for behind_mm, place_mm in thinned(measurement.shape, self._priors.shape_spacing_mm):
            depth_mm = tip_mm - behind_mm
            if -_AT_ENTRY_MM < depth_mm <= 0.0:
                depth_mm = _NOTHING_MM
            channel, offset_mm = _place_on(way, depth_mm)
            # What is outside of the tissue lies in no channel.
            if channel != ENTRY:
                self._shaft.add(self._channels, channel, offset_mm, place_mm)

    def estimate(self) -> Estimate:
        """The best estimate from everything noted so far; deterministic.

        Raises:
            DeviceError: The measurements leave no estimate that is a number.
        """
        stds = np.array(self._stds)
        start = np.zeros(len(stds))
        start[: len(self._solution)] = self._solution
        readings = self._readings + self._shaft.readings(self._channels)
        problem = Problem(readings, self._channels, self._priors, stds)
        expected = (self._entry, 1.0 / self._radius_mm)

        try:
            self._solution, unknowns_covariance = least_squares(
                lambda unknowns: problem.at(unknowns, *expected), start, stds
            )
        except np.linalg.LinAlgError as error:
            raise DeviceError(
                f"no needle can be estimated from the measurements: {error}\n"
                "hint: are they in mm, and the priors and the noise of the tracker sensible?"
            ) from error
        self._covariance = unknowns_covariance
        begin, placed = place(self._channels, *expected, self._solution)
        path, present = self._path(self._solution, begin, placed)
        tip, to_expected, ahead = self._ahead(present, begin, unknowns_covariance)
        covariance = to_expected @ ahead.covariance @ to_expected.T
        off_mm = differences_mm(self._readings, begin, placed)
        misfit_mm = 0.0
        if len(off_mm) >= RECENT:
            misfit_mm = float(np.linalg.norm(np.mean(off_mm[-RECENT:], axis=0)))
        return Estimate(
            path=path,
            radius_mm=tip.radius_mm,
            radius_std_mm=float(tip.radius_mm * math.sqrt(covariance[6, 6])),
            rms_mm=float(np.sqrt(np.mean(np.sum(off_mm**2, axis=1)))) if len(off_mm) else 0.0,
            covariance=tuple(tuple(float(value) for value in row) for row in covariance),
            ahead=ahead,
            misfit_mm=misfit_mm,
        )

    def learned(self) -> tuple[_Array, _Array]:
        """What the last `estimate` says of the needle itself, and not of where it is.

        Returns:
            The angle of the bevel from the expected one in rad, the logarithm of the curvature
            relative to the expected one, and the error of each roll in rad, in the order of the
            rolls; and their covariance.
        """
        kept = [_BEVEL, _GROWTH, *self._rolls]
        return self._solution[kept], self._covariance[np.ix_(kept, kept)]

    def _ahead(
        self, tip: Placed, entry: Placed, unknowns_covariance: _Array
    ) -> tuple[Placed, _Array, Ahead]:
        """What is expected of the tissue ahead.

        Returns:
            The tip on the expected circle; the matrix from what `Ahead.covariance` is of to what
            `Estimate.covariance` is of; and what is known ahead.
        """
        unknowns, width, depth_mm = self._solution, len(self._solution), self.depth_mm
        channel, inserted_mm = self._inserted[-1] if self._inserted else (ENTRY, 0.0)
        turn = np.zeros(width)
        if channel != ENTRY:
            parts = self._channels[channel]
            turn = padded(parts.stretches[parts.stretch_at(inserted_mm)].turn, width)
        if self._pending_rolls or channel == ENTRY:
            channel = len(self._channels)
        depths_mm: _Array = depth_mm + _STEP_MM * (np.arange(_STEPS, dtype=np.float64) + 0.5)
        rest = np.zeros((6 + 2 * _STEPS, 6 + 2 * _STEPS))
        growths, turns = np.zeros((_STEPS, width)), np.tile(turn, (_STEPS, 1))
        grown, turned = slice(6, 6 + _STEPS), slice(6 + _STEPS, None)
        if self._curvature is not None:
            growths, rest[grown, grown] = self._curvature.ahead(channel, depths_mm, width)
        if self._turn is not None:
            turns, rest[turned, turned] = self._turn.ahead(channel, depths_mm, width)
        expected = np.array([self._expected(depth_mm) for depth_mm in depths_mm])
        weights = _weights()
        circle = Stretch(0.0, weights @ growths, weights @ turns, float(weights @ expected))
        on_circle = tip.among(circle, entry, unknowns, turn)
        heading = np.array(tip.start.heading)
        rows = [tip.positions(np.zeros(1))[1][0], tip.rotation - np.outer(heading, turn)]
        table = np.vstack([*rows, growths + entry.growth, turns])
        differences = np.concatenate([growths @ unknowns + expected, turns @ unknowns])
        differences[:_STEPS] -= weights @ differences[:_STEPS]
        differences[_STEPS:] -= weights @ differences[_STEPS:]
        to_expected = np.zeros((7, len(table)))
        to_expected[:6, :6] = np.eye(6)
        to_expected[3:6, turned] = np.outer(heading, weights)
        to_expected[6, grown] = weights
        ahead = Ahead(table @ unknowns_covariance @ table.T + rest, differences)
        return on_circle, to_expected, ahead

    def _expected(self, depth_mm: float) -> float:
        """By how much the logarithm of the curvature differs at a depth, as expected."""
        return math.log1p(self._priors.first_ratio) if depth_mm < _FIRST_MM else 0.0

    def _unknown(self, std: float) -> int:
        """The index of a new unknown with this standard deviation."""
        self._stds.append(std)
        return len(self._stds) - 1

    def _extend(self, index: int, extent_mm: float, spin: float) -> None:
        """Notes how far a channel was cut, and the spin; new stretches get their unknowns."""
        channel = self._channels[index]
        if extent_mm <= channel.extent_mm:
            return
        channel.spin_from_here(spin)
        if self._is_even:
            channel.stretches = channel.stretches or [Stretch(0.0, spin=spin)]
        else:
            for offset_mm in channel.new_boundaries(extent_mm):
                channel.begin_stretch(self._stretch(index, channel.depth_mm, offset_mm, spin))
        channel.extent_mm = extent_mm

    def _stretch(self, channel: int, depth_mm: float, offset_mm: float, spin: float) -> Stretch:
        """A new stretch with its unknowns."""
        stretch = Stretch(offset_mm, spin=spin)
        begin_mm = depth_mm + offset_mm
        end_mm = STRETCH_MM * (math.floor(begin_mm / STRETCH_MM + 1e-9) + 1.0)
        middle_mm = 0.5 * (begin_mm + end_mm)
        if self._curvature is not None:
            stretch.growth = self._curvature.add(channel, middle_mm, self._unknown(1.0))
        if self._turn is not None:
            stretch.turn = self._turn.add(channel, middle_mm, self._unknown(1.0))
        stretch.expected = self._expected(middle_mm)
        return stretch

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


def _place_on(way: Sequence[tuple[int, float]], depth_mm: float) -> tuple[int, float]:
    """The channel at a depth of a way, and the length from its beginning; `ENTRY` at 0 or less.

    Args:
        way: Channels, and how far the needle is inserted in each.
        depth_mm: The depth; beyond the way it is the end.
    """
    place = (ENTRY, 0.0)
    for channel, inserted_mm in way:
        if depth_mm <= 0.0:
            break
        place = (channel, min(inserted_mm, depth_mm))
        depth_mm -= inserted_mm
    return place


def _weights(length_mm: float = _AHEAD_MM) -> _Array:
    """How much each step counts for the place at the end of a push: by the length left."""
    begins_mm = _STEP_MM * np.arange(_STEPS)
    left_mm = np.maximum(0.0, length_mm - begins_mm) ** 2
    left_mm -= np.maximum(0.0, length_mm - begins_mm - _STEP_MM) ** 2
    return np.asarray(left_mm / np.sum(left_mm))
