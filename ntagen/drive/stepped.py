"""A simulated needle that is moved through the whole path to a stepper: driver, line, emulator.

The commands of the driver become lines of G-code; an emulated controller moves its axes with ramps
and in whole steps; the axes move the needle. All runs on the emulator's clock, so a run takes no
real time, and the same seed gives the same run.

The needle has a clock of its own, with which regions move. It counts motions without ramps and
answers without delay, so it is behind. Where regions move, the needle rests whenever it is looked
at, until its clock has come up.
"""

from __future__ import annotations

from dataclasses import replace

from ntagen.drive.device import Forwarding, rest
from ntagen.drive.plant import NeedlePlant, simulated_axes, simulated_controller
from ntagen.drive.simulate import Maker, Simulated
from ntagen.grbl.actuator import GrblActuator
from ntagen.grbl.emulator import SimulatedPort
from ntagen.needle.kinematics import Arc
from ntagen.needle.measurement import Measurement
from ntagen.needle.virtual import Obstacle, require_possible
from ntagen.scene import Needle, Pose


class Stepped(Forwarding):
    """A simulated needle behind an emulated controller; a `Simulated`.

    Args:
        needle: The needle.
        speed_mm_per_s: The speed of its insertion.
        keeps_time: Whether its clock comes up.
    """

    def __init__(
        self, needle: Simulated, speed_mm_per_s: float, *, keeps_time: bool = False
    ) -> None:
        self._needle = needle
        axes = simulated_axes(speed_mm_per_s)
        self._plant = NeedlePlant(needle, axes)
        self.emulator = simulated_controller(self._plant, axes)
        self.port = SimulatedPort(self.emulator)
        self.actuator = GrblActuator(self.port, axes)
        super().__init__(self.actuator)
        self._keeps_time = keeps_time
        # Connecting took time in which the needle did not exist.
        self._since_s = self.now_s() - needle.now_s()

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """See `GrblActuator.screw`."""
        self.actuator.screw(length_mm, angle_rad)
        self._plant.finish()

    def roll(self, angle_rad: float) -> None:
        """See `GrblActuator.roll`."""
        super().roll(angle_rad)
        self._plant.finish()

    def roll_on(self, angle_rad: float) -> None:
        """See `GrblActuator.roll`; the controller cannot tell the two."""
        super().roll(angle_rad)

    def wait(self, seconds: float) -> None:
        """Lets the controller rest for a time.

        Raises:
            DeviceError: It is negative or not finite.
        """
        require_possible(seconds >= 0.0, "wait", seconds)
        self.emulator.advance(self.now_s() + seconds)

    def _settle(self) -> None:
        """Moves the needle as far as its axes went."""
        self._plant.settle()
        if not self._keeps_time:
            return
        behind_s = self.now_s() - self._since_s - self._needle.now_s()
        rest(self._needle, max(0.0, behind_s))

    def measure(self) -> Measurement:
        """A reading of the needle's own sensors, with its age on the controller's clock.

        Raises:
            DeviceError: There is no reading.
        """
        self._settle()
        reading = self._needle.measure()
        age_s = max(0.0, self._needle.now_s() - reading.time_s)
        return replace(reading, time_s=self.now_s() - age_s)

    @property
    def true_tip(self) -> Pose:
        """The true pose of the tip."""
        self._settle()
        return self._needle.true_tip

    @property
    def pierced(self) -> tuple[Arc, ...]:
        """All arcs that were cut."""
        self._settle()
        return self._needle.pierced

    def true_clearance_mm(self) -> float:
        """The smallest distance of these arcs to any actual critical region."""
        self._settle()
        return self._needle.true_clearance_mm()


def stepped(make: Maker) -> Maker:
    """Simulated needles behind an emulated controller.

    Args:
        make: Makes the needles.
    """

    def behind(needle: Needle, obstacles: tuple[Obstacle, ...], seed: int) -> Simulated:
        moves = any(one.region.motion is not None for one in obstacles)
        return Stepped(make(needle, obstacles, seed), needle.speed_mm_per_s, keeps_time=moves)

    return behind
