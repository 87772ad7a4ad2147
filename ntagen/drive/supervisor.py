"""Watches the needle while it moves, and stops it without asking the planner.

The actuator calls `Supervisor.watch` every few milliseconds of a motion
(`ntagen.drive.device.WatchedActuator`), and stops when it raises. Tracker and force are received at
their own rates by a thread of their own; here the newest sample is looked at, and nothing waits.

What ends a motion:

* the operator: the run ends;
* a sample that is missing, stale or impossible, or a peer that is lost: the run ends with a fault,
  as it does after an alarm of the controller, which the actuator sees itself;
* during a push also a breach of its `Guard`: the driver measures, and plans anew.

A guard is wide: it holds for every sample of a motion, noise included. Slow changes are judged
after each piece of a push, from several readings (`ntagen.drive.deviation`, `ntagen.drive.force`).
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from ntagen.drive.device import Halted, LiveSensor, require_finite
from ntagen.drive.settings import Settings
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import combine, distance, dot, subtract
from ntagen.scene import Region, Vector

_SIGMAS: Final = 6.0
"""A sample is farther off by noise alone less than once in 10^8 samples."""

_DEVIATIONS: Final = 2.0
"""A motion is ended at this many times the deviation that is allowed in the mean."""


@dataclass(frozen=True, slots=True)
class Guard:
    """What must hold while the needle is pushed.

    Attributes:
        start_mm: Where the tip is expected at the start.
        end_mm: Where it is expected at the end.
        tube_mm: How far it may be from the straight way between them.
        force_n: The greatest force; infinite if the force is not watched.
        regions: The known critical regions.
        unsure_mm: A tip that is measured this deep in a region is surely in it, or will be before
            the needle stands.
    """

    start_mm: Vector
    end_mm: Vector
    tube_mm: float
    force_n: float
    regions: tuple[Region, ...]
    unsure_mm: float

    @staticmethod
    def of(
        settings: Settings,
        way: tuple[Vector, Vector],
        regions: tuple[Region, ...],
        expected_n: float,
    ) -> Guard:
        """The guard of a push.

        Args:
            settings: How to drive.
            way: Where the tip is expected at the start and at the end.
            regions: The known critical regions.
            expected_n: The force that is expected.
        """
        noise_mm = _SIGMAS * settings.priors.noise_mm + settings.priors.distortion_mm
        limit_n = settings.halt_force_n + _SIGMAS * settings.force_noise_n
        return Guard(
            *way,
            tube_mm=_DEVIATIONS * settings.deviation_mm + noise_mm,
            force_n=expected_n + limit_n if settings.force_sensing else math.inf,
            regions=regions,
            unsure_mm=noise_mm - settings.overrun_mm,
        )

    def breach(self, found: Measurement) -> str | None:
        """Why the push must end; `None` if it may go on."""
        if found.force_n > self.force_n:
            return f"the force is {found.force_n:.2f} N, and {self.force_n:.2f} N is allowed"
        for region in self.regions:
            if -region.distance_mm(found.position_mm) > self.unsure_mm:
                return f"the tip is measured in the critical region '{region.name}'"
        off_mm = _from_way_mm(found.position_mm, self.start_mm, self.end_mm)
        if not off_mm <= self.tube_mm:
            return f"the tip is {off_mm:.1f} mm off its way, and {self.tube_mm:.1f} mm is allowed"
        return None


class Supervisor:
    """What looks at the needle while it moves.

    Args:
        sensor: What measures the needle; without one, only the operator is listened to.
        listen: Raises `KeyboardInterrupt` if somebody wants the run to end.
    """

    def __init__(
        self, sensor: LiveSensor | None = None, listen: Callable[[], None] = lambda: None
    ) -> None:
        self._sensor = sensor
        self._listen = listen
        self._guard: Guard | None = None

    @contextlib.contextmanager
    def guarding(self, guard: Guard) -> Iterator[None]:
        """Watches a guard until the end of the block."""
        self._guard = guard
        try:
            yield
        finally:
            self._guard = None

    def watch(self) -> None:
        """Looks once.

        Raises:
            KeyboardInterrupt: Somebody wants the run to end.
            DeviceError: There is no sample, or it cannot be true.
            Halted: The guard does not hold.
        """
        self._listen()
        if self._sensor is None:
            return
        found = self._sensor.newest()
        require_finite(found)
        breach = self._guard.breach(found) if self._guard else None
        if breach is not None:
            raise Halted(breach)


def _from_way_mm(point_mm: Vector, start_mm: Vector, end_mm: Vector) -> float:
    """The distance of a point from a straight way."""
    along = subtract(end_mm, start_mm)
    length_squared = dot(along, along)
    if length_squared == 0.0:
        return distance(point_mm, start_mm)
    ratio = dot(subtract(point_mm, start_mm), along) / length_squared
    return distance(point_mm, combine(1.0, start_mm, max(0.0, min(1.0, ratio)), along))
