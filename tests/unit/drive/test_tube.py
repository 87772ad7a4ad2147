"""How sure it is that the next part of a plan touches nothing, and that the tip is in a target."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ntagen.drive.settings import Settings
from ntagen.drive.tube import Tube, confidence_in
from ntagen.needle.estimate import Estimate, Estimator, Priors
from ntagen.needle.kinematics import push, roll
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.scene import Pose, Region, Scene
from tests.steering import ENTRY, scene, sphere

PRIORS = Priors(curvature_drift=0.2, turn_drift_rad=0.2, roll_rad=math.radians(5.0))
SETTINGS = Settings(priors=PRIORS)
RADIUS_MM = 30.0


def estimated() -> Estimate:
    """That of a needle after 10 mm."""
    estimator = Estimator(ENTRY, RADIUS_MM, PRIORS)
    path = Path(ENTRY)
    for number in range(40):
        path = path.push(RADIUS_MM, 0.25)
        estimator.push(0.25)
        estimator.measure(Measurement(0.25 * number, path.tip.position_mm, 0.0))
    return estimator.estimate()


ESTIMATE = estimated()


def here() -> Scene:
    return scene().with_needle(ESTIMATE.tip, ESTIMATE.radius_mm, 10.0)


def beside(pose: Pose, away_mm: float) -> Region:
    """A large region whose surface is this far from a place, outside of the bend."""
    x, y, z = (p + (100.0 + away_mm) * b for p, b in zip(pose.position_mm, pose.bevel, strict=True))
    return sphere("C", "critical", (x, y, z), 100.0)


def confidence(plan: Plan, *regions: Region) -> float:
    return Tube(here(), ESTIMATE, SETTINGS, regions).confidence(plan)


STRAIGHT_ON = Plan.of([Push(20.0)])
END = push(ESTIMATE.tip, ESTIMATE.radius_mm, SETTINGS.review_mm)
STD_MM = ESTIMATE.position_std_mm(SETTINGS.review_mm)


def test_without_regions_everything_is_sure() -> None:
    assert confidence(STRAIGHT_ON) == 1.0


def test_a_region_at_one_standard_deviation_is_missed_in_five_of_six_cases() -> None:
    assert confidence(STRAIGHT_ON, beside(END, STD_MM)) == pytest.approx(0.8413, abs=0.02)
    assert confidence(STRAIGHT_ON, beside(END, 4.0 * STD_MM)) > 0.9995


def test_regions_add_up_and_one_in_the_way_leaves_nothing() -> None:
    near, far = beside(END, 1.5 * STD_MM), beside(END, 2.0 * STD_MM)
    both = 1.0 - (1.0 - confidence(STRAIGHT_ON, near)) - (1.0 - confidence(STRAIGHT_ON, far))
    assert confidence(STRAIGHT_ON, near, far) == pytest.approx(both)
    assert confidence(STRAIGHT_ON, sphere("C", "critical", END.position_mm, 2.0)) < 1e-6


def test_what_comes_after_the_next_look_does_not_count() -> None:
    later = push(ESTIMATE.tip, ESTIMATE.radius_mm, SETTINGS.review_mm + 8.0)
    assert confidence(STRAIGHT_ON, sphere("C", "critical", later.position_mm, 2.0)) > 0.999
    longer = replace(SETTINGS, review_mm=15.0)
    region = sphere("C", "critical", later.position_mm, 2.0)
    assert Tube(here(), ESTIMATE, longer, (region,)).confidence(STRAIGHT_ON) < 0.01


def test_a_roll_makes_the_tube_wider() -> None:
    settings = replace(SETTINGS, review_mm=20.0)
    rolled = Plan.of([Roll(math.pi), Push(20.0)])
    end = push(roll(ESTIMATE.tip, math.pi), ESTIMATE.radius_mm, 20.0)
    # Out of the plane of the bend, to where an error of the roll moves the end.
    across = np.cross(end.heading, end.bevel)
    center = np.array(end.position_mm) + 101.5 * across
    region = sphere("C", "critical", (center[0], center[1], center[2]), 100.0)
    exact = replace(settings, priors=replace(PRIORS, roll_rad=1e-9))
    sure = Tube(here(), ESTIMATE, exact, (region,)).confidence(rolled)
    assert Tube(here(), ESTIMATE, settings, (region,)).confidence(rolled) < sure


def test_the_tip_is_in_a_target_as_surely_as_it_is_deep() -> None:
    x, y, z = ESTIMATE.tip.position_mm
    std_mm = ESTIMATE.position_std_mm(0.0)
    target = sphere("T", "target", (x, y + 3.0 - std_mm, z), 3.0)
    assert confidence_in(target, ESTIMATE) == pytest.approx(0.8413, abs=1e-3)
    outside = sphere("T", "target", (x, y + 4.0, z), 3.0)
    assert confidence_in(outside, ESTIMATE) < 0.01


def grown_mm(where: Scene, tube: Tube) -> dict[str, float]:
    """By how much the model's regions are larger than those of the scene."""
    radii = {one.name: one.radius_mm for one in where.criticals}
    return {one.name: one.radius_mm - radii[one.name] for one in tube.asked().criticals}


