"""The best plan within a budget, against the list of all plans."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import pytest

from ntagen.plan.best_plan import BestPlanSynthesiser, sequences
from ntagen.plan.rank import ROBUST_RANKING, USEFUL_CLEARANCE_MM, reserve_of
from ntagen.plan.stricter import deeper
from ntagen.plan.synthesise import EngineSynthesiser, Listing, Synthesis
from ntagen.scene import Scene
from tests.steering import CRITICAL, PAPER, scene, sphere

BESIDE = scene(sphere("C", "critical", (1.0, -24.0, -3.0), 2.0), name="beside")
OPEN = scene(name="open")
THREE_ROLLS = replace(PAPER, limits=replace(PAPER.limits, max_rolls=3))
BLOCKED = scene(sphere("C", "critical", (0.0, -30.0, 0.0), 26.0), name="blocked")


def both(where: Scene) -> tuple[Synthesis, Synthesis]:
    """The answers within a budget, and by the list of all plans."""
    engine = EngineSynthesiser()
    return BestPlanSynthesiser(engine)(where), engine(where)


def useful_mm(synthesis: Synthesis) -> float:
    """The clearance of the best plan, as far as more is useful."""
    assert synthesis.best is not None
    return min(USEFUL_CLEARANCE_MM, synthesis.best.certificate.critical_clearance_mm)


@pytest.mark.parametrize("where", [PAPER, BESIDE], ids=lambda one: one.name)
def test_its_best_plan_is_about_as_good_as_the_best_of_all(where: Scene) -> None:
    within_budget, all_listed = both(where)
    assert useful_mm(within_budget) >= useful_mm(all_listed) - 0.7
    # Certificates that are computed together may differ in the last digits.
    every = {one.plan for one in all_listed.candidates}
    assert {one.plan for one in within_budget.candidates} <= every
    assert within_budget.found < all_listed.found
    assert (within_budget.is_complete, all_listed.is_complete) == (False, True)


@pytest.mark.parametrize("where", [PAPER, BESIDE], ids=lambda one: one.name)
def test_its_best_plan_has_about_as_much_reserve_as_the_best_of_all(where: Scene) -> None:
    engine = EngineSynthesiser(ranking=ROBUST_RANKING)
    within_budget, all_listed = BestPlanSynthesiser(engine)(where), engine(where)
    assert within_budget.best is not None
    assert all_listed.best is not None
    best_mm = reserve_of(all_listed.best.certificate)
    assert reserve_of(within_budget.best.certificate) >= best_mm - 1.0
    assert within_budget.found <= 15 < all_listed.found


def test_that_there_is_no_plan_is_said_by_one_question() -> None:
    within_budget, all_listed = both(BLOCKED)
    assert within_budget.found == all_listed.found == 0
    assert within_budget.best is None


def test_the_same_scene_has_the_same_answer() -> None:
    first, second = (BestPlanSynthesiser(EngineSynthesiser())(PAPER) for _ in range(2))
    untimed = (replace(one, seconds=0.0, loop_seconds=0.0) for one in (first, second))
    assert next(untimed) == next(untimed)


@dataclass
class Counted:
    """An engine that counts how many plans it is asked for."""

    asked: list[int] = field(default_factory=list)


def test_many_rolls_are_no_reason_to_list_all_plans(monkeypatch: pytest.MonkeyPatch) -> None:
    counted = Counted()
    whole = EngineSynthesiser.listed

    def listed(engine: EngineSynthesiser, where: Scene) -> Listing:
        counted.asked.append(engine.max_plans)
        return whole(engine, where)

    monkeypatch.setattr(EngineSynthesiser, "listed", listed)
    answer = BestPlanSynthesiser(EngineSynthesiser())(THREE_ROLLS)
    assert answer.best is not None
    assert set(counted.asked) == {1}
    assert len(counted.asked) <= 6


def test_few_sequences_are_listed() -> None:
    near = scene(CRITICAL, targets=[sphere("T", "target", (0.0, -12.0, 0.0), 3.0)])
    assert sequences(near) < sequences(PAPER) < sequences(THREE_ROLLS)
    within_budget, all_listed = both(near)
    assert within_budget.candidates == all_listed.candidates


@pytest.mark.parametrize("where", [PAPER, BESIDE], ids=lambda one: one.name)
def test_plans_of_a_stricter_model_hold(where: Scene) -> None:
    engine = EngineSynthesiser(ranking=ROBUST_RANKING)
    where = replace(where, resolution_per_mm=None)
    asked = replace(deeper(where, engine.margins.depth_mm + 0.05), safety="swept")
    plain, strict = engine(where), engine(where, asked)
    assert len(plain.candidates) < 0.9 * plain.found
    assert len(strict.candidates) == strict.found > 0
    # Those that end too near to the surface go on for another step.
    deep = {one for one in plain.candidates if one.certificate.target_depth_mm > 0.4}
    assert deep <= set(strict.candidates)
    within_budget = BestPlanSynthesiser(engine)(where, asked)
    assert len(within_budget.candidates) == within_budget.found > 0


@pytest.mark.parametrize("rolls", [1, 2])
def test_without_a_plan_of_the_stricter_model_that_of_the_scene_is_asked(rolls: int) -> None:
    where = replace(BESIDE, limits=replace(BESIDE.limits, max_rolls=rolls))
    asked = where.with_regions(*BLOCKED.criticals)
    engine = EngineSynthesiser()
    for ask in (engine, BestPlanSynthesiser(engine)):
        answer = ask(where, asked)
        assert answer.found > 0
        assert replace(answer, seconds=0.0) == replace(ask(where), seconds=0.0)
