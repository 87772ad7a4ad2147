"""Plans of a needle that spins in a part of the way: their form, and what the engine finds."""

from __future__ import annotations

import json
import math
import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen import checker
from ntagen.errors import InputError
from ntagen.motion import Breath
from ntagen.plan.actions import Action, Plan, Push, Roll
from ntagen.plan.certify import certify
from ntagen.plan.certify_many import certify_all
from ntagen.plan.document import plan_from_json, plan_to_json
from ntagen.plan.extract import extract
from ntagen.plan.neighbours import neighbours
from ntagen.plan.synthesise import STRATEGY_QUERY, EngineSynthesiser
from ntagen.render import render
from ntagen.scene import Scene, Tissue
from tests.oracles import spun_plans
from tests.steering import CRITICAL, scene, sphere

QUARTER = math.pi / 2
SPINS = (0.2, 0.4, 0.6)

pushes = st.builds(Push, st.floats(0.5, 30.0), st.sampled_from((0.0, *SPINS)))
plans = st.lists(st.one_of(pushes, st.builds(Roll, st.floats(-3.0, 3.0))), max_size=6).map(Plan.of)


def spinning(where: Scene, **limits: object) -> Scene:
    """The scene with spins, and with a resolution that is fine enough."""
    changed = replace(where.limits, **({"spins": SPINS} | limits))  # type: ignore[arg-type]
    return replace(where, limits=changed, resolution_per_mm=None)


# ------------------------------------------------------------------------------------------- plans


def test_pushes_with_different_spins_are_different() -> None:
    plan = Plan.of([Push(2.0, 0.4), Push(3.0, 0.4), Push(1.0), Push(0.0, 0.2), Push(1.0)])
    assert plan.actions == (Push(5.0, 0.4), Push(2.0))
    assert str(plan) == "push 5 mm spinning 40 %, push 2 mm"


def test_a_change_of_the_spin_counts_as_a_roll() -> None:
    limits = scene().limits
    plan = Plan.of([Push(5.0, 0.4), Push(2.0), Roll(QUARTER), Push(3.0, 0.2)])
    assert plan.counted_rolls(limits) == 2
    assert certify(plan, spinning(scene())).roll_count == 2


@pytest.mark.parametrize("spin", [-0.1, 1.0, math.nan])
def test_an_impossible_spin_is_refused(spin: float) -> None:
    with pytest.raises(ValueError, match="cannot spin"):
        Plan.of([Push(1.0, spin)])


@given(plans)
def test_json_keeps_spins(plan: Plan) -> None:
    entries = plan_to_json(plan)
    for action, entry in zip(plan.actions, entries, strict=True):
        assert ("spin" in entry) == (isinstance(action, Push) and action.spin > 0.0)
    back = plan_from_json(json.loads(json.dumps(entries)))
    assert [a for a in back.actions if isinstance(a, Push)] == [
        a for a in plan.actions if isinstance(a, Push)
    ]


@pytest.mark.parametrize("spin", [1.5, "0.4", None])
def test_json_with_another_spin_is_refused(spin: object) -> None:
    with pytest.raises(InputError):
        plan_from_json([{"push_mm": 2.0, "spin": spin}])


@given(plans)
def test_a_certificate_is_that_of_small_steps(plan: Plan) -> None:
    """Small pushes and turns of a frame of its own give the same end and the same clearance."""
    region = sphere("C", "critical", (3.0, -30.0, 4.0), 2.0)
    at, heading, bend = np.zeros(3), np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, -1.0])
    least = np.linalg.norm(at - region.center_mm)
    for action in plan.actions:
        if isinstance(action, Roll):
            side = np.cross(heading, bend)
            bend = math.cos(action.angle_rad) * bend + math.sin(action.angle_rad) * side
        elif isinstance(action, Push):
            count = math.ceil(action.length_mm / 0.02)
            turn = action.length_mm / count / 30.0 * (1.0 - action.spin)
            for _ in range(count):
                at = at + action.length_mm / count * (heading + 0.5 * turn * bend)
                heading, bend = (
                    math.cos(turn) * heading + math.sin(turn) * bend,
                    math.cos(turn) * bend - math.sin(turn) * heading,
                )
                least = min(least, np.linalg.norm(at - region.center_mm))
    certificate = certify(plan, scene(region))
    assert certificate.end_mm == pytest.approx(tuple(at), abs=2e-3)
    assert certificate.critical_clearance_mm == pytest.approx(least - 2.0, abs=0.02)


