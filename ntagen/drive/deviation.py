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

from ntagen.drive.settings import Settings
from ntagen.needle.noise import squared_length_bound
from ntagen.needle.vectors import subtract
from ntagen.scene import Vector


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
