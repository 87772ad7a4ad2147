"""What weighs measured positions, whose errors are not independent of each other."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.fluctuations import oscillation
from ntagen.needle.priors import Priors
from ntagen.scene import Vector

_Array = NDArray[np.float64]

_DISTORTION_WAVELENGTH_MM = 20.0
_DISTORTION_DAMPING = 0.7
"""The distortion of a tracker along the depth is a damped oscillator, calibrated on measured
insertions (`ntagen.needle.phantom_parameters`)."""


class Whitening:
    """Makes of the errors of positions others that are independent and of size 1.

    The error of a mean position has independent noise and the tracker's distortion, which means at
    near depths share. Its weights are the inverse Cholesky factor of the covariance. A position
    that tells only how far a channel is aside counts along two directions instead of three.

    Args:
        depths_mm: The depths of the positions.
        counts: Of how many measurements each is the mean.
        priors: Noise and distortion.
        across: By its index, the two directions of each position that counts across only, as rows.
    """

    def __init__(
        self, depths_mm: _Array, counts: _Array, priors: Priors, across: Mapping[int, _Array]
    ) -> None:
        self._stds_mm = priors.noise_mm / np.sqrt(counts)
        self._weights: _Array | None = None
        self._directions: _Array | None = None
        if across:
            rows = [across.get(place, _ALL) for place in range(len(counts))]
            self._owners = np.repeat(np.arange(len(counts)), list(map(len, rows)))
            self._directions = np.concatenate(rows)
        if priors.distortion_mm <= 0.0:
            return
        apart_mm = depths_mm[:, None] - depths_mm[None, :]
        shared = oscillation(apart_mm, _DISTORTION_WAVELENGTH_MM, _DISTORTION_DAMPING)
        covariance = priors.distortion_mm**2 * shared + np.diag(priors.noise_mm**2 / counts)
        if self._directions is not None:
            covariance = covariance[np.ix_(self._owners, self._owners)]
            covariance *= self._directions @ self._directions.T
        self._weights = np.linalg.inv(np.linalg.cholesky(covariance))

    def of(self, positions: _Array) -> _Array:
        """Positions as independent numbers of size 1.

        Args:
            positions: An array (positions, 3, columns).

        Returns:
            An array (numbers, columns).
        """
        columns = positions.shape[2]
        if self._directions is not None:
            seen = np.einsum("rc,rck->rk", self._directions, positions[self._owners])
            if self._weights is None:
                # Directions of one position are at right angles, so their errors are independent.
                return np.asarray(seen / self._stds_mm[self._owners, None])
            return np.asarray(self._weights @ seen)
        if self._weights is None:
            return np.asarray(positions / self._stds_mm[:, None, None]).reshape(-1, columns)
        flat = positions.reshape(len(positions), -1)
        return np.asarray(self._weights @ flat).reshape(-1, columns)


_ALL: _Array = np.eye(3)


def unit_across(heading: Vector) -> _Array:
    """Two directions at right angles to each other and to a heading, as rows."""
    return np.asarray(np.linalg.svd(np.array([heading]))[2][1:])
