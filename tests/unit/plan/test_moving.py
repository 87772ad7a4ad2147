"""Certificates where regions move: against dense samples of time and of the needle."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ntagen.motion import Breath, Gate, Motion
from ntagen.needle.kinematics import Arc
from ntagen.plan.actions import Plan, Push, Roll, Wait
from ntagen.plan.certify import certify
from ntagen.plan.document import plan_from_json, plan_to_json
from ntagen.scene import Region, RegionKind, Scene, Vector
from ntagen.shapes import Box, Capsule, Ellipsoid, Shape, Sphere
from tests.scenes import PAPER

Array = NDArray[np.float64]

PERIOD_S = 4.0
STEP_S = 0.01
BOUND_MM = 0.2
"""Samples that are this dense in time and place may miss the nearest by so much."""

PLANS = {
    "straight on": Plan.of([Push(30.0)]),
    "waits": Plan.of([Wait(0.7), Push(11.3), Wait(2.5), Push(9.0)]),
    "rolls": Plan.of(
        [Push(8.0), Roll(math.pi), Wait(1.1), Push(17.0), Roll(0.5 * math.pi), Push(3.0)]
    ),
    "only waits": Plan.of([Wait(1.3)]),
}
MOTIONS = {
    "sinusoid": Motion(PERIOD_S, (4.0, -3.0, 8.0), 0.6),
    "table": Motion(
        PERIOD_S, table=((0.5, (0.0, 0.0, 0.0)), (1.5, (5.0, 2.0, -6.0)), (3.0, (1.0, 0.0, 0.0)))
    ),
}
SHAPES: dict[str, Shape] = {
    "sphere": Sphere((-6.0, -14.0, -4.0), 2.0),
    "box": Box((5.0, -12.0, -8.0), (3.0, 4.0, 5.0)),
    "capsule": Capsule((-9.0, -16.0, 4.0), (-3.0, -20.0, -9.0), 1.5, 1.0),
    "ellipsoid": Ellipsoid((4.0, -16.0, 1.0), (2.0, 3.0, 1.5)),
}


def displaced(motion: Motion, time_s: float) -> Array:
    """Where a region is, written afresh."""
    phase = time_s % motion.period_s
    if not motion.table:
        turn = 2.0 * math.pi * phase / motion.period_s + motion.phase_rad
        return np.array(motion.way_mm) * (1.0 - math.cos(turn)) / 2.0
    rows = [(time_s + shift, place) for shift in (-4.0, 0.0, 4.0) for time_s, place in motion.table]
    for (before, one), (after, other) in itertools.pairwise(rows):
        if before <= phase <= after:
            share = (phase - before) / (after - before)
            return np.array(one) + share * (np.array(other) - np.array(one))
    raise AssertionError(phase)


def sampled(plan: Plan, scene: Scene) -> tuple[Array, Array]:
    """Times and places of the tip: each action in small steps, by rotations of its frame."""
    tip, radius = scene.needle.tip, scene.needle.radius_mm
    assert scene.breath is not None
    place, heading, bevel = map(np.array, (tip.position_mm, tip.heading, tip.bevel))
    time_s = scene.breath.clock_s
    times, places = [time_s], [place]
    for action in plan.actions:
        seconds = PERIOD_S
        if isinstance(action, Push):
            seconds = action.length_mm / scene.needle.speed_mm_per_s
        elif isinstance(action, Wait):
            seconds = action.seconds
        center, first_bevel, first_heading = place - radius * bevel, bevel, heading
        for part in np.linspace(0.0, 1.0, max(2, round(seconds / STEP_S) + 1))[1:]:
            if isinstance(action, Push):
                angle = part * action.length_mm / radius
                bevel = math.cos(angle) * first_bevel + math.sin(angle) * first_heading
                heading = math.cos(angle) * first_heading - math.sin(angle) * first_bevel
                place = center + radius * bevel
            times.append(time_s + part * seconds)
            places.append(place)
        if isinstance(action, Roll):
            side = np.cross(heading, bevel)
            bevel = math.cos(action.angle_rad) * bevel + math.sin(action.angle_rad) * side
        time_s += seconds
    return np.array(times), np.array(places)


def scene_with(kind: RegionKind, shape: Shape, motion: Motion, **changes: object) -> Scene:
    breath = Breath(PERIOD_S, 0.5, 3, clock_s=1.2)
    scene = replace(PAPER, criticals=(), detections=(), breath=replace(breath, **changes))
    region = Region("R", kind, shape, motion=motion)
    return replace(scene, targets=(region,)) if kind == "target" else scene.with_regions(region)


@pytest.mark.parametrize("plan", PLANS)
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("shape", SHAPES)
def test_the_tip_keeps_the_certified_distance(plan: str, motion: str, shape: str) -> None:
    scene = scene_with("detection", SHAPES[shape], MOTIONS[motion])
    times, places = sampled(PLANS[plan], scene)
    moved = np.array([displaced(MOTIONS[motion], time_s) for time_s in times])
    least_mm = float(SHAPES[shape].distance_mm(places - moved).min())
    found_mm = certify(PLANS[plan], scene).detection_clearance_mm
    assert found_mm <= least_mm
    assert found_mm >= least_mm - BOUND_MM


@pytest.mark.parametrize("plan", PLANS)
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("shape", ["sphere", "capsule"])
def test_the_shaft_keeps_the_certified_distance(plan: str, motion: str, shape: str) -> None:
    scene = scene_with("critical", SHAPES[shape], MOTIONS[motion])
    times, places = sampled(PLANS[plan], scene)
    moved = np.array([displaced(MOTIONS[motion], time_s) for time_s in times])
    least_mm = min(
        float(SHAPES[shape].distance_mm(places[: index + 1 : 4] - moved[index]).min())
        for index in range(0, len(times), 2)
    )
    found_mm = certify(PLANS[plan], scene).critical_clearance_mm
    assert found_mm <= least_mm + 1e-9
    assert found_mm >= least_mm - BOUND_MM - 0.01 * abs(least_mm)


@pytest.mark.parametrize("plan", PLANS)
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("shape", ["sphere", "capsule"])
def test_the_shaft_behind_the_start_keeps_the_certified_distance(
    plan: str, motion: str, shape: str
) -> None:
    """The plan goes on where a needle was pushed before; no sample lies ahead of that place."""
    before = Arc(PAPER.needle.tip, PAPER.needle.radius_mm, 30.0)
    scene = scene_with("critical", SHAPES[shape], MOTIONS[motion])
    scene = scene.with_needle(before.end, PAPER.needle.radius_mm, 30.0)
    behind = [before.pose_at(0.5 * i).position_mm for i in range(61)]
    times, _ = sampled(PLANS[plan], scene)
    moved = np.array([displaced(MOTIONS[motion], time_s) for time_s in times])
    free = certify(PLANS[plan], scene).critical_clearance_mm
    dense = np.array([before.pose_at(0.1 * i).position_mm for i in range(301)])
    least_mm = min(float(SHAPES[shape].distance_mm(dense - one).min()) for one in moved)
    found_mm = certify(PLANS[plan], scene.with_shaft(behind)).critical_clearance_mm
    assert found_mm <= min(free, least_mm)
    # Half of the distance of the places is the price of places in the stead of a curve.
    assert found_mm >= min(free, least_mm - BOUND_MM - 0.25)


def test_a_region_that_sweeps_over_the_shaft_is_a_hit() -> None:
    """The tip has long passed; the region comes from the side, and the tip never meets it."""
    motion = Motion(40.0, (6.0, 0.0, 0.0))
    ball = Sphere((-6.0, -5.0, -0.4), 1.0)
    breath = Breath(40.0, 0.5, 1)
    scene = replace(PAPER, detections=(), breath=breath)
    plan = Plan.of([Push(25.0)])
    critical = replace(scene, criticals=(Region("C", "critical", ball, motion=motion),))
    shell = replace(
        scene, criticals=(), detections=(Region("D", "detection", ball, motion=motion),)
    )
    assert certify(plan, critical).critical_clearance_mm < 0.0
    assert certify(plan, shell).detection_clearance_mm > 0.0
    assert certify(Plan.of([Push(8.0)]), critical).critical_clearance_mm > 0.0


def test_a_target_is_where_it_is_at_the_end() -> None:
    way: Vector = (0.0, 0.0, 8.0)
    scene = scene_with("target", Sphere((0.0, -9.8, -1.6), 2.0), Motion(PERIOD_S, way), clock_s=0.0)
    hit, missed = Plan.of([Wait(2.0), Push(10.0)]), Plan.of([Push(10.0)])
    assert certify(hit, scene).target_depth_mm == pytest.approx(2.0, abs=0.1)
    assert certify(missed, scene).arrivals[0].depth_mm < -5.0


def test_pushes_outside_of_the_gate_do_not_hold() -> None:
    gate = Gate(0.0, math.pi)
    scene = scene_with(
        "target",
        Sphere((0.0, -2.0, 0.0), 1.5),
        Motion(PERIOD_S, (0.0, 0.0, 0.1)),
        gate=gate,
        clock_s=0.0,
    )
    assert certify(Plan.of([Push(2.0)]), scene).keeps_gate
    late = certify(Plan.of([Wait(1.0), Push(2.0)]), scene)
    assert not late.keeps_gate
    assert not late.holds()


def test_plans_with_waits_are_kept_as_json() -> None:
    plan = PLANS["waits"]
    assert plan_from_json(plan_to_json(plan)) == plan
    assert str(Plan.of([Wait(1.0), Wait(0.5)])) == "wait 1.5 s"
