"""The phantom needle: a needle in tissue that behaves as real ones were measured to behave.

It has the methods of the virtual needle (`ntagen.needle.virtual`), but:

* its curvature drifts and its bend plane turns, both as the tissue at that depth makes them;
* friction along the shaft holds back its tip when the base is rolled;
* a push in an old channel follows it, within its width;
* a needle that spins goes nearly straight: a small share of its bend stays, or too much goes;
* its force is the total axial force at the base: friction, cutting, layers, near regions, noise;
* a measurement is late, noisy and rounded, has a correlated error, and can be lost.

`ntagen.needle.phantom_parameters` has all numbers and their sources. Everything comes from one
seed, in separate streams: how often it is measured does not change how it moves. The tissue depends
on the depth only, so a push of 10 mm and a thousand pushes of 0.01 mm cut the same path, to within
1e-6 mm.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np

from ntagen.needle.breathing import BreathWitness
from ntagen.needle.kinematics import Arc, push, roll
from ntagen.needle.measurement import Measurement
from ntagen.needle.phantom_parameters import PhantomParameters
from ntagen.needle.phantom_sensor import Frame, PhantomSensor, Seen
from ntagen.needle.phantom_tissue import CELL_MM, Tissue
from ntagen.needle.screws import STRAIGHT_MM, is_whole, steps_of
from ntagen.needle.sweep import Sweep
from ntagen.needle.vectors import add, combine, cross, distance, scale
from ntagen.needle.virtual import (
    PULL_SPEED_RATIO,
    ROLL_RAD_PER_S,
    Obstacle,
    SimulatedClock,
    require_possible,
)
from ntagen.scene import Needle, Pose, Vector

_NOTHING_MM = 1e-9
_MARGIN_MM = 50.0
"""The tissue is drawn this much deeper than the needle is long."""


@dataclass(frozen=True, slots=True)
class _Piece:
    """A part of a channel in one cell of the tissue.

    Attributes:
        frame: The frame at its beginning. Its bevel is a reference direction that a roll of the tip
            does not turn.
        bend_rad: The angle of the bend direction from the reference.
        radius_mm: Its radius.
        length_mm: Its length.
        cell: Its cell.
    """

    frame: Pose
    bend_rad: float
    radius_mm: float
    length_mm: float
    cell: int

    @property
    def start(self) -> Pose:
        """The pose of a tip that begins to cut it."""
        return roll(self.frame, self.bend_rad)

    def frame_at(self, length_mm: float) -> Pose:
        """The frame at a length from its beginning."""
        return roll(push(self.start, self.radius_mm, length_mm), -self.bend_rad)

    def upto(self, length_mm: float) -> _Piece:
        """The first part."""
        return replace(self, length_mm=length_mm)

    def beyond(self, length_mm: float) -> _Piece:
        """The rest."""
        frame = self.frame_at(length_mm)
        return replace(self, frame=frame, length_mm=self.length_mm - length_mm)

    def arc(self) -> Arc:
        """The same as an arc."""
        return Arc(self.start, self.radius_mm, self.length_mm)


class PhantomNeedle:
    """A needle in a phantom; a `ntagen.drive.device.Device`.

    Args:
        needle: The nominal entry pose, radius and speed.
        obstacles: The actual critical regions.
        seed: The seed of everything random.
        clock: The clock on which time passes.
        parameters: What the phantom is like.
        reports_pose: Whether its tracker sees heading and bevel. The bevel is that of the tip, as
            it was turned: the tracker does not see how the tissue turns the bend plane.
    """

    def __init__(
        self,
        needle: Needle,
        obstacles: tuple[Obstacle, ...],
        seed: int,
        clock: SimulatedClock,
        parameters: PhantomParameters | None = None,
        *,
        reports_pose: bool = False,
    ) -> None:
        self._parameters = parameters or PhantomParameters()
        self._needle = needle
        self._obstacles = obstacles
        self._clock = clock
        tissue, channels, sensor, spins = np.random.SeedSequence(seed).spawn(4)
        self._tissue = Tissue(self._parameters, needle.length_mm + _MARGIN_MM, tissue)
        self._channel_errors = np.random.default_rng(channels)
        spin_std = self._parameters.shape.spin_ratio
        self._spin_error = float(np.random.default_rng(spins).normal(0.0, spin_std))
        self._base_rad = 0.0
        self._tip_rad = 0.0
        self._depth_mm = 0.0
        self._pieces: list[_Piece] = []
        # The channel beyond the tip, after a pull; the nearest part is the last one.
        self._ahead: list[_Piece] = []
        self._followed_mm = 0.0
        self._left: list[_Piece] = []
        self._bite_mm = 0.0
        self._offset: Vector = (0.0, 0.0, 0.0)
        self._reentered_mm = 0.0
        self._is_back = False
        self._direction = 1.0
        still = [o.region for o in obstacles if o.region.motion is None]
        self._sweep = Sweep(still, needle.tip.position_mm)
        self._witness = BreathWitness(obstacles)
        self._moves = len(still) < len(obstacles)
        self._sensor = PhantomSensor(
            self._parameters.sensing, self._tissue, sensor, clock, reports_pose=reports_pose
        )
        self._show()

    def now_s(self) -> float:
        """Simulated seconds."""
        return self._clock.now_s()

    def push(self, length_mm: float) -> None:
        """Moves the tip on: along an old channel if it fits, else in new tissue.

        Raises:
            DeviceError: The length is negative or not finite.
        """
        require_possible(length_mm >= 0.0, "push", length_mm)
        self._direction = 1.0
        left_mm = length_mm
        while left_mm > _NOTHING_MM:
            step_mm = self._step(left_mm)
            left_mm -= step_mm
            self._pass(step_mm / self._needle.speed_mm_per_s)
            self._show()

    def screw(self, length_mm: float, angle_rad: float) -> None:
        """Moves the tip on while the base turns; the tip turns as far as friction lets it.

        Raises:
            DeviceError: The length is negative, or a value is not finite.
        """
        require_possible(length_mm >= 0.0, "screw", length_mm)
        require_possible(math.isfinite(angle_rad), "screw", angle_rad)
        self._direction = 1.0
        seconds = max(length_mm / self._needle.speed_mm_per_s, abs(angle_rad) / ROLL_RAD_PER_S)
        bent_mm = abs(self._spin_error) * length_mm
        self._advance(bent_mm, turned_rad=math.pi if self._spin_error > 0.0 else 0.0)
        before_rad = self._tip_rad
        self._base_rad += angle_rad
        self._slip()
        if is_whole(self._tip_rad - before_rad):
            if self._ahead:
                self._leave()
            self._advance(length_mm - bent_mm, is_straight=True)
        else:
            self._base_rad, self._tip_rad = self._base_rad - angle_rad, before_rad
            steps = steps_of(angle_rad)
            for _ in range(steps):
                self._base_rad += angle_rad / steps
                self._slip()
                self._advance((length_mm - bent_mm) / steps)
        self._pass(seconds)
        self._show()

    def _advance(
        self, length_mm: float, turned_rad: float = 0.0, *, is_straight: bool = False
    ) -> None:
        """Moves the tip on, at no time."""
        left_mm = length_mm
        while left_mm > _NOTHING_MM:
            left_mm -= self._step(left_mm, turned_rad, is_straight=is_straight)

    def wait(self, seconds: float) -> None:
        """Rests for a time.

        Raises:
            DeviceError: It is negative or not finite.
        """
        require_possible(seconds >= 0.0, "wait", seconds)
        self._pass(seconds)
        self._show()

    def _pass(self, seconds: float) -> None:
        """Lets time pass, in which regions move."""
        self._clock.advance(seconds)
        if self._moves:
            self._witness.note([piece.arc() for piece in self._pieces], self._clock.now_s())

    def roll(self, angle_rad: float) -> None:
        """Turns the base; the tip turns only as far as the friction of the shaft lets it.

        Raises:
            DeviceError: The angle is not finite.
        """
        require_possible(math.isfinite(angle_rad), "roll", angle_rad)
        self._base_rad += angle_rad
        self._slip()
        self._pass(abs(angle_rad) / ROLL_RAD_PER_S)
        self._show()

    def roll_on(self, angle_rad: float) -> None:
        """Goes on with the last roll: the same as another one, since rolls of the base are exact.

        Raises:
            DeviceError: The angle is not finite.
        """
        self.roll(angle_rad)

    def pull(self, length_mm: float) -> None:
        """Moves the tip back along its channel, at most to the entry.

        Raises:
            DeviceError: The length is negative or not finite.
        """
        require_possible(length_mm >= 0.0, "pull", length_mm)
        if length_mm <= 0.0:
            return
        self._direction = -1.0
        self._cut_followed()
        left_mm = length_mm
        speed_mm_per_s = PULL_SPEED_RATIO * self._needle.speed_mm_per_s
        while self._pieces and left_mm > _NOTHING_MM:
            last = self._pieces.pop()
            rest_mm = last.length_mm - left_mm
            if rest_mm > _NOTHING_MM:
                self._pieces.append(last.upto(rest_mm))
                self._leave_behind(last.beyond(rest_mm))
                moved_mm = left_mm
            else:
                self._leave_behind(last)
                moved_mm = last.length_mm
            left_mm -= moved_mm
            self._depth_mm = max(0.0, self._depth_mm - moved_mm) if self._pieces else 0.0
            self._slip()
            self._pass(moved_mm / speed_mm_per_s)
            self._show()
        # The base goes on when the tip is out already.
        self._clock.advance(max(0.0, left_mm) / speed_mm_per_s)
        self._is_back = True

    def stop(self) -> None:
        """Does nothing: the needle stands still between commands."""

    def measure(self) -> Measurement:
        """A reading of the tracker and of the total axial force.

        A lost reading is waited for, in simulated time.

        Raises:
            DeviceError: All readings of `Sensing.patience_s` were lost.
        """
        return self._sensor.measure()

    def frame(self) -> Frame:
        """The present reading, lost or not; it takes no time on the clock."""
        return self._sensor.frame()

    @property
    def true_tip(self) -> Pose:
        """The true pose of the tip; for reports and tests, never for the driver."""
        return roll(self._frame(), self._bend_rad())

    @property
    def parameters(self) -> PhantomParameters:
        """What the phantom is like."""
        return self._parameters

    @property
    def radius_mm(self) -> float:
        """The nominal radius; for reports and tests."""
        return self._needle.radius_mm

    @property
    def tissue(self) -> Tissue:
        """The tissue; for reports and tests."""
        return self._tissue

    @property
    def tip_rad(self) -> float:
        """The angle by which the tip was turned; for reports and tests."""
        return self._tip_rad

    @property
    def pierced(self) -> tuple[Arc, ...]:
        """All arcs that were cut, including those that the needle has left."""
        pieces = (*self._left, *self._pieces, *reversed(self._ahead))
        return tuple(piece.arc() for piece in pieces)

    def true_clearance_mm(self) -> float:
        """The smallest distance of the whole path to any actual critical region.

        Infinite without critical regions, negative if one was pierced. It comes from dense sampling
        (`ntagen.needle.sweep`): never too great, too small by 0.02 mm at most.
        """
        return min(self._witness.clearance_mm(), self._sweep.clearance_mm())

    # Motion.

    def _step(self, left_mm: float, turned_rad: float = 0.0, *, is_straight: bool = False) -> float:
        """Moves the tip within one cell or piece; returns by how much.

        Args:
            left_mm: At most so far.
            turned_rad: It bends into a direction that is turned by this.
            is_straight: Whether it does not bend.
        """
        if self._ahead and not self._fits():
            self._leave()
        if self._ahead:
            return self._follow(left_mm)
        cell = self._tissue.cell(self._depth_mm)
        bend_rad = self._bend_rad() + turned_rad
        radius_mm = self._needle.radius_mm / self._tissue.curvature_ratio(cell)
        if is_straight:
            radius_mm = STRAIGHT_MM
        step_mm = min(left_mm, self._to_boundary_mm(cell))
        if self._bite_mm > _NOTHING_MM:
            step_mm = min(step_mm, self._bite_mm)
            self._bite_mm -= step_mm
            radius_mm /= 1.0 if is_straight else self._parameters.reinsertion.bite_ratio
        last = self._pieces[-1] if self._pieces else None
        new = _Piece(self._frame(), bend_rad, radius_mm, 0.0, cell)
        if last and (last.cell, last.bend_rad, last.radius_mm) == (cell, bend_rad, radius_mm):
            new = self._pieces.pop()
        self._pieces.append(new.upto(new.length_mm + step_mm))
        self._sweep.follow(new.start, 1.0 / radius_mm, new.length_mm, new.length_mm + step_mm)
        self._depth_mm += step_mm
        return step_mm

    def _to_boundary_mm(self, cell: int) -> float:
        """The length to the next cell; tissue beyond the last one has no boundaries."""
        left_mm = (cell + 1) * CELL_MM - self._depth_mm
        return left_mm if left_mm > _NOTHING_MM else CELL_MM

    def _fits(self) -> bool:
        """Whether the tip would follow the channel beyond it."""
        difference_rad = math.remainder(self._bend_rad() - self._ahead[-1].bend_rad, 2.0 * math.pi)
        return abs(difference_rad) <= self._parameters.reinsertion.capture_rad

    def _leave(self) -> None:
        """Begins a new channel here."""
        self._cut_followed()
        self._left += reversed(self._ahead)
        self._ahead.clear()
        self._is_back = False
        self._bite_mm = self._parameters.reinsertion.bite_mm

    def _follow(self, left_mm: float) -> float:
        """Moves along the old channel, to the end of its piece at most."""
        piece = self._ahead[-1]
        step_mm = min(left_mm, piece.length_mm - self._followed_mm)
        if self._is_back:
            self._reenter()
        if self._followed_mm == 0.0:
            position = add(piece.frame.position_mm, self._settled())
            self._pieces.append(replace(piece, frame=replace(piece.frame, position_mm=position)))
        current = self._pieces.pop()
        end_mm = self._followed_mm + step_mm
        self._pieces.append(current.upto(end_mm))
        curvature_per_mm = 1.0 / current.radius_mm
        self._sweep.follow(current.start, curvature_per_mm, self._followed_mm, end_mm)
        self._followed_mm = end_mm
        self._depth_mm += step_mm
        self._reentered_mm += step_mm
        if piece.length_mm - end_mm <= _NOTHING_MM:
            self._ahead.pop()
            self._followed_mm = 0.0
        return step_mm

    def _leave_behind(self, piece: _Piece) -> None:
        """Adds a piece to the channel beyond the tip; pieces of one cell become one again."""
        if self._ahead:
            after = self._ahead[-1]
            same = (after.cell, after.bend_rad, after.radius_mm)
            end = piece.frame_at(piece.length_mm).position_mm
            is_near = distance(end, after.frame.position_mm) < _NOTHING_MM
            if is_near and same == (piece.cell, piece.bend_rad, piece.radius_mm):
                self._ahead.pop()
                piece = piece.upto(piece.length_mm + after.length_mm)
        self._ahead.append(piece)

    def _cut_followed(self) -> None:
        """Splits the old piece where the tip is, so that only its rest lies ahead."""
        if self._followed_mm > 0.0:
            self._ahead[-1] = self._ahead[-1].beyond(self._followed_mm)
            self._followed_mm = 0.0

    def _reenter(self) -> None:
        """Draws where in the old channel this push runs."""
        angle, share = self._channel_errors.uniform(size=2)
        reach_mm = self._parameters.reinsertion.tolerance_mm * math.sqrt(float(share))
        frame, turn_rad = self._frame(), 2.0 * math.pi * float(angle)
        side = cross(frame.heading, frame.bevel)
        across = combine(math.cos(turn_rad), frame.bevel, math.sin(turn_rad), side)
        self._offset = scale(reach_mm, across)
        self._reentered_mm = 0.0
        self._is_back = False

    def _settled(self) -> Vector:
        """How far the tip runs beside the middle of the old channel, here."""
        share = min(1.0, self._reentered_mm / self._parameters.reinsertion.settle_mm)
        return scale(share, self._offset)

    def _slip(self) -> None:
        """Lets the tip follow the base as far as the friction lets it."""
        lag_rad = self._tissue.lag_rad(self._depth_mm)
        least_rad, most_rad = self._base_rad - lag_rad, self._base_rad + lag_rad
        self._tip_rad = min(max(self._tip_rad, least_rad), most_rad)

    def _frame(self) -> Pose:
        if not self._pieces:
            return self._needle.tip
        return self._pieces[-1].frame_at(self._pieces[-1].length_mm)

    def _bend_rad(self) -> float:
        return self._tip_rad + self._tissue.turn_rad(self._tissue.cell(self._depth_mm))

    # What can be measured.

    def _show(self) -> None:
        """Notes the present state for measurements, which show an earlier one."""
        tip = roll(self._frame(), self._tip_rad)
        force_n = self._force_n(tip.position_mm)
        seen = Seen(self._clock.now_s(), tip, self._depth_mm, force_n)
        if self._parameters.sensing.whole_shape:
            # Few states are measured, and the shaft of no other needs to be known.
            seen = replace(seen, shaft=functools.partial(self._shaft_mm, tuple(self._pieces)))
        self._sensor.note(seen)

    def _shaft_mm(self, pieces: tuple[_Piece, ...]) -> tuple[Vector, ...]:
        """Places of a shaft behind the tip, one after the other, the free part included."""
        sensing, entry = self._parameters.sensing, self._needle.tip
        places: list[Vector] = []
        begin_mm = sum(piece.length_mm for piece in pieces)
        at_mm = begin_mm - sensing.shape_apart_mm
        for piece in reversed(pieces):
            begin_mm -= piece.length_mm
            while at_mm >= max(0.0, begin_mm):
                places.append(piece.arc().position_at(at_mm - begin_mm))
                at_mm -= sensing.shape_apart_mm
        while at_mm >= -sensing.shape_free_mm:
            places.append(combine(1.0, entry.position_mm, at_mm, entry.heading))
            at_mm -= sensing.shape_apart_mm
        return tuple(places)

    def _force_n(self, position_mm: Vector) -> float:
        """The total axial force, without noise; a pull has friction the other way."""
        friction_n = self._direction * self._tissue.friction_n(self._depth_mm)
        if self._direction < 0.0:
            return friction_n
        # An old channel is open: there is nothing to cut.
        cutting_n = 0.0 if self._ahead else self._tissue.cutting_n(self._depth_mm)
        near = (o.depth_in_margin_mm(position_mm, self._clock.now_s()) for o in self._obstacles)
        rise_n = self._parameters.forces.region_n_per_mm * max(near, default=0.0)
        return friction_n + cutting_n + rise_n
