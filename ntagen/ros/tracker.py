"""The tip of the needle as topics say it, as a sensor of the driver."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from ntagen.drive.device import LiveSensor
from ntagen.errors import DeviceError
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import distance, norm, scale
from ntagen.openigtlink.samples import Policy
from ntagen.ros.inbox import Inbox
from ntagen.ros.topics import FORCE, Topics
from ntagen.scene import Pose, Vector
from ntagen.tracking.frames import Transform
from ntagen.tracking.live import LiveTracker, Source
from ntagen.tracking.mount import Mount
from ntagen.tracking.plausible import FARTHEST_MM, LivePlausible

_THOUSAND: Final = 1000.0
_FAR_MM: Final = 1000.0
"""No needle of a lab is so far from its entry."""

_INSERTED_MM: Final = 2.0
"""From this depth on, the tip must have left the entry."""

_NEAR_RATIO: Final = 0.02
"""A tip that has gone by less than this part of the depth is not where it should be."""

_LEAST_RATIO: Final = 0.3
"""A needle that bends still goes this part of the depth away from its entry."""


def unit_error(
    found_mm: Vector, entry_mm: Vector, inserted_mm: float, topic: str, unit: str
) -> str:
    """What is wrong if a place is in another unit than it is said to be; empty if nothing is.

    A place at the origin is the same in all units. So a needle that is inserted is looked at, too.

    Args:
        found_mm: The place of the tip in the frame of the stage, as it is understood.
        entry_mm: The entry there.
        inserted_mm: How far the needle is inserted.
        topic: Where it comes from.
        unit: The unit in which it is understood.
    """
    away_mm = distance(found_mm, entry_mm)
    other = "mm" if unit == "m" else "m"
    hint = (
        f"\nhint: if {topic} is in {other}, add --ros-args -p sensor_units:={other}; REP 103 asks "
        "for metres"
    )
    is_in = inserted_mm >= _INSERTED_MM
    if is_in and _NEAR_RATIO * inserted_mm > away_mm >= _LEAST_RATIO * inserted_mm / _THOUSAND:
        return (
            f"the needle is inserted by {inserted_mm:.1f} mm, and {topic} has moved by "
            f"{away_mm:.3f} mm: this is a unit error{hint}"
        )
    reach_mm = FARTHEST_MM + 2.0 * inserted_mm
    if away_mm <= reach_mm:
        return ""
    factor = 1.0 / _THOUSAND if unit == "m" else _THOUSAND
    in_other_mm = distance(scale(factor, found_mm), entry_mm)
    # Near the origin, whatever is divided by a thousand is near it, too: that says nothing.
    least_mm = _LEAST_RATIO * inserted_mm if is_in else 0.0
    is_telling = is_in or norm(entry_mm) > 2.0 * FARTHEST_MM
    if away_mm >= _FAR_MM or (is_telling and least_mm <= in_other_mm <= reach_mm):
        far = f"{away_mm:.1f} mm" if away_mm < _THOUSAND else f"{away_mm / _THOUSAND:.1f} m"
        return f"{topic} says that the tip is {far} from the entry: this is a unit error{hint}"
    return ""


class UnitChecked:
    """A sensor whose measurements must be in the unit that was said.

    Args:
        sensor: The sensor.
        entry_mm: The entry.
        inserted_mm: How far the needle is inserted now.
        topic: Where the measurements come from.
        unit: The unit that was said.
    """

    def __init__(
        self,
        sensor: LiveSensor,
        entry_mm: Vector,
        inserted_mm: Callable[[], float],
        topic: str,
        unit: str,
    ) -> None:
        self._sensor = sensor
        self._entry_mm = entry_mm
        self._inserted_mm = inserted_mm
        self._said = (topic, unit)

    @property
    def measures_force(self) -> bool:
        """See `LiveSensor.measures_force`."""
        return self._sensor.measures_force

    def measure(self) -> Measurement:
        """See `LiveSensor.measure`."""
        return self._checked(self._sensor.measure())

    def newest(self) -> Measurement:
        """See `LiveSensor.newest`."""
        return self._checked(self._sensor.newest())

    def _checked(self, found: Measurement) -> Measurement:
        if all(map(math.isfinite, found.position_mm)):
            told = unit_error(found.position_mm, self._entry_mm, self._inserted_mm(), *self._said)
            if told:
                raise DeviceError(told)
        return found


def tracker_of(
    inbox: Inbox,
    topics: Topics,
    transform: Transform,
    entry: Pose,
    now_s: Callable[[], float],
    inserted_mm: Callable[[], float],
    *,
    watches_force: bool,
    force_varies: bool,
) -> LiveSensor:
    """The sensor of a needle behind topics.

    Args:
        inbox: The samples.
        topics: How they are meant.
        transform: The registration.
        entry: Where the needle is at the start.
        now_s: The clock of the actuator.
        inserted_mm: How far the needle is inserted now.
        watches_force: Whether the driver relies on a force.
        force_varies: Whether the force has noise.
    """
    source = Source(
        host="",
        port=0,
        device=topics.tip,
        mount=Mount(topics.axis, topics.bevel or None),
        force=topics.name(FORCE) if watches_force else None,
        latency_s=topics.latency_s,
        policy=Policy(stale_s=topics.stale_s),
    )
    live = LiveTracker(source, transform, now_s, inbox)
    unit = topics.sensor_units or topics.units
    checked = UnitChecked(live, entry.position_mm, inserted_mm, topics.tip, unit)
    return LivePlausible(checked, entry, now_s, force_varies=watches_force and force_varies)
