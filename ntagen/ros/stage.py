"""Moves a needle by telling a stage again and again where it should be now.

A stage of a lab is told a position and goes there. So a motion is a row of positions, a hundred a
second, at the speed that is wanted: if this program dies, the stage stands where it was told last,
and a stop needs no word of its own. The stage says where it is all the time; one that is silent,
lags behind, or does not arrive is a fault.
"""

from __future__ import annotations

import math
import threading
import time
from typing import Final, Protocol

from ntagen.drive.device import Halted, Watch
from ntagen.drive.plugin import Speeds
from ntagen.errors import DeviceError
from ntagen.units import deg_from_rad, rad_from_deg
from ntagen.values import dataclass

PERIOD_S: Final = 0.01
"""The time between two positions."""

_LAG_S: Final = 0.5
"""The stage may be so far behind what it is told, ..."""
_LAG_MM: Final = 0.5
_LAG_RAD: Final = rad_from_deg(10.0)
"""... and by so much more."""

_ARRIVE_S: Final = 2.0
"""After the end of a motion, the stage may take so long to arrive."""

_STILL_S: Final = 0.05
"""A stage that has not moved for so long stands, ..."""
_STILL_MM: Final = 0.01
_STILL_RAD: Final = rad_from_deg(0.1)
"""... if that is less than this."""

_STOP_S: Final = 2.0
"""It must stand so soon after it was told to."""

_TOLERANCE_RAD: Final = rad_from_deg(0.5)
"""The stage has arrived when its roll is so near to what was asked; ours."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a stage is, or should be.

    Attributes:
        depth_mm: How far the needle is inserted, from where it was at first.
        roll_rad: How far it is turned, right-handed about the direction of insertion.
    """

    depth_mm: float
    roll_rad: float

    def at(self, other: Place, share: float) -> Place:
        """The place at a part of the way to another one."""
        return Place(
            self.depth_mm + share * (other.depth_mm - self.depth_mm),
            self.roll_rad + share * (other.roll_rad - self.roll_rad),
        )

    def is_near(self, other: Place, mm: float, rad: float) -> bool:
        """Whether another place is this near."""
        return (
            abs(self.depth_mm - other.depth_mm) <= mm and abs(self.roll_rad - other.roll_rad) <= rad
        )

    def __str__(self) -> str:
        return f"{self.depth_mm:.2f} mm, {deg_from_rad(self.roll_rad):.1f} deg"


class Link(Protocol):
    """The wire to a stage."""

    def now_s(self) -> float:
        """The clock of motions."""

    def tell(self, place: Place) -> None:
        """Tells the stage where it should be, at once and from any thread."""

    def where(self) -> Place:
        """Where the stage is.

        Raises:
            DeviceError: It has said nothing for too long, or nothing of use.
        """


