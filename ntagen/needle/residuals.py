"""How far measurements are from what the unknowns of an estimate make expected."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.channels import ENTRY, Channel, Placed, place, positions
from ntagen.needle.measurement import Measurement
from ntagen.needle.priors import Priors
from ntagen.scene import Pose

_Array = NDArray[np.float64]

_DISTORTION_LENGTH_MM = 10.0
"""The length over which `Priors.distortion_mm` is about the same error."""


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
        places: dict[tuple[int, int], list[tuple[float, float, Measurement]]] = {}
        noises_mm = _noises_mm(readings, priors)
        for reading, noise_mm in zip(readings, noises_mm, strict=True):
            number, along_mm = 0, reading.offset_mm
            if reading.channel != ENTRY:
                channel = channels[reading.channel]
                number = channel.stretch_at(reading.offset_mm)
                along_mm -= channel.stretches[number].offset_mm
            key = (reading.channel, number)
            places.setdefault(key, []).append((along_mm, noise_mm, reading.measurement))
            if reading.measurement.heading is not None:
                self._directed.append((reading.channel, number, along_mm, reading.measurement))
        # Rows are in the order of the stretches.
        ordered = sorted(places.items(), key=lambda item: item[0])
        self._parts = [part for part, _ in ordered]
        self._part_of = np.repeat(
            np.arange(len(ordered), dtype=np.intp), [len(group) for _, group in ordered]
        )
        rows = [row for _, group in ordered for row in group]
        self._along_mm = np.array([along_mm for along_mm, _, _ in rows])
        self._noise_mm = np.array([noise_mm for _, noise_mm, _ in rows])
        self._measured = np.array([measurement.position_mm for _, _, measurement in rows])

    def at(self, unknowns: _Array, entry: Pose, curvature_per_mm: float) -> tuple[_Array, _Array]:
        """Residuals and derivatives."""
        begin, placed = place(self._channels, entry, curvature_per_mm, unknowns)
        return self._evaluated(unknowns, begin, placed)

    def rms_mm(self, residuals: _Array) -> float:
        """Root mean square of the distances between measured and predicted positions."""
        count = 3 * len(self._noise_mm)
        if not count:
            return 0.0
        noise_mm = np.repeat(self._noise_mm, 3)
        squares = float(np.sum((noise_mm * residuals[:count]) ** 2))
        return math.sqrt(3.0 * squares / count)

    def _evaluated(
        self, unknowns: _Array, begin: Placed, placed: list[list[Placed]]
    ) -> tuple[_Array, _Array]:
        def part(channel: int, number: int) -> Placed:
            return begin if channel == ENTRY else placed[channel][number]

        residuals, slopes = [], []
        if self._parts:
            parts = [part(*one) for one in self._parts]
            expected, moved = positions(parts, self._part_of, self._along_mm)
            residuals.append(((self._measured - expected) / self._noise_mm[:, None]).ravel())
            moved /= -self._noise_mm[:, None, None]
            slopes.append(moved.reshape(-1, len(unknowns)))
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


def _noises_mm(readings: list[Reading], priors: Priors) -> list[float]:
    """The noise that each measurement counts with.

    `n` measurements with the same error `d` and independent noise `s` tell as much as `n`
    independent ones with the variance ``s^2 + n d^2``: that of their mean is ``s^2 / n + d^2``.
    """
    if priors.distortion_mm <= 0.0:
        return [priors.noise_mm] * len(readings)
    channels = np.array([reading.channel for reading in readings])
    offsets_mm = np.array([reading.offset_mm for reading in readings])
    noises_mm = np.empty(len(readings))
    for channel in set(channels.tolist()):
        here = channels == channel
        places = np.sort(offsets_mm[here])
        ends = offsets_mm[here] + 0.5 * _DISTORTION_LENGTH_MM
        near = np.searchsorted(places, ends)
        near -= np.searchsorted(places, ends - _DISTORTION_LENGTH_MM)
        noises_mm[here] = np.sqrt(priors.noise_mm**2 + near * priors.distortion_mm**2)
    return [float(noise_mm) for noise_mm in noises_mm]
