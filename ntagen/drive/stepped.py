"""A simulated needle that is moved through the whole path to a stepper: driver, line, emulator.

The commands of the driver become lines of G-code; an emulated controller moves its axes with ramps
and in whole steps; the axes move the needle. All runs on the emulator's clock, so a run takes no
real time, and the same seed gives the same run.
"""

from __future__ import annotations

from dataclasses import replace

from ntagen.drive.plant import NeedlePlant, simulated_axes, simulated_controller
from ntagen.drive.simulate import Maker, Simulated
from ntagen.grbl.actuator import GrblActuator
from ntagen.grbl.simulated import SimulatedPort
from ntagen.needle.kinematics import Arc
from ntagen.needle.measurement import Measurement
from ntagen.needle.virtual import Obstacle
from ntagen.scene import Needle, Pose


class Stepped:
    """A simulated needle behind an emulated controller; a `Simulated`.

    Args:
        needle: The needle.
        speed_mm_per_s: The speed of its insertion.
    """

    def __init__(self, needle: Simulated, speed_mm_per_s: float) -> None:
        self._needle = needle
        axes = simulated_axes(speed_mm_per_s)
        self._plant = NeedlePlant(needle, axes)
        self.emulator = simulated_controller(self._plant, axes)
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
        self._plant.finish()

    def roll_on(self, angle_rad: float) -> None:
        """See `GrblActuator.roll`; the controller cannot tell the two."""
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
