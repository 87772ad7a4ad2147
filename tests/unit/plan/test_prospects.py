"""The prospects of places, against arcs that are followed one by one."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ntagen.needle.kinematics import Arc, roll
from ntagen.needle.poses import Poses
from ntagen.plan.actions import Plan, Push, Roll, Wait
from ntagen.plan.certify import certify
from ntagen.plan.prospects import (
    ERROR_POINTS,
    ROLL_PLACES,
    SOFT_MM,
    Judged,
    Place,
    Prospects,
    _Arcs,
    first_part,
)
from ntagen.scene import Pose, Scene, Vector
from tests.steering import CRITICAL, ENTRY, PAPER, scene, sphere

DEPTH_MM = 0.3
ROUND = np.eye(3)
FREE = scene(targets=[sphere("T", "target", (0.0, -40.0, 0.0), 3.0)])


def test_the_least_distance_of_arcs_is_that_of_each_arc() -> None:
    draw = np.random.default_rng(5)
    places = 30.0 * draw.normal(size=(12, 3))
    for _ in range(300):
        heading, other = draw.normal(size=(2, 3))
        heading /= np.linalg.norm(heading)
        bevel = np.cross(heading, other)
        bevel /= np.linalg.norm(bevel)
        # Up to two turns of a circle.
        radius_mm = float(draw.uniform(10.0, 160.0))
        length_mm = float(draw.uniform(0.0, 120.0))
        start = Pose(*(tuple(one.tolist()) for one in (5.0 * other, heading, bevel)))
        arc = Arc(start, radius_mm, length_mm)
        rows = Poses(*(np.array([one]) for one in (start.position_mm, heading, bevel)))
        none = np.zeros(1)
        arcs = _Arcs(
            np.zeros(1, int),
            rows,
            np.array([length_mm]),
            np.array([radius_mm]),
            np.zeros(1, int),
            none,
            none,
            none,
        )
        expected = [arc.nearest_to(tuple(one)).distance_mm for one in places.tolist()]
        (least,) = arcs.least(np.zeros(1, int), places, np.zeros(1, int))
        assert least == pytest.approx(expected, abs=1e-6)


def judge(of: Scene, place: Place, left_mm: float, covariance_mm2: NDArray[np.float64]) -> Judged:
    (found,) = Prospects(of, DEPTH_MM).judge([place], left_mm, covariance_mm2)
    return found


def judged(of: Scene, place: Pose = ENTRY, std_mm: float = 1.0) -> float:
    return judge(of, Place(place), 60.0, std_mm**2 * ROUND).prospect


def aside(x_mm: float, z_mm: float) -> Pose:
    """A place beside the entry, as it looks at the target."""
    return replace(ENTRY, position_mm=(x_mm, 0.0, z_mm))


def one_by_one(of: Scene, place: Pose, left_mm: float, stds_mm: Vector) -> float:
    """The prospect with at most one roll and without regions."""
    target = of.targets[-1]
    inside_mm = target.radius_mm - DEPTH_MM
    straight_mm = math.dist(place.position_mm, target.center_mm)
    left_mm = min(left_mm, 1.5 * straight_mm + target.radius_mm)
    radius_mm = of.needle.radius_mm
    whole = Arc(place, radius_mm, left_mm)
    arcs = [whole]
    for number in range(ROLL_PLACES[0]):
        at_mm = number * left_mm / ROLL_PLACES[0]
        for angle_rad in of.limits.roll_angles_rad:
            turned = roll(whole.pose_at(at_mm), angle_rad)
            arcs.append(Arc(turned, radius_mm, left_mm - at_mm))
    variances, axes = np.linalg.eigh(np.diag(np.square(stds_mm)))
    places = np.array(target.center_mm) - ERROR_POINTS @ (axes * np.sqrt(variances)).T
    counted = 0.0
    for x, y, z in places.tolist():
        away_mm = min(arc.nearest_to((x, y, z)).distance_mm for arc in arcs)
        counted += min(1.0, max(0.0, (inside_mm - away_mm) / SOFT_MM + 0.5))
    return counted / len(ERROR_POINTS)


def test_the_errors_are_spread_as_a_normal_distribution() -> None:
    assert np.abs(ERROR_POINTS.mean(axis=0)).max() < 1e-12
    assert np.abs(np.cov(ERROR_POINTS.T, bias=True) - ROUND).max() < 1e-12
    assert 2.0 < np.linalg.norm(ERROR_POINTS, axis=1).max() < 4.0


def test_a_prospect_is_that_of_all_arcs() -> None:
    draw = random.Random(7)
    one_roll = replace(FREE, limits=replace(FREE.limits, max_rolls=1))
    values = []
    for _ in range(60):
        place = aside(draw.uniform(-12.0, 12.0), draw.uniform(-12.0, 12.0))
        place = roll(place, draw.uniform(0.0, 6.0))
        stds_mm = (draw.uniform(0.2, 3.0), draw.uniform(0.2, 3.0), draw.uniform(0.2, 3.0))
        left_mm = draw.uniform(35.0, 80.0)
        covariance = np.diag(np.square(stds_mm))
        found = judge(one_roll, Place(place), left_mm, covariance).prospect
        expected = one_by_one(one_roll, place, left_mm, stds_mm)
        assert found == pytest.approx(expected, abs=1e-6)
        values.append(found)
    assert min(values) < 0.3
    assert max(values) > 0.7


def test_a_place_at_the_edge_of_what_can_be_reached_is_worse() -> None:
    stiff = FREE.with_needle(ENTRY, 100.0)
    # A single arc reaches the middle of the target from here, and from nowhere beyond.
    edge_mm = 100.0 - math.sqrt(100.0**2 - 40.0**2)
    for sign in (-1.0, 1.0):
        inside, edge, beyond = (
            judged(stiff, aside(0.0, sign * part * edge_mm), 1.5) for part in (0.4, 1.0, 1.6)
        )
        assert inside > 0.95
        assert 0.5 < edge < inside - 0.05
        assert beyond < 0.25


def test_the_less_is_known_the_worse_is_a_place() -> None:
    stiff = FREE.with_needle(ENTRY, 100.0)
    prospects = [judged(stiff, ENTRY, std_mm) for std_mm in (0.1, 1.0, 2.0, 4.0, 8.0)]
    assert prospects == sorted(prospects, reverse=True)
    assert prospects[0] == 1.0
    assert prospects[-1] < 0.6


def test_a_wall_leaves_no_way() -> None:
    wall = sphere("C", "critical", (0.0, -25.0, 0.0), 12.0)
    blocked = scene(wall, targets=FREE.targets)
    found = judge(blocked, Place(aside(0.0, 0.5)), 60.0, ROUND)
    assert found.prospect == 0.0
    assert found.way is None
    assert judged(PAPER) > 0.9


def test_the_way_holds_in_exact_kinematics() -> None:
    draw = random.Random(11)
    ways = 0
    of = scene(CRITICAL, targets=[sphere("T", "target", (2.0, -45.0, 1.0), 3.0)])
    for _ in range(120):
        place = roll(
            aside(draw.uniform(-8.0, 8.0), draw.uniform(-8.0, 8.0)), draw.uniform(0.0, 6.0)
        )
        rolls = draw.choice([0, 1, 2])
        since_mm = draw.choice([0.0, 1.0, math.inf])
        found = judge(of, Place(place, since_mm, rolls), 70.0, ROUND)
        if found.way is None:
            continue
        ways += 1
        here = of.with_needle(place, of.needle.radius_mm)
        certificate = certify(found.way, here)
        assert certificate.target_depth_mm >= DEPTH_MM - 1e-6
        # Arcs are sampled for what they touch.
        assert certificate.critical_clearance_mm > -0.1
        assert found.way.roll_count <= rolls
        pushed_mm, last_mm = 0.0, -since_mm
        for action in found.way.actions:
            if isinstance(action, Roll):
                assert pushed_mm - last_mm >= of.limits.min_roll_distance_mm - 1e-9
                last_mm = pushed_mm
            elif isinstance(action, Push):
                pushed_mm += action.length_mm
        assert pushed_mm <= 70.0
    assert ways > 20


def test_a_needle_that_is_too_short_has_no_prospect() -> None:
    for left_mm in (20.0, 0.0):
        found = judge(FREE, Place(ENTRY), left_mm, 0.01 * ROUND)
        assert found.prospect == 0.0
        assert found.way is None


def test_places_that_are_judged_together_are_judged_as_alone() -> None:
    draw = random.Random(3)
    of = scene(CRITICAL, targets=[sphere("T", "target", (2.0, -45.0, 1.0), 3.0)])
    spinning = replace(of, limits=replace(of.limits, spins=(0.25, 0.5)))
    for one in (of, spinning):
        places = [
            Place(
                roll(
                    aside(draw.uniform(-9.0, 9.0), draw.uniform(-9.0, 9.0)), draw.uniform(0.0, 6.0)
                ),
                draw.choice([0.0, 1.0, math.inf]),
                draw.choice([None, 0, 1, 2]),
                draw.choice([None, 0.0]),
            )
            for _ in range(30)
        ]
        # From here, the target is too far away.
        places.insert(7, Place(aside(500.0, 0.0)))
        together = Prospects(one, DEPTH_MM).judge(places, 70.0, ROUND)
        for place, found in zip(places, together, strict=True):
            alone = judge(one, place, 70.0, ROUND)
            assert found.prospect == pytest.approx(alone.prospect, abs=1e-9)
            assert found.way == alone.way
        assert len({round(found.prospect, 2) for found in together}) > 10
        assert sum(found.way is not None for found in together) > 5


def test_which_scenes_suit() -> None:
    assert Prospects.suits(FREE)
    assert not Prospects.suits(FREE.with_targets([*FREE.targets, *FREE.targets]))


def test_the_first_part_of_a_plan() -> None:
    plan = Plan.of([Push(2.0), Roll(1.0), Push(4.0), Roll(2.0), Wait(1.0), Push(5.0)])
    assert first_part(plan, 5.0) == Plan.of([Push(2.0), Roll(1.0), Push(3.0)])
    # A roll at the end comes after the driver has looked.
    assert first_part(plan, 6.0) == Plan.of([Push(2.0), Roll(1.0), Push(4.0)])
    assert first_part(plan, 50.0) == plan
    assert first_part(Plan.of([Roll(1.0), Push(3.0)]), 1.0) == Plan.of([Roll(1.0), Push(1.0)])
