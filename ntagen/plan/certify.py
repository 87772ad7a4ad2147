"""The certificate of a plan: its distances to every region along the whole continuous path.

The model checks regions at the ends of its steps, in integers that lose about 1 % of the arc. A
certificate uses the exact kinematics in double precision over whole arcs: closed forms for spheres,
and subdivision to a micrometre for other shapes (`ntagen.needle.nearest`). So it describes a needle
on exact circles, also between the ends of steps. It shares no code with the engine.

Cost: one closed form for each arc and sphere, about 20 microseconds each; those of many spheres are
computed together, in a tenth of that. Less than a millisecond for each other shape, but for an
ellipsoid, which takes a few.

Where regions move with the breath, the certificate follows the plan in time (`timeline`). A roll
takes no time in the model, and some in truth. The driver then waits until the breath is where the
plan expects it, at most for a period. So a plan counts as resting for a whole period at each roll.
Its times after a roll are those of the model and a period, which is the same place of the breath.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from ntagen.motion import Breath, Motion
from ntagen.needle.kinematics import Arc, Nearest, roll
from ntagen.needle.nearest import enters_at, nearest_to
from ntagen.needle.path import nearest_on_all
from ntagen.needle.vectors import add, distance
from ntagen.plan.actions import Plan, Push, Wait
from ntagen.scene import Needle, Region, RegionKind, Scene, Vector
from ntagen.shapes import Sphere
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.needle.timeline import Timeline

_STILL: Final = Motion(1.0)


@dataclass(frozen=True, slots=True)
class Clearance:
    """The smallest distance of a path to a region.

    Attributes:
        region: The region's name.
        kind: The region's kind.
        distance_mm: The smallest distance to the region's surface; negative inside.
        at_mm: The insertion since the plan's start at which the path is nearest.
    """

    region: str
    kind: RegionKind
    distance_mm: float
    at_mm: float


@dataclass(frozen=True, slots=True)
class Arrival:
    """Where a path enters a target, and how deep it gets.

    Attributes:
        region: The target's name.
        entered_at_mm: Insertion since the plan's start at which the target is entered, in the order
            of the targets; None if it is not.
        depth_mm: The depth in the target: for the last target at the end of the path, for an
            earlier one the greatest depth; negative outside.
    """

    region: str
    entered_at_mm: float | None
    depth_mm: float


@dataclass(frozen=True, slots=True)
class Certificate:
    """The properties of a plan in exact kinematics.

    Attributes:
        clearances: One per critical, detection and unexplored region, in the order of the scene.
        arrivals: One per target, in the order of the scene.
        end_mm: The position of the tip at the end.
        end_distance_mm: The distance from there to the centre of the last target.
        length_mm: Total insertion.
        roll_count: Number of rolls that count; see `Plan.counted_rolls`.
        keeps_gate: Whether all pushes are made while the gate of the breath is open.
        seconds: How long pushes and waits take, where regions move.
    """

    clearances: tuple[Clearance, ...]
    arrivals: tuple[Arrival, ...]
    end_mm: Vector
    end_distance_mm: float
    length_mm: float
    roll_count: int
    keeps_gate: bool = True
    seconds: float = 0.0

    @property
    def critical_clearance_mm(self) -> float:
        """The smallest distance to the surface of any critical region; infinite without one."""
        return self._smallest("critical")

    @property
    def detection_clearance_mm(self) -> float:
        """The smallest distance to the surface of any detection region; infinite without one."""
        return self._smallest("detection")

    @property
    def unexplored_clearance_mm(self) -> float:
        """The smallest distance to the surface of any unexplored region; infinite without one."""
        return self._smallest("unexplored")

    @property
    def target_depth_mm(self) -> float:
        """The least depth that the plan reaches in its targets; negative if it misses one."""
        depths = [a.depth_mm if a.entered_at_mm is not None else -math.inf for a in self.arrivals]
        return min(depths, default=math.inf)

    def holds(
        self, clearance_mm: float = 0.0, depth_mm: float = 0.0, detection_mm: float = 0.0
    ) -> bool:
        """Whether the plan avoids its regions and reaches its targets, with these margins.

        A path that touches a critical, detection or unexplored region does not hold, whatever the
        margin. The model also gives up a path that is in one of them, at its start too; with
        `safety sampled` it does not ask at the end of a path that has reached the last target. A
        certificate asks there too.

        Args:
            clearance_mm: The path is farther than this from every critical region.
            depth_mm: The path's end lies at least this deep in the last target.
            detection_mm: The path is farther than this from every detection region.
        """
        free = self.critical_clearance_mm > clearance_mm
        unfelt = self.detection_clearance_mm > detection_mm
        known = self.unexplored_clearance_mm > 0.0
        return free and unfelt and known and self.keeps_gate and self.target_depth_mm >= depth_mm

    def _smallest(self, kind: RegionKind) -> float:
        return min((c.distance_mm for c in self.clearances if c.kind == kind), default=math.inf)


def certify(plan: Plan, scene: Scene) -> Certificate:
    """The certificate of a plan that starts at the needle's pose in the scene."""
    if scene.breath is not None:
        return _certified_in_time(plan, scene, scene.breath)
    arcs = plan.arcs(scene.needle)
    entry_mm = scene.needle.tip.position_mm
    end_mm = arcs[-1].end.position_mm if arcs else entry_mm
    last = scene.targets[-1] if scene.targets else None
    return Certificate(
        clearances=_clearances(arcs, entry_mm, scene.avoided),
        arrivals=_arrivals(arcs, entry_mm, end_mm, scene.targets),
        end_mm=end_mm,
        end_distance_mm=distance(end_mm, last.center_mm) if last else 0.0,
        length_mm=plan.length_mm,
        roll_count=plan.counted_rolls(scene.limits),
    )


