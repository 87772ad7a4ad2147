"""The contract tests: right devices and trackers pass, and each mistake is found."""

# ruff: noqa: ANN401  devices are broken from inside, as no type would allow

from __future__ import annotations

import contextlib
import importlib.util
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ntagen.cli import main
from ntagen.errors import Halted
from ntagen.needle.measurement import Measurement
from ntagen.plugins import IDENTITY, Speeds, run_watched
from ntagen.testing import device_contract, require, tracker_contract

EXAMPLE = Path(__file__).parents[3] / "examples" / "plugin" / "mystage.py"
SPEEDS = Speeds(4.0, 8.0, 4.0)


def module() -> Any:
    spec = importlib.util.spec_from_file_location("mystage_of_the_examples", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


MYSTAGE = module()


@pytest.mark.slow
def test_the_example_keeps_the_protocol() -> None:
    with MYSTAGE.open_stage("simulated", SPEEDS) as stage:
        require(device_contract(stage, SPEEDS, length_mm=0.6))


def test_the_tracker_of_the_example_keeps_the_protocol() -> None:
    with MYSTAGE.open_tracker("simulated", IDENTITY, time.monotonic) as tracker:
        require(tracker_contract(tracker))


@pytest.mark.slow
def test_our_own_steppers_keep_the_protocol(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["device", "test", "grbl+sim", "--yes"]) == 0
    out = capsys.readouterr().out
    assert out.count("ok    ") == 10
    assert "all 10 checks hold" in out


def _swallows(stage: Any) -> None:
    def move(axis: Any, way: float, speed: float) -> None:
        with contextlib.suppress(Halted, Exception):
            run_watched(lambda: axis.move(way, speed), stage.watch, stage.stop)

    stage._move = move


def _is_not_watched(stage: Any) -> None:
    stage._move = lambda axis, way, speed: axis.move(way, speed)


def _is_watched_rarely(stage: Any) -> None:
    def move(axis: Any, way: float, speed: float) -> None:
        for _ in range(10):
            stage.watch()
            axis.move(way / 10.0, speed)

    stage._move = move


def _returns_at_once(stage: Any) -> None:
    stage._move = lambda axis, way, speed: setattr(axis, "position", axis.position + way)


def _is_slow_to_stop(stage: Any) -> None:
    right = stage._move

    def move(axis: Any, way: float, speed: float) -> None:
        try:
            right(axis, way, speed)
        except Halted:
            time.sleep(0.6)
            raise

    stage._move = move


def _tells_no_part(stage: Any) -> None:
    right = stage._move

    def move(axis: Any, way: float, speed: float) -> None:
        try:
            right(axis, way, speed)
        except Halted as halted:
            halted.part = 0.0
            raise

    stage._move = move


def _tells_another_part(stage: Any) -> None:
    right = stage._move

    def move(axis: Any, way: float, speed: float) -> None:
        try:
            right(axis, way, speed)
        except Halted as halted:
            halted.part = 20.0
            raise

    stage._move = move


def _accepts_all(stage: Any) -> None:
    stage.push = lambda length: stage._move(stage._insert, length, 4.0)


def _refuses_wrongly(stage: Any) -> None:
    right = stage.roll

    def roll(angle: float) -> None:
        if not math.isfinite(angle):
            raise ValueError(angle)
        right(angle)

    stage.roll = roll


def _ignores_stop(stage: Any) -> None:
    stage.stop = lambda: None


def _stops_once(stage: Any) -> None:
    right, calls = stage.stop, []

    def stop() -> None:
        calls.append(1)
        if len(calls) == 2:
            raise OSError("it stands already")
        right()

    stage.stop = stop


def _clock_goes_back(stage: Any) -> None:
    stage.now_s = lambda: -time.monotonic()


DEVICES: dict[Callable[[Any], None], str] = {
    _swallows: "what the watch raises goes on",
    _is_not_watched: "the watch is never called",
    _is_watched_rarely: "the watch is called every",
    _returns_at_once: "returns after",
    _is_slow_to_stop: "the motion ends when the watch raises",
    _tells_no_part: "which is too little",
    _tells_another_part: "the part of the motion that was made is 20",
    _accepts_all: "push\\(-0.8\\): it moves",
    _refuses_wrongly: "roll\\(nan\\): it raises ValueError",
    _ignores_stop: "stop ends a motion from another thread",
    _stops_once: "stop works at rest, also twice: OSError",
    _clock_goes_back: "the clock goes forward",
}


QUICK = (_accepts_all, _refuses_wrongly, _returns_at_once, _clock_goes_back)
"""These are found before the longer checks."""


@pytest.mark.parametrize(
    "breaking",
    [pytest.param(one, marks=() if one in QUICK else pytest.mark.slow) for one in DEVICES],
    ids=lambda one: one.__name__,
)
def test_each_mistake_of_a_device_is_found(breaking: Callable[[Any], None]) -> None:
    with MYSTAGE.open_stage("simulated", SPEEDS) as stage:
        breaking(stage)
        with pytest.raises(AssertionError, match=DEVICES[breaking]):
            require(device_contract(stage, SPEEDS, length_mm=0.8))


class Sensor:
    """A tracker that can be broken."""

    measures_force: Any = False

    def __init__(self, **changes: Any) -> None:
        self.changes: dict[str, Any] = {"force_n": 0.0, "position_mm": (1.0, 2.0, 3.0), **changes}

    def measure(self) -> Any:
        return Measurement(**{"time_s": time.monotonic(), **self.changes})

    def newest(self) -> Any:
        return self.measure()


class Waiting(Sensor):
    """A tracker that waits for its newest sample."""

    def newest(self) -> Any:
        time.sleep(0.02)
        return self.measure()


class Hanging(Sensor):
    """A tracker that never gets another sample."""

    def __init__(self) -> None:
        super().__init__()
        self.first = self.measure()

    def newest(self) -> Any:
        return self.first


class Nothing(Sensor):
    """A tracker that measures nothing."""

    def measure(self) -> Any:
        return None


class Unsure(Sensor):
    """A tracker that says no yes or no."""

    measures_force = "yes"


TRACKERS: dict[str, tuple[Callable[[], Sensor], str]] = {
    "no number": (lambda: Sensor(position_mm=(math.nan, 0.0, 0.0)), "what is no number"),
    "a long heading": (lambda: Sensor(heading=(0.0, 2.0, 0.0)), "heading has the length 2"),
    "not a right angle": (
        lambda: Sensor(heading=(0.0, 1.0, 0.0), bevel=(0.0, 0.6, 0.8)),
        "not at a right angle",
    ),
    "a force from nowhere": (lambda: Sensor(force_n=1.0), "without a force sensor"),
    "the future": (lambda: Sensor(time_s=time.monotonic() + 5.0), "clock of the needle"),
    "another clock": (lambda: Sensor(time_s=0.0), "s old"),
    "nothing": (Nothing, "no Measurement"),
    "unsure": (Unsure, "measures_force is 'yes'"),
    "waiting": (Waiting, "newest\\(\\) never waits"),
    "hanging": (Hanging, "the same sample"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", TRACKERS)
def test_each_mistake_of_a_tracker_is_found(name: str) -> None:
    make, says = TRACKERS[name]
    require(tracker_contract(Sensor()))
    with pytest.raises(AssertionError, match=says):
        require(tracker_contract(make()))


def test_the_command_needs_an_agreement_and_a_task(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["device", "test", "grbl+sim"]) != 0
    assert main(["device", "test", "grbl:/dev/ttyNOWHERE", "--yes"]) == 2
    assert "give --task TASK.nsl" in capsys.readouterr().err
    task = str(EXAMPLE.parents[1] / "stepper.nsl")
    assert main(["device", "test", "grbl:/dev/ttyNOWHERE", "--yes", "--task", task]) == 5
    assert main(["device", "test", "csv:nowhere.csv"]) == 2
