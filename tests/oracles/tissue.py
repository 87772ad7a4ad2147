"""Tissues that answer, simulated without the model: arcs in floating point.

It shares nothing with the product but the tree of decisions as JSON and the shapes: its motion is
an integration along circles of its own. Many tissues are followed at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ntagen.scene import Pose, Scene, Vector

Array = NDArray[np.float64]

SPACING_MM = 0.2
"""The path is sampled at points so far apart."""

SEEN_AFTER_MM = 10.0
"""After this much of a segment, or its shortest branch, the driver tells the branches apart."""

AHEAD_MM = 20.0
"""A heading that is off by 1 rad counts as much as a position that is off by this."""


@dataclass
class Poses:
    """Poses of many needles: positions, headings, bevels, each of shape (n, 3)."""

    position: Array
    heading: Array
    bevel: Array

    def rolled(self, angle: Array) -> Poses:
        """After a roll about the headings, right-handed."""
        side = np.cross(self.heading, self.bevel)
        turned = np.cos(angle)[:, None] * self.bevel + np.sin(angle)[:, None] * side
        return Poses(self.position, self.heading, turned)

    def pushed(self, curvature: Array, length_mm: float) -> Poses:
        """After a push on circles that lie on the side away from the bevels."""
        angle = (curvature * length_mm)[:, None]
        ahead = np.sin(angle) / curvature[:, None]
        aside = (1.0 - np.cos(angle)) / curvature[:, None]
        return Poses(
            self.position + ahead * self.heading - aside * self.bevel,
            np.cos(angle) * self.heading - np.sin(angle) * self.bevel,
            np.cos(angle) * self.bevel + np.sin(angle) * self.heading,
        )

    def of(self, which: NDArray[np.intp]) -> Poses:
        """Some of them."""
        return Poses(self.position[which], self.heading[which], self.bevel[which])


Picks = Callable[[int, bool], tuple[Array, Array]]
"""Picks of so many tissues in a segment: factors and roll errors; whether rolls may err."""


@dataclass
class Outcome:
    """What became of each tissue: least distance to what must not be touched, depth at the end."""

    clearance_mm: Array
    depth_mm: Array
    branches: list[int] = field(default_factory=list)

    def safe(self, tip_mm: float) -> NDArray[np.bool_]:
        """Those in which nothing is touched and the target is reached if the tip is so far off."""
        slack = 1e-6
        return (self.clearance_mm >= tip_mm - slack) & (self.depth_mm >= tip_mm - slack)


def simulate_pushes(
    tree: Mapping[str, Any], scene: Scene, count: int, random: np.random.Generator
) -> Outcome:
    """Lets so many tissues pick a corner or the middle anew at each push.

    The driver tells branches apart by the mean of the first pushes, and follows the nearest one.
    """
    push_mm = scene.needle.speed_mm_per_s * scene.limits.step_s
    tissue = scene.tissue
    outcome = Outcome(np.full(count, math.inf), np.full(count, -math.inf))

    def follow(
        segment: Mapping[str, Any], which: NDArray[np.intp], poses: Poses, expected: Poses
    ) -> None:
        branches = segment["branches"]
        errs = any(branch["roll_error_rad"] != 0.0 for branch in branches)
        errors = random.choice(tissue.roll_errors_rad if errs else (0.0,), len(which))
        pushes = round(max(branch["length_mm"] for branch in branches) / push_mm)
        factors = random.choice(tissue.factors, (pushes, len(which)))
        bends = factors / scene.needle.radius_mm
        rolled = poses.rolled(segment["roll_rad"] + errors)
        shortest_mm = min(branch["length_mm"] for branch in branches)
        seen = round(min(SEEN_AFTER_MM, shortest_mm) / push_mm)
        seen_poses = _pushed_one_by_one(rolled, bends[:seen], push_mm)[-1]
        starts = []
        for branch in branches:
            begin = expected.rolled(np.array([segment["roll_rad"] + branch["roll_error_rad"]]))
            starts.append((begin, np.array([branch["factor"] / scene.needle.radius_mm])))
        there = [begin.pushed(bend, seen * push_mm) for begin, bend in starts]
        chosen = np.argmin(np.stack([_apart(seen_poses, one) for one in there]), axis=0)
        for number, branch in enumerate(branches):
            some = np.flatnonzero(chosen == number)
            if not len(some):
                continue
            length_mm = branch["length_mm"]
            own = bends[: round(length_mm / push_mm), some]
            passed = _pushed_one_by_one(rolled.of(some), own, push_mm)
            for begin, bend in zip(passed, own, strict=False):
                _touch(begin, bend, push_mm, scene, outcome, which[some])
            if branch["then"] is None:
                depth = -scene.targets[-1].shape.distance_mm(passed[-1].position)
                outcome.depth_mm[which[some]] = depth
                continue
            begin, bend = starts[number]
            follow(branch["then"], which[some], passed[-1], begin.pushed(bend, length_mm))

    tip = scene.needle.tip
    start = Poses(*(np.tile(np.array(part), (count, 1)) for part in _frame(tip)))
    expected = Poses(*(np.array(part)[None, :] for part in _frame(tip)))
    follow(tree, np.arange(count), start, expected)
    return outcome


def _pushed_one_by_one(poses: Poses, bends: Array, push_mm: float) -> list[Poses]:
    """The poses before and after each push; `bends` has a row of curvatures for each."""
    passed = [poses]
    for bend in bends:
        passed.append(passed[-1].pushed(bend, push_mm))
    return passed


def _apart(poses: Poses, there: Poses) -> Array:
    """How far poses are from another one: a length that counts directions too."""
    return np.asarray(
        np.linalg.norm(poses.position - there.position, axis=1)
        + AHEAD_MM * np.linalg.norm(poses.heading - there.heading, axis=1)
        + AHEAD_MM * np.linalg.norm(poses.bevel - there.bevel, axis=1)
    )


def simulate(tree: Mapping[str, Any], scene: Scene, count: int, picks: Picks) -> Outcome:
    """Lets so many tissues pick, and follows in each segment the branch that is nearest."""
    outcome = Outcome(np.full(count, math.inf), np.full(count, -math.inf))
    tip = scene.needle.tip
    start = Poses(*(np.tile(np.array(part), (count, 1)) for part in _frame(tip)))
    expected = Poses(*(np.array(part)[None, :] for part in _frame(tip)))
    _follow(tree, scene, picks, outcome, np.arange(count), start, expected, 0.0)
    return outcome


def _frame(tip: Pose) -> tuple[Vector, Vector, Vector]:
    return tip.position_mm, tip.heading, tip.bevel


def _follow(
    segment: Mapping[str, Any],
    scene: Scene,
    picks: Picks,
    outcome: Outcome,
    which: NDArray[np.intp],
    poses: Poses,
    expected: Poses,
    inserted_mm: float,
) -> None:
    branches = segment["branches"]
    errs = any(branch["roll_error_rad"] != 0.0 for branch in branches)
    factors, errors = picks(len(which), errs)
    curvature = factors / scene.needle.radius_mm
    rolled = poses.rolled(segment["roll_rad"] + errors)
    seen_mm = min(SEEN_AFTER_MM, *(branch["length_mm"] for branch in branches))
    seen = rolled.pushed(curvature, seen_mm)
    costs, starts = [], []
    for branch in branches:
        begin = expected.rolled(np.array([segment["roll_rad"] + branch["roll_error_rad"]]))
        bend = np.array([branch["factor"] / scene.needle.radius_mm])
        starts.append((begin, bend))
        costs.append(_apart(seen, begin.pushed(bend, seen_mm)))
    chosen = np.argmin(np.stack(costs), axis=0)
    for number, branch in enumerate(branches):
        some = np.flatnonzero(chosen == number)
        if not len(some):
            continue
        own, bend = rolled.of(some), curvature[some]
        length_mm = branch["length_mm"]
        _touch(own, bend, length_mm, scene, outcome, which[some])
        end = own.pushed(bend, length_mm)
        begin, expected_bend = starts[number]
        if branch["then"] is None:
            depth = -scene.targets[-1].shape.distance_mm(end.position)
            outcome.depth_mm[which[some]] = depth
            outcome.branches.append(number)
            continue
        after = begin.pushed(expected_bend, length_mm)
        deeper_mm = inserted_mm + length_mm
        _follow(branch["then"], scene, picks, outcome, which[some], end, after, deeper_mm)


def _touch(
    poses: Poses,
    curvature: Array,
    length_mm: float,
    scene: Scene,
    outcome: Outcome,
    which: NDArray[np.intp],
) -> None:
    """The least distances on a stretch, on the safe side."""
    count = max(1, math.ceil(length_mm / SPACING_MM))
    steps = [poses.pushed(curvature, length_mm * i / count).position for i in range(count + 1)]
    points = np.concatenate(steps)
    for region in scene.avoided:
        near = region.shape.distance_mm(points).reshape(count + 1, -1).min(axis=0)
        outcome.clearance_mm[which] = np.minimum(outcome.clearance_mm[which], near)


def corners(scene: Scene, random: np.random.Generator) -> Picks:
    """Tissues that pick corners or the middle, at random."""
    tissue = scene.tissue

    def picks(count: int, errs: bool) -> tuple[Array, Array]:
        errors = random.choice(tissue.roll_errors_rad if errs else (0.0,), count)
        return random.choice(tissue.factors, count), errors

    return picks


def between(scene: Scene, random: np.random.Generator) -> Picks:
    """Tissues that pick any value within the bounds, at random."""
    x, y = scene.tissue.curvature_ratio, scene.tissue.roll_rad

    def picks(count: int, errs: bool) -> tuple[Array, Array]:
        errors = random.uniform(-y, y, count) if errs else np.zeros(count)
        return random.uniform(1.0 - x, 1.0 + x, count), errors

    return picks


def worst(tree: Mapping[str, Any], scene: Scene, count: int) -> Array:
    """The least margins over all tissues that pick corners or the middle: the worst so many."""
    margins: list[float] = []
    tip = scene.needle.tip
    start = Poses(*(np.array(part)[None, :] for part in _frame(tip)))

    def follow(segment: Mapping[str, Any], poses: Poses, so_far_mm: float) -> None:
        for branch in segment["branches"]:
            begin = poses.rolled(np.array([segment["roll_rad"] + branch["roll_error_rad"]]))
            bend = np.array([branch["factor"] / scene.needle.radius_mm])
            outcome = Outcome(np.array([so_far_mm]), np.zeros(1))
            _touch(begin, bend, branch["length_mm"], scene, outcome, np.arange(1))
            end = begin.pushed(bend, branch["length_mm"])
            least_mm = float(outcome.clearance_mm[0])
            if branch["then"] is None:
                depth_mm = -float(scene.targets[-1].shape.distance_mm(end.position)[0])
                margins.append(min(least_mm, depth_mm))
            else:
                follow(branch["then"], end, least_mm)

    follow(tree, start, math.inf)
    return np.sort(np.array(margins))[:count]
