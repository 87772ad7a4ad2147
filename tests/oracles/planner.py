"""An independent planner: all pushes and rolls that the model's rules allow, by brute force.

It shares nothing with the engine, the generated model or `ntagen.needle`: whole families of paths
are moved at once as arrays, in exact arithmetic where the model has integers. So its plans are not
the model's one by one, but it answers the same question, and fast enough for hundreds of drives.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ntagen.scene import Region, Scene
from ntagen.shapes import Capsule

Array = NDArray[np.float64]
Steps = tuple[tuple[str, float], ...]
"""A plan as ``("push", mm)`` and ``("roll", rad)``."""


@dataclass(frozen=True)
class _Family:
    """Many poses at once, each with the way that led to it."""

    position: Array
    heading: Array
    bevel: Array
    ways: list[Steps]


def plans(scene: Scene, *, samples: int = 1) -> list[Steps]:
    """All plans to the first target, each as pushes of whole model steps and rolls.

    Args:
        scene: The scene; regions to avoid are spheres or capsules, and the target is a sphere.
        samples: At so many places of each step, the path is outside of what it must avoid.
    """
    tip = scene.needle.tip
    family = _Family(
        np.array([tip.position_mm]), np.array([tip.heading]), np.array([tip.bevel]), [()]
    )
    found = _plans_from(family, scene, samples, is_rolled=False)
    if scene.limits.free_bevel:
        start = family.position[:, None], family.heading[:, None], family.bevel[:, None]
        chosen = _rolled(family, *start, np.ones((1, 1), dtype=bool), scene)
        found += _plans_from(chosen, scene, samples, is_rolled=True)
    return found


def _plans_from(family: _Family, scene: Scene, samples: int, *, is_rolled: bool) -> list[Steps]:
    """All plans that begin with a family; the next roll keeps its distance from a roll before."""
    found: list[Steps] = []
    for rolls in range(scene.limits.max_rolls + 1):
        path, headings, bevels = _pushed(family, scene, samples)
        positions = path[:, ::samples]
        headings, bevels = headings[:, ::samples], bevels[:, ::samples]
        pierced = _pierced(path, scene, samples)
        reached, alive = _classified(positions, headings, pierced, scene)
        step_mm = _step_mm(scene)
        for row, column in zip(*np.nonzero(reached), strict=True):
            found.append((*family.ways[row], ("push", float(column * step_mm))))
        if rolls == scene.limits.max_rolls:
            break
        if rolls > 0 or is_rolled:
            least = math.ceil(scene.limits.min_roll_distance_mm / step_mm - 1e-9)
            alive[:, :least] = False
        if not alive.any():
            break
        family = _rolled(family, positions, headings, bevels, alive, scene)
    return found


def _step_mm(scene: Scene) -> float:
    return scene.needle.speed_mm_per_s * scene.limits.step_s


def _pushed(family: _Family, scene: Scene, samples: int) -> tuple[Array, Array, Array]:
    """Positions, headings and bevels of shape (members, pushes * samples, 3)."""
    target = scene.targets[0]
    farthest = np.linalg.norm(family.position - np.array(target.center_mm), axis=1).max()
    count = int((farthest + target.radius_mm) * 2.0 / _step_mm(scene)) + 2
    sample_mm = _step_mm(scene) / samples
    turn = np.arange((count - 1) * samples + 1) * sample_mm / scene.needle.radius_mm
    cosine, sine = np.cos(turn)[None, :, None], np.sin(turn)[None, :, None]
    heading, bevel = family.heading[:, None, :], family.bevel[:, None, :]
    bevels = bevel * cosine + heading * sine
    headings = heading * cosine - bevel * sine
    center = family.position[:, None, :] - scene.needle.radius_mm * bevel
    return center + scene.needle.radius_mm * bevels, headings, bevels


def _pierced(path: Array, scene: Scene, samples: int) -> Array:
    """For each step: whether its end, or a sample since the end before, is in what is avoided."""
    pierced = np.zeros(path.shape[:2], dtype=bool)
    for region in scene.criticals + scene.detections + scene.unexplored:
        pierced |= _inside(path, region)
    steps = pierced[:, 1:].reshape(len(path), -1, samples).any(axis=2)
    return np.concatenate([pierced[:, :1], steps], axis=1)


def _classified(
    positions: Array, headings: Array, pierced: Array, scene: Scene
) -> tuple[Array, Array]:
    """Where a path reaches the target, and where it may go on; nothing counts after an end."""
    axis, target = np.array(scene.axis), scene.targets[0]
    backward = headings @ axis < -1e-12
    inside = _inside(positions, target)
    beyond = positions @ axis > np.dot(target.center_mm, axis) + target.radius_mm
    reached = inside & ~backward
    if scene.safety == "swept":
        reached &= ~pierced
    ended = backward | inside | beyond | pierced
    before = np.cumsum(ended, axis=1) - ended == 0
    return reached & before, ~ended & before


def _inside(positions: Array, region: Region) -> Array:
    if isinstance(region.shape, Capsule):
        return _in_capsule(positions, region.shape)
    offsets = positions - np.array(region.center_mm)
    return np.asarray((offsets * offsets).sum(axis=2) <= region.radius_mm**2)


def _in_capsule(positions: Array, capsule: Capsule) -> Array:
    if capsule.start_radius_mm != capsule.end_radius_mm:
        raise ValueError("a tapered capsule")
    start, end = np.array(capsule.start_mm), np.array(capsule.end_mm)
    share = np.clip((positions - start) @ (end - start) / np.dot(end - start, end - start), 0, 1)
    offsets = positions - start - share[..., None] * (end - start)
    return np.asarray((offsets * offsets).sum(axis=2) <= capsule.start_radius_mm**2)


def _rolled(
    family: _Family,
    positions: Array,
    headings: Array,
    bevels: Array,
    alive: Array,
    scene: Scene,
) -> _Family:
    rows, columns = np.nonzero(alive)
    position, heading, bevel = (a[rows, columns] for a in (positions, headings, bevels))
    side = np.cross(heading, bevel)
    angles = scene.limits.roll_angles_rad
    step_mm = _step_mm(scene)
    turned = [math.cos(angle) * bevel + math.sin(angle) * side for angle in angles]
    ways = [
        (*family.ways[row], ("push", float(column * step_mm)), ("roll", angle))
        for angle in angles
        for row, column in zip(rows, columns, strict=True)
    ]
    return _Family(
        np.concatenate([position] * len(angles)),
        np.concatenate([heading] * len(angles)),
        np.concatenate(turned),
        ways,
    )
