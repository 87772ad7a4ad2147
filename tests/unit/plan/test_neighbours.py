"""Small changes of plans: which there are, what they lead to, and what the model says of them."""

from __future__ import annotations

import math
from dataclasses import replace

from ntagen.plan.actions import Action, Plan, Push, Roll
from ntagen.plan.certify import Certificate, certify
from ntagen.plan.neighbours import improved, neighbours
from ntagen.plan.rank import DEFAULT_RANKING, Candidate, rank
from ntagen.plan.synthesise import EngineSynthesiser, Margins
from ntagen.scene import Scene
from tests.steering import PAPER


def turned(first_mm: float, degrees: int, last_mm: float) -> Plan:
    actions: list[Action] = [Push(first_mm), Roll(math.radians(degrees)), Push(last_mm)]
    return Plan.of(actions)


def allow(certificate: Certificate) -> bool:
    return Margins().allow(certificate)


def candidate(plan: Plan, where: Scene) -> Candidate:
    return Candidate(plan, certify(plan, where))


def test_a_roll_is_moved_or_changed_and_the_length_too() -> None:
    assert set(neighbours(turned(4.0, 90, 6.0), PAPER)) == {
        turned(2.0, 90, 8.0),
        turned(6.0, 90, 4.0),
        turned(4.0, 180, 6.0),
        turned(4.0, 270, 6.0),
        turned(4.0, 90, 4.0),
        turned(4.0, 90, 8.0),
    }


def test_a_roll_is_not_moved_before_the_entry_or_to_the_end() -> None:
    found = set(neighbours(turned(0.0, 90, 2.0), PAPER))
    assert turned(2.0, 90, 0.0) not in found
    assert all(isinstance(plan.actions[-1], Push) for plan in found)
    assert turned(0.0, 90, 4.0) in found


def test_rolls_stay_apart() -> None:
    between = [Push(2.0), Roll(math.pi / 2), Push(4.0), Roll(math.pi), Push(8.0)]
    far = replace(PAPER, limits=replace(PAPER.limits, min_roll_distance_mm=4.0))
    assert len(set(neighbours(Plan.of(between), PAPER))) == 10
    # Both moves of a roll towards the other one are missing.
    assert len(set(neighbours(Plan.of(between), far))) == 8


def test_changes_lead_to_a_plan_that_no_change_makes_better() -> None:
    plans = EngineSynthesiser()(PAPER).candidates
    worst = plans[-1]
    best = improved(worst, PAPER, allow, DEFAULT_RANKING)
    assert best.certificate == certify(best.plan, PAPER)
    assert allow(best.certificate)
    assert rank([worst, best])[0] is best
    around = [candidate(plan, PAPER) for plan in neighbours(best.plan, PAPER)]
    assert rank([best, *(one for one in around if allow(one.certificate))])[0] is best


def test_the_model_has_its_own_plans_and_no_other() -> None:
    listing = EngineSynthesiser().listed(PAPER)
    plans = set(listing.plans)
    tried = {one for plan in listing.plans[:3] for one in neighbours(plan, PAPER)}
    assert tried - plans
    for plan in tried:
        *before, last = plan.actions
        assert isinstance(last, Push)
        # The model ends with the first step in the target; a plan may go deeper.
        shorter = {
            Plan.of([*before, Push(2.0 * n)]) for n in range(1, int(last.length_mm) // 2 + 1)
        }
        assert listing.has(plan, PAPER) == bool(shorter & plans)
