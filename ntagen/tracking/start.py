"""Whether a tracker and a scene belong together, before anything moves.

A registration that is missing, old or of another frame gives positions that look like any others.
But at the start of a run the needle is at the entry, and points along it: that can be seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from ntagen.drive.device import Sensor
from ntagen.errors import DeviceError
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import distance, dot
from ntagen.scene import Pose
from ntagen.units import deg_from_rad

FARTHEST_MM: Final = 10.0
"""At the start, the tip may be measured so far from the entry."""

WIDEST_DEG: Final = 45.0
"""At the start, the measured directions may differ so much from those of the scene."""


class StartChecked:
    """A sensor whose first measurement must be at the entry of the scene.

    Args:
        sensor: The sensor.
        entry: The pose at which the needle should be.
    """

    def __init__(self, sensor: Sensor, entry: Pose) -> None:
        self._sensor = sensor
        self._check: Callable[[Measurement], None] = lambda found: require_start(found, entry)

    def measure(self) -> Measurement:
        """Measures the needle.

        Raises:
            DeviceError: There is no reading, or the first one is not at the entry.
        """
        found = self._sensor.measure()
        self._check(found)
        self._check = lambda _: None
        return found


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
