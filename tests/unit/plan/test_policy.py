"""Policies: how they are learned, what they decide, and their file."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace

import pytest

from ntagen import checker
from ntagen.errors import InputError
from ntagen.needle.kinematics import push, roll
from ntagen.nsl import loads
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.chance import Sampling, odds_of
from ntagen.plan.policy import CONTINUOUS, Policy, features, read_policy
from ntagen.plan.steering import Steered, around_of, steer
from ntagen.render import Seen, render_policy
from ntagen.scene import Scene, Tissue
from ntagen.units import rad_from_deg

TEXT = """
environment e {
  needle { radius 50 mm  speed 1 mm/s }
  target   T1  sphere (0, -50, 4) mm  radius 4 mm
  critical C1  capsule (-20, -25, 0) mm to (20, -25, 0) mm  radius 4.5 mm
  tissue stochastic  curvature 5 %  roll 5 deg  tip 0.3 mm
}
"""
SCENE = loads(TEXT)
HALF_TURN = Roll(rad_from_deg(180.0))
PLAN = Plan.of([HALF_TURN, Push(18.0), HALF_TURN, Push(32.0)])
WORSE = Plan.of([HALF_TURN, Push(18.0), HALF_TURN, Push(30.0)])
SEEN = Seen(0.1, rad_from_deg(1.0), rad_from_deg(5.0))
FEW = Sampling(runs=4000, seed=3, learning_runs=20_000)
FEWER = replace(FEW, runs=100, learning_runs=1000)


@pytest.fixture(scope="module")
def steered() -> Steered:
    return steer([WORSE, PLAN], SCENE, "probability", SEEN, FEW)


@pytest.fixture(scope="module")
def document(steered: Steered) -> dict[str, object]:
    read: dict[str, object] = json.loads(steered.policy.text())
    return read


@pytest.mark.slow
def test_it_beats_the_best_plan_in_the_same_tissues(steered: Steered) -> None:
    assert steered.plan == PLAN
    compared = steered.aims["probability"]
    assert compared.verdict == steered.guard.verdict == "better"
    assert not steered.policy.is_silent
    assert compared.difference.value == pytest.approx(
        compared.policy.value - compared.plan.value, abs=1e-9
    )
    # The tissues are the same, so the interval is narrower than that of independent runs.
    widths = [one.upper - one.lower for one in (compared.plan, compared.policy)]
    assert compared.difference.upper - compared.difference.lower < math.hypot(*widths)


@pytest.mark.slow
def test_the_plan_has_the_value_that_its_own_model_gives(steered: Steered) -> None:
    odds = odds_of(PLAN, SCENE, Sampling(runs=4000, seed=1, risk=1e-3))
    plan = steered.aims["probability"].plan
    assert odds.reach.lower is not None
    assert odds.reach.upper is not None
    assert plan.lower < odds.reach.upper
    assert plan.upper > odds.reach.lower


@pytest.mark.slow
def test_the_same_seed_gives_the_same_policy() -> None:
    texts = [
        steer([PLAN], SCENE, "miss", SEEN, sampling).policy.text()
        for sampling in (FEWER, replace(FEWER, threads=1), replace(FEWER, seed=4))
    ]
    assert texts[0] == texts[1] != texts[2]


@pytest.mark.slow
def test_a_policy_that_is_not_better_is_silent() -> None:
    """Few runs teach nothing for certain: the policy is the plan, and its file says so."""
    steered = steer([PLAN], SCENE, "cut", SEEN, FEWER)
    assert steered.guard.verdict != "better"
    policy = steered.policy
    assert policy.is_silent
    assert policy.around.window == 0
    assert not policy.trees
    assert policy.decide(SCENE, SCENE.needle.tip, 0.0, 0) is None
    for compared in steered.aims.values():
        assert compared.policy == compared.plan
        assert (compared.difference.value, compared.verdict) == (0.0, "alike")
    assert read_policy(policy.text().encode(), SCENE) == policy
    other = loads(TEXT.replace("-50, 4", "-49, 4"))
    with pytest.raises(InputError, match="learned for another task"):
        read_policy(policy.text().encode(), other)


@pytest.mark.slow
def test_a_file_gives_the_same_policy_again(steered: Steered) -> None:
    assert read_policy(steered.policy.text().encode(), SCENE) == steered.policy


@pytest.mark.slow
def test_it_rolls_within_its_windows(steered: Steered) -> None:
    policy = steered.policy
    start = roll(SCENE.needle.tip, math.pi)
    assert policy.decide(SCENE, SCENE.needle.tip, 0.0, 0) == "roll"
    first, last = policy.around.first[1], policy.around.last[1]
    decided = {
        pushes: policy.decide(SCENE, push(start, 50.0, 2.0 * pushes), 2.0 * pushes, 1)
        for pushes in range(last + 2)
    }
    assert {decided[pushes] for pushes in range(first)} == {"push"}
    assert decided[last] == "roll"
    assert decided[last + 1] is None
    assert "roll" in {decided[pushes] for pushes in range(first, last)}
    assert policy.decide(SCENE, start, 3.0, 1) is None, "between two pushes"
    assert policy.decide(SCENE, start, 40.0, 2) is None, "after the last roll"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": "plans"}, "it does not say 'ntagen policy'"),
        ({"version": 1}, "the policy has version 1, and this program reads 2"),
        ({"is_silent": "no"}, "is_silent is neither true nor false"),
        ({"aim": "speed"}, "it is the best for 'speed'"),
        ({"strategy": {}}, "statevars' is missing"),
        ({"model_sha256": "0"}, "learned for another task"),
        ({"around": {"actions": []}}, "'seen' is missing"),
        ({"around": {**asdict(around_of(PLAN, SCENE, SEEN)), "window": 10**9}}, "more than 10000"),
    ],
)
def test_a_file_that_is_none_is_refused(
    document: dict[str, object], changes: dict[str, object], words: str
) -> None:
    with pytest.raises(InputError, match=words) as refused:
        read_policy(json.dumps(document | changes).encode(), SCENE)
    assert "hint: " in str(refused.value)


@pytest.mark.slow
def test_other_features_and_torn_files_are_refused(document: dict[str, object]) -> None:
    strategy = document["strategy"]
    assert isinstance(strategy, dict)
    other = json.dumps(document | {"strategy": strategy | {"pointvars": ["t"]}})
    with pytest.raises(InputError, match="it sees roll_count, push_count, t"):
        read_policy(other.encode(), SCENE)
    with pytest.raises(InputError, match="is no JSON"):
        read_policy(json.dumps(document).encode()[:-50], SCENE)
    for node in ({"var": 9, "bound": 0.0, "low": 1.0, "high": 2.0}, "inf", float("nan")):
        regressors = {"(1,8)": {"regressor": {"0": node}}}
        torn = json.dumps(document | {"strategy": strategy | {"regressors": regressors}})
        with pytest.raises(InputError, match="torn"):
            read_policy(torn.encode(), SCENE)


@pytest.mark.slow
def test_a_policy_of_another_task_is_refused(steered: Steered) -> None:
    data = steered.policy.text().encode()
    nearer = loads(TEXT.replace("-50, 4", "-49, 4"))
    with pytest.raises(InputError, match="learned for another task"):
        read_policy(data, nearer)
    static = loads(TEXT.replace("stochastic  curvature 5 %  roll 5 deg  tip 0.3 mm", "static"))
    with pytest.raises(InputError, match="one of another task: the tissue has no chance"):
        read_policy(data, static)


def test_trees_decide_by_what_is_seen() -> None:
    """A policy by hand: it rolls once the target lies more than 1 mm above."""
    above = CONTINUOUS.index("above")
    strategy = {
        "statevars": ["roll_count", "push_count"],
        "pointvars": list(CONTINUOUS),
        "actions": {
            "0": "Insertion.Next->Insertion.Push { 1, tau, 1 }",
            "1": "Insertion.Next->Insertion.Next { 1, tau, 1 }",
            "2": "WAIT",
        },
        "regressors": {
            "(1,8)": {
                "regressor": {
                    "0": 0.5,
                    "1": {"var": above, "bound": 1.0, "low": 0.75, "high": 0.25},
                }
            },
            "(1,9)": {"regressor": {"1": 0.25}},
        },
    }
    around = around_of(PLAN, SCENE, SEEN)
    policy = Policy.of("probability", "", around, strategy, {})
    tip = roll(SCENE.needle.tip, math.pi)
    seen = dict(zip(CONTINUOUS, features(SCENE, tip), strict=True))
    assert seen["ahead"] == pytest.approx(50.0)
    assert seen["above"] == pytest.approx(-4.0)
    assert policy.decide(SCENE, tip, 16.0, 1) == "push"
    assert policy.decide(SCENE, SCENE.needle.tip, 16.0, 1) == "roll"
    assert policy.decide(SCENE, tip, 18.0, 1) is None, "one move was never tried"
    assert policy.decide(SCENE, tip, 20.0, 1) is None, "it was never there"


@pytest.mark.parametrize(
    ("scene", "plan", "words"),
    [
        (replace(SCENE, targets=SCENE.targets * 2), PLAN, "the task has 2"),
        (SCENE, Plan.of([Push(50.0)]), "the plan has no roll"),
        (replace(SCENE, tissue=Tissue()), PLAN, "no chance"),
    ],
)
def test_what_a_policy_cannot_be_for_is_refused(scene: Scene, plan: Plan, words: str) -> None:
    with pytest.raises(InputError, match=words):
        render_policy(scene, around_of(plan, scene, SEEN))


def test_the_needle_bounds_the_pushes() -> None:
    assert around_of(PLAN, SCENE, SEEN).most_pushes == 28
    short = replace(SCENE, needle=replace(SCENE.needle, length_mm=52.0))
    assert around_of(PLAN, short, SEEN).most_pushes == 26


def test_only_learning_follows_the_plan_at_first() -> None:
    model = checker.load(render_policy(SCENE, around_of(PLAN, SCENE, SEEN)))
    query = "simulate [<=60; 60] {rolled_at, led_pushes}"
    led = {}
    for learns in ("false", "true"):
        answer = model.with_constants(IS_LEARNING=learns).check(query, seed=1)
        ends = [
            (run.values["led_pushes"][-1], run.values["rolled_at"][-1])
            for run in answer.trajectories
        ]
        led[learns] = {one for one, _ in ends}
        # The plan rolls after 9 pushes, its window begins after 4.
        assert all(rolled == 9.0 for one, rolled in ends if one > 9.0)
        assert any(rolled == 4.0 for one, rolled in ends if one <= 4.0)
    assert led["false"] == {0.0}
    assert 0.0 in led["true"]
    assert len(led["true"]) > 5
    fixed = model.with_constants(IS_FIXED="true").check(query, seed=1)
    assert {run.values["rolled_at"][-1] for run in fixed.trajectories} == {9.0}


def test_plans_without_rolls_leave_nothing_to_decide() -> None:
    with pytest.raises(InputError, match="nothing that a policy could decide"):
        steer([Plan.of([Push(50.0)])], SCENE, "miss", SEEN, FEW)