class StageActuator:
    """A `ntagen.drive.device.WatchedActuator` behind a stage.

    Args:
        link: The wire.
        speeds: How fast it moves.
        tolerance_mm: It has arrived when it is so near.
        ramp_mm_per_s2: The acceleration with which it stops.

    Attributes:
        watch: See `WatchedActuator`.

    Raises:
        DeviceError: The stage is silent, or moves.
    """

    def __init__(
        self, link: Link, speeds: Speeds, tolerance_mm: float, ramp_mm_per_s2: float
    ) -> None:
        self.watch: Watch = lambda: None
        self.ramp_mm_per_s2 = ramp_mm_per_s2
        self._link = link
        self._speeds = speeds
        self._tolerance_mm = tolerance_mm
        self._lock = threading.Lock()
        self._stops = 0
        self._at = self._stand()
        self._origin = self._at

    @property
    def moved_mm(self) -> float:
        """How far the needle is inserted now, since this was opened.

        Raises:
            DeviceError: The stage is silent.
        """
        return self._link.where().depth_mm - self._origin.depth_mm

    def now_s(self) -> float:
        """The clock of motions."""
        return self._link.now_s()

    def push(self, length_mm: float) -> None:
        """See `WatchedActuator.push`."""
        _require(length_mm >= 0.0, "push", length_mm)
        self._move(length_mm, 0.0, length_mm / self._speeds.push_mm_per_s)

    def pull(self, length_mm: float) -> None:
        """See `WatchedActuator.pull`."""
        _require(length_mm >= 0.0, "pull", length_mm)
        self._move(-length_mm, 0.0, length_mm / self._speeds.pull_mm_per_s)

    def roll(self, angle_rad: float) -> None:
        """See `WatchedActuator.roll`."""
        _require(True, "roll", angle_rad)
        self._move(0.0, angle_rad, abs(angle_rad) / self._speeds.roll_rad_per_s)

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """See `ntagen.drive.device.Screwing.screw`."""
        _require(length_mm >= 0.0, "screw", length_mm)
        _require(True, "screw", angle_rad)
        seconds = max(
            length_mm / self._speeds.push_mm_per_s, abs(angle_rad) / self._speeds.roll_rad_per_s
        )
        self._move(length_mm, angle_rad, seconds)

    def stop(self) -> None:
        """Stops the stage where it is, from any thread, and waits until it stands.

        A motion that another thread waits for ends there with `DeviceError`.

        Raises:
            DeviceError: It is silent, or does not stand.
        """
        self.hold()
        self._at = self._stand()

    def hold(self) -> None:
        """Tells the stage to stay where it is, from any thread, and does not wait.

        Raises:
            DeviceError: It is silent.
        """
        with self._lock:
            # From here on, nobody tells it anything that belongs to a motion.
            self._stops += 1
            self._link.tell(self._link.where())

    def _stand(self) -> Place:
        """Waits until the stage stands; where it does."""
        # By the clock of the machine: a simulated one may stand still.
        end_s = time.monotonic() + _STOP_S
        last = self._link.where()
        since_s = time.monotonic()
        while time.monotonic() - since_s < _STILL_S:
            time.sleep(PERIOD_S)
            here = self._link.where()
            if not here.is_near(last, _STILL_MM, _STILL_RAD):
                last, since_s = here, time.monotonic()
            if time.monotonic() > end_s:
                raise DeviceError(
                    f"the stage moves although nothing commands it: it is at {here}\n"
                    "hint: end what commands it, or stop it by its hardware switch"
                )
        return last

    def _move(self, way_mm: float, angle_rad: float, seconds: float) -> None:
        start, stops = self._at, self._stops
        goal = Place(start.depth_mm + way_mm, start.roll_rad + angle_rad)
        if goal == start:
            return
        try:
            here = self._link.where()
            if not here.is_near(start, self._lag_mm(0.0), _LAG_RAD):
                raise DeviceError(
                    f"the stage stands at {here}, but was left at {start}\n"
                    "hint: something else has moved it; measure where the needle is"
                )
            self._follow(start, goal, seconds, stops)
        except BaseException as error:
            self._end(error, start, goal)
            raise

    def _follow(self, start: Place, goal: Place, seconds: float, stops: int) -> None:
        """Leads the stage to its goal."""
        began_s = self.now_s()
        speed_mm_per_s = abs(goal.depth_mm - start.depth_mm) / max(seconds, PERIOD_S)
        speed_rad_per_s = abs(goal.roll_rad - start.roll_rad) / max(seconds, PERIOD_S)
        while True:
            self.watch()
            passed_s = self.now_s() - began_s
            asked = start.at(goal, min(1.0, passed_s / seconds))
            with self._lock:
                is_stopped = self._stops != stops
                if not is_stopped:
                    self._link.tell(asked)
            if is_stopped:
                # Who stopped it may have said why.
                self.watch()
                raise DeviceError("the motion was stopped")
            here = self._link.where()
            is_over = passed_s >= seconds
            if is_over and here.is_near(goal, self._tolerance_mm, _TOLERANCE_RAD):
                self._at = goal
                return
            lag_rad = _LAG_RAD + speed_rad_per_s * _LAG_S
            if not here.is_near(asked, self._lag_mm(speed_mm_per_s), lag_rad):
                raise DeviceError(
                    f"the stage does not follow: it is at {here}, and should be at {asked}\n"
                    "hint: is it blocked, too slow, or in another unit?"
                )
            if passed_s > seconds + _ARRIVE_S:
                raise DeviceError(
                    f"the stage does not arrive: it is at {here}, and should be at {goal}, within "
                    f"{self._tolerance_mm:g} mm\nhint: `stage_tolerance_mm` says how near is near"
                )
            time.sleep(PERIOD_S)

    @staticmethod
    def _lag_mm(speed_mm_per_s: float) -> float:
        return _LAG_MM + speed_mm_per_s * _LAG_S

    def _end(self, error: BaseException, start: Place, goal: Place) -> None:
        """Stops a motion because of an error, and notes how much of it was made."""
        try:
            self.stop()
        except DeviceError as failure:
            # A stage that says nothing was told nothing more, and so stands.
            if isinstance(error, DeviceError):
                return
            raise DeviceError(f"{failure}\nhint: stop the stage by its hardware switch") from error
        if isinstance(error, Halted):
            way = goal.depth_mm - start.depth_mm
            made = self._at.depth_mm - start.depth_mm
            if way == 0.0 or goal.roll_rad != start.roll_rad:
                way, made = goal.roll_rad - start.roll_rad, self._at.roll_rad - start.roll_rad
            error.part = max(0.0, min(1.0, made / way))


def _require(possible: bool, command: str, value: float) -> None:
    if not possible or not math.isfinite(value):
        raise DeviceError(f"the device refuses to {command} by {value}")