def _certified_in_time(plan: Plan, scene: Scene, breath: Breath) -> Certificate:
    """The certificate where regions may move."""
    needle = scene.needle
    line, keeps_gate = timeline(plan, needle, breath, scene.shaft_mm)
    unmoved = tuple(one for one in scene.avoided if one.motion is None)
    near = iter(_clearances(plan.arcs(needle), needle.tip.position_mm, unmoved))
    clearances = []
    for one in scene.avoided:
        if one.motion is None:
            clearances.append(next(near))
        else:
            found = nearest_in_time(line, one, one.motion)
            clearances.append(Clearance(one.name, one.kind, found.distance_mm, found.at_mm))
    arrivals = arrivals_in_time(line, scene.targets, breath.clock_s)
    return Certificate(
        clearances=tuple(clearances),
        arrivals=tuple(Arrival(one.name, at_mm, -away_mm) for one, at_mm, away_mm in arrivals),
        end_mm=line.end_mm,
        end_distance_mm=(
            distance(line.end_mm, center_at_mm(scene.targets[-1], line.end_s))
            if scene.targets
            else 0.0
        ),
        length_mm=plan.length_mm,
        roll_count=plan.counted_rolls(scene.limits),
        keeps_gate=keeps_gate,
        seconds=plan.length_mm / needle.speed_mm_per_s + plan.waits_s,
    )


def _clearances(
    arcs: tuple[Arc, ...], entry_mm: Vector, regions: tuple[Region, ...]
) -> tuple[Clearance, ...]:
    balls = {
        index: shape
        for index, region in enumerate(regions)
        if isinstance(shape := region.shape, Sphere)
    }
    places = nearest_on_all(arcs, entry_mm, [ball.middle_mm for ball in balls.values()])
    near = dict(zip(balls, places, strict=True))
    return tuple(
        Clearance(
            region.name,
            region.kind,
            near[index].distance_mm - balls[index].radius_mm,
            near[index].at_mm,
        )
        if index in near
        else clearance(arcs, entry_mm, region)
        for index, region in enumerate(regions)
    )


def clearance(arcs: tuple[Arc, ...], entry_mm: Vector, region: Region) -> Clearance:
    """The smallest distance of a chain of arcs to a region; it begins at `entry_mm`."""
    nearest = nearest_to(arcs, entry_mm, region.shape)
    # Wherever a moving region is: no time is given.
    away_mm = nearest.distance_mm - region.moved_mm
    return Clearance(region.name, region.kind, away_mm, nearest.at_mm)


def _arrivals(
    arcs: tuple[Arc, ...], entry_mm: Vector, end_mm: Vector, targets: tuple[Region, ...]
) -> tuple[Arrival, ...]:
    arrivals: list[Arrival] = []
    since_mm: float | None = 0.0
    for target in targets:
        if since_mm is not None:
            since_mm = _entered_at(arcs, entry_mm, target, since_mm)
        if target is targets[-1]:
            away_mm = target.distance_mm(end_mm)
        else:
            away_mm = nearest_to(arcs, entry_mm, target.shape).distance_mm
        arrivals.append(Arrival(target.name, since_mm, -away_mm))
    return tuple(arrivals)


def _entered_at(
    arcs: tuple[Arc, ...], entry_mm: Vector, target: Region, since_mm: float
) -> float | None:
    """The first insertion, not before `since_mm`, at which the tip is in the target."""
    if not arcs:
        return 0.0 if target.distance_mm(entry_mm) <= 0.0 else None
    start_mm = 0.0
    for arc in arcs:
        skipped_mm = max(0.0, since_mm - start_mm)
        if skipped_mm <= arc.length_mm:
            rest = Arc(arc.pose_at(skipped_mm), arc.radius_mm, arc.length_mm - skipped_mm)
            entered_mm = enters_at(rest, target.shape)
            if entered_mm is not None:
                return start_mm + skipped_mm + entered_mm
        start_mm += arc.length_mm
    return None


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
