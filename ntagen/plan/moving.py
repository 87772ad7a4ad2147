"""A plan in time, for scenes with moving regions: when it pushes and rests, and what comes near.

A roll takes no time in the model, and some in truth. The driver then waits until the breath is
where the plan expects it, at most for a period. So a plan counts as resting for a whole period at
each roll. Its times after a roll are those of the model and a period, which is the same place of
the breath.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ntagen.motion import Breath, Motion
from ntagen.needle.kinematics import Nearest, roll
from ntagen.needle.nearest import nearest_to
from ntagen.needle.vectors import add
from ntagen.plan.actions import Plan, Push, Wait
from ntagen.scene import Needle, Region, Vector

if TYPE_CHECKING:
    from ntagen.needle.timeline import Timeline

_STILL = Motion(1.0)


def timeline(
    plan: Plan, needle: Needle, breath: Breath, shaft_mm: Sequence[Vector] = ()
) -> tuple[Timeline, bool]:
    """The plan on the clock of the breath, and whether it pushes only while the gate is open."""
    # It takes numpy, which still scenes do not need.
    from ntagen.needle.timeline import Timeline

    speed_mm_per_s = needle.speed_mm_per_s
    line = Timeline(needle.tip, needle.radius_mm, speed_mm_per_s, breath.clock_s, shaft_mm)
    keeps_gate, pose = True, needle.tip
    for action in plan.actions:
        if isinstance(action, Push):
            seconds = action.length_mm / speed_mm_per_s
            keeps_gate = keeps_gate and breath.is_open(line.end_s, seconds)
            line.push(pose, action.length_mm, action.radius_mm(needle.radius_mm))
            pose = line.end
        elif isinstance(action, Wait):
            line.rest(action.seconds)
        else:
            line.rest(breath.period_s)
            pose = roll(pose, action.angle_rad)
    return line, keeps_gate


def nearest_in_time(line: Timeline, region: Region, motion: Motion) -> Nearest:
    """How near a moving region comes to the tip; a critical one also to the shaft behind it."""
    if region.kind == "critical":
        return line.shaft_nearest(region.shape, motion)
    return line.tip_nearest(region.shape, motion)


def arrivals_in_time(
    line: Timeline, targets: tuple[Region, ...], clock_s: float
) -> Iterator[tuple[Region, float | None, float]]:
    """For each target, how deep the tip is when it enters it, and how far it is from its surface.

    The entry is None if there is none after that of the target before. The distance is that at the
    end for the last target, and the least one for another.
    """
    since_s: float | None = clock_s
    for target in targets:
        motion = target.motion or _STILL
        if since_s is not None:
            since_s = line.tip_enters(target.shape, motion, since_s)
        if target is targets[-1]:
            away_mm = target.distance_at_mm(line.end_mm, line.end_s)
        elif target.motion is None:
            away_mm = nearest_to(line.arcs, line.end_mm, target.shape).distance_mm
        else:
            away_mm = line.tip_nearest(target.shape, target.motion).distance_mm
        yield target, None if since_s is None else line.depth_mm(since_s), away_mm


def center_at_mm(region: Region, clock_s: float) -> Vector:
    """The middle of a region at a time of the breath."""
    if region.motion is None:
        return region.center_mm
    return add(region.center_mm, region.motion.at_mm(clock_s))
