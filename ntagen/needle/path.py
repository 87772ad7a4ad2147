"""The path that the needle has cut into the tissue: arcs, and the rolls between them.

The shaft lies in the path. A push adds to its end, a pull takes the tip back along it, and a roll
turns the shaft. A pull does not undo a roll: the shaft keeps its angle. So when the tip comes back
to a place, its bevel differs from the first time by the rolls that were made beyond that place
(`Path.pull`). To go on in the old channel, the driver rolls back (`ntagen.drive.controller`).

A path is an immutable value; every operation gives a new one. Lengths along it are insertion depths
in mm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ntagen.needle.kinematics import Arc, Nearest, circle_center, roll
from ntagen.needle.vectors import distance
from ntagen.scene import Pose, Vector
from ntagen.values import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    _Array = NDArray[np.float64]

_MANY = 8
"""For fewer points, one after the other is faster."""

_NOTHING_MM = 1e-12
"""Arcs shorter than this are rounding errors of sums of lengths."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """One arc of a path, and the roll before it.

    Attributes:
        arc: The arc.
        roll_before_rad: The roll just before it, at the end of the arc before (or at the entry).
    """

    arc: Arc
    roll_before_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Path:
    """The pierced path and the pose of the tip at its end.

    Attributes:
        entry: The pose at depth 0, before any roll.
        stretches: The arcs in the order in which they were cut.
        pending_roll_rad: Rolls made at the end of the path since the last push.
    """

    entry: Pose
    stretches: tuple[Stretch, ...] = ()
    pending_roll_rad: float = 0.0

    @property
    def depth_mm(self) -> float:
        """The inserted length of the needle."""
        return sum(stretch.arc.length_mm for stretch in self.stretches)

    @property
    def tip(self) -> Pose:
        """The pose of the tip."""
        end = self.stretches[-1].arc.end if self.stretches else self.entry
        return roll(end, self.pending_roll_rad) if self.pending_roll_rad else end

    @property
    def arcs(self) -> tuple[Arc, ...]:
        """The arcs without the rolls between them."""
        return tuple(stretch.arc for stretch in self.stretches)

    def push(self, radius_mm: float, length_mm: float) -> Path:
        """The path after a push; a push on the same circle lengthens the last arc."""
        if length_mm <= 0.0:
            return self
        last = self.stretches[-1] if self.stretches else None
        if last and last.arc.radius_mm == radius_mm and self.pending_roll_rad == 0.0:
            longer = Arc(last.arc.start, radius_mm, last.arc.length_mm + length_mm)
            whole = Stretch(longer, last.roll_before_rad)
            return Path(self.entry, (*self.stretches[:-1], whole))
        added = Stretch(Arc(self.tip, radius_mm, length_mm), self.pending_roll_rad)
        return Path(self.entry, (*self.stretches, added))

    def roll(self, angle_rad: float) -> Path:
        """The path after a roll at its end."""
        return replace(self, pending_roll_rad=self.pending_roll_rad + angle_rad)

    def pull(self, length_mm: float) -> Path:
        """The path after the tip went back along it; a pull beyond the entry ends at the entry."""
        kept, pending_rad, left_mm = list(self.stretches), self.pending_roll_rad, length_mm
        while kept and left_mm > 0.0:
            last = kept.pop()
            rest_mm = last.arc.length_mm - left_mm
            left_mm -= last.arc.length_mm
            if rest_mm > _NOTHING_MM:
                kept.append(replace(last, arc=last.arc.upto(rest_mm)))
                break
            # The roll before this arc stays in the shaft, although the tip has left its place.
            pending_rad += last.roll_before_rad
        return Path(self.entry, tuple(kept), pending_rad)

    def nearest_to(self, point_mm: Vector) -> Nearest:
        """The smallest distance of the path to a point, and the depth of the nearest place."""
        return nearest_on(self.arcs, self.entry.position_mm, point_mm)


def nearest_on(arcs: tuple[Arc, ...], entry_mm: Vector, point_mm: Vector) -> Nearest:
    """The smallest distance of a chain of arcs to a point; without arcs that of the entry."""
    best = Nearest(distance(entry_mm, point_mm), 0.0)
    start_mm = 0.0
    for arc in arcs:
        nearest = arc.nearest_to(point_mm)
        if nearest.distance_mm < best.distance_mm:
            best = Nearest(nearest.distance_mm, start_mm + nearest.at_mm)
        start_mm += arc.length_mm
    return best


def nearest_on_all(
    arcs: tuple[Arc, ...], entry_mm: Vector, points_mm: Sequence[Vector]
) -> list[Nearest]:
    """`nearest_on` for each of many points, by one computation for all of them."""
    if len(points_mm) < _MANY:
        return [nearest_on(arcs, entry_mm, point_mm) for point_mm in points_mm]
    import numpy as np

    points = np.array(points_mm)
    best_mm = np.linalg.norm(points - np.array(entry_mm), axis=1)
    best_at_mm = np.zeros(len(points))
    start_mm = 0.0
    for arc in arcs:
        for distance_mm, at_mm in _near_places(arc, points):
            is_nearer = distance_mm < best_mm
            best_mm = np.where(is_nearer, distance_mm, best_mm)
            best_at_mm = np.where(is_nearer, start_mm + at_mm, best_at_mm)
        start_mm += arc.length_mm
    return [Nearest(float(d), float(a)) for d, a in zip(best_mm, best_at_mm, strict=True)]


def _near_places(arc: Arc, points: _Array) -> Iterator[tuple[_Array, _Array]]:
    """The places of an arc of which one is nearest: both ends, and the foot if it is on the arc.

    Yields:
        The distance from each point, and the arc length; see `Arc.nearest_to`.
    """
    import numpy as np

    ends = ((arc.start, 0.0), (arc.end, arc.length_mm))
    for pose, at_mm in ends:
        away_mm = np.linalg.norm(points - np.array(pose.position_mm), axis=1)
        yield away_mm, np.full(len(points), at_mm)
    start, heading, bevel = (
        np.array(vector) for vector in (arc.start.position_mm, arc.start.heading, arc.start.bevel)
    )
    if math.isinf(arc.radius_mm):
        foot_mm = (points - start) @ heading
        places = start + np.outer(foot_mm, heading)
        is_on = (foot_mm >= 0.0) & (foot_mm < arc.length_mm)
    else:
        center = np.array(circle_center(arc.start, arc.radius_mm))
        from_center = points - center
        turn_rad = np.arctan2(from_center @ heading, from_center @ bevel) % (2.0 * math.pi)
        foot_mm = turn_rad * arc.radius_mm
        aside = np.outer(np.cos(turn_rad), bevel) + np.outer(np.sin(turn_rad), heading)
        places = center + arc.radius_mm * aside
        is_on = foot_mm < arc.length_mm
    away_mm = np.linalg.norm(points - places, axis=1)
    yield np.where(is_on, away_mm, math.inf), foot_mm


def sample_poses(arcs: tuple[Arc, ...], spacing_mm: float) -> list[Pose]:
    """Poses along a chain of arcs, at most `spacing_mm` apart, with both ends of every arc."""
    poses: list[Pose] = []
    for arc in arcs:
        count = max(1, round(arc.length_mm / spacing_mm + 0.5))
        poses += [arc.pose_at(arc.length_mm * i / count) for i in range(count + 1)]
    return poses
