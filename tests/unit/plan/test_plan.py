"""Plans: their form, their certificates against dense sampling, their ranking and their JSON."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen.errors import InputError, NtagenError
from ntagen.needle.vectors import distance
from ntagen.plan.actions import Action, Plan, Push, Roll
from ntagen.plan.certify import Arrival, Certificate, Clearance, certify
from ntagen.plan.document import document, plan_from_json, plan_to_json
from ntagen.plan.extract import extract
from ntagen.plan.rank import (
    CRITERIA,
    USEFUL_RESERVE_MM,
    Candidate,
    parse_ranking,
    rank,
    reserve_of,
)
from ntagen.plan.synthesise import Margins
from ntagen.plan.wording import counted, ranked_by
from ntagen.scene import Scene
from tests.oracles import planner
from tests.steering import CRITICAL, PAPER, TARGET, scene, sphere

actions = st.one_of(
    st.builds(Push, st.floats(0.0, 30.0)), st.builds(Roll, st.floats(-math.pi, math.pi))
)
plans = st.lists(actions, max_size=7).map(Plan.of)


def oracle_plans(of: Scene) -> list[Plan]:
    return [
        Plan.of(Push(value) if kind == "push" else Roll(value) for kind, value in steps)
        for steps in planner.plans(of)
    ]


def check_merged(given_actions: list[Action], expected: list[Action]) -> None:
    assert list(Plan.of(given_actions).actions) == expected


def test_neighbouring_pushes_are_one() -> None:
    check_merged([Push(2.0), Push(2.0), Roll(1.0), Push(2.0)], [Push(4.0), Roll(1.0), Push(2.0)])


def test_an_empty_push_is_none() -> None:
    check_merged([Push(0.0), Roll(1.0), Push(0.0)], [Roll(1.0)])


@pytest.mark.parametrize("action", [Push(-1.0), Push(math.nan), Roll(math.inf)])
def test_impossible_actions_are_refused(action: Action) -> None:
    with pytest.raises(ValueError, match="a needle cannot"):
        Plan.of([action])


@given(plans)
def test_json_keeps_the_plan(plan: Plan) -> None:
    back = plan_from_json(json.loads(json.dumps(plan_to_json(plan))))
    assert len(back.actions) == len(plan.actions)
    for ours, theirs in zip(back.actions, plan.actions, strict=True):
        match ours, theirs:
            case Push(a), Push(b):
                assert a == b
            case Roll(a), Roll(b):
                assert a == pytest.approx(b, abs=1e-9)
            case _:
                pytest.fail("the kind of an action changed")


@pytest.mark.parametrize("text", [{}, [{"push": 1}], [{"push_mm": "1"}], [{"push_mm": -1.0}], [1]])
def test_what_is_no_plan_is_refused(text: object) -> None:
    with pytest.raises(InputError):
        plan_from_json(text)


@given(plans, st.tuples(*[st.floats(-40.0, 40.0)] * 3), st.floats(0.5, 10.0))
def test_certified_clearance_is_that_of_dense_sampling(
    plan: Plan, center_mm: tuple[float, float, float], radius_mm: float
) -> None:
    region = sphere("C", "critical", center_mm, radius_mm)
    where = scene(region)
    certificate = certify(plan, where)
    arcs = plan.arcs(where.needle)
    sampled_mm = min(
        (
            distance(arc.pose_at(s).position_mm, center_mm) - radius_mm
            for arc in arcs
            for s in np.linspace(0.0, arc.length_mm, 101)
        ),
        default=distance(where.needle.tip.position_mm, center_mm) - radius_mm,
    )
    assert certificate.critical_clearance_mm <= sampled_mm + 1e-9
    assert certificate.critical_clearance_mm >= sampled_mm - 0.4
    assert certificate.end_mm == pytest.approx(plan.end(where.needle).position_mm)


def test_a_path_between_the_samples_through_a_small_region_is_not_certified() -> None:
    # One push of the model ends 2 mm deep, the next 4 mm deep: both are outside of this region.
    needle_eye = sphere("C", "critical", (0.0, -3.0, 0.0), 0.5)
    target = sphere("T", "target", (0.0, -6.0, 0.0), 1.0)
    where = scene(needle_eye, targets=[target])
    assert oracle_plans(where)
    certificate = certify(Plan.of([Push(6.0)]), where)
    assert certificate.critical_clearance_mm < 0.0
    assert certificate.clearances[0].at_mm == pytest.approx(3.0, abs=0.1)
    assert not certificate.holds()


def test_a_plan_that_enters_a_detection_region_does_not_hold() -> None:
    vessel = sphere("C", "critical", (0.0, -4.0, 4.0), 1.0)
    target = sphere("T", "target", (0.0, -8.0, 0.0), 3.0)
    plan = Plan.of([Push(8.0)])
    for margin_mm, holds in ((2.0, True), (4.0, False)):
        shell = sphere("D", "detection", vessel.center_mm, vessel.radius_mm + margin_mm)
        certificate = certify(plan, scene(vessel, shell, targets=[target]))
        assert certificate.critical_clearance_mm > 2.0
        assert certificate.holds() is holds
        assert Margins().allow(certificate) is holds
        assert not certificate.holds(detection_mm=certificate.detection_clearance_mm)


def test_a_plan_that_enters_an_unexplored_region_does_not_hold() -> None:
    target = sphere("T", "target", (0.0, -8.0, 0.0), 3.0)
    plan = Plan.of([Push(8.0)])
    for x_mm, holds in ((0.0, False), (9.0, True)):
        unknown = sphere("U", "unexplored", (x_mm, -4.0, 0.0), 2.0)
        safe = sphere("S", "safe", (0.0, -4.0, 0.0), 2.0)
        certificate = certify(plan, scene(unknown, safe, targets=[target]))
        assert [c.region for c in certificate.clearances] == ["U"]
        assert (certificate.unexplored_clearance_mm > 0.0) is holds
        assert certificate.holds() is holds


def test_a_number_that_is_not_that_of_the_model_is_not_called_found() -> None:
    assert counted(129, 101) == "129 plans found, 101 hold in exact kinematics"
    assert counted(3, 1, is_complete=False) == "3 plans looked at, 1 holds in exact kinematics"
    assert counted(0, 0) == "no plan found"


def test_the_words_for_a_ranking_name_its_criteria_in_order() -> None:
    said = ranked_by(("length", "clearance"))
    assert said == "best first: by length, then clearance (up to 5 mm counts)"
    assert len({ranked_by((name,)) for name in CRITERIA}) == len(CRITERIA)


def test_targets_count_in_their_order() -> None:
    near, far = (
        sphere(n, "target", (0.0, -y, 0.0), 3.0) for n, y in (("near", 8.0), ("far", 20.0))
    )
    plan = Plan.of([Push(4.0), Roll(math.pi), Push(8.0), Roll(math.pi), Push(8.0)])
    ordered = certify(plan, scene(targets=[near, far]))
    assert ordered.holds()
    entries = [a.entered_at_mm for a in ordered.arrivals]
    assert entries[0] is not None
    assert entries[1] is not None
    assert entries[0] < entries[1]
    assert not certify(plan, scene(targets=[far, near])).holds()


def test_a_plan_that_ends_short_of_its_target_does_not_hold() -> None:
    certificate = certify(Plan.of([Push(10.0)]), scene())
    assert certificate.target_depth_mm == -math.inf
    assert not certificate.holds()


def test_plans_of_the_paper_instance_are_found_certified_and_ranked_by_clearance() -> None:
    found = [Candidate(plan, certify(plan, PAPER)) for plan in oracle_plans(PAPER)]
    assert 100 < len(found) < 160
    ranked = rank(c for c in found if c.certificate.holds())
    clearances = [min(5.0, c.certificate.critical_clearance_mm) for c in ranked]
    assert clearances[0] == pytest.approx(max(clearances), abs=0.1)
    assert clearances[0] > 3.0
    assert rank(reversed(ranked)) == ranked


def test_the_ranking_is_the_users_choice() -> None:
    found = [Candidate(plan, certify(plan, PAPER)) for plan in oracle_plans(PAPER)]
    best = rank(found, parse_ranking("length,rolls"))[0]
    assert best.plan.length_mm == min(c.plan.length_mm for c in found)
    nearest = rank(found, parse_ranking("target"))[0]
    distances = [c.certificate.end_distance_mm for c in found]
    assert nearest.certificate.end_distance_mm == min(distances)


def reserve_mm(distance_mm: float, at_mm: float, depth_mm: float) -> float:
    """The reserve of a path of 40 mm past one region, with this depth in its target."""
    return reserve_of(
        Certificate(
            clearances=(Clearance("C", "detection", distance_mm, at_mm),),
            arrivals=(Arrival("T", 36.0, depth_mm),),
            end_mm=(0.0, -40.0, 0.0),
            end_distance_mm=5.0,
            length_mm=40.0,
            roll_count=0,
        )
    )


def test_the_reserve_is_what_a_needle_may_be_off_at_the_end_without_harm() -> None:
    assert reserve_mm(2.0, at_mm=40.0, depth_mm=3.0) == 2.0
    assert reserve_mm(2.0, at_mm=40.0, depth_mm=1.0) == 1.0
    assert reserve_mm(1.0, at_mm=20.0, depth_mm=3.0) == 2.0
    # Near the start nothing is known so well that the distance would not count.
    assert (
        reserve_mm(1.0, at_mm=0.0, depth_mm=9.0) == reserve_mm(1.0, at_mm=4.0, depth_mm=9.0) == 3.0
    )
    assert reserve_mm(9.0, at_mm=20.0, depth_mm=9.0) == USEFUL_RESERVE_MM
    assert reserve_mm(-1.0, at_mm=20.0, depth_mm=9.0) == -1.0


@pytest.mark.parametrize("text", ["", "clearance,beauty", "rolls,rolls"])
def test_unknown_rankings_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="ranking criterion"):
        parse_ranking(text)


def test_the_document_is_json_even_without_a_region_to_be_far_from() -> None:
    where = scene()
    plan = oracle_plans(where)[0]
    text = json.dumps(document(where, [Candidate(plan, certify(plan, where))]), allow_nan=False)
    assert json.loads(text)["plans"][0]["certificate"]["critical_clearance_mm"] is None


@dataclass(frozen=True)
class FakeEdge:
    """An edge of the model."""

    sync: str | None
    select: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class FakeStep:
    """A move."""

    edges: tuple[FakeEdge, ...]


@dataclass(frozen=True)
class FakeRun:
    """A winning run."""

    steps: tuple[FakeStep, ...]


def run_of(*edges: FakeEdge) -> FakeRun:
    return FakeRun(tuple(FakeStep((edge, FakeEdge(None))) for edge in edges))


PUSH = FakeEdge("do_push!")
TURN = FakeEdge("do_rotate!", {"angle_index": 1})


def test_runs_become_plans_each_once() -> None:
    check = FakeEdge("do_check!")
    runs = [run_of(PUSH, check, PUSH, TURN, PUSH), run_of(PUSH, PUSH, TURN, check, PUSH)]
    expected = Plan.of([Push(4.0), Roll(math.pi), Push(2.0)])
    assert extract(runs, PAPER) == (expected,)


def test_a_roll_by_an_angle_that_the_scene_lacks_is_an_error() -> None:
    with pytest.raises(NtagenError, match="index 7"):
        extract([run_of(FakeEdge("do_rotate!", {"angle_index": 7}))], PAPER)


def test_the_targets_of_the_tests_are_the_papers() -> None:
    assert (TARGET.radius_mm, CRITICAL.radius_mm) == (10.0, 2.0)
