"""The branches of a strategy against a tissue that answers, one after the other, as paths.

Where a branch leads follows from the needle's pose and from what the tissue picks, in exact
kinematics.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ntagen.needle.kinematics import Arc, orthonormal, roll
from ntagen.needle.path import sample_poses
from ntagen.plan.closed_loop import Branch, Segment
from ntagen.scene import Pose, Scene

_SPACING_MM = 0.25


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
