"""Drives of needles that do not bend as planned: plans are renewed early, and runs end early."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from pathlib import Path

import pytest

from ntagen.drive.configure import configure
from ntagen.drive.records import Command, Synthesised, Transition
from ntagen.drive.simulate import Result, simulate, synthesiser_for
from ntagen.drive.states import Event, State
from ntagen.nsl import load
from ntagen.parameters import BY_WORDS, Given
from ntagen.scene import Scene
from tests.drive.runs import Diary
from tests.steering import ENTRY, PAPER, scene, sphere

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

NEAR = scene(targets=[sphere("T1", "target", (0.0, -20.0, 0.0), 8.0)], name="near")


# A gap through which a needle passes with 0.2 mm on both sides.
GAP = scene(
    sphere("C1", "critical", (5.2, -4.0, 0.0), 5.0),
    sphere("C2", "critical", (-5.2, -4.0, 0.0), 5.0),
    targets=[sphere("T1", "target", (0.0, -20.0, -4.0), 4.0)],
    name="gap",
)


def phantom_drive(where: Scene, seed: int, accept: str = "0.98") -> tuple[Result, Diary]:
    """A run of a phantom needle with plans of the engine."""
    parameter = BY_WORDS["accept"]
    given = [Given(parameter, parameter.parse(accept), "a test")]
    configuration = configure(given, where, needle="phantom")
    settings, diary = configuration.settings, Diary()
    make = configuration.needle.make
    return simulate(where, synthesiser_for(settings), settings, diary, make=make, seed=seed), diary


def events_of(diary: Diary, state: State) -> list[str]:
    """The events of one state, without routine."""
    events = [one.event for one in diary.of(Transition) if one.state == state.value]
    return [event for event in events if event != Event.AS_PREDICTED.value]


def test_a_run_ends_when_the_tip_is_in_the_target_for_sure() -> None:
    result, diary = phantom_drive(NEAR, seed=1)
    assert result.ended.outcome == State.TARGET_REACHED.value
    assert events_of(diary, State.MONITOR)[-1] == Event.IN_TARGET.value
    # Deep enough, and no deeper than it takes to be sure.
    assert 0.2 < -result.target_distance_mm < 1.5


def test_the_end_says_how_sure_it_is_and_how_much_was_cut() -> None:
    ended = phantom_drive(NEAR, seed=1)[0].ended
    assert 0.98 <= ended.confidence <= 1.0
    assert 0.0 < ended.error_mm < 0.3
    assert ended.cut_mm == pytest.approx(ended.depth_mm)


def test_nothing_moves_if_no_plan_is_sure_enough_until_less_is_accepted() -> None:
    result, diary = phantom_drive(GAP, seed=1)
    ended = result.ended
    assert ended.outcome == State.NONE_HOLDS.value
    said = re.search(r"the confidence of the best one is (0\.\d+)", ended.reason)
    assert said is not None
    assert [one.kind for one in diary.of(Command)] == ["stop"]
    less = f"{float(said[1]) - 0.001:.3f}"
    result, diary = phantom_drive(GAP, seed=1, accept=less)
    assert any(one.kind == "push" for one in diary.of(Command))


def test_a_plan_with_little_reserve_is_renewed_while_it_holds() -> None:
    result, diary = phantom_drive(PAPER, seed=1)
    assert result.ended.outcome == State.TARGET_REACHED.value
    assert result.clearance_mm > 0.0
    events = events_of(diary, State.MONITOR)
    assert events.count(Event.PLAN_IS_THIN.value) >= 1
    assert result.ended.adjustments == 0
    # Each renewal is a synthesis where the needle is; there was always a plan.
    renewed = [one for one in diary.of(Synthesised) if one.depth_mm > 5.0]
    assert len(renewed) >= events.count(Event.PLAN_IS_THIN.value)
    assert all(one.plan for one in renewed)


def bending(number: int) -> Scene:
    """A random task: a needle that bends little or much, and a target that is small and deep."""
    draw = random.Random(f"bending {number}")
    depth_mm = draw.uniform(45.0, 75.0)
    middle = (draw.uniform(-6.0, 6.0), -depth_mm, draw.uniform(-6.0, 6.0))
    critical = sphere(
        "C", "critical", (draw.uniform(-10.0, 10.0), -0.5 * depth_mm, draw.uniform(5.0, 10.0)), 3.0
    )
    task = scene(critical, targets=[sphere("T", "target", middle, draw.choice([4.0, 5.0]))])
    return replace(task.with_needle(ENTRY, draw.choice([30.0, 45.0, 60.0, 100.0])), name="bending")


@pytest.mark.slow
def test_random_tasks_are_reached_with_a_needle_that_is_not_exact() -> None:
    ends = [phantom_drive(bending(number), seed=number)[0] for number in range(16)]
    assert all(end.clearance_mm > 0.0 for end in ends)
    reached = [end for end in ends if end.ended.outcome == State.TARGET_REACHED.value]
    assert len(reached) >= 15, [end.ended for end in ends]
    assert all(end.target_distance_mm <= 0.1 for end in reached)


@pytest.mark.parametrize("name", ["bevel_tip", "bent_tip"])
def test_needles_that_bend_as_real_ones_reach_their_targets(name: str) -> None:
    where = load(EXAMPLES / "needles" / f"{name}.nsl")
    result, _ = phantom_drive(where, seed=2)
    assert result.ended.outcome == State.TARGET_REACHED.value
    assert result.target_distance_mm < 0.0 < result.clearance_mm
