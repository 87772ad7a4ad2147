"""Rolls that make up for the friction along the shaft: the base turns too far and comes back.

Friction holds the shaft of a needle in tissue, so its tip turns only when the base is ahead by more
than a lag, which grows with the square of the inserted length (Reed, Okamura and Cowan, "Modeling
and control of needles with torsional friction", 2009; 45 degrees at 10 cm in some phantoms). If the
lag is known, the base is turned farther by it and then turned back by it. The tip then has the
wanted angle, and the shaft has none of the twist that the next roll would meet.

An error of the assumed lag leaves an error of the tip of the same size.
"""

from __future__ import annotations

from dataclasses import dataclass

from ntagen.drive.device import Actuator, Halted, rest


@dataclass(frozen=True, slots=True)
class Lag:
    """The assumed lag of the tip.

    Attributes:
        lag_rad: The lag at `depth_mm`.
        depth_mm: The depth for which it is given.
    """

    lag_rad: float
    depth_mm: float = 100.0

    def at_rad(self, depth_mm: float) -> float:
        """The lag at a depth."""
        return self.lag_rad * (depth_mm / self.depth_mm) ** 2


class Compensated:
    """An actuator whose rolls reach the tip.

    Args:
        actuator: What moves the needle. Nothing else may move it.
        lag: The assumed lag.
    """

    def __init__(self, actuator: Actuator, lag: Lag) -> None:
        self._actuator = actuator
        self._lag = lag
        self._depth_mm = 0.0

    def now_s(self) -> float:
        """See `Actuator.now_s`."""
        return self._actuator.now_s()

    def push(self, length_mm: float) -> None:
        """See `Actuator.push`."""
        try:
            self._actuator.push(length_mm)
        except Halted as halted:
            self._depth_mm += halted.part * length_mm
            raise
        self._depth_mm += length_mm

    def roll(self, angle_rad: float) -> None:
        """Turns the base by the angle and the lag, and then back by the lag.

        Raises:
            DeviceError: The motion is impossible or failed.
        """
        lag_rad = self._lag.at_rad(self._depth_mm)
        if angle_rad < 0.0:
            lag_rad = -lag_rad
        self._actuator.roll(angle_rad + lag_rad)
        if lag_rad:
            self._actuator.roll(-lag_rad)

    def pull(self, length_mm: float) -> None:
        """See `Actuator.pull`."""
        self._actuator.pull(length_mm)
        self._depth_mm = max(0.0, self._depth_mm - length_mm)

    def wait(self, seconds: float) -> None:
        """See `ntagen.drive.device.rest`."""
        rest(self._actuator, seconds)

    def stop(self) -> None:
        """See `Actuator.stop`."""
        self._actuator.stop()
