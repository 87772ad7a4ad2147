"""The virtual needle: exact kinematics, a hidden true state, and sensors with noise.

It replaces a needle in a phantom. It moves on exact circles, as the paper's virtual needle does.
Each roll has a random error and each measured coordinate has noise, all from one seed. It knows the
actual critical regions, also those that the driver does not know, and shows them only as a force:
0 outside the sensing margin of a region, and growing with the depth inside the margin. It never
reveals where a region is.

It never reads a clock or waits: motions take simulated time on the clock that it is given.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from ntagen.errors import DeviceError
from ntagen.needle.answering import Answers
from ntagen.needle.breathing import BreathWitness
from ntagen.needle.breathing import Obstacle as Obstacle
from ntagen.needle.errors import Errors as Errors
from ntagen.needle.kinematics import Arc
from ntagen.needle.measurement import Measurement
from ntagen.needle.nearest import TOLERANCE_MM, nearest_to
from ntagen.needle.path import Path
from ntagen.needle.screws import STRAIGHT_MM, TURN_RAD, is_whole, steps_of
from ntagen.scene import Needle, Pose, Vector
from ntagen.shapes import Shape

ROLL_RAD_PER_S: Final = math.pi
"""The speed of a roll: half a turn per second; our choice."""

PULL_SPEED_RATIO: Final = 5.0
"""Pulling in an open channel is faster than insertion by this factor; our choice."""


class SimulatedClock:
    """A clock that advances only when it is told to."""

    def __init__(self) -> None:
        self._now_s = 0.0

    def now_s(self) -> float:
        """Seconds since the clock was made."""
        return self._now_s

    def advance(self, seconds: float) -> None:
        """Lets time pass."""
        self._now_s += seconds


class VirtualNeedle:
    """A needle in simulated tissue; a `ntagen.drive.device.Device`.

    Args:
        needle: The true entry pose, radius and speed.
        obstacles: The actual critical regions.
        errors: The size of the random errors.
        seed: The seed of the random errors.
        clock: The clock on which time passes.
        reports_pose: Whether measurements have heading and bevel, with the noise of the rolls.
        answers: What the tissue picks in each segment; None if it does what is expected.
        free_bevel: Whether the bevel is set before the entry, so that a roll there does not err.
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
        answers: Answers | None = None,
        free_bevel: bool = False,
    ) -> None:
        self._needle = needle
        self._obstacles = obstacles
        self._errors = errors
        self._clock = clock
        self._reports_pose = reports_pose
        # Two streams, so that the number of measurements does not change the roll errors.
        noise, rolls = np.random.SeedSequence(seed).spawn(2)
        self._noise = np.random.default_rng(noise)
        self._roll_errors = np.random.default_rng(rolls)
        self._path = Path(needle.tip)
        self._answers = answers
        self._free_bevel = free_bevel
        self._has_picked = False
        self._has_rolled = False
        self._factor = 1.0
        self._left: list[Arc] = []
        self._witness = BreathWitness(obstacles)
        still = [one.region.shape for one in obstacles if one.region.motion is None]
        self._clearance = CutClearance(needle.tip.position_mm, still)

    def now_s(self) -> float:
        """Simulated seconds."""
        return self._clock.now_s()

    def push(self, length_mm: float) -> None:
        """Moves the tip on along its circle.

        Raises:
            DeviceError: The length is negative or not finite.
        """
        require_possible(length_mm >= 0.0, "push", length_mm)
        self._let_pick()
        self._path = self._path.push(self._needle.radius_mm / self._factor, length_mm)
        self._pass(length_mm / self._needle.speed_mm_per_s)

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """Moves the tip on while it turns; in whole turns that is straight.

        Raises:
            DeviceError: The length is negative, or a value is not finite.
        """
        require_possible(length_mm >= 0.0, "screw", length_mm)
        require_possible(math.isfinite(angle_rad), "screw", angle_rad)
        turn_s = abs(angle_rad) / ROLL_RAD_PER_S
        if is_whole(angle_rad):
            self._path = self._path.push(STRAIGHT_MM, length_mm)
            left_rad = math.remainder(angle_rad, TURN_RAD)
            self._path = self._path.roll(left_rad) if left_rad else self._path
        else:
            steps = steps_of(angle_rad)
            for _ in range(steps):
                path = self._path.roll(angle_rad / steps)
                self._path = path.push(self._needle.radius_mm, length_mm / steps)
        self._pass(max(length_mm / self._needle.speed_mm_per_s, turn_s))

    def _let_pick(self) -> None:
        """At the first push of a segment, the tissue picks what holds until the next roll."""
        if self._answers is None or self._has_picked:
            return
        is_seen = self._free_bevel and self._path.depth_mm == 0.0
        rolls_err = self._has_rolled and not is_seen
        self._factor, error_rad = next(self._answers)
        self._path = self._path.roll(error_rad if rolls_err else 0.0)
        self._has_picked = True

    def wait(self, seconds: float) -> None:
        """Rests for a time.

        Raises:
            DeviceError: It is negative or not finite.
        """
        require_possible(seconds >= 0.0, "wait", seconds)
        self._pass(seconds)

    def _pass(self, seconds: float) -> None:
        """Lets time pass, in which regions move."""
        self._clock.advance(seconds)
        self._witness.note(self._path.arcs, self._clock.now_s())

    def roll(self, angle_rad: float) -> None:
        """Turns the shaft; the tip turns by the same angle plus the roll error.

        Raises:
            DeviceError: The angle is not finite.
        """
        require_possible(math.isfinite(angle_rad), "roll", angle_rad)
        self._turn(angle_rad, float(self._roll_errors.normal(0.0, self._errors.roll_rad)))

    def roll_on(self, angle_rad: float) -> None:
        """Goes on with the last roll: there is no further error.

        Raises:
            DeviceError: The angle is not finite.
        """
        require_possible(math.isfinite(angle_rad), "roll", angle_rad)
        self._turn(angle_rad, 0.0)

    def pull(self, length_mm: float) -> None:
        """Moves the tip back along its channel, at most to the entry.

        Raises:
            DeviceError: The length is negative or not finite.
        """
        require_possible(length_mm >= 0.0, "pull", length_mm)
        before, self._path = self._path.arcs, self._path.pull(length_mm)
        # The arc in which the tip is now was left in part: all of it was cut.
        self._left += before[max(0, len(self._path.arcs) - 1) :]
        self._pass(length_mm / (PULL_SPEED_RATIO * self._needle.speed_mm_per_s))

    def stop(self) -> None:
        """Does nothing: the needle stands still between commands."""

    def measure(self) -> Measurement:
        """The position with noise, and the force."""
        tip = self._path.tip
        x, y, z = (
            float(c + self._noise.normal(0.0, self._errors.noise_mm or 0.0))
            for c in tip.position_mm
        )
        return Measurement(
            time_s=self._clock.now_s(),
            position_mm=(x, y, z),
            force_n=max(
                (o.force_n(tip.position_mm, self._clock.now_s()) for o in self._obstacles),
                default=0.0,
            ),
            heading=tip.heading if self._reports_pose else None,
            bevel=tip.bevel if self._reports_pose else None,
        )

    @property
    def true_tip(self) -> Pose:
        """The true pose of the tip; for reports and tests, never for the driver."""
        return self._path.tip

    @property
    def pierced(self) -> tuple[Arc, ...]:
        """All arcs that were cut, including those that the needle has left."""
        return (*self._left, *self._path.arcs)

    def true_clearance_mm(self) -> float:
        """The smallest distance of all arcs that were cut to any actual critical region.

        Infinite without critical regions, negative if one was pierced.
        """
        return min(self._witness.clearance_mm(), self._clearance.of(self.pierced))

    def _turn(self, angle_rad: float, error_rad: float) -> None:
        self._path = self._path.roll(angle_rad + error_rad)
        self._has_rolled, self._has_picked = True, False
        self._pass(abs(angle_rad) / ROLL_RAD_PER_S)


