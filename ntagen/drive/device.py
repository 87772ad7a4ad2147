"""The protocol that virtual and real needles follow.

A device executes one command at a time and returns when the motion is over. It raises `DeviceError`
if it cannot execute a command, if it does not answer, or if a sensor gives no reading; the driver
then stops it. Lengths are in mm, angles in rad, times in seconds on the device's own clock, which
never goes back.

A device whose motions take real time is watched during them: it calls its `watch` at least every
`WATCH_S`. What that raises ends the motion: the device stops first, then raises it again.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Final, Protocol, runtime_checkable

from ntagen.errors import DeviceError
from ntagen.errors import Halted as Halted  # Users of the protocol need it.
from ntagen.needle.measurement import Measurement

Watch = Callable[[], None]
"""Looks at the needle while it moves; raises to end the motion."""

WATCH_S: Final = 0.01
"""A device that moves calls its watch at least so often."""


class Sensor(Protocol):
    """A sensor for the position of the tip and the force on it."""

    def measure(self) -> Measurement:
        """Measures the needle now.

        Raises:
            DeviceError: There is no reading.
        """


class Actuator(Protocol):
    """What moves a needle: it can be pushed, rolled and pulled."""

    def now_s(self) -> float:
        """The time on the device's clock."""

    def push(self, length_mm: float) -> None:
        """Inserts the needle by a length.

        Raises:
            DeviceError: The motion is impossible or failed.
            Halted: Who watched it ended it early.
        """

    def roll(self, angle_rad: float) -> None:
        """Turns the shaft, right-handed about the heading.

        Raises:
            DeviceError: The motion is impossible or failed.
        """

    def pull(self, length_mm: float) -> None:
        """Moves the tip back along the channel that it has cut; the shaft keeps its angle.

        Raises:
            DeviceError: The motion is impossible or failed.
        """

    def stop(self) -> None:
        """Stops the needle where it is: the safe state. It must work at any time, also twice."""


class WatchedActuator(Actuator, Protocol):
    """What moves a needle in real time.

    Attributes:
        watch: Is called at least every `WATCH_S` while the needle moves. If it raises, the needle
            is stopped, and the exception goes on to the caller; a `Halted` gets its `part`.
    """

    watch: Watch


class LiveSensor(Sensor, Protocol):
    """A sensor that can also be looked at while the needle moves."""

    @property
    def measures_force(self) -> bool:
        """Whether measurements have a force; without it, the force is always 0."""

    def newest(self) -> Measurement:
        """The newest measurement, at once: it never waits.

        Raises:
            DeviceError: There is none, or none that is new enough.
        """


@runtime_checkable
class Waiting(Protocol):
    """What can rest for a time by itself: a simulation, whose clock only goes on with motions."""

    def wait(self, seconds: float) -> None:
        """Rests where it is.

        Raises:
            DeviceError: That is impossible.
        """


@runtime_checkable
class Screwing(Protocol):
    """What can insert a needle and turn it at once; it may have `can_screw` to say it cannot."""

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """Inserts the needle by a length, and turns it by an angle meanwhile, at a constant ratio.

        Raises:
            DeviceError: The motion is impossible or failed.
            Halted: Who watched it ended it early; its part is that of the angle.
        """


@runtime_checkable
class Spinning(Protocol):
    """What inserts a needle that spins in a part of the way; see `ntagen.drive.spinning`."""

    def spin(self, length_mm: float, fraction: float) -> None:
        """Inserts the needle by a length, and spins it in a fraction of that.

        Raises:
            DeviceError: The motion is impossible or failed.
            Halted: Who watched it ended it early.
        """

    def settle(self) -> None:
        """Ends the turn in which it was ended early, if it was: the needle has its angle again.

        Raises:
            DeviceError: The motion failed.
        """


Counts = tuple[float, float]
"""Where the axes stand by the count of what moves them, from a place that is its own: mm in the
direction of insertion, and rad of the roll, right-handed about the heading."""


@runtime_checkable
class Counting(Protocol):
    """What counts its motions, and goes on counting while no program is connected to it."""

    def counts(self) -> Counts | None:
        """Where the axes stand; None if nobody knows.

        Raises:
            DeviceError: It does not answer.
        """


@runtime_checkable
class Compensating(Protocol):
    """What knows how deep the needle lies by what it was told; at first that is 0."""

    def lies(self, depth_mm: float, wound_rad: float) -> None:
        """Notes that the needle lies in the tissue already.

        Args:
            depth_mm: How deep.
            wound_rad: By how much its base is ahead of its tip.
        """


def counts_of(actuator: Actuator) -> Counts | None:
    """Where the axes of an actuator stand; None if it does not count."""
    return actuator.counts() if isinstance(actuator, Counting) else None


