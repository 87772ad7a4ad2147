"""All plans of a needle that may spin, by brute force on exact circles, one push after the other.

It shares no code with the product. The needle starts at the entry of the scene; regions to avoid
and the only target are spheres, which are asked about at the ends of pushes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ntagen.scene import Region, Scene

Array = NDArray[np.float64]
Action = tuple[str, float, float]
"""A push with its length and its spin, or a roll with its angle."""


@dataclass(frozen=True)
class _State:
    """Where the needle is, and what was done.

    Attributes:
        at: The tip.
        heading: Its direction of travel.
        bevel: The direction away from the bend.
        way: The actions so far, with each step as a push.
        changes: How many rolls and changes of the spin there were.
        since: The pushes since the last one; none before.
        spin: The spin of the pushes since then; none while the next one may choose.
        other: The next push must have another spin than this.
    """

    at: Array
    heading: Array
    bevel: Array
    way: tuple[Action, ...] = ()
    changes: int = 0
    since: int | None = None
    spin: float | None = None
    other: float | None = None


def plans(scene: Scene, slack_mm: float) -> set[tuple[Action, ...]]:
    """All plans that end this deep in the target, and keep this much from what is avoided.

    A negative slack lets them miss by as much. Pushes of one spin in a row are one action.
    """
    tip = scene.needle.tip
    start = _State(*(np.array(one) for one in (tip.position_mm, tip.heading, tip.bevel)))
    return {_joined(way) for way in _search(start, scene, slack_mm)}


def _search(state: _State, scene: Scene, slack_mm: float) -> Iterator[tuple[Action, ...]]:
    target = scene.targets[0]
    if state.way and state.way[-1][0] == "push":
        if _away(state.at, target) <= -slack_mm:
            yield state.way
            return
        lowest = np.dot(target.center_mm, scene.axis) + target.radius_mm - slack_mm
        if state.at @ np.array(scene.axis) > lowest or state.heading @ np.array(scene.axis) < 0.0:
            return
    if any(_away(state.at, region) <= slack_mm for region in scene.avoided):
        return
    for after in (*_pushes(state, scene), *_rolls(state, scene)):
        yield from _search(after, scene, slack_mm)


def _pushes(state: _State, scene: Scene) -> Iterator[_State]:
    step_mm = scene.needle.speed_mm_per_s * scene.limits.step_s
    for spin in (0.0, *scene.limits.spins):
        if spin == state.other or (state.spin is not None and spin != state.spin):
            continue
        radius = scene.needle.radius_mm / (1.0 - spin)
        turn = step_mm / radius
        heading = math.cos(turn) * state.heading - math.sin(turn) * state.bevel
        bevel = math.cos(turn) * state.bevel + math.sin(turn) * state.heading
        yield replace(
            state,
            at=state.at - radius * state.bevel + radius * bevel,
            heading=heading,
            bevel=bevel,
            way=(*state.way, ("push", step_mm, spin)),
            since=None if state.since is None else state.since + 1,
            spin=spin,
            other=None,
        )


def _rolls(state: _State, scene: Scene) -> Iterator[_State]:
    limits = scene.limits
    step_mm = scene.needle.speed_mm_per_s * limits.step_s
    is_near = state.since is not None and state.since * step_mm < limits.min_roll_distance_mm - 1e-9
    if state.changes >= limits.max_rolls or is_near or state.other is not None:
        return
    rolled = replace(state, changes=state.changes + 1, since=0, spin=None)
    for angle in limits.roll_angles_rad:
        side = np.cross(state.heading, state.bevel)
        bevel = math.cos(angle) * state.bevel + math.sin(angle) * side
        yield replace(rolled, bevel=bevel, way=(*state.way, ("roll", angle, 0.0)))
    if state.spin is not None and limits.spins:
        yield replace(rolled, other=state.spin)


def _away(at: Array, region: Region) -> float:
    return float(np.linalg.norm(at - np.array(region.center_mm))) - region.radius_mm


def _joined(way: tuple[Action, ...]) -> tuple[Action, ...]:
    joined: list[Action] = []
    for kind, value, spin in way:
        if joined and kind == "push" == joined[-1][0] and joined[-1][2] == spin:
            joined[-1] = (kind, joined[-1][1] + value, spin)
        else:
            joined.append((kind, value, spin))
    return tuple(joined)