def require_possible(possible: bool, command: str, value: float) -> None:
    """Refuses a command to a simulated needle that is impossible or not finite.

    Raises:
        DeviceError: It is.
    """
    if not possible or not math.isfinite(value):
        raise DeviceError(f"the needle refuses to {command} by {value}")


_SAFE_MM: Final = 2.0 * TOLERANCE_MM
"""Distances to shapes may be too small by the tolerance."""


class CutClearance:
    """The least distance of all that was cut to some shapes, which stand still.

    What was cut stays cut, so each piece of an arc is looked at once, when the needle has just made
    it. A distance changes by no more than the way along the path: a region that is farther from the
    start of a piece than the piece is long, and the least distance so far, is left out.

    Args:
        entry_mm: Where the needle enters; it counts as cut.
        shapes: The shapes.
    """

    def __init__(self, entry_mm: Vector, shapes: Sequence[Shape]) -> None:
        self._entry_mm = entry_mm
        self._shapes = shapes
        self._least_mm = self._nearest_mm((), shapes)
        # The lengths that were looked at, by where an arc starts and its radius.
        self._seen_mm: dict[tuple[Pose, float], float] = {}

    def of(self, arcs: Sequence[Arc]) -> float:
        """The least distance in mm when these arcs are all that was ever cut.

        Infinite without shapes, negative if one was pierced.
        """
        for arc in arcs:
            circle = (arc.start, arc.radius_mm)
            seen_mm = self._seen_mm.get(circle, 0.0)
            if arc.length_mm > seen_mm:
                self._seen_mm[circle] = arc.length_mm
                self._look_at(Arc(arc.pose_at(seen_mm), arc.radius_mm, arc.length_mm - seen_mm))
        return self._least_mm

    def _look_at(self, piece: Arc) -> None:
        reach_mm = self._least_mm + piece.length_mm + _SAFE_MM
        near = [one for one in self._shapes if _distance_mm(one, piece) < reach_mm]
        self._least_mm = min(self._least_mm, self._nearest_mm((piece,), near))

    def _nearest_mm(self, arcs: tuple[Arc, ...], shapes: Sequence[Shape]) -> float:
        start_mm = arcs[0].start.position_mm if arcs else self._entry_mm
        return min(
            (nearest_to(arcs, start_mm, one).distance_mm for one in shapes), default=math.inf
        )


def _distance_mm(shape: Shape, piece: Arc) -> float:
    """The least distance that a shape can have from where a piece starts."""
    if shape.error_mm > 0.0:
        # Its distance is a bound, which may change faster than the place.
        return -math.inf
    return shape.distance_at_mm(piece.start.position_mm) - shape.excess_mm
