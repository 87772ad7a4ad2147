"""Runs that a signal ends at any moment: the log is whole, and the same is decided again.

By default few moments are tried; ``NTAGEN_INTERRUPTIONS=100`` tries so many for each signal.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ntagen.drive.log import Log, metadata_of
from ntagen.drive.operator import Operator
from ntagen.drive.reading import read_log
from ntagen.drive.records import Command, Ended, Journals, Record, Synthesised
from ntagen.drive.replay import replay
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate
from ntagen.drive.states import State
from ntagen.errors import DeviceError, LimitError
from ntagen.needle.virtual import Errors, VirtualNeedle
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import HIDDEN

ROOT = Path(__file__).parents[2]
TRIES = int(os.environ.get("NTAGEN_INTERRUPTIONS", "5"))


def slow(share: float) -> object:
    """A share of a run that takes seconds to drive and to decide again."""
    return pytest.param(share, marks=pytest.mark.slow)


class Impatient:
    """A journal that wants the run to end after so many records."""

    def __init__(self, operator: Operator, after: int) -> None:
        self._operator = operator
        self._left = after

    def record(self, _: Record) -> None:
        self._left -= 1
        if self._left == 0:
            self._operator.end("no patience")

    def started(self, scene: Scene) -> None:
        pass

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        pass


def check_replays(path: Path, outcome: State) -> Ended:
    """The run is decided again as it was, up to its end."""
    run = read_log(path)
    assert run.torn_at_byte is None
    ended = run.records[-2]  # The last is what was true at the end.
    assert isinstance(ended, Ended)
    assert ended.outcome == outcome.value
    comparison = replay(run, oracle_synthesis)
    assert comparison.is_same, comparison
    assert comparison.complete
    return ended


def logged(path: Path, *journals: Impatient, operator: Operator | None = None) -> None:
    with Log(path, metadata_of({"settings": Settings().to_json()}), {}) as log:
        simulate(
            HIDDEN,
            oracle_synthesis,
            Settings(),
            Journals(log, *journals),
            known="C1",
            errors=Errors(0.1),
            seed=2,
            listen=operator.listen if operator else lambda: None,
        )


@pytest.fixture(scope="module")
def count(tmp_path_factory: pytest.TempPathFactory) -> int:
    """How many records the whole run has."""
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    logged(path)
    return len(read_log(path).records)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.25, slow(0.5), slow(0.9)])
def test_a_run_that_is_ended_anywhere_is_decided_again(
    tmp_path: Path, count: int, share: float
) -> None:
    for after in range(1 + int(share * count), 1 + int(share * count) + 3):
        operator = Operator()
        path = tmp_path / f"{after}.mcap"
        logged(path, Impatient(operator, after), operator=operator)
        assert check_replays(path, State.INTERRUPTED).reason == "no patience"


@pytest.mark.parametrize("method", ["push", "pull", "roll", "measure"])
@pytest.mark.parametrize(
    ("error", "outcome"),
    [(DeviceError("stuck"), State.FAULTED), (KeyboardInterrupt(), State.INTERRUPTED)],
)
def test_a_run_that_a_motion_or_reading_ends_is_decided_again(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    method: str,
    error: BaseException,
    outcome: State,
) -> None:
    done = {"push": 30, "pull": 0, "roll": 0, "measure": 40}[method]
    original = getattr(VirtualNeedle, method)
    calls = 0

    def failing(self: VirtualNeedle, *arguments: float) -> object:
        nonlocal calls
        calls += 1
        if calls > done:
            raise error
        return original(self, *arguments)

    monkeypatch.setattr(VirtualNeedle, method, failing)
    logged(tmp_path / "run.mcap")
    monkeypatch.undo()
    check_replays(tmp_path / "run.mcap", outcome)


@pytest.mark.parametrize("after", [0, 1])
@pytest.mark.parametrize(
    ("error", "outcome"),
    [
        (LimitError("no answer from the engine: stopped by memory"), State.TIMED_OUT),
        (KeyboardInterrupt("no patience"), State.INTERRUPTED),
    ],
)
def test_a_run_that_ends_in_a_synthesis_is_decided_again(
    tmp_path: Path, after: int, error: BaseException, outcome: State
) -> None:
    calls = 0

    def limited(scene: Scene) -> Synthesis:
        nonlocal calls
        calls += 1
        if calls > after:
            raise error
        return oracle_synthesis(scene)

    path = tmp_path / "run.mcap"
    with Log(path, metadata_of({"settings": Settings().to_json()}), {}) as log:
        simulate(HIDDEN, limited, Settings(), log, known="C1", errors=Errors(0.1), seed=2)
    assert check_replays(path, outcome).syntheses == after
    assert len([r for r in read_log(path).records if isinstance(r, Synthesised)]) == after


def drive(folder: Path, log: Path, seconds: float, number: signal.Signals) -> int:
    """A run of the command line that gets a signal after a time; its exit code."""
    command = [sys.executable, "-m", "ntagen", "drive", str(ROOT / "examples" / "paper.nsl")]
    command += ["--known", "none", "--noise", "0.1", "--seed", "3", "--quiet", "--log", str(log)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        # A run has begun when the head of its log is written.
        while not (log.exists() and log.stat().st_size) and process.poll() is None:
            time.sleep(0.001)
        time.sleep(seconds)
        process.send_signal(number)
        return process.wait()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_at_random_moments_end_a_run_that_is_decided_again(
    tmp_path: Path, number: signal.Signals
) -> None:
    from ntagen.cli import main

    chance = random.Random(number)
    # A signal that comes when the run has ended, and nobody listens any more, ends the process.
    ends = {0: 0, 130: 0, 143: 0, -number: 0}
    for index in range(TRIES):
        path = tmp_path / f"{index}.mcap"
        code = drive(tmp_path, path, chance.uniform(0.0, 1.2), number)
        ends[code] += 1
        run = read_log(path)
        assert run.torn_at_byte is None
        assert len([r for r in run.records if isinstance(r, Ended)]) == 1
        assert any(isinstance(r, Command) and r.kind == "stop" for r in run.records)
        assert main(["replay", str(path)]) == 0
    assert ends[130 if number == signal.SIGINT else 143] > 0
    assert ends[143 if number == signal.SIGINT else 130] == 0
