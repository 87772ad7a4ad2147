"""Runs of `ntagen drive` in a process of its own, with faults that only a process can have.

The driver opens a pseudo-terminal and connects to the server of a tracker, as at hardware. Both are
those of a lab (`ntagen.lab`) in this process, which knows the truth and runs faster than real time.
"""

from __future__ import annotations

import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ntagen.drive.reading import read_log
from ntagen.drive.records import Command, Ended
from ntagen.lab.lab import Freeze, Lab
from ntagen.lab.needles import place
from ntagen.nsl import load

ROOT = Path(__file__).resolve().parents[2]
TASK = ROOT / "examples" / "stepper.nsl"
SPEED = 10.0

LATEST_S = 4.5
"""A fault comes within this time after the log was begun; a run takes about 6 s."""

STEP_MM = 2.0
PULLED_MM = 5.01
_PATIENCE_S = 170.0
"""A run ends by itself after 120 s."""

_SETTLE_S = 0.7
_STILL_MM = 1e-6

Strike = Callable[["Bench", random.Random], None]


@dataclass(frozen=True)
class LiveFault:
    """A fault of a process or of what it is connected to.

    Attributes:
        name: Its name.
        strike: What happens.
        codes: The exit codes that are right; 0 is that of a run that is over before.
        words: One of these stands in the reason, if there is one.
        limit_bytes: The driver may write files up to a size in this range.
        is_heard: Whether the driver can say how it ended.
    """

    name: str
    strike: Strike
    codes: frozenset[int]
    words: tuple[str, ...] = ()
    limit_bytes: tuple[int, int] | None = None
    is_heard: bool = True


@dataclass
class LiveFinding:
    """What a run came to: its exit code, and what must not have been."""

    code: int
    reason: str = ""
    deeper_mm: float = 0.0
    wrong: list[str] = field(default_factory=list)