def test_the_model_is_asked_for_what_the_tube_needs() -> None:
    near, far = beside(END, 1.0), beside(push(ESTIMATE.tip, RADIUS_MM, 25.0), 9.0)
    where = here().with_regions(near, replace(far, name="far"))
    by_mm = grown_mm(where, Tube(where, ESTIMATE, SETTINGS, where.criticals))
    std_mm = ESTIMATE.position_std_mm(0.0)
    assert 1.5 * std_mm < by_mm["C"] < 2.0 * STD_MM
    assert by_mm["far"] == pytest.approx(0.05)
    wider = replace(SETTINGS, accept=0.99)
    assert grown_mm(where, Tube(where, ESTIMATE, wider, where.criticals))["C"] > by_mm["C"]
    # What nobody told of is judged by the force, and not by the tube.
    assert grown_mm(where, Tube(where, ESTIMATE, SETTINGS, ()))["C"] == pytest.approx(0.05)


def test_a_plan_that_keeps_out_of_the_larger_region_is_sure() -> None:
    ahead = push(ESTIMATE.tip, ESTIMATE.radius_mm, SETTINGS.review_mm)
    x, y, z = (p + 3.0 * h for p, h in zip(ahead.position_mm, ahead.heading, strict=True))
    where = here().with_regions(sphere("C", "critical", (x, y, z), 2.8))
    by_mm = grown_mm(where, Tube(where, ESTIMATE, SETTINGS, where.criticals))["C"]
    # What is made larger by so much would just be touched at the end of the tube.
    touched = (sphere("C", "critical", (x, y, z), 3.0 - by_mm),)
    sure = Tube(where, ESTIMATE, SETTINGS, touched).confidence(Plan.of([Push(5.0)]))
    assert sure == pytest.approx(SETTINGS.accept, abs=0.002)


def test_the_model_starts_outside_of_its_regions_and_ends_deep_in_the_target() -> None:
    where = here().with_regions(beside(ESTIMATE.tip, 0.3))
    tube = Tube(where, ESTIMATE, replace(SETTINGS, accept=1.0 - 1e-9), where.criticals)
    asked = tube.asked()
    assert asked.criticals[0].distance_mm(ESTIMATE.tip.position_mm) == pytest.approx(0.1)
    depth_mm = where.targets[-1].radius_mm - asked.targets[-1].radius_mm
    assert depth_mm == pytest.approx(SETTINGS.margins.depth_mm + 0.05)
    assert (asked.safety, asked.resolution_per_mm) == ("swept", None)


def test_the_record_of_a_tube_says_how_far_the_tip_may_be_off() -> None:
    region = beside(END, 1.5 * STD_MM)
    tube = Tube(here(), ESTIMATE, SETTINGS, (region,))
    record = tube.foreseen(STRAIGHT_ON, 7.0, 10.0)
    assert (record.time_s, record.depth_mm) == (7.0, 10.0)
    assert record.confidence == tube.confidence(STRAIGHT_ON) < 1.0
    assert record.length_mm[0] == 0.0
    assert record.length_mm[-1] == pytest.approx(SETTINGS.review_mm)
    assert record.std_mm[0] == pytest.approx(ESTIMATE.position_std_mm(0.0))
    assert record.std_mm[-1] == pytest.approx(STD_MM)
    end_mm = (record.x_mm[-1], record.y_mm[-1], record.z_mm[-1])
    assert end_mm == pytest.approx(END.position_mm)
