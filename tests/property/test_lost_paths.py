"""A game against tissue gives up paths early where the target is lost, and has the same winner."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen import checker
from ntagen.plan.synthesise import STRATEGY_QUERY
from ntagen.render import render
from ntagen.scene import Region, Scene, Tissue
from tests.examples import examples
from tests.property.test_only_plans import aimed
from tests.scenes import lengths

BISECTIONS = 7


@st.composite
def answered(draw: st.DrawFn) -> Scene:
    """Scenes with tissue that answers; some may be won if the target is large enough."""
    scene = draw(aimed())
    tissue = Tissue(
        "adversarial",
        draw(lengths(0.0, 0.3)),
        math.radians(draw(lengths(0.0, 15.0))),
        draw(lengths(0.0, 0.3)),
    )
    limits = replace(scene.limits, free_bevel=draw(st.booleans()))
    return replace(scene, tissue=tissue, limits=limits)


def wins(scene: Scene, radius_mm: float, *, only_plans: bool) -> bool:
    target = Region.ball("T", "target", scene.targets[0].center_mm, radius_mm)
    model = checker.load(render(replace(scene, targets=(target,)), only_plans=only_plans))
    answer = model.check(STRATEGY_QUERY, timeout_s=60.0)
    assert answer.verdict in ("satisfied", "not satisfied")
    return answer.verdict == "satisfied"


@pytest.mark.slow
@settings(max_examples=examples(12), deadline=None)
@given(answered())
def test_the_least_target_that_is_reached_stays(scene: Scene) -> None:
    # Where the winner changes, a cut that takes too much is seen first.
    least_mm, most_mm = 0.4, 10.0
    for _ in range(BISECTIONS):
        radius_mm = (least_mm + most_mm) / 2
        is_won = wins(scene, radius_mm, only_plans=False)
        assert wins(scene, radius_mm, only_plans=True) == is_won
        least_mm, most_mm = (least_mm, radius_mm) if is_won else (radius_mm, most_mm)
