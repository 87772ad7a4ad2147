"""A model for plans alone gives up paths early, and loses no plan."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen import checker
from ntagen.plan.actions import Action, Plan, Push, Roll
from ntagen.plan.extract import extract, step_length_mm
from ntagen.plan.synthesise import STRATEGY_QUERY
from ntagen.render import render
from ntagen.scene import Region, Scene
from tests.examples import examples
from tests.scenes import PAPER, lengths, scenes, with_limits


def plans_of(scene: Scene, *, only_plans: bool) -> tuple[set[Plan], int]:
    """All plans of a scene's model, and how many states were explored."""
    model = checker.load(render(scene, only_plans=only_plans))
    answer = model.check(STRATEGY_QUERY, plans="all", timeout_s=60.0)
    assert answer.verdict in ("satisfied", "not satisfied")
    found = extract(answer.plans, scene) if answer.verdict == "satisfied" else ()
    return set(found), answer.explored


@pytest.mark.parametrize("safety", ["sampled", "swept"])
@pytest.mark.parametrize("max_rolls", [0, 1, 2])
def test_the_paper_keeps_its_plans_and_explores_less(safety: str, max_rolls: int) -> None:
    scene = replace(with_limits(PAPER, max_rolls=max_rolls), safety=safety)
    usual, explored = plans_of(scene, only_plans=False)
    pruned, still_explored = plans_of(scene, only_plans=True)
    assert pruned == usual
    assert still_explored < explored


@st.composite
def aimed(draw: st.DrawFn) -> Scene:
    """Scenes whose last target lies about where some plan with at most two rolls ends."""
    scene = with_limits(draw(scenes()), max_rolls=draw(st.integers(0, 2)))
    step_mm = step_length_mm(scene)
    actions: list[Action] = [Push(step_mm * draw(st.integers(1, 8)))]
    for _ in range(scene.limits.max_rolls):
        actions.append(Roll(draw(st.sampled_from(scene.limits.roll_angles_rad))))
        actions.append(Push(step_mm * draw(st.integers(1, 8))))
    x, y, z = Plan.of(actions).arcs(scene.needle)[-1].end.position_mm
    dx, dy, dz = draw(st.tuples(*(lengths(-3.0, 3.0) for _ in range(3))))
    target = Region.ball("T", "target", (x + dx, y + dy, z + dz), draw(lengths(0.5, 5.0)))
    return replace(scene, targets=(target,))


@settings(max_examples=examples(100), deadline=None)
@given(aimed())
def test_any_scene_keeps_its_plans(scene: Scene) -> None:
    assert plans_of(scene, only_plans=True)[0] == plans_of(scene, only_plans=False)[0]


@settings(max_examples=examples(20), deadline=None)
@given(aimed())
def test_swept_scenes_keep_their_plans(scene: Scene) -> None:
    swept = replace(scene, safety="swept")
    assert plans_of(swept, only_plans=True)[0] == plans_of(swept, only_plans=False)[0]