def lies(actuator: Actuator, depth_mm: float, wound_rad: float) -> None:
    """Tells an actuator that the needle lies in the tissue already; see `Compensating.lies`."""
    if isinstance(actuator, Compensating):
        actuator.lies(depth_mm, wound_rad)


def can_screw(actuator: Actuator) -> bool:
    """Whether an actuator can insert a needle and turn it at once."""
    return isinstance(actuator, Screwing) and getattr(actuator, "can_screw", True)


def screw_on(actuator: Actuator, length_mm: float, angle_rad: float) -> None:
    """Inserts a needle and turns it at once.

    Raises:
        DeviceError: The actuator cannot do that, or the motion failed.
        Halted: Who watched it ended it early; its part is that of the angle.
    """
    if not isinstance(actuator, Screwing):
        raise DeviceError(CANNOT_SPIN)
    actuator.screw(length_mm, angle_rad)


def spin_on(device: Actuator, length_mm: float, fraction: float) -> None:
    """Inserts a needle that spins in a fraction of the way.

    Raises:
        DeviceError: The device cannot do that, or the motion failed.
        Halted: Who watched it ended it early.
    """
    if not isinstance(device, Spinning):
        raise DeviceError(CANNOT_SPIN)
    device.spin(length_mm, fraction)


def settle(device: Actuator) -> None:
    """Ends the turn in which a device was ended early, if it was."""
    if isinstance(device, Spinning):
        device.settle()


CANNOT_SPIN: Final = (
    "this device cannot insert and turn the needle at once\n"
    "hint: leave `spin` out of the task, or choose a device that can"
)


def rest(actuator: Actuator, seconds: float) -> None:
    """Lets an actuator rest for a time on its clock.

    One in real time is watched meanwhile, if it is watched in motions.
    """
    if isinstance(actuator, Waiting):
        actuator.wait(seconds)
        return
    watch: Watch = getattr(actuator, "watch", lambda: None)
    until_s = actuator.now_s() + seconds
    while (left_s := until_s - actuator.now_s()) > 0.0:
        watch()
        time.sleep(min(left_s, WATCH_S))


class Device(Actuator, Sensor, Protocol):
    """A needle that can be moved, with its sensor."""


class Forwarding:
    """An actuator that is moved through this one; what a subclass does not change goes on to it."""

    def __init__(self, actuator: Actuator) -> None:
        self._actuator = actuator

    def now_s(self) -> float:
        """The time on the actuator's clock."""
        return self._actuator.now_s()

    def push(self, length_mm: float) -> None:
        """See `Actuator.push`."""
        self._actuator.push(length_mm)

    def roll(self, angle_rad: float) -> None:
        """See `Actuator.roll`."""
        self._actuator.roll(angle_rad)

    def pull(self, length_mm: float) -> None:
        """See `Actuator.pull`."""
        self._actuator.pull(length_mm)

    def wait(self, seconds: float) -> None:
        """See `rest`."""
        rest(self._actuator, seconds)

    def stop(self) -> None:
        """See `Actuator.stop`."""
        self._actuator.stop()

    def counts(self) -> Counts | None:
        """See `counts_of`."""
        return counts_of(self._actuator)

    def lies(self, depth_mm: float, wound_rad: float) -> None:
        """See `lies`."""
        lies(self._actuator, depth_mm, wound_rad)


class Assembly(Forwarding):
    """A device of two parts: what moves the needle, and what measures it.

    Args:
        actuator: What moves the needle.
        sensor: What measures it.
    """

    def __init__(self, actuator: Actuator, sensor: Sensor) -> None:
        super().__init__(actuator)
        self._sensor = sensor

    def spin(self, length_mm: float, fraction: float) -> None:
        """See `Spinning.spin`."""
        spin_on(self._actuator, length_mm, fraction)

    def settle(self) -> None:
        """See `Spinning.settle`."""
        settle(self._actuator)

    def measure(self) -> Measurement:
        """See `Sensor.measure`."""
        return self._sensor.measure()


def require_finite(measurement: Measurement) -> None:
    """Refuses a measurement with something that is not a number.

    Raises:
        DeviceError: There is one.
    """
    numbers = (*measurement.position_mm, measurement.force_n, measurement.time_s)
    if not all(math.isfinite(number) for number in numbers):
        raise DeviceError(f"the sensor reported {measurement}: not a number")
    for number, place in enumerate(measurement.shape, start=1):
        if not all(map(math.isfinite, place)):
            raise DeviceError(
                f"place {number} of the {len(measurement.shape)} of the shape is {place}, which is "
                "not a number\nhint: is a part of the needle out of view, or a fibre broken?"
            )
