"""Runs with faults at random moments; `tests/benchmarks/faults.py` makes many more of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from ntagen.drive.reading import read_log
from ntagen.drive.records import Command, Ended, JournalError, Measured, Record, Transition
from ntagen.drive.replay import replay
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate, synthesiser_for
from ntagen.drive.states import State
from ntagen.errors import ModelError
from ntagen.needle.virtual import Errors, Obstacle, SimulatedClock, VirtualNeedle
from ntagen.nsl import load
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Needle, Scene
from tests.drive.runs import Diary
from tests.faults.catalogue import FAULTS, Fault
from tests.faults.live import LIVE, run_live
from tests.faults.rig import Rig
from tests.faults.runs import EXAMPLES, OVER, Finding, run
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import PAPER


def check(fault: Fault, needle: str, seeds: range) -> list[Finding]:
    findings = [run(fault, needle, seed) for seed in seeds]
    assert [
        (seed, what) for seed, one in zip(seeds, findings, strict=True) for what in one.wrong
    ] == []
    return findings


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_run_with_a_fault_ends_well(fault: Fault) -> None:
    check(fault, "virtual", range(1))


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_runs_with_a_fault_end_well(fault: Fault) -> None:
    found = [one for needle in ("virtual", "phantom") for one in check(fault, needle, range(1, 2))]
    assert {one.outcome for one in found} != {OVER}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SIGTERM", "SIGKILL", "suspended", "cable pulled", "disk full"])
def test_a_driver_in_a_lab_ends_well(name: str, tmp_path: Path) -> None:
    """`tests/benchmarks/lab_faults.py` has more of them."""
    fault = next(one for one in LIVE if one.name == name)
    assert run_live(fault, "virtual", 0, tmp_path).wrong == []


def test_a_run_without_a_fault_reaches_the_target() -> None:
    """What the runs with faults are compared with; the rig itself breaks nothing."""
    for watched in (False, True):
        rig = Rig(load(EXAMPLES / "paper.nsl"), "virtual", "all", 1, watched=watched)
        assert rig.drive(lambda _: None).ended.outcome == State.TARGET_REACHED.value


def test_a_log_that_is_full_ends_the_run_and_others_tell_it(tmp_path: Path) -> None:
    rig = Rig(load(EXAMPLES / "paper.nsl"), "virtual", "all", 1, folder=tmp_path)
    ended = rig.drive(lambda r: r.emulator.after(9.0, r.fill_disk)).ended
    assert ended.outcome == State.FAULTED.value
    assert "no space left on device" in ended.reason
    logged = list(read_log(tmp_path / "run.mcap").records)
    assert logged == rig.diary.records[: len(logged)]
    assert rig.diary.records[-2] == ended


class Unwritable(Diary):
    """A journal that cannot keep the first record that a test means; it is told once."""

    def __init__(self, means: Callable[[Record], bool]) -> None:
        super().__init__()
        self._means = means
        self.failures = 0

    def record(self, record: Record) -> None:
        if not self.failures and self._means(record):
            self.failures += 1
            raise JournalError("no space left")
        super().record(record)


def is_stop(record: Record) -> bool:
    return isinstance(record, Command) and record.kind == "stop"


def is_arrival(record: Record) -> bool:
    return isinstance(record, Transition) and record.following == State.TARGET_REACHED.value


@pytest.mark.parametrize(
    "means",
    [
        lambda record: isinstance(record, Measured),
        lambda record: isinstance(record, Command),
        is_arrival,
        is_stop,
        lambda record: isinstance(record, Ended),
    ],
    ids=["measured", "command", "transition", "stop", "ended"],
)
def test_a_record_that_cannot_be_kept_ends_the_run_with_the_needle_stopped(
    monkeypatch: pytest.MonkeyPatch, means: Callable[[Record], bool]
) -> None:
    stops: list[float] = []
    monkeypatch.setattr(VirtualNeedle, "stop", lambda self: stops.append(self.now_s()))
    journal = Unwritable(means)
    ended = simulate(PAPER, oracle_synthesis, Settings(), journal).ended
    assert journal.failures == 1
    assert stops
    assert (ended.outcome, ended.reason) == (State.FAULTED.value, "no space left")
    assert journal.of(Ended) == [ended]


@pytest.mark.parametrize("error", [ModelError("it fails"), MemoryError(), ValueError("a bug")])
def test_a_mistake_of_ours_is_told_by_the_journal(error: Exception) -> None:
    calls = 0

    def broken(scene: Scene) -> Synthesis:
        nonlocal calls
        calls += 1
        if calls > 1:
            raise error
        return oracle_synthesis(scene)

    diary = Diary()
    with pytest.raises(type(error)):
        simulate(PAPER, broken, Settings(), diary)
    *_, turn, stop, ended, _ = diary.records
    assert isinstance(turn, Transition)
    assert turn.following == State.FAULTED.value
    assert is_stop(stop)
    assert isinstance(ended, Ended)
    assert ended.outcome == State.FAULTED.value
    assert ended.reason.startswith(f"internal error: {type(error).__name__}: {error}")
    assert ended.depth_mm > 0.0


def test_an_interruption_between_two_tasks_writes_nothing_more() -> None:
    class Interrupted(Diary):
        """A journal in which a second Ctrl-C comes in the middle of a record."""

        def record(self, record: Record) -> None:
            if isinstance(record, Transition):
                raise KeyboardInterrupt
            super().record(record)

    diary = Interrupted()
    with pytest.raises(KeyboardInterrupt):
        simulate(PAPER, oracle_synthesis, Settings(), diary)
    assert not diary.of(Ended)


@pytest.mark.parametrize("delay_s", [30.0, 200.0])
def test_a_run_with_a_late_synthesis_is_decided_again(tmp_path: Path, delay_s: float) -> None:
    rig = Rig(load(EXAMPLES / "paper.nsl"), "phantom", "all", 1, folder=tmp_path)

    def wait() -> None:
        if rig.syntheses == 2:
            rig.emulator.advance(rig.emulator.now_s + delay_s)

    rig.before_synthesis = wait
    ended = rig.drive(lambda _: None).ended
    assert (ended.outcome == State.TARGET_REACHED.value) == (delay_s < 100.0)
    log = read_log(tmp_path / "run.mcap")
    again = replay(log, synthesiser_for(rig.configuration.settings))
    assert again.is_same
    assert again.complete


def test_the_clock_of_a_device_may_begin_anywhere() -> None:
    def make(needle: Needle, obstacles: tuple[Obstacle, ...], seed: int) -> VirtualNeedle:
        clock = SimulatedClock()
        clock.advance(1e6)
        return VirtualNeedle(needle, obstacles, Errors(), seed, clock)

    ended = simulate(PAPER, oracle_synthesis, Settings(), Diary(), make=make).ended
    assert ended.outcome == State.TARGET_REACHED.value
