"""The protocol that virtual and real needles follow.

A device executes one command at a time and returns when the motion is over. It raises `DeviceError`
if it cannot execute a command, if it does not answer, or if a sensor gives no reading; the driver
then stops it. Lengths are in mm, angles in rad, times in seconds on the device's own clock, which
never goes back.
"""

from __future__ import annotations

from typing import Protocol

from ntagen.needle.measurement import Measurement


class Sensor(Protocol):
    """A sensor for the position of the tip and the force on it."""

    def measure(self) -> Measurement:
        """Measures the needle now.

        Raises:
            DeviceError: There is no reading.
        """


class Device(Sensor, Protocol):
    """A needle that can be pushed, rolled and pulled, with its sensor."""

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
