"""Force as a signal: what plain insertion explains, and when a rise is more than that.

The force on an inserted needle grows with its length, by friction. So the monitor keeps a line
through the readings, by least squares with a prior, and looks at how far a new reading is above it,
in standard deviations of what the line predicts: such residuals are independent (R. L. Brown,
J. Durbin, J. M. Evans, "Techniques for Testing the Constancy of Regression Relationships over
Time", JRSS B 37, 1975). Rises are summed up as Page's test does (CUSUM; E. S. Page, "Continuous
Inspection Schemes", Biometrika 41, 1954)::

    sum = max(0, sum + residual - slack)        alarm when sum > bound

The slack is half the rise that must be detected. The bound follows from the false alarms that are
allowed in a run, by Siegmund's formula for the mean number of readings until a false alarm
(D. Siegmund, "Sequential Analysis", 1985, section 2.6)::

    readings = (exp(2 slack b) - 2 slack b - 1) / (2 slack^2),   b = bound + 1.166

When the sum leaves zero for the last time before an alarm, the rise began: there a region is near.

How near, the force tells: within its sensing margin it rises by at least `force_rise_n_per_mm` for
each mm. So a needle that feels a region may pass it. It must stop when the rise is so great that
the region may be nearer than `felt_clearance_mm`.
"""

from __future__ import annotations

import math
from copy import copy
from typing import Final

from ntagen.drive.settings import Settings
from ntagen.errors import InputError
from ntagen.values import dataclass

_OVERSHOOT: Final = 1.166
"""The mean excess over the bound when it is passed, in standard deviations (Siegmund)."""

_SLOPE_STD_N_PER_MM: Final = 0.05
"""Friction grows by at most a few times this: 5 N over 100 mm in a stiff phantom."""

_OFFSET_STD_N: Final = 1.0
"""The force at the entry: a sensor that was not set to zero, and the cut through the skin."""

_LEAST_NOISE_RATIO: Final = 0.05
"""The noise counts as at least this part of the rise to be detected."""

_LEAST_SPACING_MM: Final = 0.05
"""Pushes are not made shorter than this: no stepper is asked for less."""


_STOP_SIGMAS: Final = 3.0
"""A reading at the place where the needle must stop may be too small by this much noise."""

_OPEN_STDS: Final = 6.0
"""A reading this far below the line is that of an open channel, not of noise."""

_OPEN_BEYOND_MM: Final = 0.5
"""A channel may seem to be open this much longer than it is, by late readings and lengths."""


@dataclass(frozen=True, slots=True)
class Rise:
    """A rise of the force.

    Attributes:
        began_mm: The insertion depth at which it began.
        felt_mm: The insertion depth at which it was sure, and too great to go on.
        force_n: The force above plain insertion there.
    """

    began_mm: float
    felt_mm: float
    force_n: float


@dataclass(frozen=True, slots=True)
class PageTest:
    """Page's test with its bound.

    Attributes:
        noise_n: The standard deviation of a reading.
        slack: What a reading must be above the line to add to the sum, in standard deviations.
        bound: The sum at which the rise is sure, in standard deviations.
    """

    noise_n: float
    slack: float
    bound: float

    @staticmethod
    def of(settings: Settings, length_mm: float) -> PageTest:
        """The test with the false alarms that the settings allow over a whole insertion."""
        noise_n = max(settings.force_noise_n, _LEAST_NOISE_RATIO * settings.force_n)
        slack = 0.5 * settings.force_n / noise_n
        readings = max(1.0, length_mm / settings.spacing_mm) / settings.false_alarm
        return PageTest(noise_n, slack, _bound(slack, readings))

    def felt_after_mm(self, rise_n_per_mm: float, spacing_mm: float) -> float:
        """How far the tip moves into a steady rise until it is sure, without noise.

        The worst case counts: the rise begins just after a reading.
        """
        total, count = 0.0, 0
        while total <= self.bound:
            count += 1
            per_reading = count * spacing_mm * rise_n_per_mm / self.noise_n
            total = max(0.0, total + per_reading - self.slack)
        return (count + 1) * spacing_mm


def _bound(slack: float, readings: float) -> float:
    """The bound with which a false alarm comes after this many readings in the mean."""

    def mean_readings(bound: float) -> float:
        exponent = 2.0 * slack * (bound + _OVERSHOOT)
        if exponent > 700.0:
            return math.inf
        return (math.exp(exponent) - exponent - 1.0) / (2.0 * slack * slack)

    low, high = 0.0, 1.0
    while mean_readings(high) < readings:
        high *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if mean_readings(middle) < readings else (low, middle)
    return high


def stop_force_n(settings: Settings) -> float:
    """The needle stops at a rise of this size; 0 if it stops as soon as it feels one."""
    shell_mm = settings.sensing_margin_mm - settings.felt_clearance_mm - settings.overrun_mm
    return max(0.0, shell_mm) * settings.force_rise_n_per_mm


