"""Whether a task has a plan on exact circles, with slack.

Every sequence of pushes and rolls is tried. It shares no code with the product, and knows spheres,
capsules and boxes along the axes only. A needle starts at the origin, goes along -y and bends
towards -z, in pushes of one length; a path is looked at every tenth of a millimetre.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SPACING_MM = 0.1


@dataclass(frozen=True)
class Ball:
    """A sphere."""

    center: tuple[float, float, float]
    radius: float

    def away(self, points: Array) -> Array:
        """The signed distances of points, whose last axis is that of space."""
        return np.linalg.norm(points - np.array(self.center), axis=-1) - self.radius


@dataclass(frozen=True)
class Rod:
    """A capsule."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float

    def away(self, points: Array) -> Array:
        """The signed distances of points."""
        start, way = np.array(self.start), np.array(self.end) - np.array(self.start)
        along = np.clip((points - start) @ way / (way @ way), 0.0, 1.0)
        return np.linalg.norm(points - start - along[..., None] * way, axis=-1) - self.radius


@dataclass(frozen=True)
class Block:
    """A box along the axes."""

    center: tuple[float, float, float]
    size: tuple[float, float, float]

    def away(self, points: Array) -> Array:
        """The signed distances of points."""
        beyond = np.abs(points - np.array(self.center)) - 0.5 * np.array(self.size)
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
        return np.where((beyond > 0.0).any(axis=-1), outside, beyond.max(axis=-1))


Solid = Ball | Rod | Block


@dataclass(frozen=True)
class Steering:
    """A task.

    Attributes:
        radius: The radius of the motion circle; all lengths are in mm.
        push: The length of a push.
        length: The length of the needle.
        angles: The rolls, in degrees.
        most_rolls: How many of them there may be.
        between: The pushes between two of them, at least.
        target: What is to be reached at the end of a push.
        avoided: What must not be touched.
        spins: The parts of the way in which the needle may spin; the curvature is less by them. The
            part may change at a roll, and where there may be a roll, in its place.
    """

    radius: float
    push: float
    length: float
    angles: tuple[int, ...]
    most_rolls: int
    between: int
    target: Ball
    avoided: tuple[Solid, ...]
    spins: tuple[float, ...] = ()


def has_plan(task: Steering, slack_mm: float) -> bool:
    """Whether some plan keeps this much away from everything, and ends this deep in the target.

    With a negative slack, plans may enter regions and miss the target by as much.
    """
    return _Search(task, slack_mm).found()


@dataclass
class _Search:
    task: Steering
    slack_mm: float

    def found(self) -> bool:
        position, heading = np.zeros((1, 3)), np.array([[0.0, -1.0, 0.0]])
        inward = np.array([[0.0, 0.0, -1.0]])
        most = int(self.task.length / self.task.push + 1e-9)
        spins = (0.0, *self.task.spins)
        starts = {spin: [(position, heading, inward, np.array([most]))] for spin in spins}
        if not self.is_free(position[:, None, :]).all():
            return False
        for rolls in range(self.task.most_rolls + 1):
            ends: dict[float, list[Any]] = {spin: [] for spin in spins}
            for spin, some in starts.items():
                for start in some:
                    # Before the first push a roll may come at once.
                    if self.follow(*start, ends[spin], spin, is_entry=rolls == 0):
                        return True
            everywhere = [end for some in ends.values() for end in some]
            rolled = [self.rolled(everywhere, one) for one in self.task.angles if everywhere]
            kept = {spin: self.rolled(some, 0) for spin, some in ends.items() if some}
            starts = {
                spin: [*rolled, *(some for other, some in kept.items() if other != spin)]
                for spin in spins
            }
        return False

    def follow(
        self,
        position: Array,
        heading: Array,
        inward: Array,
        left: NDArray[np.int64],
        ends: list[Any],
        spin: float,
        *,
        is_entry: bool,
    ) -> bool:
        """Pushes all needles on, each on its circle; adds to `ends` where they may roll.

        Returns:
            Whether one of them arrives.
        """
        task = self.task
        radius = task.radius / (1.0 - spin)
        if is_entry:
            ends.append((position, heading, inward, left))
        center = position + radius * inward
        fine = max(1, math.ceil(task.push / SPACING_MM))
        low = task.target.center[1] - task.target.radius + self.slack_mm
        alive = np.arange(len(position))
        for number in range(1, int(left.max(initial=0)) + 1):
            alive = alive[left[alive] >= number]
            turns = (number - 1 + np.arange(1, fine + 1) / fine) * task.push / radius
            points = center[alive, None, :] + radius * (
                np.sin(turns)[None, :, None] * heading[alive, None, :]
                - np.cos(turns)[None, :, None] * inward[alive, None, :]
            )
            is_free = self.is_free(points).all(axis=1)
            alive, points = alive[is_free], points[is_free]
            tips = points[:, -1]
            if (task.target.away(tips) <= -self.slack_mm).any():
                return True
            is_above = tips[:, 1] >= low
            alive, tips = alive[is_above], tips[is_above]
            if not len(alive):
                return False
            turn = float(turns[-1])
            ahead = math.cos(turn) * heading[alive] + math.sin(turn) * inward[alive]
            across = math.cos(turn) * inward[alive] - math.sin(turn) * heading[alive]
            if is_entry or number >= task.between:
                ends.append((tips, ahead, across, left[alive] - number))
        return False

    def is_free(self, points: Array) -> NDArray[np.bool_]:
        free = np.ones(points.shape[:-1], dtype=bool)
        for solid in self.task.avoided:
            free &= solid.away(points) > self.slack_mm
        return free

    def rolled(self, ends: Sequence[Any], angle: int) -> Any:  # noqa: ANN401
        position, heading, inward, left = (
            np.concatenate(parts) for parts in zip(*ends, strict=True)
        )
        cosine, sine = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        return position, heading, cosine * inward + sine * np.cross(heading, inward), left
