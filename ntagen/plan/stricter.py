"""Scenes that ask for more: what a plan of them has, it has in the original scene too.

The engine answers yes or no. So whoever wants a better plan asks for a plan of a stricter scene:
with larger regions, a smaller target, a shorter needle or fewer rolls.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from ntagen.scene import Scene

BETWEEN_STEPS_MM: Final = 0.3
"""A path can be this much nearer to a ball between two steps of 2 mm than at their ends."""

_LEAST_TARGET_MM: Final = 0.05
"""No target is asked for that is smaller than this."""


def shorter(scene: Scene, length_mm: float) -> Scene:
    """The scene with plans of at most this length."""
    shortest_mm = min(scene.needle.length_mm, length_mm)
    return replace(scene, needle=replace(scene.needle, length_mm=shortest_mm))


def wider(scene: Scene, by_mm: float) -> Scene:
    """The scene whose plans stay this far from critical regions; farther, if `by_mm` is less."""
    return replace(scene, criticals=tuple(region.grown(by_mm) for region in scene.criticals))


def deeper(scene: Scene, depth_mm: float) -> Scene:
    """The scene whose plans end this deep in the last target, or half as deep as it is."""
    *before, last = scene.targets
    most_mm = last.shape.depth_mm
    return scene.with_targets([*before, last.grown(-min(0.5 * most_mm, max(0.0, depth_mm)))])


def near_center(scene: Scene, away_mm: float) -> Scene:
    """The scene whose plans end at most this far from the centre of the last target, a ball."""
    *before, last = scene.targets
    shrunk_mm = max(0.0, last.shape.depth_mm - max(away_mm, _LEAST_TARGET_MM))
    return scene.with_targets([*before, last.grown(-shrunk_mm)])


def stricter(scene: Scene, by_mm: float, shells_mm: float, depth_mm: float) -> Scene:
    """The scene with larger critical regions, and shells and target that plans do not graze.

    Args:
        scene: The scene.
        by_mm: By how much the critical regions are larger.
        shells_mm: By how much the other regions to avoid are larger.
        depth_mm: How deep a plan must lead into the last target.
    """
    return replace(
        wider(deeper(scene, depth_mm + BETWEEN_STEPS_MM), by_mm),
        detections=tuple(region.grown(shells_mm) for region in scene.detections),
        unexplored=tuple(region.grown(shells_mm) for region in scene.unexplored),
    )
