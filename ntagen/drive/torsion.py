"""Rolls that make up for the friction along the shaft: the base turns too far and comes back.

Friction holds the shaft of a needle in tissue, so its tip turns only when the base is ahead by more
than a lag, which grows with the square of the inserted length (Reed, Okamura and Cowan, "Modeling
and control of needles with torsional friction", 2009; 45 degrees at 10 cm in some phantoms). If the
lag is known, the base is turned farther by it and then turned back by it. The tip then has the
wanted angle, and the shaft has none of the twist that the next roll would meet.

A needle that spins is turned ahead by the lag first, and back by it at the end: in between the tip
follows each turn of the base.

An error of the assumed lag leaves an error of the tip of the same size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ntagen.drive.device import Actuator, Forwarding, Halted, can_screw, screw_on


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


class Compensated(Forwarding):
    """An actuator whose rolls reach the tip.

    Args:
        actuator: What moves the needle. Nothing else may move it.
        lag: The assumed lag.
    """

    def __init__(self, actuator: Actuator, lag: Lag) -> None:
        super().__init__(actuator)
        self._lag = lag
        self._depth_mm = 0.0
        # By how much the base is ahead of the tip, since a motion was ended early.
        self._wound_rad = 0.0

    def lies(self, depth_mm: float, wound_rad: float) -> None:
        """See `Compensating.lies`; the base is turned back before the next motion."""
        self._depth_mm, self._wound_rad = depth_mm, wound_rad

    def push(self, length_mm: float) -> None:
        """See `Actuator.push`."""
        self._unwind()
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
        self._unwind()
        lag_rad = self._lag_rad(angle_rad)
        self._actuator.roll(angle_rad + lag_rad)
        if lag_rad:
            self._actuator.roll(-lag_rad)

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """Turns the base by the lag, then inserts it in a turn that the tip follows, and back.

        Raises:
            DeviceError: The motion is impossible or failed.
            Halted: Who watched it ended it early; its part is that of the angle.
        """
        self._unwind()
        self._wind(self._lag_rad(angle_rad), done=0.0)
        try:
            screw_on(self._actuator, length_mm, angle_rad)
        except Halted as halted:
            self._depth_mm += halted.part * length_mm
            raise
        self._depth_mm += length_mm
        self._wind(-self._wound_rad, done=1.0)

    @property
    def can_screw(self) -> bool:
        """Whether the actuator can be inserted and turned at once."""
        return can_screw(self._actuator)

    def _lag_rad(self, angle_rad: float) -> float:
        """The lag at this depth in a turn by an angle, with its sign."""
        return math.copysign(self._lag.at_rad(self._depth_mm), angle_rad)

    def _wind(self, angle_rad: float, done: float) -> None:
        """Turns the base only; if that is ended early, this part of the screw motion was made."""
        if not angle_rad:
            return
        try:
            self._actuator.roll(angle_rad)
        except Halted as halted:
            self._wound_rad += halted.part * angle_rad
            halted.part = done
            raise
        self._wound_rad += angle_rad

    def _unwind(self) -> None:
        """Turns the base back to the tip."""
        wound_rad, self._wound_rad = self._wound_rad, 0.0
        if wound_rad:
            self._actuator.roll(-wound_rad)

    def pull(self, length_mm: float) -> None:
        """See `Actuator.pull`."""
        self._unwind()
        self._actuator.pull(length_mm)
        self._depth_mm = max(0.0, self._depth_mm - length_mm)
