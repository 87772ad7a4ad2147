"""How far measurements are from what the unknowns of an estimate make expected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.channels import ENTRY, Channel, Placed, padded, place, points, positions
from ntagen.needle.kinematics import roll
from ntagen.needle.measurement import Measurement
from ntagen.needle.priors import Priors
from ntagen.needle.whitening import Whitening, unit_across
from ntagen.scene import Pose

_Array = NDArray[np.float64]
_Indices = NDArray[np.intp]

BIN_MM = 1.0
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
        count: Of so many measured places it is the mean.
        is_across: Whether it tells only how far the channel is aside, not how deep a place is.
    """

    channel: int
    stretch: int
    along_mm: float
    depth_mm: float
    measurement: Measurement
    count: int = 1
    is_across: bool = False

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
        ordered = sorted(readings, key=lambda one: (one.part, one.is_across))
        self._parts, part_of = _by_part(ordered)
        lengths_mm = np.array([(one.depth_mm, one.along_mm) for one in ordered]).reshape(-1, 2)
        is_across = np.array([one.is_across for one in ordered], dtype=bool)
        begins = _begins(part_of, lengths_mm[:, 0], is_across, priors)
        numbers = np.array([one.count for one in ordered], dtype=np.float64)[:, None]
        counts = _sums(numbers, begins)
        self._part_of, self._is_across = part_of[begins], is_across[begins]
        self._depths_mm, self._along_mm = (_sums(numbers * lengths_mm, begins) / counts).T
        places = np.array([one.measurement.position_mm for one in ordered]).reshape(-1, 3)
        self._measured = _sums(numbers * places, begins) / counts
        self._counts = counts[:, 0]
        self._whitening: Whitening | None = None

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
            if self._whitening is None:
                # The directions of the channels change too little to matter in one search.
                self._whitening = self._weighed(parts)
            residuals.append(self._whitening.of((self._measured - expected)[:, :, None]).ravel())
            slopes.append(-self._whitening.of(moved))
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

    def _weighed(self, parts: list[Placed]) -> Whitening:
        """What weighs the errors of the positions on channels that are placed so."""
        places = np.flatnonzero(self._is_across)
        headings = [
            parts[self._part_of[at]].directions(self._along_mm[at])[0].heading for at in places
        ]
        across = dict(zip(places.tolist(), map(unit_across, headings), strict=True))
        return Whitening(self._depths_mm, self._counts, self._priors, across)

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


def _begins(
    part_of: _Indices, depths_mm: _Array, is_across: NDArray[np.bool_], priors: Priors
) -> _Indices:
    """Where the groups of measurements begin that count as one."""
    if priors.distortion_mm <= 0.0:
        return np.arange(len(depths_mm), dtype=np.intp)
    cells = np.floor(depths_mm / BIN_MM)
    is_new = np.ones(len(cells), dtype=bool)
    is_new[1:] = (np.diff(part_of) != 0) | (np.diff(cells) != 0) | np.diff(is_across)
    return np.flatnonzero(is_new)


def _sums(rows: _Array, begins: _Indices) -> _Array:
    """The sums of groups of rows."""
    return np.add.reduceat(rows, begins) if len(begins) else rows
