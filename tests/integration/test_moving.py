"""Moving regions in the generated model: the same plans as an independent enumeration."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import pytest

from ntagen import checker
from ntagen.motion import Breath, Gate, Motion
from ntagen.plan.actions import Plan, Push, Roll, Wait
from ntagen.plan.extract import extract
from ntagen.render import render
from ntagen.scene import Region, Scene
from tests.oracles.declaration import Instance, Needle
from tests.scenes import PAPER, with_limits

UNIT_S = 0.5
PERIOD = 8
SLACK = 2


@dataclass
class Walker:
    """A needle of the oracle, on a clock; the rules of waits are written afresh."""

    needle: Needle
    plan: tuple[Push | Roll | Wait, ...] = ()
    clock: int = 0
    rested: int = 0
    waited: int = 0
    pauses: int = 0
    pauses_here: bool = False


def displacement(region: Region, clock: int) -> tuple[float, float, float]:
    """Where a region is, in mm from rest: a sinusoid, or at rest."""
    if region.motion is None:
        return 0.0, 0.0, 0.0
    share = 0.5 - 0.5 * math.cos(2 * math.pi * clock / PERIOD + region.motion.phase_rad)
    x, y, z = (share * part for part in region.motion.way_mm)
    return x, y, z


def away_mm(walker: Walker, region: Region, clock: int) -> float:
    tip = (part / 1000 for part in walker.needle.tip_pos)
    middle = (a + b for a, b in zip(region.center_mm, displacement(region, clock), strict=True))
    return math.dist(tuple(tip), tuple(middle)) - region.radius_mm


def is_open(scene: Scene, clock: int) -> bool:
    """Whether a push may begin: it takes `step_s`, and the gate is open for all of it."""
    gate = scene.breath.gate if scene.breath else None
    if gate is None:
        return True
    push = scene.limits.step_s / UNIT_S
    first, last = (PERIOD * angle / (2 * math.pi) for angle in (gate.from_rad, gate.to_rad))
    return first - 1e-9 <= clock % PERIOD and clock % PERIOD + push <= last + 1e-9


def touches(walker: Walker, scene: Scene, ahead: int) -> bool:
    for region in scene.avoided:
        slack_mm = SLACK / 1000 if region.motion else 0.001
        later = ahead if region.kind == "critical" and region.motion else 0
        moments = range(walker.clock - walker.rested, walker.clock + later + 1)
        if any(away_mm(walker, region, moment) <= slack_mm for moment in moments):
            return True
    return False


def plans(scene: Scene) -> set[Plan]:
    """All plans, by walking every sequence of pushes, rolls and waits."""
    return {Plan.of(actions) for actions in walk(scene)}


def walk(scene: Scene) -> Iterator[tuple[Push | Roll | Wait, ...]]:
    breath, target = scene.breath, scene.targets[0]
    assert breath is not None
    push, wait = round(scene.limits.step_s / UNIT_S), round(breath.wait_s / UNIT_S)
    reach_mm = target.motion.reach_mm if target.motion else 0.0
    waiting = [Walker(Needle.start(Instance.of_scene(scene)))]
    while waiting:
        one = waiting.pop()
        needle = one.needle
        if needle.vectors[3][1] > 0 or needle.needle_progress > 200_000:
            continue
        slack_mm = SLACK / 1000 if target.motion else 0.0
        if away_mm(one, target, one.clock) <= -slack_mm:
            yield one.plan
            continue
        if needle.tip_pos[1] / 1000 < target.center_mm[1] - target.radius_mm - reach_mm - 0.002:
            continue
        still_mm = away_mm(one, replace(target, motion=None), 0) - reach_mm - 0.002
        ahead = min(PERIOD, max(0, math.floor(still_mm / scene.limits.step_s)) * push)
        if touches(one, scene, ahead):
            continue
        if needle.may_roll():
            for angle, turn in zip(
                needle.instance.angles, scene.limits.roll_angles_rad, strict=True
            ):
                rolled = needle.copy()
                rolled.roll(angle)
                actions = (*one.plan, Roll(turn))
                waiting.append(Walker(rolled, actions, one.clock, PERIOD, 0, one.pauses))
        opened = is_open(scene, one.clock)
        may_pause = one.pauses_here or one.pauses < breath.max_pauses
        if not opened or (may_pause and one.waited + wait < PERIOD):
            paused = opened and not one.pauses_here
            waiting.append(
                Walker(
                    needle.copy(),
                    (*one.plan, Wait(breath.wait_s)),
                    one.clock + wait,
                    wait,
                    one.waited + wait,
                    one.pauses + paused,
                    one.pauses_here or opened,
                )
            )
        if opened:
            pushed = needle.copy()
            pushed.push()
            actions = (*one.plan, Push(scene.limits.step_s))
            waiting.append(Walker(pushed, actions, one.clock + push, 0, 0, one.pauses))


def scene_with(
    way_mm: tuple[float, float, float],
    *,
    radius_mm: float = 3.0,
    rolls: int = 0,
    step_s: float = 2.0,
    wait_s: float = 1.0,
    pauses: int = 1,
    gate: Gate | None = None,
    moved: str = "target",
    phase_rad: float = 0.0,
) -> Scene:
    motion = Motion(PERIOD * UNIT_S, way_mm, phase_rad)
    scene = with_limits(PAPER, max_rolls=rolls)
    scene = replace(
        scene,
        limits=replace(scene.limits, step_s=step_s),
        breath=Breath(PERIOD * UNIT_S, wait_s, pauses, gate),
        targets=(Region.ball("T1", "target", (0.0, -18.5, -6.4), radius_mm),),
        criticals=(Region.ball("C1", "critical", (-6.0, -14.0, -4.0), 2.0),),
        detections=(Region.ball("D1", "detection", (-6.0, -14.0, -4.0), 3.0),),
    )
    kinds = {"target": "targets", "critical": "criticals", "detection": "detections"}
    regions = getattr(scene, kinds[moved])
    return replace(scene, **{kinds[moved]: tuple(replace(r, motion=motion) for r in regions)})


def of_model(scene: Scene) -> set[Plan]:
    model = checker.load(render(scene))
    model.overflow = "error"
    answer = model.check("control: A<> Checker.Final_TR_Reached", plans="all")
    return set(extract(answer.plans, scene))


SCENES = {
    "target": scene_with((0.0, 0.0, 6.0), pauses=2),
    "target and a roll": scene_with((3.0, 0.0, 6.0), rolls=1, radius_mm=4.0, wait_s=2.0),
    "target along the way": scene_with((0.0, -6.0, 0.0), radius_mm=2.0, phase_rad=1.0),
    "critical": scene_with((4.5, 0.0, 0.0), moved="critical", rolls=1, wait_s=1.0),
    "detection": scene_with((4.5, 0.0, 0.0), moved="detection", pauses=2),
    "gate": scene_with((0.0, 0.0, 6.0), gate=Gate(math.pi / 2, 2 * math.pi), wait_s=0.5, pauses=0),
    "gate and pause": scene_with((0.0, 0.0, 6.0), gate=Gate(0.7, 5.9), wait_s=0.5),
}


@pytest.mark.parametrize("name", SCENES)
def test_plans_with_waits_agree_with_the_enumeration(name: str) -> None:
    scene = SCENES[name]
    found = of_model(scene)
    assert found == plans(scene)
    assert found, "there is nothing to compare"


@pytest.mark.parametrize("name", ["target", "critical", "detection"])
def test_motion_makes_a_difference(name: str) -> None:
    scene = SCENES[name]
    still = {
        kind: tuple(replace(region, motion=None) for region in getattr(scene, kind))
        for kind in ("targets", "criticals", "detections")
    }
    assert of_model(replace(scene, **still)) != of_model(scene)


def test_a_model_of_regions_that_keep_still_has_no_time() -> None:
    text = render(PAPER)
    assert "cycle" not in text
    assert "do_wait" not in text
