"""All channels that a needle has cut, as a tree of stretches, and how they depend on the unknowns.

A push cuts a channel. After a pull and a roll, the next push leaves it: a new channel begins there.
Each channel is divided where the depth is a multiple of `STRETCH_MM`; at these places curvature and
bend plane may change (`ntagen.needle.fluctuations`). It is also divided where the spin changes: a
needle that spins in a part of the way bends less by this part. Without all that, a channel is one
stretch.

The derivatives are exact. If an unknown changes by ``dx``, all that lies beyond it moves as a rigid
body: a point ``x`` by ``w x x + v``, with a rotation vector ``w`` and a translation ``v`` that are
linear in ``dx``. So a stretch needs two matrices, ``w`` and ``v`` at its start. A roll adds a
rotation about the heading, and a change of curvature adds that of the end of its stretch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.kinematics import bending_axis, push, roll
from ntagen.needle.poses import Poses
from ntagen.needle.vectors import add, combine, cross, rotate, scale, subtract
from ntagen.scene import Pose, Vector

_Array = NDArray[np.float64]
_Indices = NDArray[np.intp]

ENTRY = -1
"""The index of the entry in the tree of channels."""

STRETCH_MM = 5.0
"""The length of the stretches. Longer ones predict worse: on phantom runs, the 95 % quantile of the
error after 10 mm was 1.9 mm with 10 mm, 1.5 mm with 5 mm, and the same with 2.5 mm."""

_NOTHING_MM = 1e-9
_NONE: _Array = np.zeros(0)


def _none() -> _Array:
    return _NONE


@dataclass(slots=True)
class Stretch:
    """A part of a channel with one curvature, in one plane.

    What the tissue does there is a linear combination of unknowns, by its coefficients; it may have
    fewer than there are unknowns (`ntagen.needle.fluctuations`).

    Attributes:
        offset_mm: Where it begins in its channel.
        growth: The logarithm of its curvature without a spin, relative to that at the entry.
        turn: The angle by which the tissue has turned the bend plane.
        expected: What is added to `growth` whatever the unknowns are.
        spin: In this part of it the needle spins.
    """

    offset_mm: float
    growth: _Array = field(default_factory=_none)
    turn: _Array = field(default_factory=_none)
    expected: float = 0.0
    spin: float = 0.0


@dataclass(frozen=True, slots=True)
class Bite:
    """How much less a channel bends that leaves another one, as a length without bend.

    Attributes:
        expected_mm: The length that is expected.
        std_mm: Its standard deviation.
        unknown: The index of the unknown for its error, in standard deviations.
    """

    expected_mm: float
    std_mm: float
    unknown: int


@dataclass(slots=True)
class Channel:
    """Where a channel leaves its parent, the rolls made there, and its stretches.

    Attributes:
        parent: The index of the channel that it leaves, or `ENTRY`.
        branch_mm: Where it leaves its parent, in mm from the parent's beginning.
        depth_mm: The depth of its beginning.
        roll_rad: The sum of the rolls.
        rolls: The indices of the unknown errors of these rolls.
        stretches: Its stretches in order.
        extent_mm: The greatest length that was cut.
        bite: How much less it bends at its beginning; None if not at all.
    """

    parent: int
    branch_mm: float
    depth_mm: float
    roll_rad: float
    rolls: tuple[int, ...]
    stretches: list[Stretch] = field(default_factory=list)
    extent_mm: float = 0.0
    bite: Bite | None = None

    def new_boundaries(self, extent_mm: float) -> list[float]:
        """Where stretches begin in the part that is cut when the channel grows to this length."""
        first = math.ceil((self.depth_mm + self.extent_mm) / STRETCH_MM - _NOTHING_MM)
        last = math.ceil((self.depth_mm + extent_mm) / STRETCH_MM - _NOTHING_MM)
        offsets_mm = [number * STRETCH_MM - self.depth_mm for number in range(first, last)]
        inner_mm = [offset_mm for offset_mm in offsets_mm if offset_mm > _NOTHING_MM]
        return inner_mm if self.stretches else [0.0, *inner_mm]

    def spin_from_here(self, spin: float) -> None:
        """Notes the spin of the part that is cut next: the tissue there is as in the last part."""
        if not self.stretches or self.stretches[-1].spin == spin:
            return
        last = self.stretches[-1]
        if self.extent_mm <= last.offset_mm + _NOTHING_MM:
            last.spin = spin
        else:
            self.stretches.append(replace(last, offset_mm=self.extent_mm, spin=spin))

    def begin_stretch(self, stretch: Stretch) -> None:
        """Adds a stretch, in the place of one that begins there because the spin has changed."""
        last_mm = self.stretches[-1].offset_mm if self.stretches else 0.0
        if last_mm > 0.0 and stretch.offset_mm - last_mm <= _NOTHING_MM:
            self.stretches.pop()
        self.stretches.append(stretch)

    def stretch_at(self, offset_mm: float) -> int:
        """The index of the stretch in which a place lies; its end belongs to it."""
        number = len(self.stretches) - 1
        while number > 0 and self.stretches[number].offset_mm > offset_mm - _NOTHING_MM:
            number -= 1
        return number


@dataclass(slots=True)
class Placed:
    """A stretch in space, with its derivatives by the unknowns.

    Attributes:
        start: The pose at its beginning, after rolls and turns.
        curvature_per_mm: The curvature that it would have without a spin.
        rotation: The rotation vector of the beginning, 3 rows, one column for each unknown.
        shift: The translation, in the same form.
        growth: The derivative of the curvature's logarithm by each unknown.
        spin: In this part of it the needle spins.
    """

    start: Pose
    curvature_per_mm: float
    rotation: _Array
    shift: _Array
    growth: _Array
    spin: float = 0.0

    @property
    def bent_per_mm(self) -> float:
        """The curvature that it has."""
        return self.curvature_per_mm * (1.0 - self.spin)

    @property
    def radius_mm(self) -> float:
        """One over the curvature that it has."""
        return 1.0 / self.bent_per_mm

    def positions(self, along_mm: _Array) -> tuple[_Array, _Array]:
        """Positions at these lengths from the beginning, and their derivatives: see `positions`."""
        return positions([self], np.zeros(len(along_mm), dtype=np.intp), along_mm)

    def directions(self, along_mm: float) -> tuple[Pose, _Array]:
        """The pose at a length from the beginning, and the derivative of its rotation vector."""
        turn_rad = self.bent_per_mm * along_mm
        axis = np.array(bending_axis(self.start))
        return (
            push(self.start, self.radius_mm, along_mm),
            self.rotation + np.outer(turn_rad * axis, self.growth),
        )

    def beyond(self, along_mm: float) -> Placed:
        """What begins after this length: the same curvature, further on."""
        start = self.start
        turn_rad = self.bent_per_mm * along_mm
        end = push(start, self.radius_mm, along_mm)
        # A change of the curvature moves the end by `own`, and turns it about the bending axis.
        half = 0.5 * turn_rad
        chord_mm = along_mm * (math.sin(half) / half if half else 1.0)
        own = combine(
            along_mm * math.cos(turn_rad) - chord_mm * math.cos(half),
            start.heading,
            chord_mm * math.sin(half) - along_mm * math.sin(turn_rad),
            start.bevel,
        )
        turn = scale(turn_rad, bending_axis(start))
        shift = subtract(own, cross(turn, end.position_mm))
        return Placed(
            end,
            self.curvature_per_mm,
            self.rotation + np.array(turn)[:, None] * self.growth,
            self.shift + np.array(shift)[:, None] * self.growth,
            self.growth,
            self.spin,
        )

    def rolled(self, angle_rad: float, unknowns: tuple[int, ...]) -> Placed:
        """The same after a roll whose errors are these unknowns."""
        start = roll(self.start, angle_rad)
        rotation, shift = self.rotation, self.shift
        if unknowns:
            rotation, shift = rotation.copy(), shift.copy()
            for unknown in unknowns:
                _turn_about(rotation, shift, unknown, start.heading, start.position_mm)
        return Placed(start, self.curvature_per_mm, rotation, shift, self.growth, self.spin)

    def among(self, stretch: Stretch, entry: Placed, unknowns: _Array, before: _Array) -> Placed:
        """The same with the curvature and the bend plane of a stretch.

        Args:
            stretch: The stretch that begins here.
            entry: What lasts: the curvature at the entry.
            unknowns: The unknowns.
            before: The coefficients of the bend plane's turn before, as `Stretch.turn`.
        """
        placed = self
        if len(stretch.turn) or len(before):
            turn = padded(stretch.turn, len(unknowns)) - padded(before, len(unknowns))
            placed = self.turned(turn, unknowns)
        growth = padded(stretch.growth, len(unknowns))
        change = float(growth @ unknowns) + stretch.expected
        return Placed(
            placed.start,
            entry.curvature_per_mm * math.exp(change),
            placed.rotation,
            placed.shift,
            entry.growth + growth,
            stretch.spin,
        )

    def bitten(self, bite: Bite, unknowns: _Array) -> Placed:
        """The same without the bend of so much of its length."""
        length_mm = bite.expected_mm + bite.std_mm * float(unknowns[bite.unknown])
        angle_rad = -self.bent_per_mm * length_mm
        axis = bending_axis(self.start)
        slopes = angle_rad * self.growth
        slopes[bite.unknown] -= self.bent_per_mm * bite.std_mm
        moved = np.array(cross(axis, self.start.position_mm))
        return Placed(
            Pose(
                self.start.position_mm,
                rotate(self.start.heading, axis, angle_rad),
                rotate(self.start.bevel, axis, angle_rad),
            ),
            self.curvature_per_mm,
            self.rotation + np.array(axis)[:, None] * slopes,
            self.shift - moved[:, None] * slopes,
            self.growth,
            self.spin,
        )

    def turned(self, turn: _Array, unknowns: _Array) -> Placed:
        """The same after a turn of the bend plane with these coefficients."""
        start = roll(self.start, float(turn @ unknowns))
        heading = np.array(start.heading)
        moved = np.array(cross(start.heading, start.position_mm))
        return Placed(
            start,
            self.curvature_per_mm,
            self.rotation + heading[:, None] * turn,
            self.shift - moved[:, None] * turn,
            self.growth,
            self.spin,
        )


def padded(coefficients: _Array, width: int) -> _Array:
    """The same coefficients for more unknowns."""
    full = np.zeros(width)
    full[: len(coefficients)] = coefficients
    return full


def placed_entry(entry: Pose, curvature_per_mm: float, unknowns: _Array) -> Placed:
    """The beginning at the entry, from the first seven unknowns.

    These are three translations, rotations about heading, bevel and bending axis, and the
    logarithm of the curvature relative to `curvature_per_mm`.
    """
    heading, bevel = entry.heading, entry.bevel
    moved: Vector = (float(unknowns[0]), float(unknowns[1]), float(unknowns[2]))
    position = add(entry.position_mm, moved)
    rotation, shift = np.zeros((3, len(unknowns))), np.zeros((3, len(unknowns)))
    shift[:, :3] = np.eye(3)
    axes = (entry.heading, entry.bevel, bending_axis(entry))
    angles = [float(angle_rad) for angle_rad in unknowns[3:6]]
    for number, (axis, angle_rad) in enumerate(zip(axes, angles, strict=True)):
        heading, bevel = rotate(heading, axis, angle_rad), rotate(bevel, axis, angle_rad)
        # The rotations are made one after the other: a later one also turns this one's axis.
        turned = axis
        for later in range(number + 1, 3):
            turned = rotate(turned, axes[later], angles[later])
        _turn_about(rotation, shift, 3 + number, turned, position)
    growth = np.zeros(len(unknowns))
    growth[6] = 1.0
    curvature = math.exp(float(unknowns[6])) * curvature_per_mm
    return Placed(Pose(position, heading, bevel), curvature, rotation, shift, growth)


def place(
    channels: list[Channel], entry: Pose, curvature_per_mm: float, unknowns: _Array
) -> tuple[Placed, list[list[Placed]]]:
    """The entry, and the stretches of each channel, for these unknowns."""
    start = placed_entry(entry, curvature_per_mm, unknowns)
    placed: list[list[Placed]] = []
    for channel in channels:
        before = _NONE
        if channel.parent == ENTRY:
            begin = start
        else:
            parent = channels[channel.parent]
            number = parent.stretch_at(channel.branch_mm)
            along_mm = channel.branch_mm - parent.stretches[number].offset_mm
            begin = placed[channel.parent][number].beyond(along_mm)
            before = parent.stretches[number].turn
        error_rad = sum(float(unknowns[i]) for i in channel.rolls)
        current = begin.rolled(channel.roll_rad + error_rad, channel.rolls)
        parts: list[Placed] = []
        offset_mm = 0.0
        for stretch in channel.stretches:
            current = current.beyond(stretch.offset_mm - offset_mm)
            current = current.among(stretch, start, unknowns, before)
            if channel.bite is not None and not parts:
                current = current.bitten(channel.bite, unknowns)
            parts.append(current)
            offset_mm, before = stretch.offset_mm, stretch.turn
        placed.append(parts)
    return start, placed


def positions(
    parts: Sequence[Placed], part_of: _Indices, along_mm: _Array
) -> tuple[_Array, _Array]:
    """Positions on stretches, and their derivatives; all at once, since each call of NumPy counts.

    Args:
        parts: The stretches.
        part_of: By place: the index of its stretch.
        along_mm: By place: its length from the beginning of the stretch.

    Returns:
        One row a place; one 3-row matrix a place, with one column for each unknown.
    """
    arcs = _Arcs.of(parts, part_of, along_mm)
    places = arcs.places
    # Derivatives of both parts by the curvature's logarithm.
    ahead_growth = along_mm * np.cos(arcs.turned) - arcs.ahead
    aside_growth = along_mm * np.sin(arcs.turned) - arcs.aside
    own = ahead_growth[:, None] * arcs.starts.heading - aside_growth[:, None] * arcs.starts.bevel
    slopes = np.stack([part.shift for part in parts])[part_of]
    growth = np.stack([part.growth for part in parts])[part_of]
    rotation = np.stack([part.rotation for part in parts], axis=1)[:, part_of]
    slopes += own[:, :, None] * growth[:, None, :]
    # A place moves by ``w x place + v`` with each unknown.
    x, y, z = places[:, 0, None], places[:, 1, None], places[:, 2, None]
    slopes[:, 0] += rotation[1] * z - rotation[2] * y
    slopes[:, 1] += rotation[2] * x - rotation[0] * z
    slopes[:, 2] += rotation[0] * y - rotation[1] * x
    return places, slopes


def points(parts: Sequence[Placed], part_of: _Indices, along_mm: _Array) -> _Array:
    """The positions alone; see `positions`."""
    return _Arcs.of(parts, part_of, along_mm).places


@dataclass(frozen=True, slots=True)
class _Arcs:
    """Arcs from the beginnings of stretches to places; one row for each place.

    Attributes:
        starts: The beginnings.
        turned: By how much the heading has turned, in rad.
        ahead: The length of the chord along the heading, in mm.
        aside: Its length against the bevel, in mm.
        places: The ends.
    """

    starts: Poses
    turned: _Array
    ahead: _Array
    aside: _Array
    places: _Array

    @staticmethod
    def of(parts: Sequence[Placed], part_of: _Indices, along_mm: _Array) -> _Arcs:
        """The arcs to places on stretches; see `positions`."""
        starts = Poses.of(part.start for part in parts).at(part_of)
        turned = np.array([part.bent_per_mm for part in parts])[part_of] * along_mm
        half = 0.5 * turned
        chord = along_mm * np.sinc(half / math.pi)
        ahead, aside = chord * np.cos(half), chord * np.sin(half)
        ends = starts.position + ahead[:, None] * starts.heading
        ends -= aside[:, None] * starts.bevel
        return _Arcs(starts, turned, ahead, aside, ends)


def _turn_about(
    rotation: _Array, shift: _Array, unknown: int, axis: Vector, point_mm: Vector
) -> None:
    """Adds a rotation about an axis through a point to the derivatives by an unknown."""
    rotation[:, unknown] += axis
    shift[:, unknown] -= cross(axis, point_mm)