@given(st.lists(plans, min_size=1, max_size=5))
def test_many_certificates_are_the_same(several: list[Plan]) -> None:
    where = spinning(scene(CRITICAL))
    for plan, found in zip(several, certify_all(several, where), strict=True):
        one = certify(plan, where)
        assert found.end_mm == pytest.approx(one.end_mm, abs=1e-8)
        assert found.critical_clearance_mm == pytest.approx(one.critical_clearance_mm, abs=1e-8)
        assert found.target_depth_mm == pytest.approx(one.target_depth_mm, abs=1e-8)
        assert found.roll_count == one.roll_count


def test_a_neighbour_spins_more_or_less_in_one_place() -> None:
    plan = Plan.of([Push(10.0, 0.4), Roll(QUARTER), Push(20.0)])
    found = set(neighbours(plan, spinning(scene())))
    assert Plan.of([Push(10.0, 0.2), Roll(QUARTER), Push(20.0)]) in found
    assert Plan.of([Push(10.0, 0.6), Roll(QUARTER), Push(20.0)]) in found
    assert Plan.of([Push(10.0, 0.4), Roll(QUARTER), Push(20.0, 0.2)]) in found
    assert Plan.of([Push(10.0), Roll(QUARTER), Push(20.0)]) not in found


def test_neighbours_of_a_change_of_the_spin_move_it() -> None:
    plan = Plan.of([Push(10.0, 0.4), Push(20.0)])
    found = set(neighbours(plan, spinning(scene())))
    assert Plan.of([Push(8.0, 0.4), Push(22.0)]) in found
    assert Plan.of([Push(12.0, 0.4), Push(18.0)]) in found


# ------------------------------------------------------------------------------------------- model


def engine(where: Scene) -> set[Plan]:
    return set(EngineSynthesiser().listed(where).plans)


def exact(where: Scene, slack_mm: float) -> set[Plan]:
    """The plans of brute force."""
    found = set()
    for way in spun_plans.plans(where, slack_mm):
        actions: list[Action] = [
            Push(value, spin) if kind == "push" else Roll(value) for kind, value, spin in way
        ]
        found.add(Plan.of(actions))
    return found


def unended(found: set[Plan]) -> set[tuple[Action, ...]]:
    """The plans without the length of their last push: a smaller target ends it later."""
    return {(*plan.actions[:-1], replace(plan.actions[-1], length_mm=0.0)) for plan in found}  # type: ignore[call-arg]


def drawn(number: int) -> Scene:
    """A random scene with at most one roll, whose target lies about where some plan ends."""
    numbers = random.Random(f"spinning {number}")
    spins = numbers.choice(((0.5,), (0.6, 0.25)))
    where = spinning(
        scene(),
        max_rolls=numbers.choice((0, 1, 1)),
        roll_angles_rad=(QUARTER, 3.0 * QUARTER),
        min_roll_distance_mm=numbers.choice((0.0, 4.0, 8.0)),
        spins=spins,
    )
    actions: list[Action] = [Push(2.0 * numbers.randint(4, 9), numbers.choice((0.0, *spins)))]
    if where.limits.max_rolls:
        actions.append(Roll(numbers.choice(where.limits.roll_angles_rad)))
        actions.append(Push(2.0 * numbers.randint(4, 9), numbers.choice((0.0, *spins))))
    x, y, z = Plan.of(actions).end(where.needle).position_mm
    target = sphere("T", "target", (x, y, z), numbers.choice((1.5, 3.0)))
    aside = (x + numbers.uniform(-4.0, 4.0), 0.5 * y, numbers.uniform(-4.0, 4.0))
    return replace(where, targets=(target,), criticals=(sphere("C", "critical", aside, 2.0),))


