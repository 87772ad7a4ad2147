"""A bevel that is free: a roll before the first push chooses its direction, and does not count."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from ntagen.nsl import loads
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.certify import certify
from ntagen.plan.neighbours import neighbours
from ntagen.plan.rank import Candidate, rank
from ntagen.plan.synthesise import EngineSynthesiser, Margins
from ntagen.scene import Scene
from tests.oracles import planner
from tests.steering import CRITICAL, ENTRY, scene, sphere

ASIDE = sphere("T", "target", (12.0, -24.0, 0.0), 2.0)
QUARTER = math.pi / 2


def limited(where: Scene, *, rolls: int, free: bool, apart_mm: float = 2.0) -> Scene:
    limits = replace(where.limits, max_rolls=rolls, free_bevel=free, min_roll_distance_mm=apart_mm)
    return replace(where, limits=limits)


def oracle(where: Scene) -> set[Plan]:
    return {
        Plan.of(Push(value) if kind == "push" else Roll(value) for kind, value in steps)
        for steps in planner.plans(where)
    }


def engine(where: Scene) -> set[Plan]:
    return set(EngineSynthesiser().listed(where).plans)


def test_a_target_on_one_side_is_reached_without_a_roll_that_counts() -> None:
    where = scene(targets=[ASIDE])
    assert not engine(limited(where, rolls=0, free=False))
    (plan,) = engine(limited(where, rolls=0, free=True))
    assert isinstance(plan.actions[0], Roll)
    assert certify(plan, limited(where, rolls=0, free=True)).roll_count == 0
    assert certify(plan, limited(where, rolls=1, free=False)).roll_count == 1


@pytest.mark.parametrize("apart_mm", [0.0, 2.0, 10.0])
@pytest.mark.parametrize("rolls", [0, 1])
@pytest.mark.parametrize("free", [False, True])
def test_the_engine_finds_what_brute_force_finds(rolls: int, free: bool, apart_mm: float) -> None:
    target = sphere("T", "target", (5.0, -40.0, 3.0), 6.0)
    where = limited(scene(CRITICAL, targets=[target]), rolls=rolls, free=free, apart_mm=apart_mm)
    # The model's integers lose 1 % of an arc, so plans at the edge of the target may differ.
    inner = replace(where, targets=(target.grown(-0.7),))
    outer = replace(where, targets=(target.grown(0.7),))
    found = engine(where)
    reached = {plan.actions[:-1] for plan in found}
    assert {plan.actions[:-1] for plan in oracle(inner)} <= reached
    assert reached <= {plan.actions[:-1] for plan in oracle(outer)}
    assert bool(found) == bool(oracle(where))


def test_only_one_roll_before_the_entry_is_free_and_none_in_the_tissue() -> None:
    where = limited(scene(targets=[ASIDE]), rolls=1, free=True)
    for plan in engine(where):
        rolls = [isinstance(action, Roll) for action in plan.actions]
        assert rolls[:2] != [True, True]
        assert sum(rolls[1:]) <= 1
    assert where.with_needle(ENTRY, 30.0).limits.free_bevel
    assert not where.with_needle(ENTRY, 30.0, 2.0).limits.free_bevel


def test_a_neighbour_has_no_roll_too_many() -> None:
    where = limited(scene(targets=[ASIDE]), rolls=1, free=True)
    plan = Plan.of([Roll(QUARTER), Push(10.0), Roll(QUARTER), Push(16.0)])
    found = list(neighbours(plan, where))
    assert found
    assert all(isinstance(one.actions[0], Roll) for one in found)


def test_a_free_roll_does_not_make_a_plan_worse() -> None:
    where = limited(scene(targets=[ASIDE]), rolls=2, free=True)
    once = Plan.of([Roll(QUARTER), Push(28.0)])
    later = Plan.of([Push(2.0), Roll(QUARTER), Push(26.0)])
    ranked = rank([Candidate(plan, certify(plan, where)) for plan in (later, once)], ("rolls",))
    assert ranked[0].plan == once
    assert Margins().allow(ranked[0].certificate)


def needle(words: str) -> str:
    return (
        f"environment e {{ needle {{ {words} radius 30 mm speed 1 mm/s }} "
        "target T sphere (0, -50, 0) mm radius 10 mm }"
    )


def test_the_language_has_a_free_bevel() -> None:
    free = loads(needle("bevel free"))
    assert free.limits.free_bevel
    assert free.needle.tip.bevel == (0.0, 0.0, 1.0)
    assert not loads(needle("bevel +z")).limits.free_bevel


@pytest.mark.parametrize("heading", ["+z", "-y", "+x", "(1, -1, 1)"])
def test_a_free_bevel_is_at_right_angles_to_any_heading(heading: str) -> None:
    tip = loads(needle(f"heading {heading} bevel free")).needle.tip
    assert sum(a * b for a, b in zip(tip.heading, tip.bevel, strict=True)) == pytest.approx(0.0)


def test_free_is_a_name_where_a_file_defines_it() -> None:
    where = loads("let free = -z\n" + needle("bevel free"))
    assert where.needle.tip.bevel == (0.0, 0.0, -1.0)
    assert not where.limits.free_bevel
