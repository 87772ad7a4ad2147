"""Which axis of the controller does what to the needle, and how fast."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

from ntagen.errors import InputError
from ntagen.grbl.identity import Identity, no_axis
from ntagen.grbl.link import Link
from ntagen.hardware import GrblDevice

_STEPS: Final = 100
_SPEEDS: Final = 110
_ACCELERATIONS: Final = 120
_MATCH: Final = 1e-3
_ROUNDING: Final = 0.001
"""Positions are reported with three decimals."""


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis of the controller; its unit is mm, or degrees where it turns.

    Attributes:
        letter: Its letter.
        sign: 1 if the needle moves in the positive direction of the axis, -1 otherwise.
        steps_per_unit: What the controller's setting must be; not checked if `None`.
        low: The lowest machine position that is allowed; none if infinite.
        high: The highest one.
    """

    letter: str
    sign: int = 1
    steps_per_unit: float | None = None
    low: float = -math.inf
    high: float = math.inf


@dataclass(frozen=True, slots=True)
class Axes:
    """How the controller moves the needle.

    Attributes:
        insert: The axis that inserts it, in mm.
        roll: The axis that turns it, in degrees.
        push_mm_per_s: The speed of insertion.
        pull_mm_per_s: The speed of pulling.
        roll_deg_per_s: The speed of rolling.
        max_mm: Longer motions are made in pieces of this length. If this program dies, the needle
            stops at the end of the piece.
        max_deg: The same for rolls.

    Raises:
        InputError: A value is impossible.
    """

    insert: Axis = field(default_factory=lambda: Axis("X"))
    roll: Axis = field(default_factory=lambda: Axis("A"))
    push_mm_per_s: float = 1.0
    pull_mm_per_s: float = 5.0
    roll_deg_per_s: float = 90.0
    max_mm: float = 5.0
    max_deg: float = 90.0

    def __post_init__(self) -> None:
        sizes = (self.push_mm_per_s, self.pull_mm_per_s, self.roll_deg_per_s)
        if not all(0.0 < size < math.inf for size in (*sizes, self.max_mm, self.max_deg)):
            raise InputError("speeds and longest motions of a device must be greater than 0")
        for axis in (self.insert, self.roll):
            if axis.sign not in (-1, 1) or axis.letter not in tuple("XYZABC"):
                raise InputError(f"'{axis.letter}' with the sign {axis.sign} is no axis of GRBL")
        if self.insert.letter == self.roll.letter:
            raise InputError(f"the axis {self.roll.letter} cannot both insert and roll the needle")


def axes_of(
    device: GrblDevice, push_mm_per_s: float, pull_mm_per_s: float, roll_deg_per_s: float
) -> Axes:
    """The axes as a task describes them, with their speeds.

    Args:
        device: The device in the task; an axis with negative steps turns the other way round.
        push_mm_per_s: The speed of insertion.
        pull_mm_per_s: The speed of pulling.
        roll_deg_per_s: The speed of rolling.

    Raises:
        InputError: The axes are impossible.
    """
    insert, roll = (
        Axis(axis.letter, 1 if axis.steps_per_unit > 0.0 else -1, abs(axis.steps_per_unit))
        for axis in (device.insert, device.roll)
    )
    return Axes(insert, roll, push_mm_per_s, pull_mm_per_s, roll_deg_per_s)


@dataclass(frozen=True, slots=True)
class Motor:
    """An axis as the controller has it.

    Attributes:
        axis: The axis.
        index: Its place in positions.
        unit: ``mm`` or ``deg``.
        speed: The greatest speed of the controller, in units per second.
        acceleration: In units per second squared.
        tolerance: How far a position may be from the commanded one.
    """

    axis: Axis
    index: int
    unit: str
    speed: float
    acceleration: float
    tolerance: float

    def seconds(self, length: float, speed: float) -> float:
        """How long a motion takes from rest to rest, with ramps of constant acceleration."""
        v, a, s = min(speed, self.speed), self.acceleration, abs(length)
        return s / v + v / a if s * a >= v * v else 2.0 * math.sqrt(s / a)


def motors(link: Link, identity: Identity, axes: Axes) -> tuple[Motor, Motor]:
    """Finds the axes that insert and turn the needle, as `motor`.

    Raises:
        DeviceError: One is not there, its steps are others, or it is too slow.
    """
    speed_mm_per_s = max(axes.push_mm_per_s, axes.pull_mm_per_s)
    insert = motor(link, identity, axes.insert, "mm", speed_mm_per_s)
    return insert, motor(link, identity, axes.roll, "deg", axes.roll_deg_per_s)


def motor(link: Link, identity: Identity, axis: Axis, unit: str, speed: float) -> Motor:
    """Finds an axis at the controller, and compares the settings with what is expected.

    Raises:
        DeviceError: The axis is not there, its steps are others, or it is too slow.
    """
    if axis.letter not in identity.axes:
        raise no_axis(link, axis.letter, identity.axes)
    index = identity.axes.index(axis.letter)
    numbers = [identity.settings.get(first + index) for first in (_STEPS, _SPEEDS, _ACCELERATIONS)]
    steps, per_minute, acceleration = (0.0 if number is None else number for number in numbers)
    if min(steps, per_minute, acceleration) <= 0.0:
        raise link.fail(
            f"{link.name}: the controller does not tell steps, speed and acceleration of the axis "
            f"{axis.letter}\nhint: set ${_STEPS + index}, ${_SPEEDS + index} and "
            f"${_ACCELERATIONS + index}"
        )
    expected = axis.steps_per_unit
    if expected is not None and abs(steps - expected) > _MATCH * expected:
        raise link.fail(
            f"{link.name}: the axis {axis.letter} makes {steps:g} steps per {unit}, but "
            f"{expected:g} are expected\nhint: correct ${_STEPS + index} or the task"
        )
    if speed > per_minute / 60.0 * (1.0 + _MATCH):
        raise link.fail(
            f"{link.name}: the axis {axis.letter} can move {per_minute / 60.0:.3g} {unit}/s at "
            f"most, but {speed:g} are wanted\nhint: lower the speed, or raise ${_SPEEDS + index}"
        )
    return Motor(axis, index, unit, per_minute / 60.0, acceleration, 1.5 / steps + _ROUNDING)
