"""Whether a measurement can be true: at the start of a run, and after the one before it.

A registration that is missing, old or of another frame gives positions that look like any others.
But at the start of a run the needle is at the entry, and points along it: that can be seen. Later
the tip cannot be far from where it was: a position that jumps is of another tool, of a marker that
was taken for another, or of a tracker that has lost its reference.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, Generic, TypeVar

from ntagen.drive.device import LiveSensor, Sensor, require_finite
from ntagen.errors import DeviceError
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import distance, dot, subtract
from ntagen.scene import Pose
from ntagen.units import deg_from_rad

FARTHEST_MM: Final = 10.0
"""At the start, the tip may be measured so far from the entry."""

DEEPEST_MM: Final = 3.0
"""At the start, the tip may be measured so far beyond the entry, along the heading; ours. Farther
in, it is in the tissue already: a run before this one was cut off."""

WIDEST_DEG: Final = 45.0
"""At the start, the measured directions may differ so much from those of the scene."""

JUMP_MM: Final = 20.0
"""Measurements may differ by this without any motion: ten times the noise of a bad tracker."""

FASTEST_MM_PER_S: Final = 50.0
"""A needle is pulled back at most so fast; ours."""

SAME_FORCES: Final = 20
"""A sensor that gives the same force so often in a row is dead; ours. A living one has noise."""

STALE_S: Final = 0.5
"""A measurement that is older says nothing about where the needle is; ours."""


Checked = TypeVar("Checked", bound=Sensor)


class Plausible(Generic[Checked]):
    """A sensor whose measurements must be plausible.

    Args:
        sensor: The sensor.
        entry: The pose at which the needle is at the start; None if it may be anywhere.
        now_s: The clock of the measurements' times; without it they may be of any age.
        force_varies: Whether the force has noise, so that one that stays the same is wrong.
    """

    def __init__(
        self,
        sensor: Checked,
        entry: Pose | None,
        now_s: Callable[[], float] | None = None,
        *,
        force_varies: bool = False,
    ) -> None:
        self._sensor = sensor
        self._entry = entry
        self._now_s = now_s
        self._most_same = SAME_FORCES if force_varies else math.inf
        self._force_n = math.nan
        self._same = 0
        self._last: Measurement | None = None

    def measure(self) -> Measurement:
        """Measures the needle.

        Raises:
            DeviceError: There is no reading, or it cannot be true.
        """
        found = self._require(self._sensor.measure())
        self._require_alive(found.force_n)
        return found

    def _require_alive(self, force_n: float) -> None:
        self._same = self._same + 1 if force_n == self._force_n else 1
        self._force_n = force_n
        if self._same >= self._most_same:
            raise DeviceError(
                f"the force was exactly {force_n:g} N in {self._same} readings in a row\n"
                "hint: check the force sensor, its cable and its range; add --set 'force noise 0' "
                "if it really has no noise"
            )

    def _require(self, found: Measurement) -> Measurement:
        require_finite(found)
        if self._now_s is not None:
            require_fresh(found, self._now_s())
        if self._last is not None:
            require_near(found, self._last)
        elif self._entry is not None:
            require_start(found, self._entry)
        self._last = found
        return found


class LivePlausible(Plausible[LiveSensor]):
    """The same for a sensor that is looked at while the needle moves."""

    @property
    def measures_force(self) -> bool:
        """See `LiveSensor.measures_force`."""
        return self._sensor.measures_force

    def newest(self) -> Measurement:
        """The newest measurement, at once.

        Raises:
            DeviceError: There is none, or it cannot be true.
        """
        return self._require(self._sensor.newest())


def require_fresh(found: Measurement, now_s: float) -> None:
    """Refuses a measurement that is older than `STALE_S`.

    Raises:
        DeviceError: It is.
    """
    age_s = now_s - found.time_s
    if age_s > STALE_S:
        raise DeviceError(
            f"the measurement is {age_s:.2f} s old, and {STALE_S:g} s is allowed\n"
            "hint: is the tracker, or the network to it, too slow?"
        )


def require_near(found: Measurement, last: Measurement) -> None:
    """Refuses a measurement that is too far from the one before it.

    Raises:
        DeviceError: No needle moves so fast.
    """
    passed_s = max(0.0, found.time_s - last.time_s)
    allowed_mm = JUMP_MM + FASTEST_MM_PER_S * passed_s
    moved_mm = distance(found.position_mm, last.position_mm)
    if not moved_mm <= allowed_mm:
        raise DeviceError(
            f"the measured tip jumped by {moved_mm:.1f} mm in {passed_s:.2f} s, to "
            f"{_words(found.position_mm)} mm; {allowed_mm:.1f} mm is allowed\n"
            "hint: does the tracker take another tool for the needle, or was its reference moved?"
        )


def require_start(found: Measurement, entry: Pose) -> None:
    """Refuses a measurement that is not at the entry.

    Raises:
        DeviceError: It is too far away, or points elsewhere.
    """
    away_mm = distance(found.position_mm, entry.position_mm)
    if not away_mm <= FARTHEST_MM:
        raise DeviceError(
            f"the tracker sees the tip at {_words(found.position_mm)} mm, {away_mm:.1f} mm from "
            f"the entry at {_words(entry.position_mm)} mm; {FARTHEST_MM:g} mm is allowed\n"
            "hint: is the needle at the entry, is the registration that of this tracker, and are "
            "both in mm?"
        )
    depth_mm = dot(subtract(found.position_mm, entry.position_mm), entry.heading)
    if depth_mm > DEEPEST_MM:
        raise DeviceError(
            f"the tracker sees the tip {depth_mm:.1f} mm beyond the entry, at "
            f"{_words(found.position_mm)} mm; {DEEPEST_MM:g} mm is allowed\n"
            "hint: was a run before this one cut off? Go on from its log with `ntagen drive "
            "--resume RUN.mcap`, or pull the needle back to the entry first"
        )
    for name, option, seen, expected in (
        ("heading", "axis", found.heading, entry.heading),
        ("bevel direction", "bevel", found.bevel, entry.bevel),
    ):
        if seen is None:
            continue
        angle_deg = deg_from_rad(math.acos(max(-1.0, min(1.0, dot(seen, expected)))))
        if angle_deg > WIDEST_DEG:
            raise DeviceError(
                f"the tracker sees a {name} that is {angle_deg:.0f} deg from that of the scene\n"
                f"hint: check {option}=… of the tracker and the registration"
            )


def _words(point: tuple[float, float, float]) -> str:
    return "(" + ", ".join(f"{number:.1f}" for number in point) + ")"
