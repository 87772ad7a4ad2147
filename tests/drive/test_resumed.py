"""Runs that are cut off and go on from their logs; `tests.benchmarks.cuts` makes many."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ntagen.drive.log import Log, metadata_of
from ntagen.drive.past import Leg, depth_mm
from ntagen.drive.reading import read_log
from ntagen.drive.records import (
    Answered,
    Command,
    Ended,
    Found,
    Journals,
    Learned,
    Record,
    Transition,
)
from ntagen.drive.replay import replay
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import Result, simulate
from ntagen.errors import InputError
from ntagen.needle.virtual import Errors
from tests.drive.runs import Diary
from tests.faults.cuts import attempt
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import HIDDEN

SETTINGS = Settings()


class _Cut(BaseException):
    """The driver is no more."""


class _Cutting(Diary):
    """A diary after so many records of which the driver is no more."""

    def __init__(self, after: int) -> None:
        super().__init__()
        self._after = after

    def record(self, record: Record) -> None:
        super().record(record)
        if len(self.records) == self._after:
            raise _Cut


def drive(
    diary: Diary, *legs: Leg, agrees: bool = True, log: Log | None = None, seed: int = 2
) -> Result:
    return simulate(
        HIDDEN,
        oracle_synthesis,
        SETTINGS,
        Journals(diary, *([log] if log else [])),
        known="C1",
        errors=Errors(0.1),
        seed=seed,
        legs=legs,
        ask=lambda question: agrees or "pulled back" in question,
    )


def cut(after: int, *legs: Leg) -> Leg:
    """A run that is cut off after so many records."""
    diary = _Cutting(after)
    with pytest.raises(_Cut):
        drive(diary, *legs)
    # What the driver does when it ends is not done by one that is no more.
    return Leg.of(diary.records[:after])


@pytest.fixture(scope="module")
def whole() -> list[Record]:
    """The run, if nobody cuts it off."""
    diary = Diary()
    assert drive(diary).ended.outcome == "target reached"
    assert diary.of(Learned), "the run must learn a region"
    return diary.records


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_run_goes_on_from_anywhere(whole: list[Record], share: float) -> None:
    leg = cut(int(share * len(whole)))
    diary = Diary()
    result = drive(diary, leg)
    assert result.ended.outcome == "target reached"
    assert result.clearance_mm > 0.0
    found = diary.of(Found)[0]
    assert found.depth_mm == pytest.approx(depth_mm([leg]) + _pushed_mm(leg), abs=1e-6)
    first = next(i for i, record in enumerate(diary.records) if isinstance(record, Command))
    assert any(isinstance(record, Answered) for record in diary.records[:first])


def _pushed_mm(leg: Leg) -> float:
    """How far the motion went in which the run was cut off: a simulated needle ends it."""
    if leg.pending is None or leg.pending.kind == "roll":
        return 0.0
    return leg.pending.value if leg.pending.kind == "push" else -leg.pending.value


def test_what_was_felt_before_the_cut_is_known_after_it(whole: list[Record]) -> None:
    at = next(
        i for i, one in enumerate(whole) if isinstance(one, Transition) and one.event == "force"
    )
    for after in (at, at + 2):
        diary = Diary()
        result = drive(diary, cut(after))
        assert result.clearance_mm > 0.0
        assert len(diary.of(Learned)) >= 1


def test_a_run_that_goes_on_twice_is_decided_again(whole: list[Record], tmp_path: Path) -> None:
    first = cut(int(0.3 * len(whole)))
    second = cut(40, first)
    assert second.pending is None or second.pending.kind in ("push", "pull", "roll")
    diary = Diary()
    assert drive(diary, first, second).ended.outcome == "target reached"
    assert len(diary.of(Found)) == 1


def test_the_needle_is_pulled_out_without_a_turn(whole: list[Record]) -> None:
    diary = Diary()
    result = drive(diary, cut(int(0.6 * len(whole))), agrees=False)
    assert (result.ended.outcome, result.ended.depth_mm) == ("pulled back", pytest.approx(0.0))
    assert {one.kind for one in diary.of(Command)} == {"pull", "stop"}


def test_runs_that_are_decided_otherwise_now_are_refused(whole: list[Record]) -> None:
    leg = cut(int(0.6 * len(whole)))
    changed = [
        Transition(one.time_s, one.state, "plan done", one.following)
        if isinstance(one, Transition) and one.event == "acted"
        else one
        for one in leg.records
    ]
    diary = Diary()
    with pytest.raises(InputError, match="decided otherwise now"):
        drive(diary, Leg(tuple(changed), None, None))
    assert diary.records == []


def test_another_simulated_needle_is_refused(whole: list[Record]) -> None:
    leg = cut(int(0.6 * len(whole)))
    with pytest.raises(InputError, match="measured elsewhere now"):
        drive(Diary(), leg, seed=3)


def test_a_log_without_its_end_tells_how_it_ended(whole: list[Record], tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with Log(path, metadata_of({"settings": SETTINGS.to_json()}), {}) as log:
        drive(Diary(), log=log)
    leg = Leg.of(read_log(path).records)
    assert isinstance(leg.ended, Ended)
    assert leg.pending is None
    assert replay(read_log(path), oracle_synthesis).complete


@pytest.mark.slow
@pytest.mark.parametrize("way", ["power of all", "power of the computer", "kill, and again"])
def test_a_needle_behind_a_controller_never_moves_wrongly(way: str) -> None:
    trial = attempt(way, 5)
    assert trial.wrong == []
    assert trial.outcome in ("target reached", "pulled back", "refused"), trial


@pytest.mark.slow
def test_a_driver_that_was_killed_in_a_lab_goes_on_by_the_bevel(tmp_path: Path) -> None:
    from tests.faults.live import ROOT, Bench

    pty = pytest.importorskip("pty")
    log = tmp_path / "run.mcap"
    bench = Bench("virtual", 1, log)
    with bench.lab:
        bench.start()
        bench.wait_for_log()
        end_s = time.monotonic() + 60.0
        while bench.depth_mm() < 8.0 and time.monotonic() < end_s:
            time.sleep(0.05)
        bench.process.send_signal(signal.SIGKILL)
        bench.finish()
        time.sleep(1.0)
        with bench.lab.lock:
            bench.lab.emulator.power_on()
        ours, theirs = pty.openpty()
        words = [sys.executable, "-m", "ntagen", "drive", "--resume", str(log), "--json"]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        with subprocess.Popen(
            words, stdin=theirs, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment
        ) as process:
            os.write(ours, b"y\n")
            out, errors = process.communicate(timeout=120)
        os.close(theirs)
        os.close(ours)
        summary = json.loads(out)
        assert summary["outcome"] == "target reached", errors
        assert b"it has lost its position" in errors
        assert b"turned as the tracker sees its bevel" in errors
        truth = bench.lab.truth()
    assert truth.clearance_mm > 0.0
    assert truth.target_distance_mm <= 0.0
