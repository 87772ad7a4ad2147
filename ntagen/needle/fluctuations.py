"""How curvature and bend plane change along the depth, as random processes.

On measured insertions the curvature fluctuates around that of the whole insertion, and the bend
plane fluctuates and turns (`ntagen.needle.phantom_parameters` has the sources). Both are described
by Gaussian processes of the depth: a damped oscillator, and for the bend plane also a steady turn.
So a curvature that is too great now is expected to be too small half a wavelength further on.

A process has one value in each stretch of a channel. The value is a linear combination of unknowns
that are independent before anything is measured, each with the standard deviation 1: a row of the
Cholesky factor of the covariance of all values. A new stretch adds a row and an unknown, and leaves
the rows before it as they are. This is Gaussian process regression (C. E. Rasmussen, C. K. I.
Williams, "Gaussian Processes for Machine Learning", 2006, section 2.2).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]

Covariance = Callable[[_Array, _Array], _Array]
"""Of the values at two depths; it takes arrays that go together as those of NumPy."""

WAVELENGTH_MM = 30.0
"""The undamped wavelength of curvature and bend plane; calibrated on measured insertions."""

DAMPING = 0.2
"""The damping ratio of both."""

DRIFT_LENGTH_MM = 10.0
"""The length for which drifts are given."""

STEADY_SHARE = 0.12
"""The share of the steady turn in the variance of the bend plane's turn over `DRIFT_LENGTH_MM`."""

ALIKE = 0.95
"""The correlation of the values of two channels at the same depth: they lie in the same tissue, and
a few millimetres apart. Ours."""

_LEAST_VARIANCE = 1e-9


def oscillation(length_mm: _Array, wavelength_mm: float, damping: float) -> _Array:
    """The correlation of a damped oscillator that white noise drives, over these lengths."""
    rate = 2.0 * math.pi / wavelength_mm
    root = math.sqrt(1.0 - damping**2)
    turned = rate * np.abs(length_mm)
    wave = np.cos(root * turned) + damping / root * np.sin(root * turned)
    return np.asarray(np.exp(-damping * turned) * wave)


def _correlation(length_mm: _Array) -> _Array:
    return oscillation(length_mm, WAVELENGTH_MM, DAMPING)


DRIFT_RATIO = math.sqrt(2.0 - 2.0 * float(_correlation(np.array(DRIFT_LENGTH_MM))))
"""The change of a fluctuation over `DRIFT_LENGTH_MM`, relative to its standard deviation."""


def fluctuating(drift: float) -> Covariance:
    """The covariance of a stationary fluctuation that changes by this much over 10 mm."""
    variance = (drift / DRIFT_RATIO) ** 2
    return lambda one_mm, other_mm: variance * _correlation(one_mm - other_mm)


def turning(drift: float) -> Covariance:
    """The covariance of a bend plane that turns by this much over 10 mm; it starts at 0."""
    variance = (1.0 - STEADY_SHARE) * (drift / DRIFT_RATIO) ** 2
    steady = STEADY_SHARE * (drift / DRIFT_LENGTH_MM) ** 2

    def covariance(one_mm: _Array, other_mm: _Array) -> _Array:
        since = 1.0 + _correlation(one_mm - other_mm)
        since = since - _correlation(one_mm) - _correlation(other_mm)
        return np.asarray(variance * since + steady * one_mm * other_mm)

    return covariance


class Process:
    """The values of a process in all stretches, as rows of coefficients of unknowns.

    Args:
        covariance: Of the values in one channel.
    """

    def __init__(self, covariance: Covariance) -> None:
        self._covariance = covariance
        self._depths_mm = np.zeros(0)
        self._channels = np.zeros(0, dtype=np.intp)
        self._unknowns = np.zeros(0, dtype=np.intp)
        self._lower = np.zeros((0, 0))

    def add(self, channel: int, depth_mm: float, unknown: int) -> _Array:
        """The row of a new stretch: its last coefficient is that of the new unknown."""
        own = float(self._covariance(np.array(depth_mm), np.array(depth_mm)))
        known = self._known(channel, np.array([depth_mm]))[0]
        rest = math.sqrt(max(_LEAST_VARIANCE * own, own - float(known @ known)))
        count = len(known)
        lower = np.zeros((count + 1, count + 1))
        lower[:count, :count] = self._lower
        lower[count, :count], lower[count, count] = known, rest
        self._lower = lower
        self._depths_mm = np.append(self._depths_mm, depth_mm)
        self._channels = np.append(self._channels, channel)
        self._unknowns = np.append(self._unknowns, unknown)
        row = np.zeros(unknown + 1)
        row[self._unknowns] = lower[count]
        return row

    def ahead(self, channel: int, depths_mm: _Array, width: int) -> tuple[_Array, _Array]:
        """Values at other depths of a channel: what the unknowns tell of them, and the rest.

        Args:
            channel: The channel; it may be a new one.
            depths_mm: The depths.
            width: The number of all unknowns.

        Returns:
            A row of coefficients for each depth, and the covariance of what they leave open.
        """
        known = self._known(channel, depths_mm)
        rows = np.zeros((len(depths_mm), width))
        rows[:, self._unknowns] = known
        own = self._covariance(depths_mm[:, None], depths_mm[None, :])
        return rows, own - known @ known.T

    def _known(self, channel: int, depths_mm: _Array) -> _Array:
        """The coefficients of the unknowns so far; forward substitution."""
        shared = np.where(self._channels == channel, 1.0, ALIKE)
        both = shared * self._covariance(depths_mm[:, None], self._depths_mm[None, :])
        return np.asarray(np.linalg.solve(self._lower, both.T).T)
