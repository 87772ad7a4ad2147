"""Drives of needles that do not bend as planned: plans are renewed early, and runs end early."""

from __future__ import annotations

from ntagen.drive.configure import configure
from ntagen.drive.records import Synthesised, Transition
from ntagen.drive.simulate import Result, simulate, synthesiser_for
from ntagen.drive.states import Event, State
from ntagen.scene import Scene
from tests.drive.runs import Diary
from tests.steering import PAPER, scene, sphere

NEAR = scene(targets=[sphere("T1", "target", (0.0, -20.0, 0.0), 8.0)], name="near")


def phantom_drive(where: Scene, seed: int) -> tuple[Result, Diary]:
    """A run of a phantom needle with plans of the engine."""
    configuration = configure([], where, needle="phantom")
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
