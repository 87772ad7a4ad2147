"""The model of a plan in a tissue with chance, against exact kinematics and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from ntagen import checker
from ntagen.errors import InputError
from ntagen.nsl import loads
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.certify import certify
from ntagen.plan.chance import Sampling, actions_of, odds_of
from ntagen.plan.extract import pages_of
from ntagen.render import render, render_plan, render_queries
from ntagen.scene import MEASURED_TISSUE, Scene, Tissue
from ntagen.units import rad_from_deg

CERTAIN = "tissue stochastic  curvature 0 %  roll 0 deg  tip 0 mm"

BALLS = """
environment e {
  needle { radius 50 mm  speed 1 mm/s }
  target   T1  sphere (0, -50, 4) mm  radius 4 mm
  critical C1  sphere (0, -25, 0) mm  radius 2 mm
  tissue stochastic
}
"""

SCENES = {
    "balls": BALLS,
    "turned": """
environment e {
  needle { tip (1, 2, 3) mm  heading (0.6, 0, 0.8)  bevel (0.8, 0, -0.6)
           radius 40 mm  speed 2 mm/s }
  motion { step 1 s }
  target   T1  sphere (30, 2, 40) mm  radius 10 mm
  critical C1  sphere (14, 0, 20) mm  radius 2 mm
  tissue stochastic
}
""",
    "solids": """
environment e {
  needle { radius 50 mm  speed 1 mm/s }
  target   T1  box (0, -30, 0) mm  size (20, 10, 20) mm
  target   T2  cylinder (-6, -54, 4) mm to (6, -50, 4) mm  radius 5 mm
  critical C1  capsule (-8, -22, 6) mm to (8, -22, 6) mm  radius 2 mm
  critical C2  box (9, -20, 0) mm  size (2, 8, 8) mm
  detection D1 around C1  margin 1 mm
  unexplored U1  capsule (0, -40, -12) mm to (0, -44, -9) mm  radius 1 mm
  unexplored U2  sphere (0, -10, 8) mm  radius 2 mm
  tissue stochastic
}
""",
    "only unexplored": """
