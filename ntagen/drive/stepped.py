"""A simulated needle that is moved through the whole path to a stepper: driver, line, emulator.

The commands of the driver become lines of G-code; an emulated controller moves its axes with ramps
and in whole steps; the axes move the needle. All runs on the emulator's clock, so a run takes no
real time, and the same seed gives the same run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final, Protocol

from ntagen.drive.simulate import Maker, Simulated
from ntagen.grbl.actuator import GrblActuator
from ntagen.grbl.axes import Axes, Axis
from ntagen.grbl.dialects import GRBLHAL
from ntagen.grbl.emulator import Emulator
from ntagen.grbl.memory import Memory
from ntagen.grbl.simulated import SimulatedPort
from ntagen.needle.kinematics import Arc
from ntagen.needle.measurement import Measurement
from ntagen.needle.virtual import PULL_SPEED_RATIO, ROLL_RAD_PER_S, Obstacle
from ntagen.scene import Needle, Pose
from ntagen.units import deg_from_rad, rad_from_deg

_INSERT: Final = "X"
_ROLL: Final = "A"
_STEPS_PER_MM: Final = 1000.0
_STEPS_PER_DEG: Final = 100.0
_ACCELERATION_MM_PER_S2: Final = 200.0
_ACCELERATION_DEG_PER_S2: Final = 2000.0


class Movable(Protocol):
    """A needle that an axis can move."""

    def push(self, length_mm: float) -> None:
        """Inserts it."""

    def roll(self, angle_rad: float) -> None:
        """Turns its base."""

    def pull(self, length_mm: float) -> None:
        """Pulls it back."""


class NeedlePlant:
    """A needle behind the axes of a controller.

    Motion in one direction is added up and given to the needle as one: a needle whose rolls have
    errors has one error for each roll, and not one for each piece of it.

    Args:
        needle: The needle.
    """

    def __init__(self, needle: Movable) -> None:
        self._needle = needle
        self._axis = ""
        self._way = 0.0

    def move(self, steps: Mapping[str, float], seconds: float) -> None:
        """Adds motion of the axes, in mm and degrees."""
        for axis, step in steps.items():
            if axis != self._axis or step * self._way < 0.0:
                self.settle()
                self._axis = axis
            self._way += step

    def settle(self) -> None:
        """Moves the needle by what has been added up."""
        way, self._way = self._way, 0.0
        if way == 0.0:
            return
        if self._axis == _ROLL:
            self._needle.roll(rad_from_deg(way))
        elif self._axis == _INSERT and way > 0.0:
            self._needle.push(way)
        elif self._axis == _INSERT:
            self._needle.pull(-way)


class Stepped:
    """A simulated needle behind an emulated controller; a `Simulated`.

    Args:
        needle: The needle.
        speed_mm_per_s: The speed of its insertion.
    """

    def __init__(self, needle: Simulated, speed_mm_per_s: float) -> None:
        self._needle = needle
        self._plant = NeedlePlant(needle)
        pull_mm_per_s = PULL_SPEED_RATIO * speed_mm_per_s
        roll_deg_per_s = deg_from_rad(ROLL_RAD_PER_S)
        insert, roll = GRBLHAL.axes.index(_INSERT), GRBLHAL.axes.index(_ROLL)
        settings = {
            1: 255.0,
            100 + insert: _STEPS_PER_MM,
            100 + roll: _STEPS_PER_DEG,
            110 + insert: 60.0 * pull_mm_per_s,
            110 + roll: 60.0 * roll_deg_per_s,
            120 + insert: _ACCELERATION_MM_PER_S2,
            120 + roll: _ACCELERATION_DEG_PER_S2,
        }
        self.emulator = Emulator(GRBLHAL, self._plant, Memory(GRBLHAL, settings))
        self.emulator.power_on()
        axes = Axes(
            insert=Axis(_INSERT, steps_per_unit=_STEPS_PER_MM),
            roll=Axis(_ROLL, steps_per_unit=_STEPS_PER_DEG),
            push_mm_per_s=speed_mm_per_s,
            pull_mm_per_s=pull_mm_per_s,
            roll_deg_per_s=roll_deg_per_s,
        )
        self.port = SimulatedPort(self.emulator)
        self.actuator = GrblActuator(self.port, axes)

    def now_s(self) -> float:
        """Seconds on the controller's clock."""
        return self.actuator.now_s()

    def push(self, length_mm: float) -> None:
        """See `GrblActuator.push`."""
        self.actuator.push(length_mm)

    def roll(self, angle_rad: float) -> None:
        """See `GrblActuator.roll`."""
        self.actuator.roll(angle_rad)

    def pull(self, length_mm: float) -> None:
        """See `GrblActuator.pull`."""
        self.actuator.pull(length_mm)

    def stop(self) -> None:
        """See `GrblActuator.stop`."""
        self.actuator.stop()

    def measure(self) -> Measurement:
        """A reading of the needle's own sensors, with its age on the controller's clock.

        Raises:
            DeviceError: There is no reading.
        """
        self._plant.settle()
        reading = self._needle.measure()
        age_s = max(0.0, self._needle.now_s() - reading.time_s)
        return replace(reading, time_s=self.now_s() - age_s)

    @property
    def true_tip(self) -> Pose:
        """The true pose of the tip."""
        self._plant.settle()
        return self._needle.true_tip

    @property
    def pierced(self) -> tuple[Arc, ...]:
        """All arcs that were cut."""
        self._plant.settle()
        return self._needle.pierced

    def true_clearance_mm(self) -> float:
        """The smallest distance of these arcs to any actual critical region."""
        self._plant.settle()
        return self._needle.true_clearance_mm()


def stepped(make: Maker) -> Maker:
    """Simulated needles behind an emulated controller.

    Args:
        make: Makes the needles.
    """

    def behind(needle: Needle, obstacles: tuple[Obstacle, ...], seed: int) -> Simulated:
        return Stepped(make(needle, obstacles, seed), needle.speed_mm_per_s)

    return behind
