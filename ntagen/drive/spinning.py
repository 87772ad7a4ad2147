"""Duty-cycled spinning: a needle that spins about its shaft in a part of the way bends less.

A bevel-tip needle that spins while it is inserted goes straight. If it does so in a part of each
short cycle, its curvature is less by that part (Minhas, Engh, Fenske and Riviere, "Modeling of
needle steering via duty-cycled spinning", IEEE EMBC 2007; docs/spinning.md has more).

A cycle is at most `CYCLE_MM` long. Half of what bends comes before the turn, and half after it, so
that the end of the cycle lies where the arc of the mean curvature ends. The turns are whole ones,
alternately forward and back, so that the shaft and its cables do not wind up.

A motion that is ended early in a turn leaves the needle at some angle. `Spun.settle` makes the
rest of that turn, or takes it back, whichever is nearer, without insertion. Nothing else moves the
needle before.
"""

from __future__ import annotations

import math
from typing import Final

from ntagen.drive.device import CANNOT_SPIN, Actuator, Forwarding, can_screw, screw_on
from ntagen.drive.torsion import Compensated, Lag
from ntagen.errors import DeviceError, Halted, InputError
from ntagen.needle.screws import TURN_RAD
from ntagen.plan.actions import Push
from ntagen.scene import Scene

CYCLE_MM: Final = 1.0
"""A cycle is at most so long; ours: the tip is then at most 0.005 mm off the arc of a needle with a
radius of 30 mm."""


def cycles_of(length_mm: float) -> int:
    """The number of cycles of a push with a spin."""
    return max(1, math.ceil(length_mm / CYCLE_MM - 1e-9))


def bent_last_mm(push: Push) -> float:
    """How much of a push with a spin comes after its last turn."""
    return 0.5 * (1.0 - push.spin) * push.length_mm / cycles_of(push.length_mm)


def push_seconds(push: Push, speed_mm_per_s: float, roll_rad_per_s: float, lag_rad: float) -> float:
    """How long a push takes.

    Args:
        push: The push; in a turn of its spin, the slower of both motions counts.
        speed_mm_per_s: The speed of insertion.
        roll_rad_per_s: The speed of turns.
        lag_rad: By so much the base is turned ahead before each turn, and back after it.
    """
    seconds = push.length_mm / speed_mm_per_s
    if not push.spin:
        return seconds
    cycles = cycles_of(push.length_mm)
    spun_s = max(push.spin * seconds, cycles * TURN_RAD / roll_rad_per_s)
    return (1.0 - push.spin) * seconds + spun_s + cycles * 2.0 * lag_rad / roll_rad_per_s


def steered(actuator: Actuator, scene: Scene, lag_rad: float) -> Actuator:
    """An actuator whose rolls reach the tip, and that spins the needle if plans may do that.

    Args:
        actuator: What moves the needle.
        scene: Its limits say whether plans may spin the needle.
        lag_rad: The lag that rolls make up for, in rad; see `Settings.compensated_lag_rad`.

    Raises:
        InputError: They may, and the actuator cannot.
    """
    if lag_rad > 0.0:
        actuator = Compensated(actuator, Lag(lag_rad))
    if not scene.limits.spins:
        return actuator
    if not can_screw(actuator):
        raise InputError(CANNOT_SPIN)
    return Spun(actuator)


class Spun(Forwarding):
    """An actuator that makes the cycles of a needle that spins.

    Args:
        actuator: What moves the needle. Nothing else may move it.
    """

    def __init__(self, actuator: Actuator) -> None:
        super().__init__(actuator)
        self._is_wound = False
        # The rest of a turn that was ended early, and whether the shaft is wound up after it.
        self._rest: tuple[float, bool] | None = None

    def spin(self, length_mm: float, fraction: float) -> None:
        """Inserts the needle by a length, and spins it in a fraction of that.

        Raises:
            DeviceError: The actuator cannot do that, or a motion failed.
            Halted: Who watched it ended it early; its part is that of the length.
        """
        if not (0.0 < fraction < 1.0 and 0.0 < length_mm < math.inf):
            raise DeviceError(f"the needle refuses to spin for {fraction} of {length_mm} mm")
        self.settle()
        count = cycles_of(length_mm)
        spun_mm = fraction * length_mm / count
        bent_mm = 0.5 * (length_mm / count - spun_mm)
        made_mm = now_mm = 0.0
        try:
            for number in range(count):
                made_mm, now_mm = number * length_mm / count, bent_mm
                self._actuator.push(bent_mm)
                made_mm, now_mm = made_mm + bent_mm, spun_mm
                self._turn(spun_mm)
                made_mm, now_mm = made_mm + spun_mm, bent_mm
                self._actuator.push(bent_mm)
        except Halted as halted:
            halted.part = min(1.0, (made_mm + halted.part * now_mm) / length_mm)
            raise

    def _turn(self, length_mm: float) -> None:
        """Inserts the needle by a length in one whole turn, which undoes the one before."""
        turn_rad = -TURN_RAD if self._is_wound else TURN_RAD
        try:
            screw_on(self._actuator, length_mm, turn_rad)
        except Halted as halted:
            done_rad = halted.part * turn_rad
            if halted.part > 0.5:
                self._rest = (turn_rad - done_rad, not self._is_wound)
            else:
                self._rest = (-done_rad, self._is_wound)
            raise
        self._is_wound = not self._is_wound

    def settle(self) -> None:
        """Ends the turn in which the needle was stopped, if it was: it has its angle again.

        Raises:
            DeviceError: The motion failed.
        """
        if self._rest is not None:
            (rest_rad, self._is_wound), self._rest = self._rest, None
            self._actuator.roll(rest_rad)

    def push(self, length_mm: float) -> None:
        """See `Actuator.push`."""
        self.settle()
        self._actuator.push(length_mm)

    def roll(self, angle_rad: float) -> None:
        """See `Actuator.roll`."""
        self.settle()
        self._actuator.roll(angle_rad)

    def pull(self, length_mm: float) -> None:
        """See `Actuator.pull`."""
        self.settle()
        self._actuator.pull(length_mm)
