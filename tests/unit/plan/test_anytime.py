"""The best plans within a budget, against the list of all plans."""

from __future__ import annotations

import itertools
from dataclasses import replace
from time import monotonic

import pytest

from ntagen.plan.anytime import QUESTIONS, Best, best_plans, goodness
from ntagen.plan.rank import CRITERIA, Candidate, place_of
from ntagen.plan.synthesise import EngineSynthesiser
from ntagen.scene import Scene
from tests.steering import CRITICAL, PAPER, TARGET, scene, sphere

BESIDE = scene(
    CRITICAL, sphere("C2", "critical", (6.0, -32.0, 4.0), 4.0), targets=[TARGET.grown(-5.0)]
)
LOST = scene(sphere("C", "critical", (0.0, -15.0, 0.0), 14.0), targets=[TARGET.grown(-6.0)])
RANKINGS = [
    ("clearance", "rolls", "length"),
    ("reserve", "length", "rolls"),
    ("length", "clearance"),
    ("rolls", "target"),
    ("target", "rolls", "clearance"),
]


def final(where: Scene, *, count: int = 1, ranking: tuple[str, ...] = RANKINGS[0]) -> Best:
    *_, last = best_plans(where, EngineSynthesiser(ranking=ranking), clock=monotonic, count=count)
    return last


def every(where: Scene, ranking: tuple[str, ...]) -> tuple[Candidate, ...]:
    """All plans of the model that hold, best first."""
    return EngineSynthesiser(ranking=ranking)(where).candidates


@pytest.mark.parametrize("where", [PAPER, BESIDE], ids=["paper", "beside"])
@pytest.mark.parametrize("ranking", RANKINGS, ids="-".join)
def test_no_plan_is_better_than_a_limit_says(where: Scene, ranking: tuple[str, ...]) -> None:
    best = final(where, ranking=ranking)
    others = list(every(where, ranking))
    assert best.is_final
    assert best.verdict == "found"
    for name in ranking:
        badness, question = CRITERIA[name], QUESTIONS[name]
        # The model's integers lose 1 % of an arc.
        limit = best.limits[name] - (0.0 if question.is_exact else 0.7)
        # The list may have none: its plans end with the first step that ends in the target.
        assert min((badness(one.certificate) for one in others), default=limit) >= limit
        mine = badness(best.candidates[0].certificate) + question.resolution(where)
        others = [one for one in others if badness(one.certificate) <= mine]


@pytest.mark.parametrize("ranking", [RANKINGS[0], RANKINGS[2], RANKINGS[3]], ids="-".join)
def test_what_is_settled_is_the_best_of_all(ranking: tuple[str, ...]) -> None:
    best = final(PAPER, ranking=ranking)
    name = ranking[0]
    badness, question = CRITERIA[name], QUESTIONS[name]
    optimum = badness(every(PAPER, ranking)[0].certificate)
    assert best.is_settled(name, PAPER)
    mine = badness(best.candidates[0].certificate)
    assert mine <= optimum + question.resolution(PAPER) + 0.7


def test_each_answer_is_at_least_as_good_as_the_one_before() -> None:
    ranking = RANKINGS[0]
    answers = list(best_plans(BESIDE, EngineSynthesiser(ranking=ranking), clock=monotonic, count=3))
    assert [one.is_final for one in answers] == [False] * (len(answers) - 1) + [True]
    for before, after in itertools.pairwise(answers):
        keys = [
            [place_of(name, one.candidates[0].certificate) for name in ranking]
            for one in (before, after)
        ]
        assert keys[1] <= keys[0]
        assert after.looked_at >= before.looked_at
        assert all(after.limits[name] >= limit for name, limit in before.limits.items())


def test_the_best_five_are_the_five_best_of_all() -> None:
    best = final(PAPER, count=5)
    ranking = RANKINGS[0]
    expected = [
        [place_of(n, one.certificate) for n in ranking] for one in every(PAPER, ranking)[:5]
    ]
    assert best.is_complete
    assert [[place_of(n, one.certificate) for n in ranking] for one in best.candidates] == expected


def test_all_plans_given_hold() -> None:
    engine = EngineSynthesiser()
    for best in best_plans(BESIDE, engine, clock=monotonic, count=20):
        assert all(engine.margins.allow(one.certificate) for one in best.candidates)


def test_it_is_proved_that_there_is_no_plan() -> None:
    best = final(LOST)
    assert best.verdict == "none"
    assert not best.candidates
    assert not every(LOST, RANKINGS[0])


def test_without_time_nothing_is_known() -> None:
    *_, best = best_plans(PAPER, EngineSynthesiser(), clock=monotonic, budget_s=0.0)
    assert best.verdict == "unknown"
    assert best.is_final


def test_three_rolls_of_45_degrees_need_no_list() -> None:
    angles = tuple(k * PAPER.limits.roll_angles_rad[0] / 2 for k in range(1, 8))
    limits = replace(PAPER.limits, roll_angles_rad=angles, max_rolls=3)
    best = final(replace(PAPER, limits=limits), ranking=("rolls",))
    assert goodness("rolls", best.limits["rolls"]) == 1
    assert best.is_settled("rolls", PAPER)
