"""Brute force: is there a strategy against a tissue that picks corners or the middle?

Exact kinematics in floating point, no model, no order, no pruning but the first failure: all
decisions are tried against all answers. For tiny tasks only.
"""

from __future__ import annotations

import numpy as np

from ntagen.scene import Scene
from tests.oracles.tissue import Poses

_SPACING_MM = 0.05


def has_strategy(scene: Scene, margin_mm: float) -> bool:
    """Whether the controller wins if regions are larger, and the target smaller, by a margin."""
    tip = scene.needle.tip
    parts = (tip.position_mm, tip.heading, tip.bevel)
    pose = Poses(*(np.array(part)[None, :] for part in parts))
    starts = [(pose, 0)]
    if scene.limits.max_rolls > 0:
        starts += [(_rolled(pose, angle), 1) for angle in scene.limits.roll_angles_rad]
    return any(_wins_all(scene, start, rolls, 0.0, margin_mm) for start, rolls in starts)


def _rolled(pose: Poses, angle_rad: float) -> Poses:
    return pose.rolled(np.array([angle_rad]))


def _wins_all(scene: Scene, pose: Poses, rolls: int, depth_mm: float, margin_mm: float) -> bool:
    """Whether there is a win after every pick of the tissue."""
    tissue = scene.tissue
    errors = tissue.roll_errors_rad if rolls > 0 else (0.0,)
    return all(
        _wins(scene, _rolled(pose, error), factor, rolls, depth_mm, margin_mm)
        for factor in tissue.factors
        for error in errors
    )


def _wins(
    scene: Scene, start: Poses, factor: float, rolls: int, depth_mm: float, margin_mm: float
) -> bool:
    """Whether one of the decisions in a segment wins."""
    curvature = np.array([factor / scene.needle.radius_mm])
    push_mm = scene.needle.speed_mm_per_s * scene.limits.step_s
    target, limits = scene.targets[0].shape, scene.limits
    axis = np.array(scene.axis)
    lowest_mm = float(np.array(target.center_mm) @ axis) + target.depth_mm - margin_mm
    at_mm = 0.0
    while depth_mm + at_mm + push_mm <= scene.needle.length_mm:
        ways = np.arange(at_mm, at_mm + push_mm + 1e-9, _SPACING_MM)
        points = np.concatenate([start.pushed(curvature, way).position for way in ways])
        at_mm += push_mm
        pose = start.pushed(curvature, at_mm)
        if any(one.shape.distance_mm(points).min() <= margin_mm for one in scene.avoided):
            return False
        if target.distance_mm(pose.position)[0] <= -margin_mm:
            return True
        if pose.heading[0] @ axis < 0.0 or pose.position[0] @ axis > lowest_mm:
            return False
        if rolls < limits.max_rolls and any(
            _wins_all(scene, _rolled(pose, angle), rolls + 1, depth_mm + at_mm, margin_mm)
            for angle in limits.roll_angles_rad
        ):
            return True
    return False
