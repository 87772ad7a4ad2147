"""How far measurements are from what the unknowns of an estimate make expected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.channels import ENTRY, Channel, Placed, padded, place, points, positions
from ntagen.needle.fluctuations import oscillation
from ntagen.needle.kinematics import roll
from ntagen.needle.measurement import Measurement
from ntagen.needle.priors import Priors
from ntagen.scene import Pose

_Array = NDArray[np.float64]
_Indices = NDArray[np.intp]

_DISTORTION_WAVELENGTH_MM = 20.0
_DISTORTION_DAMPING = 0.7
"""The distortion of a tracker along the depth is a damped oscillator, calibrated on measured
insertions (`ntagen.needle.phantom_parameters`)."""

_BIN_MM = 1.0
"""Measurements on this length have about the same distortion, so that their mean says as much."""


@dataclass(frozen=True, slots=True)
class Reading:
    """A measurement and its place.

    Attributes:
        channel: The index of the channel in which it was taken, or `ENTRY`.
        stretch: The index of the stretch in the channel.
        along_mm: The length from the beginning of the stretch.
        depth_mm: The depth.
        measurement: The measurement.
    """

    channel: int
    stretch: int
    along_mm: float
    depth_mm: float
    measurement: Measurement

    @staticmethod
    def at(
        channels: list[Channel], channel: int, offset_mm: float, measurement: Measurement
    ) -> Reading:
        """A measurement at a length from the beginning of a channel."""
        if channel == ENTRY:
            return Reading(channel, 0, offset_mm, 0.0, measurement)
        here = channels[channel]
        stretch = here.stretch_at(offset_mm)
        along_mm = offset_mm - here.stretches[stretch].offset_mm
        return Reading(channel, stretch, along_mm, here.depth_mm + offset_mm, measurement)

    @property
    def part(self) -> tuple[int, int]:
        """The stretch: its channel, and its index there."""
        return self.channel, self.stretch


class Problem:
    """The least-squares problem: residuals in standard deviations, and their derivatives.

    Measurements on 1 mm of a stretch count as one at their mean place, if the tracker has
    distortion; what this leaves out of an arc is 0.001 mm.
    """

    def __init__(
        self,
        readings: list[Reading],
        channels: list[Channel],
        priors: Priors,
        stds: _Array,
    ) -> None:
        self._channels = channels
        self._priors = priors
        self._stds = stds
        self._directed = [one for one in readings if one.measurement.heading is not None]
        # Rows are in the order of the stretches.
        ordered = sorted(readings, key=lambda one: one.part)
        self._parts, part_of = _by_part(ordered)
        lengths_mm = np.array([(one.depth_mm, one.along_mm) for one in ordered]).reshape(-1, 2)
        begins = _begins(part_of, lengths_mm[:, 0], priors)
        counts = np.diff([*begins, len(ordered)])
        self._part_of = part_of[begins]
        depths_mm, self._along_mm = (_sums(lengths_mm, begins) / counts[:, None]).T
        places = np.array([one.measurement.position_mm for one in ordered]).reshape(-1, 3)
        self._measured = _sums(places, begins) / counts[:, None]
        self._whitening = _whitening(depths_mm, counts, priors)

    def at(self, unknowns: _Array, entry: Pose, curvature_per_mm: float) -> tuple[_Array, _Array]:
        """Residuals and derivatives."""
        begin, placed = place(self._channels, entry, curvature_per_mm, unknowns)
        return self._evaluated(unknowns, begin, placed)

    def _evaluated(
        self, unknowns: _Array, begin: Placed, placed: list[list[Placed]]
    ) -> tuple[_Array, _Array]:
        residuals, slopes = [], []
        if self._parts:
            parts = [_placed_at(one, begin, placed) for one in self._parts]
            expected, moved = positions(parts, self._part_of, self._along_mm)
            moved = self._whitened(moved.reshape(len(expected), -1))
            residuals.append(self._whitened(self._measured - expected).ravel())
            slopes.append(-moved.reshape(-1, len(unknowns)))
        for reading in self._directed:
            measurement = reading.measurement
            here = _placed_at(reading.part, begin, placed)
            pose, rotation = here.directions(reading.along_mm)
            # A tracker sees how the tip was turned, and not how the tissue turns the bend plane.
            turn = self._turn(reading, len(unknowns))
            seen_and_expected = (
                (measurement.heading, pose.heading, rotation),
                (
                    measurement.bevel,
                    roll(pose, -float(turn @ unknowns)).bevel,
                    rotation - np.outer(pose.heading, turn),
                ),
            )
            for seen, direction, moved in seen_and_expected:
                if seen is not None:
                    difference = np.array(seen) - np.array(direction)
                    residuals.append(difference / self._priors.direction_rad)
                    turned = np.cross(moved.T, direction).T
                    slopes.append(turned / -self._priors.direction_rad)
        residuals.append(unknowns / self._stds)
        slopes.append(np.diag(1.0 / self._stds))
        return np.concatenate(residuals), np.vstack(slopes)

    def _whitened(self, rows: _Array) -> _Array:
        """Rows of positions, so that their errors are independent and of size 1."""
        if self._whitening is None:
            return rows / self._priors.noise_mm
        return np.asarray(self._whitening @ rows)

    def _turn(self, reading: Reading, width: int) -> _Array:
        """The coefficients of the turn of the bend plane at a reading."""
        if reading.channel == ENTRY:
            return np.zeros(width)
        return padded(self._channels[reading.channel].stretches[reading.stretch].turn, width)


def differences_mm(
    readings: Sequence[Reading], begin: Placed, placed: Sequence[Sequence[Placed]]
) -> _Array:
    """By how much measured positions differ from those on placed channels; one row for each.

    Args:
        readings: The measurements with their places.
        begin: The entry.
        placed: The stretches of the channels.
    """
    if not readings:
        return np.zeros((0, 3))
    numbers, part_of = _by_part(readings)
    parts = [_placed_at(one, begin, placed) for one in numbers]
    along_mm = np.array([one.along_mm for one in readings])
    measured_mm = np.array([one.measurement.position_mm for one in readings])
    return measured_mm - points(parts, part_of, along_mm)


def _by_part(readings: Sequence[Reading]) -> tuple[list[tuple[int, int]], _Indices]:
    """The stretches on which measurements lie, and the index of its stretch for each of them."""
    parts = list(dict.fromkeys(one.part for one in readings))
    index = {part: place for place, part in enumerate(parts)}
    return parts, np.array([index[one.part] for one in readings], dtype=np.intp)


def _placed_at(part: tuple[int, int], begin: Placed, placed: Sequence[Sequence[Placed]]) -> Placed:
    """The stretch with a channel and an index there, as `Reading.part` gives them."""
    channel, number = part
    return begin if channel == ENTRY else placed[channel][number]


def _begins(part_of: _Indices, depths_mm: _Array, priors: Priors) -> _Indices:
    """Where the groups of measurements begin that count as one."""
    if priors.distortion_mm <= 0.0:
        return np.arange(len(depths_mm), dtype=np.intp)
    cells = np.floor(depths_mm / _BIN_MM)
    is_new = np.ones(len(cells), dtype=bool)
    is_new[1:] = (np.diff(part_of) != 0) | (np.diff(cells) != 0)
    return np.flatnonzero(is_new)


def _sums(rows: _Array, begins: _Indices) -> _Array:
    """The sums of groups of rows."""
    return np.add.reduceat(rows, begins) if len(begins) else rows


def _whitening(depths_mm: _Array, counts: _Indices, priors: Priors) -> _Array | None:
    """What positions are multiplied by, so that their errors are independent and of size 1.

    None without distortion: each position then has the noise alone.

    The error of a mean has independent noise and the tracker's distortion, which the means at near
    depths share. The matrix is the inverse Cholesky factor of their covariance.
    """
    if priors.distortion_mm <= 0.0:
        return None
    apart_mm = depths_mm[:, None] - depths_mm[None, :]
    shared = oscillation(apart_mm, _DISTORTION_WAVELENGTH_MM, _DISTORTION_DAMPING)
    covariance = priors.distortion_mm**2 * shared + np.diag(priors.noise_mm**2 / counts)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))
