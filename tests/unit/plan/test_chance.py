"""What random runs say of plans, and how plans are compared."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ntagen.errors import InputError
from ntagen.nsl import loads
from ntagen.plan.actions import Plan, Push, Roll, Wait
from ntagen.plan.chance import Rated, Sampling, actions_of, odds_of, rated
from ntagen.plan.rank import Candidate, certified, parse_ranking, split_ranking
from ntagen.scene import Tissue
from ntagen.units import rad_from_deg

SCENE = loads("""
environment e {
  needle { radius 50 mm  speed 1 mm/s }
  target   T1  sphere (0, -50, 4) mm  radius 4 mm
  critical C1  sphere (0, -25, 0) mm  radius 2 mm
  tissue stochastic  curvature 5 %  roll 5 deg  tip 0.3 mm
}
""")

HALF_TURN = Roll(rad_from_deg(180.0))
GOOD = Plan.of([Push(2.0), HALF_TURN, Push(18.0), HALF_TURN, Push(30.0)])
AS_GOOD = Plan.of([HALF_TURN, Push(18.0), HALF_TURN, Push(32.0)])
SHORT = Plan.of([Push(14.0), HALF_TURN, Push(36.0)])
PIERCING = Plan.of([Push(50.0)])

FEW = Sampling(runs=400, seed=3)


def candidates(*plans: Plan) -> list[Candidate]:
    """Plans with their certificates, in this order."""
    found = {one.plan: one for one in certified(plans, SCENE)}
    return [found[plan] for plan in plans]


def order(found: tuple[Rated, ...]) -> list[Plan]:
    return [one.candidate.plan for one in found]


def test_actions_are_steps_and_degrees() -> None:
    assert actions_of(Plan.of([Push(4.0), HALF_TURN, Push(2.0)]), SCENE) == (0, 0, 180, 0)


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        (Plan.of([Push(3.0)]), "no number of whole steps"),
        (Plan.of([Roll(0.1), Push(2.0)]), "none of the model"),
        (Plan.of([Wait(1.0), Push(2.0)]), "a plan with waits"),
        (Plan.of([]), "the plan has no actions"),
    ],
)
def test_what_the_model_cannot_do_is_refused(plan: Plan, words: str) -> None:
    with pytest.raises(InputError, match=words):
        odds_of(plan, SCENE)


def test_static_tissue_has_no_odds() -> None:
    with pytest.raises(InputError, match="the tissue has no chance"):
        odds_of(GOOD, replace(SCENE, tissue=Tissue()))


def test_the_same_seed_gives_the_same_runs_whatever_the_threads() -> None:
    one = odds_of(SHORT, SCENE, replace(FEW, threads=1))
    two = odds_of(SHORT, SCENE, replace(FEW, threads=2))
    other = odds_of(SHORT, SCENE, replace(FEW, seed=4))
    assert one == two
    assert one.clearance_mm != other.clearance_mm


def test_without_spreads_a_plan_does_what_its_certificate_says() -> None:
    scene = replace(SCENE, tissue=Tissue("stochastic"))
    good, bad = odds_of(GOOD, scene, FEW), odds_of(PIERCING, scene, FEW)
    assert (good.reach.value, bad.reach.value) == (1.0, 0.0)
    assert good.touch is not None
    assert good.touch.value == 0.0


def test_more_spread_makes_a_plan_less_likely() -> None:
    def reached(tissue: Tissue) -> float:
        return odds_of(GOOD, replace(SCENE, tissue=tissue), FEW).reach.value

    assert reached(replace(SCENE.tissue, roll_rad=rad_from_deg(30.0))) < reached(SCENE.tissue) - 0.1
    assert reached(replace(SCENE.tissue, curvature_ratio=0.4)) < reached(SCENE.tissue) - 0.1
    assert reached(replace(SCENE.tissue, tip_mm=3.0)) < reached(SCENE.tissue) - 0.1


def test_plans_are_ranked_by_how_likely_they_arrive() -> None:
    found = rated(candidates(SHORT, AS_GOOD, GOOD), SCENE, FEW)
    assert order(found)[-1] == SHORT
    assert [one.is_apart for one in found] == [False, False, True]
    values = [one.odds.reach.value for one in found]
    assert values == sorted(values, reverse=True)


def test_intervals_of_several_plans_hold_together() -> None:
    alone = rated(candidates(SHORT), SCENE, FEW)[0].odds.reach
    together = rated(candidates(SHORT, GOOD), SCENE, FEW)[1].odds.reach
    assert alone.confidence == pytest.approx(0.95)
    assert together.confidence == pytest.approx(0.975)
    assert alone.value == together.value
    assert together.lower is not None
    assert alone.lower is not None
    assert together.lower < alone.lower


def test_no_plans_have_no_odds() -> None:
    assert rated([], SCENE) == ()


def test_plans_of_one_seed_meet_the_same_tissue() -> None:
    """The second roll of one plan changes where it ends, but not how near it comes to a region."""
    longer = Plan.of([Push(14.0), HALF_TURN, Push(34.0), HALF_TURN, Push(2.0)])
    one, two = (odds_of(plan, SCENE, FEW) for plan in (SHORT, longer))
    assert one.clearance_mm == two.clearance_mm
    assert one.reach != two.reach


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("probability", (True, ("reserve", "length", "rolls"))),
        ("probability, clearance,rolls", (True, ("clearance", "rolls"))),
        ("clearance", (False, ("clearance",))),
    ],
)
def test_probability_comes_first(text: str, expected: tuple[bool, tuple[str, ...]]) -> None:
    assert split_ranking(text) == expected


@pytest.mark.parametrize("text", ["clearance,probability", "probability,probability"])
def test_probability_comes_nowhere_else(text: str) -> None:
    with pytest.raises(InputError, match="before all else"):
        split_ranking(text)
    with pytest.raises(InputError, match="before all else"):
        parse_ranking(text)