environment e {
  needle { radius 50 mm  speed 1 mm/s }
  motion { roll by 90, 180, 270 deg at most 3 times }
  target     T1  ellipsoid (0, -44, 0) mm  radii (12, 14, 13) mm
  unexplored U1  ellipsoid (0, -20, 9) mm  radii (9, 8, 7) mm
  tissue stochastic
}
""",
}

PLANS = {
    "straight on": Plan.of([Push(50.0)]),
    "two rolls": Plan.of(
        [Push(14.0), Roll(rad_from_deg(180.0)), Push(20.0), Roll(rad_from_deg(90.0)), Push(18.0)]
    ),
    "roll first": Plan.of([Roll(rad_from_deg(270.0)), Push(30.0)]),
}


def scene_of(text: str) -> Scene:
    """The scene of a file."""
    return loads(text)


def certain(scene: Scene) -> Scene:
    """The same scene with a tissue that does what is expected."""
    return replace(scene, tissue=Tissue("stochastic"))


def values(scene: Scene, plan: Plan, *expressions: str, runs: int = 1) -> list[float]:
    """The means of the least values of some expressions, at the end of the plan."""
    model = checker.load(render_plan(scene, actions_of(plan, scene), runs))
    seconds = 2 * len(actions_of(plan, scene)) + 2
    found = []
    for expression in expressions:
        answer = model.check(f"E[<={seconds}; {runs}](min: {expression})")
        assert answer.estimate is not None
        found.append(answer.estimate.value)
    return found


@pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS)
@pytest.mark.parametrize("text", SCENES.values(), ids=SCENES)
def test_without_spreads_the_tip_goes_as_exact_kinematics_say(text: str, plan: Plan) -> None:
    """All shapes are near: far from an ellipsoid, the model has a bound on the distance."""
    scene = certain(scene_of(text))
    certificate = certify(plan, scene)
    unsafe_mm = min(certificate.critical_clearance_mm, certificate.unexplored_clearance_mm)
    (clearance_mm,) = values(scene, plan, "tip_clearance")
    assert clearance_mm == pytest.approx(unsafe_mm, abs=0.02)
    # The last target counts at the end only, the others on the whole way.
    depth_mm = min(arrival.depth_mm for arrival in certificate.arrivals)
    miss = "(tip_miss < 1000 ? (Insertion.Done ? tip_miss : 1000.0) : 1000.0)"
    (miss_mm,) = values(scene, plan, miss)
    assert miss_mm == pytest.approx(-depth_mm, abs=0.02)


def test_deviations_have_the_spreads_of_the_tissue() -> None:
    tissue = Tissue("stochastic", 0.1, rad_from_deg(20.0), 0.5)
    scene = replace(scene_of(BALLS), tissue=tissue)
    plan = Plan.of([Push(4.0), Roll(rad_from_deg(90.0)), Push(4.0)])
    runs = 20_000
    drawn = {
        "ln(drawn_factor[0])": 0.1,
        "ln(drawn_factor[1])": 0.1,
        "drawn_error[1]": rad_from_deg(20.0),
        "tip_offset[0]": 0.5,
        "tip_offset[2]": 0.5,
    }
    at_end = [f"(Insertion.Done ? {one}*{one} : 1000000.0)" for one in drawn]
    for spread, square in zip(drawn.values(), values(scene, plan, *at_end, runs=runs), strict=True):
        # The square of a normal number has the variance 2 s^4; five of its standard deviations.
        assert abs(square - spread**2) < 5.0 * spread**2 * math.sqrt(2.0 / runs)


def test_before_the_entry_a_free_bevel_does_not_err() -> None:
    tissue = Tissue("stochastic", 0.0, rad_from_deg(20.0), 0.0)
    text = BALLS.replace("radius 50 mm", "bevel free  radius 50 mm")
    plan = Plan.of([Roll(rad_from_deg(90.0)), Push(30.0)])
    free, bound = (replace(scene_of(one), tissue=tissue) for one in (text, BALLS))
    side_mm = "(Insertion.Done ? true_pos[0]*true_pos[0] : 1000000.0)"
    end_mm = certify(plan, free).end_mm
    assert values(free, plan, side_mm, runs=200)[0] == pytest.approx(end_mm[0] ** 2)
    assert values(bound, plan, side_mm, runs=200)[0] < 0.95 * end_mm[0] ** 2


def test_decisions_are_those_of_static_tissue() -> None:
    scene = scene_of(BALLS)
    found = []
    for tissue in (Tissue(), MEASURED_TISSUE):
        model = checker.load(render(replace(scene, tissue=tissue), only_plans=True))
        answer = model.check("control: A<> Checker.Final_TR_Reached", plans="all")
        assert answer.verdict == "satisfied"
        found.append((answer.explored, answer.stored, sum(1 for _ in answer.plans)))
    assert found[0] == found[1]


def test_what_is_expected_is_the_same_text_as_in_static_tissue() -> None:
    scene = scene_of(BALLS)
    static = render(replace(scene, tissue=Tissue()))
    chance = render(scene)
    common, _, rest = chance.partition(
        "/****************************************** The tissue with"
    )
    assert common.rstrip() in static
    assert "random_normal" in rest
    assert "random_normal" not in static


def test_without_unsafe_regions_nothing_is_asked_about_touching() -> None:
    text = BALLS.replace("  critical C1  sphere (0, -25, 0) mm  radius 2 mm\n", "")
    model = checker.load(render_plan(scene_of(text), [0] * 25, 100))
    assert [query.comment.partition("\n")[0] for query in model.queries] == ["ReachProbability"]
    assert "tip_clearance" not in model.text
    model = checker.load(render_plan(scene_of(BALLS), [0] * 25, 100))
    names = [query.comment.partition("\n")[0] for query in model.queries]
    assert names == ["ReachProbability", "TouchProbability", "ExpectedClearance"]


def test_moving_regions_and_static_tissue_are_refused() -> None:
    moving = BALLS.replace("radius 2 mm", "radius 2 mm  moves 2 mm along +z every 4 s")
    with pytest.raises(InputError, match="regions that move, and a tissue with chance"):
        render(scene_of(moving))
    with pytest.raises(InputError, match="the tissue has no chance"):
        render_plan(replace(scene_of(BALLS), tissue=Tissue()), [0], 1)
    with pytest.raises(InputError, match="the plan has no actions"):
        render_plan(scene_of(BALLS), [], 1)


def test_queries_of_static_tissue_stay_the_same() -> None:
    scene = replace(scene_of(BALLS), tissue=Tissue())
    assert "Probability" not in render_queries(scene)


def test_each_such_task_has_the_questions_about_its_strategy() -> None:
    lines = render_queries(scene_of(BALLS)).splitlines()
    asked = [line for line in lines if line.endswith(" under ReachFinalTR")]
    assert [line.partition("[")[0] for line in asked] == ["Pr", "Pr", "E"]
    names = ["// ReachProbability", "// TouchProbability", "// ExpectedClearance"]
    assert [line for line in lines if line in names] == names


@pytest.mark.slow
def test_under_the_strategy_the_true_tip_does_its_plan() -> None:
    """There is one plan, so the model of this plan must say the same."""
    text = BALLS.replace("tissue stochastic", "motion { roll by 180 deg at most 0 times }").replace(
        "sphere (0, -50, 4) mm  radius 4 mm", "sphere (0, -35, -13) mm  radius 3 mm"
    )
    text = text.replace("\n}", "\n  tissue stochastic  curvature 10 %  roll 0 deg  tip 0.5 mm\n}")
    text = text.replace("sphere (0, -25, 0) mm", "sphere (0, -20, -1) mm")
    scene = scene_of(text)
    model = checker.load(render(scene))
    by_name = {query.comment.partition("\n")[0]: query.text for query in model.queries}
    strategy = model.check(by_name["ReachFinalTR"], strategy=True, plans="all")
    assert strategy.verdict == "satisfied"
    (plan,) = (plan for page in pages_of(strategy, scene) for plan in page)
    odds = odds_of(plan, scene, Sampling(runs=4000, seed=1, risk=1e-4))
    ended = model.check("Pr[<=204](<> Checker.Final_TR_Reached) under ReachFinalTR", runs=100)
    assert ended.estimate is not None
    assert ended.estimate.value == 1.0
    for name, expected in (
        ("ReachProbability", odds.reach),
        ("TouchProbability", odds.touch),
        ("ExpectedClearance", odds.clearance_mm),
    ):
        found = model.check(by_name[name], runs=4000, seed=2, alpha=1e-4).estimate
        assert found is not None
        assert expected is not None
        assert found.lower is not None
        assert found.upper is not None
        assert expected.lower is not None
        assert expected.upper is not None
        assert found.lower <= expected.upper
        assert expected.lower <= found.upper
        assert name == "ExpectedClearance" or 0.02 < found.value < 0.98