class _Line:
    """The line of plain insertion: offset and slope with their precision, from readings."""

    def __init__(self, noise_n: float) -> None:
        self._weight = 1.0 / noise_n**2
        self._noise_n = noise_n
        # The precision matrix [[a, b], [b, c]] and the information vector (u, v).
        self._a, self._b, self._c = _OFFSET_STD_N**-2, 0.0, _SLOPE_STD_N_PER_MM**-2
        self._u = self._v = 0.0

    def learn(self, depth_mm: float, force_n: float) -> None:
        """Takes a reading."""
        self._a += self._weight
        self._b += self._weight * depth_mm
        self._c += self._weight * depth_mm**2
        self._u += self._weight * force_n
        self._v += self._weight * force_n * depth_mm

    def at(self, depth_mm: float) -> tuple[float, float]:
        """The expected reading, and the standard deviation of a reading around it, in N."""
        determinant = self._a * self._c - self._b**2
        offset = (self._c * self._u - self._b * self._v) / determinant
        slope = (self._a * self._v - self._b * self._u) / determinant
        spread = self._c - 2.0 * self._b * depth_mm + self._a * depth_mm**2
        return offset + slope * depth_mm, math.sqrt(self._noise_n**2 + spread / determinant)


class ForceMonitor:
    """Watches the force of one insertion.

    Args:
        settings: The rise to be detected, the noise and the allowed false alarms.
        length_mm: The length of the needle.
    """

    def __init__(self, settings: Settings, length_mm: float) -> None:
        self._test = PageTest.of(settings, length_mm)
        self._stop_n = stop_force_n(settings)
        self._line = _Line(self._test.noise_n)
        # The line when the sum was 0 for the last time.
        self._before = copy(self._line)
        self._sum = 0.0
        self._began_mm = 0.0
        self._deepest_mm = 0.0
        # Whether the tip is in the margin of a region.
        self._is_near = False

    def expected_n(self, depth_mm: float) -> float:
        """The force of plain insertion at a depth."""
        return self._line.at(depth_mm)[0]

    def note(self, depth_mm: float, force_n: float, allowed_n: float = 0.0) -> Rise | None:
        """Takes a reading of a push; returns the rise if the needle must stop.

        A push after a pull may follow the old channel, where nothing is cut and the force is
        smaller. Such readings tell nothing about plain insertion: if they counted, the force of
        cutting at the end of the old channel would seem to be a rise.

        Args:
            depth_mm: The insertion depth.
            force_n: The reading.
            allowed_n: The rise that known regions explain here. Where there is one, the reading
                tells nothing about plain insertion.
        """
        expected_n, std_n = self._line.at(depth_mm)
        above_n = force_n - expected_n - allowed_n
        self._sum = max(0.0, self._sum + above_n / std_n - self._test.slack)
        if self._sum > self._test.bound:
            # What was learned of plain insertion since the rise began is wrong.
            self._line = copy(self._before)
            above_n = force_n - self.expected_n(depth_mm) - allowed_n
            if above_n >= self._stop_n:
                return Rise(self._began_mm, depth_mm, above_n)
            self._sum, self._is_near = self._test.bound, True
        was_here = depth_mm <= self._deepest_mm + _OPEN_BEYOND_MM
        self._deepest_mm = max(self._deepest_mm, depth_mm)
        is_open = was_here and above_n < -_OPEN_STDS * std_n
        if self._sum == 0.0:
            self._is_near = False
        if allowed_n <= 0.0 and not is_open and not self._is_near:
            self._line.learn(depth_mm, force_n)
        if self._sum == 0.0:
            self._began_mm = depth_mm
            self._before = copy(self._line)
        return None

    def note_in_channel(
        self, depth_mm: float, force_n: float, allowed_n: float = 0.0
    ) -> Rise | None:
        """Takes a reading in a channel that was cut before; see `note`.

        Nothing is cut there, so the reading tells nothing about plain insertion. But the tip may
        have left the channel.
        """
        above_n = force_n - self.expected_n(depth_mm) - allowed_n
        if self._stop_n <= 0.0 or above_n < self._stop_n:
            return None
        return Rise(depth_mm, depth_mm, above_n)

    def forget_rise(self) -> None:
        """Starts again after an alarm, with the line from before the rise."""
        self._sum, self._is_near = 0.0, False
        self._line = copy(self._before)


def fitting_spacing_mm(settings: Settings, margin_mm: float, length_mm: float) -> float:
    """The length of a push with which a hidden region is felt before it can be pierced.

    Args:
        settings: How to drive; its spacing is the longest that is tried.
        margin_mm: The distance from a region's surface at which the force rises.
        length_mm: The length of the needle.

    Returns:
        The spacing of the settings, or a shorter one.

    Raises:
        InputError: With no allowed spacing the region is felt in time.
    """
    spacing_mm = settings.spacing_mm
    reach_mm = math.inf
    while spacing_mm >= _LEAST_SPACING_MM - 1e-12:
        # Shorter pushes mean more readings, and so a higher bound.
        test = PageTest.of(settings.with_spacing(spacing_mm), length_mm)
        rise_n_per_mm = settings.force_rise_n_per_mm
        felt_mm = test.felt_after_mm(rise_n_per_mm, spacing_mm)
        # The reading before the one at which the needle stops was just too small.
        sure_n = stop_force_n(settings) + _STOP_SIGMAS * test.noise_n
        reach_mm = settings.overrun_mm + max(felt_mm, sure_n / rise_n_per_mm + spacing_mm)
        if reach_mm < margin_mm:
            return spacing_mm
        if spacing_mm == _LEAST_SPACING_MM:
            break
        spacing_mm = max(_LEAST_SPACING_MM, spacing_mm / 2.0)
    raise InputError(
        f"a hidden region could be pierced before it is felt: the force rises {margin_mm:g} mm "
        f"before a region, and the needle stops {reach_mm:.2f} mm after the rise began\n"
        "hint: let the driver know all regions, detect a smaller rise (force), or switch force "
        "sensing off"
    )