@pytest.mark.parametrize("number", range(8))
def test_the_engine_finds_what_brute_force_finds(number: int) -> None:
    where = drawn(number)
    found = unended(engine(where))
    assert unended(exact(where, 0.05)) <= found
    assert found <= unended(exact(where, -0.05))


def test_random_scenes_have_plans() -> None:
    assert sum(bool(exact(drawn(number), 0.05)) for number in range(8)) >= 4


def test_two_changes_keep_their_distance() -> None:
    where = scene(targets=[sphere("T", "target", (0.0, -20.0, -3.0), 2.0)])
    where = spinning(where, max_rolls=2, min_roll_distance_mm=6.0, spins=(0.5,))
    where = replace(where, limits=replace(where.limits, roll_angles_rad=(math.pi,)))
    found = engine(where)
    assert unended(exact(where, 0.05)) <= unended(found) <= unended(exact(where, -0.05))
    assert any(plan.spin_changes == 2 for plan in found)


@pytest.mark.parametrize("free", [False, True])
def test_plans_that_do_not_spin_are_those_of_the_task_without_it(free: bool) -> None:
    where = scene(CRITICAL, targets=[sphere("T", "target", (5.0, -40.0, 3.0), 6.0)])
    with_spin = spinning(where, max_rolls=1, free_bevel=free, spins=(0.4,))
    plain = replace(with_spin, limits=replace(with_spin.limits, spins=()))
    unspun = {
        plan
        for plan in engine(with_spin)
        if not any(isinstance(one, Push) and one.spin for one in plan.actions)
    }
    assert unspun == engine(plain)


@pytest.mark.parametrize("safety", ["sampled", "swept"])
def test_a_model_for_plans_alone_loses_none(safety: str) -> None:
    where = replace(spinning(scene(CRITICAL), max_rolls=1), safety=safety)
    found = []
    for only_plans in (False, True):
        answer = checker.load(render(where, only_plans=only_plans)).check(
            STRATEGY_QUERY, plans="all"
        )
        found.append(set(extract(answer.plans, where)))
    assert found[0] == found[1]
    assert found[0]


def test_the_model_is_asked_about_a_plan_with_a_change_of_the_spin() -> None:
    where = spinning(scene(targets=[sphere("T", "target", (0.0, -40.0, -8.0), 4.0)]), max_rolls=1)
    listing = EngineSynthesiser().listed(where)
    changing = [plan for plan in listing.plans if plan.spin_changes]
    assert changing
    assert listing.has(changing[0], where)
    assert not listing.has(Plan.of([Push(10.0, 0.2), Push(10.0, 0.4), Push(20.0, 0.2)]), where)


def test_a_deep_target_is_reached_only_by_spinning() -> None:
    target = sphere("T", "target", (0.0, -100.0, 0.0), 4.0)
    where = spinning(scene(targets=[target]), max_rolls=1)
    plain = replace(where, limits=replace(where.limits, spins=()))
    assert not engine(plain)
    found = engine(where)
    assert found
    assert any(certify(plan, where).holds(depth_mm=0.3) for plan in found)


# --------------------------------------------------------------------------------------- the scene


@pytest.mark.parametrize("spins", [(0.0,), (1.0,), (0.4, 0.4), (math.nan,)])
def test_a_scene_refuses_other_spins(spins: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match=r"spun fraction|written twice"):
        replace(scene().limits, spins=spins)


@pytest.mark.parametrize(
    "changes",
    [
        {"tissue": Tissue("adversarial", 0.1)},
        {"tissue": Tissue("stochastic", 0.1)},
        {"breath": Breath(4.0, 0.5, 1)},
    ],
)
def test_a_scene_refuses_what_spins_do_not_know(changes: dict[str, object]) -> None:
    with pytest.raises(InputError, match="a needle that spins"):
        replace(spinning(scene()), **changes)  # type: ignore[arg-type]
