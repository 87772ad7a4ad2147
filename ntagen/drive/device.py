"""The protocol that virtual and real needles follow.

A device executes one command at a time and returns when the motion is over. It raises `DeviceError`
if it cannot execute a command, if it does not answer, or if a sensor gives no reading; the driver
then stops it. Lengths are in mm, angles in rad, times in seconds on the device's own clock, which
never goes back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ntagen.needle.measurement import Measurement


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


class Device(Actuator, Sensor, Protocol):
    """A needle that can be moved, with its sensor."""


@dataclass(frozen=True, slots=True)
class Assembly:
    """A device of two parts: what moves the needle, and what measures it.

    Attributes:
        actuator: Moves the needle.
        sensor: Measures it.
    """

    actuator: Actuator
    sensor: Sensor

    def now_s(self) -> float:
        """The time on the actuator's clock."""
        return self.actuator.now_s()

    def push(self, length_mm: float) -> None:
        """See `Actuator.push`."""
        self.actuator.push(length_mm)

    def roll(self, angle_rad: float) -> None:
        """See `Actuator.roll`."""
        self.actuator.roll(angle_rad)

    def pull(self, length_mm: float) -> None:
        """See `Actuator.pull`."""
        self.actuator.pull(length_mm)

    def stop(self) -> None:
        """See `Actuator.stop`."""
        self.actuator.stop()

    def measure(self) -> Measurement:
        """See `Sensor.measure`."""
        return self.sensor.measure()
