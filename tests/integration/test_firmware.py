"""Whole runs against real firmware in real time: grblHAL and GRBL 1.1h, which the tester has built.

NTAGEN_GRBLHAL_SIM and NTAGEN_GRBL_AVR name them (`docs/firmware.md`). Each case takes up to a
minute.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from ntagen.cli.needle.lab import _fitting
from ntagen.drive.configure import configure
from ntagen.drive.reading import read_log
from ntagen.drive.records import Ended
from ntagen.nsl import load_task

pty = pytest.importorskip("pty", reason="pseudo terminals are those of Unix")

from tests.faults.controllers import (  # noqa: E402  as the line above
    CONTROLLERS,
    GRBL_11H,
    GRBLHAL,
    Controller,
)
from tests.faults.firmware import PUSH, REFUSED, REST, Firmware  # noqa: E402  it needs pty, too

if TYPE_CHECKING:
    from _pytest.mark import ParameterSet

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.slow

STRIKES_MM = 8.0
"""Something happens when the needle is so deep, in the middle of a motion."""

DEEPER_MM = 1.0
"""The needle must not go deeper than this afterwards: at 1 mm/s it goes on for 0.15 mm."""

_PATIENCE_S = 300.0

Act = Callable[[Firmware], None]


@dataclass(frozen=True)
class Case:
    """What happens in the middle of a motion, and what must come of it.

    Attributes:
        strike: What happens.
        reason: How the run says why it ended; a regular expression.
        mend: What somebody does before the run goes on.
        found: What the resumed run must say before it asks; a regular expression.
        resumed: How the run ends that goes on, and its exit code.
        answers: What the operator types: whether to go on, and whether to pull the needle back.
        moment: When it happens.
        hard, soft: Whether the controller has limit switches, and soft limits.
    """

    strike: Act
    reason: str
    mend: Act
    found: str = "turned by the count of the controller"
    resumed: tuple[str, int] = ("target reached", 0)
    answers: str = "y\n"
    moment: str = PUSH
    hard: bool = False
    soft: bool = False


def _nothing(_: Firmware) -> None:
    """Somebody looks at the needle, and that is all."""


def _sending(*data: bytes) -> Act:
    def send(firmware: Firmware) -> None:
        for one in data:
            firmware.send(one)
            time.sleep(0.5)

    return send


def _pressing(key: str) -> Act:
    return lambda firmware: firmware.press(key)


_unlock = _sending(b"\x18", b"$X\n")


def _release(key: str) -> Act:
    def release(firmware: Firmware) -> None:
        firmware.press(key)
        time.sleep(0.5)
        _unlock(firmware)

    return release


_COMMON = {
    "feed hold at rest": Case(_sending(b"!"), "state Hold:0, not idle", _unlock, moment=REST),
    "alarm": Case(_pressing("x"), "limit switch", _release("x"), hard=True),
    "soft reset": Case(_sending(b"\x18"), "reset|alarm", _unlock),
    "soft limit": Case(
        _nothing,
        r"refused '\$J=.*error:15",
        _nothing,
        resumed=("pulled back", 7),
        answers="n\ny\n",
        moment=REFUSED,
        soft=True,
    ),
    "cable": Case(Firmware.pull_cable, "connection to the controller is broken", Firmware.plug_in),
    "power cycle": Case(
        Firmware.lose_power,
        "was reset",
        _nothing,
        "nothing says how its bevel stands",
        ("pulled back", 7),
    ),
}

CASES = {
    GRBLHAL: _COMMON | {"door": Case(_pressing("d"), "is stuck.*state Jog", _release("d"))},
    GRBL_11H: _COMMON
    | {
        "door": Case(_pressing("d"), "was interrupted.*state Door", _release("d")),
        "feed hold": Case(_sending(b"!"), "ended too early", _nothing),
    },
}


def _named(controller: Controller, *values: object, name: str = "") -> ParameterSet:
    """A case of a controller, which is skipped unless the tester has built that."""
    reason = f"{controller.variable} names no firmware (docs/firmware.md)"
    skip = pytest.mark.skipif(not controller.is_named, reason=reason)
    words = f"{controller.name} {name}".strip()
    return pytest.param(controller, *values, marks=skip, id=words)


@pytest.mark.parametrize("controller", [_named(one) for one in CONTROLLERS])
def test_without_a_fault_the_target_is_reached(controller: Controller, tmp_path: Path) -> None:
    with Firmware(controller, tmp_path) as firmware:
        code, summary, errors = _drive(firmware, tmp_path / "run.mcap")
        firmware.settle()
        assert (code, summary["outcome"]) == (0, "target reached"), (summary, errors)
        assert firmware.true_clearance_mm > 0.0
    _check_log(tmp_path / "run.mcap", "target reached")


@pytest.mark.parametrize("controller", [_named(GRBLHAL)])
def test_a_feed_hold_in_a_jog_is_not_heard(controller: Controller, tmp_path: Path) -> None:
    with Firmware(controller, tmp_path) as firmware:
        firmware.tell = _striking(firmware, _sending(b"!"), PUSH)
        code, summary, errors = _drive(firmware, tmp_path / "run.mcap")
        firmware.settle()
        assert firmware.struck_mm is not None
        assert (code, summary["outcome"]) == (0, "target reached"), (summary, errors)


@pytest.mark.parametrize(
    ("controller", "name"),
    [_named(one, name, name=name) for one in CONTROLLERS for name in CASES[one]],
)
def test_a_fault_ends_a_run_that_can_be_resumed(
    controller: Controller, name: str, tmp_path: Path
) -> None:
    case, log = CASES[controller][name], tmp_path / "run.mcap"
    with Firmware(controller, tmp_path, soft=case.soft) as firmware:
        if case.hard:
            firmware.command("$21=1")
        firmware.tell = _striking(firmware, case.strike, case.moment)
        code, summary, errors = _drive(firmware, log)
        assert firmware.struck_mm is not None, f"over before anything happened: {summary} {errors}"
        case.mend(firmware)
        # What is put right must not move the needle, either.
        firmware.settle()
        deeper_mm = firmware.depth_mm - firmware.struck_mm
        print(f"{name}: deeper by {deeper_mm:.2f} mm, exit code {code}: {summary.get('reason')}")
        assert (code, summary["outcome"]) == (5, "device fault"), errors
        assert re.search(case.reason, summary["reason"], re.DOTALL), summary["reason"]
        assert deeper_mm <= DEEPER_MM
        _check_log(log, "device fault")

        words = ["--resume", str(log), *_devices(firmware)]
        code, summary, errors = _run(*words, answers=case.answers)
        print(f"{name}: resumed, exit code {code}: {summary.get('reason')}\n{errors}")
        assert re.search(case.found, errors), errors
        assert (summary["outcome"], code) == case.resumed, errors
        assert firmware.true_clearance_mm > 0.0
        _check_log(tmp_path / "run-resumed.mcap", case.resumed[0])


def _striking(firmware: Firmware, strike: Act, when: str) -> Callable[[str], None]:
    """Lets something happen once, when the needle is deep enough."""

    def tell(moment: str) -> None:
        is_due = moment == when and firmware.depth_mm >= STRIKES_MM
        if is_due and firmware.struck_mm is None:
            firmware.struck_mm = firmware.depth_mm
            strike(firmware)

    return tell


def _drive(firmware: Firmware, log: Path) -> tuple[int, dict[str, Any], str]:
    """Drives from the entry, with the settings that a calibration of the phantom would give."""
    task = load_task(firmware.task)
    fitting = _fitting(configure(task.given, task.scene, "all", "phantom"), task)
    words = [str(firmware.task), *_devices(firmware), "--registration", "none", "--log", str(log)]
    return _run(*words, *fitting)


def _devices(firmware: Firmware) -> list[str]:
    return ["--needle", f"grbl:{firmware.port}", "--tracker", firmware.tracker]


def _run(*words: str, answers: str = "") -> tuple[int, dict[str, Any], str]:
    """Runs the driver at a terminal: its exit code, its summary, and its errors."""
    ours, theirs = pty.openpty()
    os.write(ours, answers.encode())
    try:
        done = subprocess.run(
            [sys.executable, "-m", "ntagen", "drive", "--json", *words],
            stdin=theirs,
            capture_output=True,
            text=True,
            timeout=_PATIENCE_S,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
    finally:
        os.close(theirs)
        os.close(ours)
    return done.returncode, json.loads(done.stdout) if done.stdout else {}, done.stderr


def _check_log(log: Path, outcome: str) -> None:
    """The log is complete, and is decided in the same way again."""
    ends = [one for one in read_log(log).records if isinstance(one, Ended)]
    assert [one.outcome for one in ends] == [outcome]
    words = [sys.executable, "-m", "ntagen", "replay", str(log)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(words, capture_output=True, text=True, env=environment, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
