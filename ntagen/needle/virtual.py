"""The virtual needle: exact kinematics, a hidden true state, and sensors that see it through noise.

It stands in for a needle in a phantom. It moves on exact circles, as the paper's virtual needle
does; each roll may err and each measured coordinate is noisy, all drawn from one seed. It knows the
actual critical regions, also those that the driver was not told about, and lets them be felt only
as a force: nothing within the sensing margin of a region, then growing with the depth in that
margin. What it never reveals is where a region is.

It never reads a clock or waits: motions take simulated time on the clock that it is given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ntagen.errors import DeviceError
from ntagen.needle.kinematics import Arc
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path, nearest_on
from ntagen.needle.vectors import distance
from ntagen.scene import Needle, Pose, Region, Vector

FORCE_N_PER_MM: Final = 1.0
"""The rise of the force in the sensing margin; ours, since no source gives a figure."""

ROLL_RAD_PER_S: Final = math.pi
"""Speed of a roll: half a turn a second; ours."""

PULL_SPEED_RATIO: Final = 5.0
"""Pulling in an open channel is this much faster than insertion; ours."""


class SimulatedClock:
    """A clock that goes on only when somebody tells it to."""

    def __init__(self) -> None:
        self._now_s = 0.0

    def now_s(self) -> float:
        """Seconds since the clock was made."""
        return self._now_s

    def advance(self, seconds: float) -> None:
        """Lets time pass."""
        self._now_s += seconds


@dataclass(frozen=True, slots=True)
class Obstacle:
    """An actual critical region and how far from its surface it is felt."""

    region: Region
    margin_mm: float

    def force_n(self, point_mm: Vector) -> float:
        """The force on a tip at a point."""
        surface_mm = distance(point_mm, self.region.center_mm) - self.region.radius_mm
        return FORCE_N_PER_MM * max(0.0, self.margin_mm - surface_mm)


@dataclass(frozen=True, slots=True)
class Errors:
    """How far the virtual needle is from ideal, as standard deviations.

    Attributes:
        noise_mm: Of each coordinate of a measured position.
        roll_rad: Of each roll.
    """

    noise_mm: float = 0.0
    roll_rad: float = 0.0


class VirtualNeedle:
    """A needle in simulated tissue; a `ntagen.drive.device.Device`.

    Args:
        needle: The true entry pose, radius and speed.
        obstacles: The actual critical regions.
        errors: The size of the random errors.
        seed: What they are drawn from.
        clock: What time passes on.
        reports_pose: Whether measurements hold heading and bevel, noisy as the rolls are.
    """

    def __init__(
        self,
        needle: Needle,
        obstacles: tuple[Obstacle, ...],
        errors: Errors,
        seed: int,
        clock: SimulatedClock,
        *,
        reports_pose: bool = False,
    ) -> None:
        self._needle = needle
        self._obstacles = obstacles
        self._errors = errors
        self._clock = clock
        self._reports_pose = reports_pose
        # Two streams, so that a drive that measures more often still makes the same roll errors.
        noise, rolls = np.random.SeedSequence(seed).spawn(2)
        self._noise = np.random.default_rng(noise)
        self._roll_errors = np.random.default_rng(rolls)
        self._path = Path(needle.tip)
        self._left: list[Arc] = []

    def now_s(self) -> float:
        """Simulated seconds."""
        return self._clock.now_s()

    def push(self, length_mm: float) -> None:
        """Moves the tip on along its circle.

        Raises:
            DeviceError: The length is negative or not finite.
        """
        _require(length_mm >= 0.0, "push", length_mm)
        self._path = self._path.push(self._needle.radius_mm, length_mm)
        self._clock.advance(length_mm / self._needle.speed_mm_per_s)

    def roll(self, angle_rad: float) -> None:
        """Turns the shaft; the tip follows up to the roll error.

        Raises:
            DeviceError: The angle is not finite.
        """
        _require(math.isfinite(angle_rad), "roll", angle_rad)
        error_rad = self._roll_errors.normal(0.0, self._errors.roll_rad)
        self._path = self._path.roll(angle_rad + float(error_rad))
        self._clock.advance(abs(angle_rad) / ROLL_RAD_PER_S)

    def pull(self, length_mm: float) -> None:
        """Moves the tip back along its channel, at most to the entry.

        Raises:
            DeviceError: The length is negative or not finite.
        """
        _require(length_mm >= 0.0, "pull", length_mm)
        self._left += self._path.arcs
        self._path = self._path.pull(length_mm)
        self._clock.advance(length_mm / (PULL_SPEED_RATIO * self._needle.speed_mm_per_s))

    def stop(self) -> None:
        """Holds the needle; it stands already between two commands."""

    def measure(self) -> Measurement:
        """The position as the sensor sees it, and the force."""
        tip = self._path.tip
        x, y, z = (
            float(c + self._noise.normal(0.0, self._errors.noise_mm)) for c in tip.position_mm
        )
        return Measurement(
            time_s=self._clock.now_s(),
            position_mm=(x, y, z),
            force_n=max((o.force_n(tip.position_mm) for o in self._obstacles), default=0.0),
            heading=tip.heading if self._reports_pose else None,
            bevel=tip.bevel if self._reports_pose else None,
        )

    @property
    def true_tip(self) -> Pose:
        """Where the tip really is; for reports and tests, never for the driver."""
        return self._path.tip

    @property
    def pierced(self) -> tuple[Arc, ...]:
        """Every arc that was ever cut, the ones that were left included."""
        return (*self._left, *self._path.arcs)

    def true_clearance_mm(self) -> float:
        """The smallest distance of all that was pierced to any actual critical region.

        Infinite without critical regions, negative if one was pierced.
        """
        entry_mm = self._needle.tip.position_mm
        return min(
            (
                nearest_on(self.pierced, entry_mm, o.region.center_mm).distance_mm
                - o.region.radius_mm
                for o in self._obstacles
            ),
            default=math.inf,
        )


def _require(possible: bool, command: str, value: float) -> None:
    if not possible or not math.isfinite(value):
        raise DeviceError(f"the needle refuses to {command} by {value}")