class Bench:
    """A lab and a driver of it.

    Args:
        needle: ``virtual`` or ``phantom``.
        seed: The needle's seed.
        log: Where the driver writes its log.
        limit_bytes: The largest file that the driver may write.
    """

    def __init__(self, needle: str, seed: int, log: Path, limit_bytes: int | None = None) -> None:
        scene = load(TASK)
        self.lab = Lab(scene, place(needle, scene, seed, 2.0), speed=SPEED)
        self._needle = needle
        self._log = log
        self._limit_bytes = limit_bytes
        self.process: subprocess.Popen[str]

    def start(self) -> None:
        """Starts a driver; it is driving when its log is there."""
        tracker = f"{self.lab.tracker_address},stale=2s"
        words = [sys.executable, "-m", "ntagen", "drive", str(TASK), "--json"]
        words += ["--needle", f"grbl:{self.lab.port}", "--tracker", tracker]
        words += ["--registration", "none", "--log", str(self._log)]
        words += self._settings()
        self._log.unlink(missing_ok=True)
        self.process = subprocess.Popen(
            words,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            preexec_fn=self._begin,
        )

    def wait_for_log(self) -> None:
        """Waits until the driver has begun to drive, or has ended."""
        end_s = time.monotonic() + _PATIENCE_S
        while not (self._log.exists() and self._log.stat().st_size):
            if self.process.poll() is not None or time.monotonic() > end_s:
                return
            time.sleep(0.01)

    def depth_mm(self) -> float:
        """Where the axis of insertion is now."""
        with self.lab.lock:
            self.lab._settle()
            return self.lab.emulator.position[0]

    def finish(self) -> tuple[int, dict[str, Any], str]:
        """Waits for the driver's end: its code, what it summed up, and its errors."""
        try:
            said, errors = self.process.communicate(timeout=_PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            said, errors = self.process.communicate()
            return -1000, {}, f"it did not end within {_PATIENCE_S} s: {errors}"
        return self.process.returncode, json.loads(said) if said else {}, errors

    def _settings(self) -> list[str]:
        """The settings that fit the needle, as after a calibration."""
        if self._needle == "virtual":
            return ["--set", "force noise 0 N"]
        from ntagen.cli.needle.lab import _fitting
        from ntagen.drive.configure import configure
        from ntagen.nsl import load_task

        task = load_task(TASK)
        return _fitting(configure(task.given, task.scene, "all", self._needle), task)

    def _begin(self) -> None:
        """Makes the new process hear signals, also if this one is in the background."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        if self._limit_bytes is None:
            return
        resource.setrlimit(resource.RLIMIT_FSIZE, (self._limit_bytes, self._limit_bytes))


def _signalled(number: signal.Signals) -> Strike:
    return lambda bench, _: bench.process.send_signal(number)


def _suspend(bench: Bench, draw: random.Random) -> None:
    bench.process.send_signal(signal.SIGSTOP)
    time.sleep(draw.choice([0.05, 0.3, 1.0, 4.0]))
    bench.process.send_signal(signal.SIGCONT)


def _faulty(name: str, value: object) -> Strike:
    return lambda bench, _: setattr(bench.lab.faults, name, value)


def _controller(act: Callable[[Bench], object]) -> Strike:
    def strike(bench: Bench, _: random.Random) -> None:
        with bench.lab.lock:
            act(bench)

    return strike


def _nothing(_: Bench, __: random.Random) -> None:
    """The fault is there from the start."""


_FAULT = frozenset({0, 5})
_ANY = frozenset({0, 1, 3, 4, 5, 6})

LIVE = (
    LiveFault("SIGINT", _signalled(signal.SIGINT), frozenset({0, 130, -2}), ("operator",)),
    LiveFault("SIGTERM", _signalled(signal.SIGTERM), frozenset({0, 143, -15}), ("SIGTERM",)),
    LiveFault("SIGHUP", _signalled(signal.SIGHUP), frozenset({0, 143, -1}), ("SIGHUP",)),
    LiveFault("SIGKILL", _signalled(signal.SIGKILL), frozenset({0, -9}), is_heard=False),
    LiveFault("suspended", _suspend, _ANY),
    LiveFault("cable pulled", lambda bench, _: bench.lab._terminal.hang_up(), _FAULT, ("broken",)),
    LiveFault(
        "server vanishes",
        lambda bench, _: bench.lab.server.close(),
        _FAULT,
        ("tracker", "connect", "stale", "sample"),
    ),
    LiveFault("disk full", _nothing, _FAULT, ("cannot write",), limit_bytes=(20_000, 400_000)),
    LiveFault("tracker silent", _faulty("is_silent", True), _FAULT, ("stale", "sample")),
    LiveFault("tracker lost", _faulty("is_lost", True), _FAULT, ("stale", "sample", "see")),
    LiveFault("tracker hangs", _faulty("freeze", Freeze.WHOLE), _FAULT, ("stale", "sample")),
    LiveFault("tracker repeats", _faulty("freeze", Freeze.STAMPED), _ANY),
    LiveFault("tracker mirrored", _faulty("signs", (-1.0, 1.0, 1.0)), _FAULT, ("mirror",)),
    LiveFault("tracker turned", _faulty("signs", (-1.0, -1.0, 1.0)), _ANY),
    LiveFault("tracker jumps", _faulty("jump_mm", (0.0, 0.0, 30.0)), _FAULT, ("jumped",)),
    LiveFault("tracker NaN", _faulty("is_nan", True), _FAULT, ("not a number",)),
    LiveFault("tracker late", _faulty("delay_s", 1.5), _FAULT, ("later than others", "stale")),
    LiveFault("tracker late by less", _faulty("delay_s", 0.7), _ANY),
    LiveFault("force stuck at 0", _faulty("force_n", 0.0), _ANY),
    LiveFault("force at full scale", _faulty("force_n", 50.0), _ANY),
    LiveFault(
        "ALARM:1", _controller(lambda b: b.lab.emulator.raise_alarm(1)), _FAULT, ("limit switch",)
    ),
    LiveFault(
        "soft reset",
        _controller(lambda b: b.lab.emulator.feed(b"\x18")),
        _FAULT,
        ("reset", "alarm"),
    ),
    LiveFault(
        "silence",
        _controller(lambda b: setattr(b.lab.emulator.faults, "is_silent", True)),
        _FAULT,
        ("no status report", "did not answer"),
    ),
    LiveFault(
        "garbage", _controller(lambda b: b.lab.emulator.send(b"\xff\xfe\n")), _FAULT, ("no reply",)
    ),
)
"""All of them."""


def run_live(fault: LiveFault, needle: str, seed: int, folder: Path) -> LiveFinding:
    """Makes a run with a fault at a random moment, and looks at it."""
    draw = random.Random(f"{fault.name} {needle} {seed}")
    limit_bytes = draw.randint(*fault.limit_bytes) if fault.limit_bytes else None
    log = folder / f"{seed}.mcap"
    bench = Bench(needle, seed, log, limit_bytes)
    with bench.lab:
        bench.start()
        bench.wait_for_log()
        time.sleep(draw.uniform(0.0, LATEST_S))
        struck_mm = bench.depth_mm()
        is_over = bench.process.poll() is not None
        if not is_over:
            fault.strike(bench, draw)
        code, summary, errors = bench.finish()
        finding = LiveFinding(code, summary.get("reason", errors.strip()))
        if not (is_over or code == 0 or limit_bytes is not None or fault.name == "suspended"):
            # What is left of a piece after the driver's death belongs to the way.
            time.sleep(_SETTLE_S)
            finding.deeper_mm = bench.depth_mm() - struck_mm
        _examine(fault, finding, bench, log)
        if fault.name == "SIGKILL" and code == -signal.SIGKILL:
            _restart(bench, finding)
    return finding


def _examine(fault: LiveFault, finding: LiveFinding, bench: Bench, log: Path) -> None:
    wrong = finding.wrong
    # A log that cannot be begun is a mistake on the command line: then nothing has moved.
    is_refused = finding.code == 2 and bool(fault.limit_bytes) and not bench.lab.truth().has_moved
    if finding.code not in fault.codes and not is_refused:
        wrong.append(f"exit code {finding.code}: {finding.reason}")
    if finding.code == 5 and fault.words and not any(w in finding.reason for w in fault.words):
        wrong.append(f"the reason has other words: {finding.reason}")
    must_stand = finding.code in (5, 130, 143, -9) and fault.codes != _ANY
    if must_stand and not -PULLED_MM <= finding.deeper_mm <= STEP_MM:
        wrong.append(f"the needle went on for {finding.deeper_mm:.2f} mm")
    _require_stillness(bench, wrong)
    clearance_mm = bench.lab.truth().clearance_mm
    if clearance_mm <= 0.0:
        wrong.append(f"a known region was pierced: {clearance_mm:.2f} mm")
    records = read_log(log).records
    ends = [record for record in records if isinstance(record, Ended)]
    if fault.is_heard and fault.limit_bytes is None and finding.code >= 0 and len(ends) != 1:
        wrong.append(f"the log has {len(ends)} ends")
    if ends and not any(isinstance(r, Command) and r.kind == "stop" for r in records):
        wrong.append("the log has no stop")


def _require_stillness(bench: Bench, wrong: list[str]) -> None:
    """Nothing moves after the end, also when somebody presses the resume button."""
    bench.lab.emulator.faults.is_silent = False
    time.sleep(_SETTLE_S)
    before_mm = bench.depth_mm()
    with bench.lab.lock:
        bench.lab.emulator.feed(b"~")
    time.sleep(_SETTLE_S)
    if abs(bench.depth_mm() - before_mm) > _STILL_MM:
        wrong.append(f"something moved after the end, by {bench.depth_mm() - before_mm:.3f} mm")


def _restart(bench: Bench, finding: LiveFinding) -> None:
    """A driver that is started again must not go on from a needle in the tissue."""
    before_mm = bench.depth_mm()
    bench.start()
    if before_mm <= 3.5:
        # It counts as being at the entry.
        bench.process.send_signal(signal.SIGKILL)
        bench.finish()
        return
    code, summary, errors = bench.finish()
    said = summary.get("reason", errors)
    if code != 5 or "entry" not in said or abs(bench.depth_mm() - before_mm) > _STILL_MM:
        moved_mm = bench.depth_mm() - before_mm
        finding.wrong.append(f"started again: exit code {code}, moved {moved_mm:.2f} mm: {said}")
