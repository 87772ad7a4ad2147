"""Deviation from the plan, judged against the noise that the estimator knows.

One measured position of a noisy tracker says little. So the mean of the last differences between
measured and predicted positions is compared with the tolerance. The window is so long that noise
alone passes the tolerance only as often as the settings allow: for a mean of ``n`` positions with
standard deviation ``s`` in each coordinate, ``n |mean|^2 / s^2`` has a chi-square distribution with
three degrees of freedom.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np

from ntagen.drive.settings import Settings
from ntagen.errors import DeviceError
from ntagen.needle.estimate import RECENT, Estimate
from ntagen.needle.measurement import squared_length_bound
from ntagen.needle.vectors import subtract
from ntagen.scene import Vector

_SIGMAS: Final = 6.0
"""A mean is farther off by noise alone less than once in 10^8 estimates."""

_CURVATURE_STDS: Final = 20.0
"""A curvature that is so many standard deviations of its prior off is that of no needle; ours. Half
and twice the expected one are 14 of the usual 5 %: the driver copes with those."""

_USUAL_RATIO: Final = 0.05
"""A needle that was calibrated better than this may still be another one."""

_CAUSES: Final = "hint: does an axis jam or lose steps? Is the tracker mirrored, frozen or late?"

_LEAST_MISFIT_MM: Final = 1.0
"""Less than this is no misfit, whatever deviation is allowed; ours."""

_DIVERGED_RATIO: Final = 0.5
"""This part of the misfit that is allowed is too much in several estimates in a row; ours."""

_DIVERGED_STDS: Final = 10.0
"""It must also be so many standard deviations of what noise does to the mean; ours."""

_DIVERGED_COUNT: Final = 3
"""So many estimates in a row are several: 15 mm of a push; ours."""

_ROUNDING: Final = 1e-6
"""A computed correlation matrix may have eigenvalues that are negative by this much."""


def window(settings: Settings, length_mm: float) -> int:
    """How many measurements are averaged, at least `Settings.deviation_count`.

    Args:
        settings: Tolerance, noise and the false alarms that are allowed in a run.
        length_mm: The length of the needle: as many windows count as there are measurements.
    """
    if settings.deviation_mm <= 0.0:
        return settings.deviation_count
    windows = max(1.0, length_mm / settings.spacing_mm)
    bound = squared_length_bound(settings.false_alarm / windows)
    needed = bound * (settings.priors.noise_mm / settings.deviation_mm) ** 2
    return max(settings.deviation_count, math.ceil(needed))


class DeviationMonitor:
    """Watches how far the tip is from the plan.

    Args:
        settings: Tolerance and noise.
        length_mm: The length of the needle.
    """

    def __init__(self, settings: Settings, length_mm: float) -> None:
        self._tolerance_mm = settings.deviation_mm
        self._last: deque[Vector] = deque(maxlen=window(settings, length_mm))

    def begin(self) -> None:
        """A new plan begins: what was before does not count."""
        self._last.clear()

    def note(self, measured_mm: Vector, predicted_mm: Vector) -> bool:
        """Takes a measurement; returns whether the tip is off the plan for sure."""
        self._last.append(subtract(measured_mm, predicted_mm))
        return len(self._last) == self._last.maxlen and self.mean_mm() > self._tolerance_mm

    def mean_mm(self) -> float:
        """The length of the mean of the last differences, in mm."""
        count = max(1, len(self._last))
        return math.sqrt(sum((sum(axis) / count) ** 2 for axis in zip(*self._last, strict=True)))


def require_explained(estimate: Estimate, settings: Settings, radius_mm: float) -> None:
    """Refuses an estimate that does not explain the last measurements.

    The estimator knows all commands, and fits pose, curvature and rolls. If the needle that fits
    best is still off by more than what is allowed between plan and needle, or bends as no needle
    of this kind does, the tip was not moved as commanded, or not measured where it is: steps were
    lost, an axis jams, the tracker is mirrored, frozen or late. A plan from there would be for
    another needle.

    Args:
        estimate: The estimate.
        settings: The noise, and what is allowed.
        radius_mm: The radius that was expected.

    Raises:
        DeviceError: It does not, or does not say how much it errs.
    """
    _require_covariance(estimate)
    allowed_mm = allowed_misfit_mm(settings)
    if not estimate.misfit_mm <= allowed_mm:
        raise DeviceError(
            f"no needle that was moved as commanded is where the tracker sees this one: the last "
            f"positions are {estimate.misfit_mm:.1f} mm off, and {allowed_mm:.1f} mm is allowed\n"
            f"{_CAUSES}"
        )
    priors = settings.priors
    log_ratio = math.log(estimate.radius_mm) - math.log(radius_mm)
    most = _CURVATURE_STDS * max(priors.curvature_ratio, _USUAL_RATIO)
    if math.isfinite(radius_mm) and abs(log_ratio) > most:
        raise DeviceError(
            f"the tip moves as if the needle bent with a radius of {estimate.radius_mm:.1f} mm, "
            f"and {radius_mm:g} mm was expected\n{_CAUSES}"
        )


class DivergenceMonitor:
    """Watches whether the estimates stay with the measurements.

    A misfit that is less than `require_explained` refuses may be a curve of the tissue that the
    next estimate knows. If it stays, measurements and estimates part.

    Args:
        settings: The noise, and what is allowed.
    """

    def __init__(self, settings: Settings) -> None:
        priors = settings.priors
        self._std_mm = math.hypot(priors.noise_mm / math.sqrt(RECENT), priors.distortion_mm)
        self._most_mm = max(
            _DIVERGED_STDS * self._std_mm, _DIVERGED_RATIO * allowed_misfit_mm(settings)
        )
        self._count = 0

    def note(self, estimate: Estimate) -> None:
        """Takes an estimate.

        Raises:
            DeviceError: This one and those before it are too far from the measurements.
        """
        self._count = self._count + 1 if estimate.misfit_mm > self._most_mm else 0
        if self._count >= _DIVERGED_COUNT:
            stds = estimate.misfit_mm / self._std_mm
            raise DeviceError(
                f"the estimates leave the measurements: in {self._count} of them in a row the last "
                f"positions are off, now by {estimate.misfit_mm:.1f} mm or {stds:.0f} standard "
                f"deviations\n{_CAUSES}"
            )


def allowed_misfit_mm(settings: Settings) -> float:
    """How far the mean of the last positions may be from the needle that fits best."""
    priors = settings.priors
    noise_mm = _SIGMAS * (priors.noise_mm / math.sqrt(RECENT) + priors.distortion_mm)
    return max(_LEAST_MISFIT_MM, settings.deviation_mm) + noise_mm


def _require_covariance(estimate: Estimate) -> None:
    """Refuses an estimate whose covariance is none.

    Raises:
        DeviceError: It is not finite, or not positive definite.
    """
    covariance = np.array(estimate.covariance)
    variances = np.diag(covariance)
    is_one = bool(np.all(np.isfinite(covariance))) and bool(np.all(variances > 0.0))
    if is_one:
        stds = np.sqrt(variances)
        is_one = float(np.linalg.eigvalsh(covariance / np.outer(stds, stds))[0]) > -_ROUNDING
    if not is_one:
        raise DeviceError(
            "the estimate of the needle does not say how much it errs: its covariance is not "
            "finite or not positive definite\n"
            "hint: are the priors and the noise of the tracker sensible "
            "(`ntagen drive TASK --settings`)?"
        )
