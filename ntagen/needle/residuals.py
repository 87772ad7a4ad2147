"""How far measurements are from what the unknowns of an estimate make expected."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.channels import ENTRY, Channel, Placed, place, positions
from ntagen.needle.fluctuations import oscillation
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


@dataclass(slots=True)
class Reading:
    """A measurement and its place.

    Attributes:
        channel: The index of the channel in which it was taken, or `ENTRY`.
        offset_mm: The length from the beginning of the channel.
        measurement: The measurement.
    """

    channel: int
    offset_mm: float
    measurement: Measurement


class Problem:
    """The least-squares problem: residuals in standard deviations, and their derivatives."""

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
        self._directed: list[tuple[int, int, float, Measurement]] = []
        rows: list[tuple[int, int, float, float, Measurement]] = []
        for reading in readings:
            number, along_mm, depth_mm = 0, reading.offset_mm, 0.0
            if reading.channel != ENTRY:
                channel = channels[reading.channel]
                depth_mm = channel.depth_mm + along_mm
                number = channel.stretch_at(reading.offset_mm)
                along_mm -= channel.stretches[number].offset_mm
            rows.append((reading.channel, number, depth_mm, along_mm, reading.measurement))
            if reading.measurement.heading is not None:
                self._directed.append((reading.channel, number, along_mm, reading.measurement))
        # Rows are in the order of the stretches.
        rows.sort(key=lambda row: row[:2])
        self._parts = list(dict.fromkeys((channel, number) for channel, number, *_ in rows))
        index = {part: place for place, part in enumerate(self._parts)}
        self._part_of = np.array([index[row[:2]] for row in rows], dtype=np.intp)
        self._along_mm = np.array([along_mm for _, _, _, along_mm, _ in rows])
        self._measured = np.array([row[-1].position_mm for row in rows]).reshape(-1, 3)
        depths_mm = np.array([depth_mm for _, _, depth_mm, _, _ in rows])
        self._begins, self._whiten = _weighed(self._part_of, depths_mm, priors)
        self._counts = np.diff([*self._begins, len(rows)])

    def at(self, unknowns: _Array, entry: Pose, curvature_per_mm: float) -> tuple[_Array, _Array]:
        """Residuals and derivatives."""
        begin, placed = place(self._channels, entry, curvature_per_mm, unknowns)
        return self._evaluated(unknowns, begin, placed)

    def rms_mm(self, unknowns: _Array, entry: Pose, curvature_per_mm: float) -> float:
        """Root mean square of the distances between measured and expected positions."""
        if not self._parts:
            return 0.0
        expected, _ = self._expected(*place(self._channels, entry, curvature_per_mm, unknowns))
        return math.sqrt(float(np.mean(np.sum((self._measured - expected) ** 2, axis=1))))

    def _expected(self, begin: Placed, placed: list[list[Placed]]) -> tuple[_Array, _Array]:
        """The positions that are expected, and their derivatives."""
        parts = [begin if one == ENTRY else placed[one][number] for one, number in self._parts]
        return positions(parts, self._part_of, self._along_mm)

    def _evaluated(
        self, unknowns: _Array, begin: Placed, placed: list[list[Placed]]
    ) -> tuple[_Array, _Array]:
        def part(channel: int, number: int) -> Placed:
            return begin if channel == ENTRY else placed[channel][number]

        residuals, slopes = [], []
        if self._parts:
            expected, moved = self._expected(begin, placed)
            off = np.add.reduceat(self._measured - expected, self._begins)
            moved = np.add.reduceat(moved.reshape(len(expected), -1), self._begins)
            off /= self._counts[:, None]
            moved /= -self._counts[:, None]
            residuals.append((self._whiten @ off).ravel())
            slopes.append((self._whiten @ moved).reshape(-1, len(unknowns)))
        for channel, number, along, measurement in self._directed:
            pose, rotation = part(channel, number).directions(along)
            seen_and_expected = (
                (measurement.heading, pose.heading),
                (measurement.bevel, pose.bevel),
            )
            for seen, direction in seen_and_expected:
                if seen is not None:
                    difference = np.array(seen) - np.array(direction)
                    residuals.append(difference / self._priors.direction_rad)
                    turned = np.cross(rotation.T, direction).T
                    slopes.append(turned / -self._priors.direction_rad)
        residuals.append(unknowns / self._stds)
        slopes.append(np.diag(1.0 / self._stds))
        return np.concatenate(residuals), np.vstack(slopes)


def _weighed(
    part_of: _Indices, depths_mm: _Array, priors: Priors
) -> tuple[_Indices, _Array]:
    """How measurements are taken together, and what their means are multiplied by.

    The error of a mean has independent noise and the tracker's distortion, which the means at near
    depths share. Multiplied by the inverse Cholesky factor of their covariance, the means have
    independent errors with the standard deviation 1.

    Returns:
        Where each group of rows begins, and the matrix.
    """
    if priors.distortion_mm <= 0.0:
        begins = np.arange(len(depths_mm), dtype=np.intp)
        return begins, np.eye(len(depths_mm)) / priors.noise_mm
    cells = np.floor(depths_mm / _BIN_MM)
    is_new = np.ones(len(cells), dtype=bool)
    is_new[1:] = (np.diff(part_of) != 0) | (np.diff(cells) != 0)
    begins = np.flatnonzero(is_new)
    counts = np.diff([*begins, len(cells)])
    middles_mm = np.add.reduceat(depths_mm, begins) / counts if len(begins) else np.zeros(0)
    apart_mm = middles_mm[:, None] - middles_mm[None, :]
    shared = oscillation(apart_mm, _DISTORTION_WAVELENGTH_MM, _DISTORTION_DAMPING)
    covariance = priors.distortion_mm**2 * shared + np.diag(priors.noise_mm**2 / counts)
    return begins, np.linalg.inv(np.linalg.cholesky(covariance))
