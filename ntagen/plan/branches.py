"""The branches of a strategy against a tissue that answers, as paths, and what holds on them.

Where a branch leads follows from the needle's pose and from what the tissue picks, in exact
kinematics.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.kinematics import Arc, orthonormal, roll
from ntagen.needle.nearest import nearest_to, places_on
from ntagen.needle.path import sample_poses
from ntagen.plan.closed_loop import Branch, Segment
from ntagen.scene import Pose, Scene

_SPACING_MM = 0.25
_DENSE_MM = 0.1
"""For a certificate, distances are computed at points so far apart on a path."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """What the tip travels from a decision to the next, on one branch.

    Attributes:
        numbers: The numbers of the branches from the root to this one: what the tissue picked.
        branch: The branch.
        arc: The arc on which it leads.
    """

    numbers: tuple[int, ...]
    branch: Branch
    arc: Arc


def start_of(pose: Pose, segment: Segment, branch: Branch) -> Pose:
    """The pose after the roll of a segment, as the tissue made it; the roll begins at a pose."""
    return roll(pose, segment.roll_rad + branch.roll_error_rad)


def arc_of(pose: Pose, segment: Segment, branch: Branch, radius_mm: float) -> Arc:
    """The arc of a branch of a segment that begins at a pose.

    Args:
        pose: The pose before the roll of the segment.
        segment: The segment.
        branch: One of its branches.
        radius_mm: The expected radius of the needle's circle.
    """
    start = start_of(pose, segment, branch)
    return Arc(start, radius_mm / branch.factor, branch.length_mm)


def stretches(tree: Segment, scene: Scene) -> Iterator[Stretch]:
    """All stretches of a tree from the needle's pose; each comes after those that lead to it."""
    yield from _below(tree, orthonormal(scene.needle.tip), (), scene.needle.radius_mm)


def _below(
    segment: Segment, pose: Pose, numbers: tuple[int, ...], radius_mm: float
) -> Iterator[Stretch]:
    for number, branch in enumerate(segment.branches):
        stretch = Stretch((*numbers, number), branch, arc_of(pose, segment, branch, radius_mm))
        yield stretch
        if branch.then is not None:
            end = orthonormal(stretch.arc.end)
            yield from _below(branch.then, end, stretch.numbers, radius_mm)


def path_of(tree: Segment, scene: Scene, numbers: tuple[int, ...]) -> tuple[Stretch, ...]:
    """The stretches of one way through a tree.

    Args:
        tree: The tree.
        scene: Its scene.
        numbers: The number of the branch in each segment; the way may end before the target.

    Raises:
        IndexError: There is no such branch.
    """
    found: list[Stretch] = []
    segment: Segment | None = tree
    pose = orthonormal(scene.needle.tip)
    for place, number in enumerate(numbers):
        if segment is None:
            raise IndexError(f"the way through the tree ends after {place} branches")
        branch = segment.branches[number]
        arc = arc_of(pose, segment, branch, scene.needle.radius_mm)
        found.append(Stretch(numbers[: place + 1], branch, arc))
        segment, pose = branch.then, orthonormal(arc.end)
    return tuple(found)


def expected_path(tree: Segment, scene: Scene) -> tuple[Stretch, ...]:
    """The way on which the tissue does what is expected: the middle of all picks."""
    numbers: list[int] = []
    segment: Segment | None = tree
    while segment is not None:
        numbers.append(middle_of(segment))
        segment = segment.branches[numbers[-1]].then
    return path_of(tree, scene, tuple(numbers))


def middle_of(segment: Segment) -> int:
    """The number of the branch on which the tissue does what is expected, or nearly."""

    def off(number: int) -> float:
        branch = segment.branches[number]
        return abs(branch.factor - 1.0) + abs(branch.roll_error_rad)

    return min(range(len(segment.branches)), key=off)


def worst_path(tree: Segment, scene: Scene) -> tuple[Stretch, ...]:
    """The way with the least margin: the distance to what must not be touched, or the depth.

    Distances are taken at points 0.25 mm apart.
    """
    margins: dict[tuple[int, ...], float] = {(): math.inf}
    worst: tuple[int, ...] = ()
    least_mm = math.inf
    for stretch in stretches(tree, scene):
        before_mm = margins[stretch.numbers[:-1]]
        points = np.array([one.position_mm for one in sample_poses((stretch.arc,), _SPACING_MM)])
        near = (float(one.shape.distance_mm(points).min()) for one in scene.avoided)
        margin_mm = margins[stretch.numbers] = min(before_mm, min(near, default=math.inf))
        if stretch.branch.then is None:
            depth_mm = -scene.targets[-1].distance_mm(stretch.arc.end.position_mm)
            if min(margin_mm, depth_mm) < least_mm:
                worst, least_mm = stretch.numbers, min(margin_mm, depth_mm)
    return path_of(tree, scene, worst)


@dataclass(frozen=True, slots=True)
class Reach:
    """What holds on all branches of a tree, in exact kinematics.

    Attributes:
        leaves: The number of branches.
        clearance_mm: The least distance to a region that must not be touched; infinite without one.
        depth_mm: The least depth in the target at the end.
        longest_mm: The length of the longest branch.
        most_rolls: The most rolls on a branch.
    """

    leaves: int
    clearance_mm: float
    depth_mm: float
    longest_mm: float
    most_rolls: int

    def holds(self, tip_mm: float) -> bool:
        """Whether nothing is touched and the target is reached if the tip is off by this much."""
        is_free = self.clearance_mm >= tip_mm and self.clearance_mm > 0.0
        return is_free and self.depth_mm >= tip_mm

    def missing_mm(self, tip_mm: float) -> float:
        """How much is missing on the worst branch so that it holds; 0 if nothing is."""
        return max(0.0, tip_mm - min(self.clearance_mm, self.depth_mm))


def certify_all(tree: Segment, scene: Scene) -> Reach:
    """Follows all branches of a tree from the needle's pose, in exact kinematics."""
    clearance_mm = depth_mm = math.inf
    for stretch in stretches(tree, scene):
        arc = stretch.arc
        points = _points(arc)
        for region in scene.avoided:
            # No point of the path is farther than half the spacing from one of these.
            near_mm = float(region.shape.distance_mm(points).min()) - 0.5 * _DENSE_MM
            if near_mm < clearance_mm:
                nearest = nearest_to((arc,), arc.start.position_mm, region.shape)
                clearance_mm = min(clearance_mm, nearest.distance_mm)
        if stretch.branch.then is None:
            depth_mm = min(depth_mm, -scene.targets[-1].distance_mm(arc.end.position_mm))
    is_free = scene.limits.free_bevel and tree.roll_rad != 0.0
    return Reach(tree.leaves, clearance_mm, depth_mm, tree.longest_mm, tree.most_rolls - is_free)


def _points(arc: Arc) -> NDArray[np.float64]:
    """Points on an arc, at most `_DENSE_MM` apart, with both ends, of shape (n, 3)."""
    count = max(1, math.ceil(arc.length_mm / _DENSE_MM))
    along_mm = np.linspace(0.0, arc.length_mm, count + 1)
    return places_on([arc], np.zeros(count + 1, dtype=np.intp), along_mm)
