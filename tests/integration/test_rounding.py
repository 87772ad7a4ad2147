"""Rounding decides no verdict where the resolution is chosen; where it is coarse, it may."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ntagen import checker, nsl
from ntagen.render import render
from ntagen.rounding import chosen
from ntagen.scene import Scene
from tests.oracles.exact_plans import Ball, Rod, Steering, has_plan

WIDE = """environment wide {
  needle { radius 196.2 mm  speed 1 mm/s  length 120 mm }
  motion { step 2 s  roll by 60, 120, 180, 240, 300 deg  at most 2 times  at least 4 mm apart }
  target T sphere (-7.46, -65.27, -1.14) mm  radius 4 mm
  critical C0 capsule (2.84, -27.2, -1.09) mm to (-6.57, -24.525, -6.47) mm  radius 2 mm
  critical C1 sphere (8.75, -53.09, -6.78) mm  radius 5 mm
  safety swept
}
"""
TASK = Steering(
    radius=196.2,
    push=2.0,
    length=120.0,
    angles=(60, 120, 180, 240, 300),
    most_rolls=2,
    between=2,
    target=Ball((-7.46, -65.27, -1.14), 4.0),
    avoided=(
        Rod((2.84, -27.2, -1.09), (-6.57, -24.525, -6.47), 2.0),
        Ball((8.75, -53.09, -6.78), 5.0),
    ),
)


def has_strategy(scene: Scene) -> bool | None:
    return checker.load(render(scene)).check("control: A<> Checker.Final_TR_Reached").satisfied


def test_a_chosen_resolution_finds_the_plans_that_a_coarse_one_loses() -> None:
    assert has_plan(TASK, 0.1)
    wide = nsl.loads_task(WIDE)
    scene = wide.scene
    assert wide.warnings == ()
    assert has_strategy(scene)
    coarse = nsl.loads_task(WIDE.replace("swept", "swept  resolution 1000 per mm"))
    (warning,) = coarse.warnings
    assert not has_strategy(coarse.scene)
    assert warning.code == "N096"
    assert f"write `{chosen(scene).per_mm} per mm`" in (warning.hint or "")


@pytest.mark.parametrize("per_mm", [100_000, 1_000_000])
def test_a_written_resolution_is_kept(per_mm: int) -> None:
    scene = nsl.loads(WIDE.replace("swept", f"swept  resolution {per_mm} per mm"))
    assert scene.resolution_per_mm == per_mm
    assert f"_SI_ = {per_mm};" in render(scene)


def test_the_model_of_a_chosen_resolution_is_that_of_the_same_one_written() -> None:
    scene = nsl.loads(WIDE)
    assert scene.resolution_per_mm is None
    assert render(scene) == render(replace(scene, resolution_per_mm=chosen(scene).per_mm))


def test_an_oracle_that_cannot_fail_would_be_none() -> None:
    """The enumeration on exact circles sees a wall, and the way past it."""
    wall = Ball((0.0, -30.0, 0.0), 20.0)
    assert not has_plan(replace(TASK, avoided=(wall,)), 0.0)
    assert has_plan(replace(TASK, avoided=()), 0.0)
