"""Whole drives on the virtual needle, with plans from the independent planner."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from ntagen.drive.records import Command, Estimated, Learned, Measured, Synthesised, Transition
from ntagen.drive.settings import Settings
from ntagen.drive.states import Event, State
from ntagen.errors import DeviceError, LimitError, ModelError
from ntagen.needle.virtual import Errors, SimulatedClock, VirtualNeedle
from ntagen.nsl import load
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Region, Scene
from tests.drive.runs import Diary, drive
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import HIDDEN, PAPER, scene, sphere

EXAMPLES = Path(__file__).parents[2] / "examples"
RUNS = 4
"""So many seeds has a slow test; `tests/benchmarks/drives.py` drives hundreds."""


def seeds(noise_mm: float, count: int = RUNS) -> range:
    """Seeds to try: without errors all of them give the same run."""
    return range(1, 1 + count) if noise_mm else range(1, 2)


def check_reached(scene: Scene, known: str, noise_mm: float, seeds: range) -> None:
    for seed in seeds:
        result, _ = drive(scene, known=known, noise_mm=noise_mm, seed=seed)
        assert result.ended.outcome == State.TARGET_REACHED.value, (seed, result.ended)
        assert result.clearance_mm > 0.0, seed
        assert result.target_distance_mm <= 0.1, seed


@pytest.mark.parametrize("noise_mm", [0.0, 0.1])
def test_the_paper_instance_is_reached(noise_mm: float) -> None:
    check_reached(PAPER, "all", noise_mm, seeds(noise_mm, 2))


@pytest.mark.slow
def test_the_paper_instance_is_reached_every_time() -> None:
    check_reached(PAPER, "all", 0.1, seeds(0.1))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["no_cr", "small_mid_cr", "surface_crs", "tunnel_crs"])
@pytest.mark.parametrize("noise_mm", [0.0, 0.1])
def test_the_scenarios_are_reached_every_time(name: str, noise_mm: float) -> None:
    where = load(EXAMPLES / "scenarios" / f"{name}.nsl")
    check_reached(where, "all", noise_mm, seeds(noise_mm))


@pytest.mark.parametrize("noise_mm", [0.0, 0.1])
def test_a_blocked_target_ends_at_once_where_the_needle_is(noise_mm: float) -> None:
    blocked = load(EXAMPLES / "scenarios" / "large_mid_cr.nsl")
    result, diary = drive(blocked, noise_mm=noise_mm)
    assert result.ended.outcome == State.NO_STRATEGY.value
    assert result.ended.adjustments == 0
    assert result.ended.depth_mm == pytest.approx(5.0)
    assert not [c for c in diary.of(Command) if c.kind in ("pull", "roll")]


def check_felt_and_avoided(noise_mm: float, seed: int) -> bool:
    """Checks that the region is felt and not pierced; returns whether the target was reached."""
    result, diary = drive(HIDDEN, known="C1", noise_mm=noise_mm, seed=seed)
    forces = [m.force_n for m in diary.of(Measured)]
    events = [t.event for t in diary.of(Transition)]
    assert Event.FORCE.value in events
    # Felt within a fraction of the margin: threshold, one piece of a push, and what the known
    # region beside it explains.
    felt_mm = 0.1 + 0.25 + (0.25 + noise_mm)
    assert max(forces) <= felt_mm + 1e-9
    assert result.clearance_mm >= 3.0 - felt_mm - 1e-9
    assert diary.of(Learned)
    assert result.ended.adjustments >= 1
    return result.ended.outcome == State.TARGET_REACHED.value


@pytest.mark.parametrize("noise_mm", [0.0, 0.1])
def test_a_region_that_was_not_told_is_felt_and_avoided(noise_mm: float) -> None:
    assert check_felt_and_avoided(noise_mm, 1)


@pytest.mark.slow
def test_a_region_that_was_not_told_is_never_pierced() -> None:
    reached = sum(check_felt_and_avoided(0.1, seed) for seed in seeds(0.1))
    # A region that is felt from three sides can leave no plan that ends in time.
    assert reached >= RUNS - 1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["small_mid_cr", "large_mid_cr", "surface_crs", "tunnel_crs"])
def test_no_region_is_ever_pierced_whatever_is_known(name: str) -> None:
    where = load(EXAMPLES / "scenarios" / f"{name}.nsl")
    for seed in seeds(0.1):
        result, _ = drive(where, known="none", noise_mm=0.1, roll_rad=0.05, seed=seed)
        assert result.clearance_mm > 0.0, (seed, result.ended)


@pytest.mark.slow
def test_roll_errors_are_seen_and_driven_around() -> None:
    noticed = 0
    for seed in range(1, 1 + RUNS):
        result, diary = drive(PAPER, roll_rad=math.radians(12.0), noise_mm=0.05, seed=seed)
        assert result.clearance_mm > 0.0
        assert result.ended.outcome == State.TARGET_REACHED.value
        events = [t.event for t in diary.of(Transition)]
        noticed += events.count(Event.DEVIATION.value) + events.count(Event.PLAN_FAILS.value)
    assert noticed > 0


def test_several_targets_are_visited_in_their_order() -> None:
    near = sphere("near", "target", (0.0, -20.0, -4.0), 4.0)
    far = sphere("far", "target", (0.0, -45.0, 0.0), 8.0)
    result, diary = drive(scene(targets=[near, far]))
    assert result.ended.outcome == State.TARGET_REACHED.value
    # From the entry, and after the initial push.
    assert len(diary.syntheses) == 2


def test_the_time_limit_ends_the_run_with_the_needle_stopped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Slow(VirtualNeedle):
        """A needle that needs twice as long as it is said to."""

        def push(self, length_mm: float) -> None:
            super().push(length_mm)
            self._clock.advance(length_mm / self._needle.speed_mm_per_s)

    monkeypatch.setattr("ntagen.drive.simulate.VirtualNeedle", Slow)
    result, diary = drive(PAPER, settings=Settings(timeout_s=60.0))
    assert result.ended.outcome == State.TIMED_OUT.value
    # At most one push or roll begins before the limit and ends after it.
    assert 60.0 <= result.ended.time_s <= 60.0 + 1.5
    assert diary.of(Command)[-1].kind == "stop"


def test_plans_that_the_time_limit_would_cut_are_not_begun() -> None:
    result, diary = drive(PAPER, settings=Settings(timeout_s=30.0))
    assert result.ended.outcome == State.NO_TIME_LEFT.value
    assert diary.of(Synthesised)[0].found > 0
    assert diary.of(Synthesised)[0].accepted == 0
    assert result.ended.depth_mm == 0.0


def test_rolls_take_time_too() -> None:
    shortest_s = (
        min(candidate.plan.length_mm for candidate in oracle_synthesis(PAPER).candidates)
        / PAPER.needle.speed_mm_per_s
    )
    slow = Settings(timeout_s=shortest_s + 1.0, roll_rad_per_s=0.1)
    result, diary = drive(PAPER, settings=slow)
    assert result.ended.outcome == State.NO_TIME_LEFT.value
    assert not [c for c in diary.of(Command) if c.kind != "stop"]


SEEDS = [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))]
"""One of them is enough for a quick look."""


@pytest.mark.parametrize("seed", SEEDS)
def test_the_first_push_belongs_to_a_plan(seed: int) -> None:
    beside = sphere("K", "critical", (0.0, -4.9, -0.75), 0.5)
    result, diary = drive(scene(beside), noise_mm=0.05, seed=seed)
    assert result.ended.outcome == State.TARGET_REACHED.value
    assert result.clearance_mm > 0.0
    # From the entry the plans that hold roll first.
    assert diary.of(Command)[0].kind == "roll"
    events = [t.event for t in diary.of(Transition)]
    assert Event.FIRST_STRATEGY.value in events


def test_without_a_plan_a_push_near_a_known_region_is_not_made() -> None:
    # The target lies behind the needle: no plan leads there.
    behind = sphere("T", "target", (0.0, 40.0, 0.0), 5.0)
    near = sphere("K", "critical", (0.0, -4.9, -0.75), 0.5)
    free, _ = drive(scene(targets=[behind]))
    assert (free.ended.outcome, free.ended.depth_mm) == (State.NO_STRATEGY.value, 5.0)
    refused, _ = drive(scene(near, targets=[behind]))
    assert (refused.ended.outcome, refused.ended.depth_mm) == (State.NO_STRATEGY.value, 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_shell_around_the_entry_may_be_left(seed: int) -> None:
    beside = sphere("K", "critical", (3.0, 1.0, 0.0), 1.5)
    shell = Region.ball("D", "detection", (3.0, 1.0, 0.0), 4.5, around="K")
    result, _ = drive(scene(beside, shell), noise_mm=0.1, seed=seed)
    assert result.ended.outcome == State.TARGET_REACHED.value
    assert result.clearance_mm > 0.0


@pytest.mark.parametrize("noise_mm", [0.5, 1.0, 2.0])
def test_noise_that_the_estimator_knows_is_no_deviation(noise_mm: float) -> None:
    result, diary = drive(PAPER, noise_mm=noise_mm, seed=3)
    assert Event.DEVIATION.value not in [t.event for t in diary.of(Transition)]
    assert result.ended.outcome == State.TARGET_REACHED.value


def test_pulling_back_stays_in_the_channel_and_undoes_rolls() -> None:
    result, diary = drive(HIDDEN, known="C1")
    commands = diary.of(Command)
    first_pull = next(i for i, c in enumerate(commands) if c.kind == "pull")
    assert commands[first_pull - 1].kind == "stop" or commands[first_pull - 2].kind == "stop"
    assert sum(c.value for c in commands if c.kind == "push") == pytest.approx(
        result.ended.depth_mm + sum(c.value for c in commands if c.kind == "pull")
    )


def test_the_estimate_is_exact_when_nothing_errs() -> None:
    _, diary = drive(PAPER)
    for estimate in diary.of(Estimated):
        assert estimate.radius_mm == pytest.approx(30.0)
        assert estimate.rms_mm < 1e-9


def test_the_same_seed_gives_the_same_run() -> None:
    first, second = (drive(HIDDEN, known="C1", noise_mm=0.1, seed=4)[1] for _ in range(2))
    assert first.records == second.records


def test_plans_that_fail_their_certificate_are_not_driven() -> None:
    # The only way to this target leads through a region that no sample of a 2 mm step meets.
    eye = sphere("C", "critical", (0.0, -9.0, -1.3), 0.3)
    where = scene(eye, targets=[sphere("T", "target", (0.0, -13.6, -3.2), 0.9)])
    result, diary = drive(where, settings=Settings(initial_push_mm=2.0))
    assert diary.of(Synthesised)[0].found > 0
    assert diary.of(Synthesised)[0].accepted < diary.of(Synthesised)[0].found
    assert result.ended.outcome in (State.NONE_HOLDS.value, State.TARGET_REACHED.value)
    assert result.clearance_mm > 0.0


def failing(error: Exception, after: int) -> type[VirtualNeedle]:
    class Failing(VirtualNeedle):
        """A needle that breaks after some pushes."""

        pushes = 0
        stops = 0

        def push(self, length_mm: float) -> None:
            Failing.pushes += 1
            if Failing.pushes > after:
                raise error
            super().push(length_mm)

        def stop(self) -> None:
            Failing.stops += 1
            super().stop()

    return Failing


@pytest.mark.parametrize("after", [3, 60])
@pytest.mark.parametrize(
    ("error", "outcome"),
    [
        (DeviceError("the carriage is stuck"), State.FAULTED),
        (KeyboardInterrupt(), State.INTERRUPTED),
    ],
)
def test_what_comes_from_outside_stops_the_needle_and_ends_the_run(
    monkeypatch: pytest.MonkeyPatch, after: int, error: Exception, outcome: State
) -> None:
    needle = failing(error, after)
    monkeypatch.setattr("ntagen.drive.simulate.VirtualNeedle", needle)
    result, _ = drive(PAPER)
    assert result.ended.outcome == outcome.value
    assert needle.stops >= 1  # type: ignore[attr-defined]


def test_a_mistake_of_ours_stops_the_needle_too(monkeypatch: pytest.MonkeyPatch) -> None:
    needle = failing(DeviceError(""), 10**9)
    monkeypatch.setattr("ntagen.drive.simulate.VirtualNeedle", needle)

    def broken(_: Scene) -> Synthesis:
        raise ModelError("the model fails")

    with pytest.raises(ModelError):
        drive(PAPER, synthesise=broken)
    assert needle.stops == 1  # type: ignore[attr-defined]


def test_a_synthesis_without_an_answer_ends_the_run_in_order() -> None:
    def slow(_: Scene) -> Synthesis:
        raise LimitError("no answer from the engine: stopped by time")

    result, _ = drive(PAPER, synthesise=slow)
    assert result.ended.outcome == State.TIMED_OUT.value
    assert "stopped by time" in result.ended.reason


def test_a_reading_that_is_no_number_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    class Blind(VirtualNeedle):
        """A needle whose sensor reports nonsense after a while."""

        def measure(self) -> object:  # type: ignore[override]
            reading = super().measure()
            if self.now_s() < 3.0:
                return reading
            return replace(reading, position_mm=(math.nan, 0.0, 0.0))

    monkeypatch.setattr("ntagen.drive.simulate.VirtualNeedle", Blind)
    result, _ = drive(PAPER)
    assert result.ended.outcome == State.FAULTED.value
    assert "not a number" in result.ended.reason


def test_the_driver_never_sees_the_true_state() -> None:
    needle = VirtualNeedle(PAPER.needle, (), Errors(), 1, SimulatedClock())
    told = {name for name in dir(needle) if not name.startswith("_")}
    hidden = {"true_tip", "pierced", "true_clearance_mm"}
    source = (Path(__file__).parents[2] / "ntagen/drive/controller.py").read_text()
    assert hidden <= told
    assert not [name for name in hidden if name in source]


def test_a_diary_of_a_run_names_its_syntheses() -> None:
    _, diary = drive(PAPER)
    assert isinstance(diary, Diary)
    assert [s.number for s in diary.of(Synthesised)] == list(range(1, len(diary.syntheses) + 1))
    assert oracle_synthesis(diary.syntheses[0].scene) == diary.syntheses[0]
