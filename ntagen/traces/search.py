"""The search for the rolls that explain a trace: which ones, and at which steps.

For given rolls the chain has a fixed form, and the start that fits it best is known in closed form
(Kabsch, 1976), if each measured point is compared with the place of the chain at its own depth. So
thousands of sequences are compared at once. All sequences are tried if they are few. Else a beam
search adds one roll after the other, anywhere in the sequence, to the best ones so far, and then
moves each roll of the best ones to all other places and angles as long as that helps.

What the search ranks by is close to the deviation, but not the same; the best of its results are
fitted exactly (`ntagen.traces.refine`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.traces.chain import Array, Rolls, chain_points

MOST_EXHAUSTIVE: Final = 3000
"""If there are at most so many sequences with a number of rolls, all are tried."""

BEAM: Final = 24
"""So many sequences are extended by a further roll."""

_EXCHANGED: Final = 4
_ROUNDS: Final = 6
_POINTS: Final = 48
"""At most so many points of a trace are compared in the search."""

_CHUNK: Final = 1500
"""So many sequences are compared at once: their arrays stay in the cache of the processor."""

Steps = tuple[tuple[int, int], ...]
"""Rolls: after how many steps, and which of the scene's angles; in the order of the steps."""


@dataclass(frozen=True, slots=True)
class Start:
    """What is known of the start in a search.

    Attributes:
        position_mm: The position of the tip; None if it is free.
        frame: Heading, bevel and their product as columns; None if the orientation is free.
    """

    position_mm: Array | None = None
    frame: Array | None = None


@dataclass(frozen=True, slots=True)
class Space:
    """The sequences among which is searched, and the points that they are compared with.

    Attributes:
        points_mm: The measured points.
        depths_mm: Their depths.
        curvature_per_mm: The curvature of all arcs.
        step_mm: The length of a push.
        angles_rad: The angles of rolls.
        apart: At least so many steps lie between two rolls.
        start: What is known of the start.
    """

    points_mm: Array
    depths_mm: Array
    curvature_per_mm: float
    step_mm: float
    angles_rad: tuple[float, ...]
    apart: int
    start: Start

    @property
    def places(self) -> range:
        """The steps after which a roll can be told: one at the entry only if the pose is known."""
        first = 0 if self.start.frame is not None else 1
        return range(first, max(first, math.ceil(self.depths_mm[-1] / self.step_mm)))

    def allows(self, steps: Steps) -> bool:
        """Whether the rolls are far enough apart."""
        return all(b[0] - a[0] >= self.apart for a, b in itertools.pairwise(steps))

    def contains(self, steps: Steps) -> bool:
        """Whether the rolls are at such places, and far enough apart."""
        return all(place in self.places for place, _ in steps) and self.allows(steps)

    def rolls(self, sequences: list[Steps]) -> Rolls:
        """The rolls of sequences that have equally many of them."""
        steps = np.array(sequences, dtype=np.intp).reshape(len(sequences), -1, 2)
        angles: Array = np.array(self.angles_rad or (0.0,), dtype=np.float64)
        depths_mm: Array = steps[:, :, 0] * np.float64(self.step_mm)
        return Rolls(depths_mm, angles[steps[:, :, 1]])


def best_sequences(space: Space, roll_count: int, wanted: int) -> list[Steps]:
    """The sequences with so many rolls that explain the trace best, the best one first.

    None if no such sequence is allowed.
    """
    if roll_count == 0:
        return [()]
    alone = [(place, angle) for place in space.places for angle in range(len(space.angles_rad))]
    if math.comb(len(space.places), roll_count) * len(space.angles_rad) ** roll_count <= (
        MOST_EXHAUSTIVE
    ):
        return _best(space, set(_all(space, roll_count)), wanted)
    beam: list[Steps] = [()]
    for _ in range(roll_count):
        longer = {added for steps in beam for one in alone if (added := _added(space, steps, one))}
        beam = _best(space, longer, max(BEAM, wanted))
    found = set(beam)
    for steps in beam[:_EXCHANGED]:
        found.update(_exchanged(space, steps, alone))
    return _best(space, found, wanted)


def misfits(space: Space, sequences: list[Steps]) -> Array:
    """The sum of squared distances of each sequence at its best start, in mm^2."""
    stride = max(1, math.ceil(len(space.points_mm) / _POINTS))
    measured, depths_mm = space.points_mm[::stride], space.depths_mm[::stride]
    found = []
    for begin in range(0, len(sequences), _CHUNK):
        rolls = space.rolls(sequences[begin : begin + _CHUNK])
        points = chain_points(space.curvature_per_mm, rolls, depths_mm)
        found.append(_aligned_misfits(points, measured, space.start))
    return np.concatenate(found) if found else np.zeros(0)


def _all(space: Space, count: int) -> Iterator[Steps]:
    for places in itertools.combinations(space.places, count):
        for angles in itertools.product(range(len(space.angles_rad)), repeat=count):
            steps = tuple(zip(places, angles, strict=True))
            if space.allows(steps):
                yield steps


def _added(space: Space, steps: Steps, one: tuple[int, int]) -> Steps | None:
    """The sequence with one more roll; None if it is too near to another."""
    added = tuple(sorted((*steps, one)))
    return added if space.allows(added) else None


def _best(space: Space, sequences: set[Steps], wanted: int) -> list[Steps]:
    ordered = sorted(sequences)
    order: NDArray[np.intp] = np.argsort(misfits(space, ordered), kind="stable")
    return [ordered[index] for index in order[:wanted].tolist()]


def _exchanged(space: Space, steps: Steps, alone: list[tuple[int, int]]) -> set[Steps]:
    """The sequence, and those to which exchanges of one roll at a time lead."""
    found = {steps}
    for _ in range(_ROUNDS):
        others = {
            added
            for index in range(len(steps))
            for one in alone
            if (added := _added(space, steps[:index] + steps[index + 1 :], one))
        }
        (best,) = _best(space, others | {steps}, 1)
        if best == steps:
            break
        steps = best
        found.add(steps)
    return found


def _aligned_misfits(points: Array, measured: Array, start: Start) -> Array:
    """Sums of squared distances after the best motion that the start leaves free.

    With both sets about their fixed point, the least sum over all rotations is ``sum |p|^2 + sum
    |q|^2 - 2 (s1 + s2 + d s3)`` with the singular values of ``sum p q^T`` and ``d`` the sign of
    its determinant.
    """
    if start.position_mm is not None and start.frame is not None:
        local = (measured - start.position_mm) @ start.frame
        return np.asarray(np.sum((points - local) ** 2, axis=(1, 2)))
    if start.position_mm is None:
        points = points - points.mean(axis=1, keepdims=True)
        measured = measured - measured.mean(axis=0)
    else:
        measured = measured - start.position_mm
    moments = np.swapaxes(points, 1, 2) @ measured
    singular = np.linalg.svd(moments, compute_uv=False)
    singular[:, 2] *= np.sign(np.linalg.det(moments))
    squares = np.sum(points**2, axis=(1, 2)) + np.sum(measured**2)
    return np.asarray(squares - 2.0 * singular.sum(axis=1))
