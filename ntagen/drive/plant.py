"""What stands behind the axes of an emulated controller: a simulated needle, and its stepper.

The controller tells in small pieces how its axes move. Here the pieces become pushes, rolls and
pulls of the needle.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Protocol

from ntagen.errors import InputError
from ntagen.grbl.axes import Axes, Axis
from ntagen.grbl.dialects import GRBLHAL
from ntagen.grbl.emulator import Emulator, Plant
from ntagen.grbl.memory import Memory
from ntagen.needle.virtual import PULL_SPEED_RATIO, ROLL_RAD_PER_S
from ntagen.units import deg_from_rad, rad_from_deg

STEPS_PER_MM: Final = 1000.0
STEPS_PER_DEG: Final = 100.0
ACCELERATION_MM_PER_S2: Final = 200.0
ACCELERATION_DEG_PER_S2: Final = 2000.0

_HOLDS_ALWAYS: Final = 255.0


class Movable(Protocol):
    """A needle that an axis can move."""

    def push(self, length_mm: float) -> None:
        """Inserts it."""

    def roll(self, angle_rad: float) -> None:
        """Turns its base."""

    def roll_on(self, angle_rad: float) -> None:
        """Goes on with the last roll: no error is added."""

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """Inserts it and turns its base at once."""

    def pull(self, length_mm: float) -> None:
        """Pulls it back."""


class NeedlePlant:
    """A needle behind the axes of a controller.

    Pieces of a motion are added up until somebody wants to see the needle (`settle`). A roll is one
    roll of the needle, however often it is seen on the way: errors of rolls come once for each. It
    ends when another axis moves, when the direction changes, or with `finish`. Where both axes move
    at once, they make a screw motion.

    Args:
        needle: The needle.
        axes: Which axis does what.
    """

    def __init__(self, needle: Movable, axes: Axes) -> None:
        self._needle = needle
        self._axes = axes
        # The directions of the axes that move, and how far they went.
        self._directions = (0, 0)
        self._has_begun = False
        self._ways = (0.0, 0.0)

    def move(self, steps: Mapping[str, float], seconds: float) -> None:
        """Adds motion of the axes, in mm and degrees."""
        axes = (self._axes.insert, self._axes.roll)
        mm, deg = (axis.sign * steps.get(axis.letter, 0.0) for axis in axes)
        directions = ((mm > 0.0) - (mm < 0.0), (deg > 0.0) - (deg < 0.0))
        if directions == (0, 0):
            return
        if directions != self._directions:
            self.settle()
            self._directions = directions
            self._has_begun = False
        self._ways = (self._ways[0] + mm, self._ways[1] + deg)

    def settle(self) -> None:
        """Moves the needle by what has been added up."""
        (mm, deg), self._ways = self._ways, (0.0, 0.0)
        angle_rad = rad_from_deg(deg)
        if mm > 0.0 and deg:
            self._needle.screw(mm, angle_rad)
        else:
            if mm > 0.0:
                self._needle.push(mm)
            elif mm < 0.0:
                self._needle.pull(-mm)
            if deg:
                turn = self._needle.roll_on if self._has_begun else self._needle.roll
                turn(angle_rad)
        self._has_begun |= mm != 0.0 or deg != 0.0

    def finish(self) -> None:
        """Ends the motion: one in the same direction after it is another one."""
        self.settle()
        self._has_begun = False


def simulated_axes(speed_mm_per_s: float) -> Axes:
    """The axes of the steppers that move a simulated needle."""
    return Axes(
        insert=Axis("X", steps_per_unit=STEPS_PER_MM),
        roll=Axis("A", steps_per_unit=STEPS_PER_DEG),
        push_mm_per_s=speed_mm_per_s,
        pull_mm_per_s=PULL_SPEED_RATIO * speed_mm_per_s,
        roll_deg_per_s=deg_from_rad(ROLL_RAD_PER_S),
    )


def simulated_controller(plant: Plant, axes: Axes) -> Emulator:
    """An emulated controller that is switched on, with these axes.

    Args:
        plant: What they move.
        axes: Their steps and greatest speeds; the accelerations are ours.

    Raises:
        InputError: The emulated firmware has no such axis.
    """
    settings = {1: _HOLDS_ALWAYS}
    speed_mm_per_s = max(axes.push_mm_per_s, axes.pull_mm_per_s)
    for axis, steps, speed, acceleration in (
        (axes.insert, STEPS_PER_MM, speed_mm_per_s, ACCELERATION_MM_PER_S2),
        (axes.roll, STEPS_PER_DEG, axes.roll_deg_per_s, ACCELERATION_DEG_PER_S2),
    ):
        if axis.letter not in GRBLHAL.axes:
            raise InputError(
                f"the emulated controller has no axis {axis.letter}\n"
                f"hint: its axes are {', '.join(GRBLHAL.axes)}"
            )
        index = GRBLHAL.axes.index(axis.letter)
        settings[100 + index] = axis.steps_per_unit or steps
        settings[110 + index] = 60.0 * speed
        settings[120 + index] = acceleration
    emulator = Emulator(GRBLHAL, plant, Memory(GRBLHAL, settings))
    emulator.power_on()
    return emulator
