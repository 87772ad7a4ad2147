"""Runs of `ntagen ros` in a process of its own, with faults of topics, nodes and clocks.

The lab is made of nodes in this process, and knows the truth. Driver and lab find each other over
DDS on this machine only, in a domain of their own. This module needs ROS 2 (``ntagen[ros]``).
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String
from std_srvs.srv import Trigger

from ntagen.cli.needle.lab import _fitting
from ntagen.drive.configure import configure
from ntagen.drive.steppers import speeds_for
from ntagen.lab.lab import Freeze
from ntagen.lab.needles import place
from ntagen.nsl import load_task
from ntagen.ros import messages
from ntagen.ros.bridge import Bridge, opened_nodes, quality
from ntagen.ros.lab import RosLab, opened_lab
from ntagen.ros.topics import STATUS, TARGET, TIP, Topics

ROOT = Path(__file__).resolve().parents[2]

TASK = """\
environment fast {
  needle {
    tip (0, 0, 0) mm  heading -y  bevel +z
    radius 30 mm  speed 5 mm/s
  }
  motion {
    step 0.4 s
    roll by 90, 180, 270 deg  at most 2 times  at least 2 mm apart
  }
  target    T1  sphere (0, -50, 0) mm  radius 10 mm
  critical  C1  sphere (0, -25, 0) mm  radius 2 mm
  detection D1  sphere (0, -25, 0) mm  radius 5 mm
  tissue static
  resolution 1000 per mm
  safety sampled
}
"""
"""The task of the paper for a needle that is inserted quickly."""

SPEED_MM_PER_S = 5.0
STEP_MM = SPEED_MM_PER_S * 0.6 + 0.5
"""A fault that shows at once is noticed after the stale time at the latest."""

_PATIENCE_S = 120.0
_SETTLE_S = 0.5
_STILL_MM = 1e-6
_DOMAINS = 100
_FIRST_PORT = 47_000

Strike = Callable[["Bench", random.Random], None]


@contextlib.contextmanager
def own_domain() -> Iterator[dict[str, str]]:
    """A domain of DDS that nobody else uses, until the end of the block; the environment for it."""
    with _reserved() as domain, pytest.MonkeyPatch.context() as patch:
        own = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        for name, value in own.items():
            patch.setenv(name, value)
        yield own


@contextlib.contextmanager
def _reserved() -> Iterator[int]:
    """The number of a domain, which no other process of these tests uses meanwhile."""
    numbers = random.SystemRandom().sample(range(1, _DOMAINS), _DOMAINS - 1)
    for number in numbers:
        with socket.socket() as one:
            try:
                one.bind(("127.0.0.1", _FIRST_PORT + number))
            except OSError:
                continue
            yield number
            return
    raise RuntimeError("all domains are in use")


@dataclass(frozen=True)
class Fault:
    """A fault of a lab, of its nodes or of the driver's process.

    Attributes:
        name: Its name.
        strike: What happens.
        codes: The exit codes that are right; 0 is that of a run that is over before.
        words: One of these stands in the reason, or in the errors.
        arguments: What else the driver is told: arguments of ROS.
        is_at_start: Whether it is there before the driver: then nothing may move.
        shows_at_once: Whether a sensor can tell it at once.
        has_clock: Whether the driver takes its time from ``/clock``.
    """

    name: str
    strike: Strike
    codes: frozenset[int] = frozenset({5})
    words: tuple[str, ...] = ()
    arguments: tuple[str, ...] = ()
    is_at_start: bool = False
    shows_at_once: bool = True
    has_clock: bool = False


@dataclass
class Finding:
    """What a run came to: its exit code, its reason, and what must not have been."""

    code: int
    reason: str = ""
    deeper_mm: float = 0.0
    wrong: list[str] = field(default_factory=list)


class Bench:
    """A lab of nodes, and a driver of it in a process of its own.

    Args:
        needle: ``virtual`` or ``phantom``.
        seed: The needle's seed.
        folder: Where files may be written.
        arguments: Arguments of ROS for the driver.
        has_clock: Whether the driver takes its time from ``/clock``.
        task: Another task than `TASK`.
    """

    def __init__(
        self,
        needle: str,
        seed: int,
        folder: Path,
        arguments: tuple[str, ...] = (),
        *,
        has_clock: bool = False,
        task: Path | None = None,
    ) -> None:
        self.path = task or folder / "fast.nsl"
        if task is None:
            self.path.write_text(TASK)
        self.statuses: list[str] = []
        self.clock_shift_s = 0.0
        self.clock_stands = False
        self._task = load_task(self.path)
        self._needle = needle
        self._seed = seed
        self._arguments = [*arguments, *(("-p", "use_sim_time:=true") if has_clock else ())]
        self._has_clock = has_clock
        self._stack = contextlib.ExitStack()
        self.lab: RosLab
        self.peer: Bridge
        self.process: subprocess.Popen[str]

    def __enter__(self) -> Bench:
        self._environment = self._stack.enter_context(own_domain())
        scene = self._task.scene
        self._fitted = configure(self._task.given, scene, "all", self._needle)
        settings = configure(self._task.given, scene, needle="ros").settings
        placed = place(self._needle, scene, self._seed, settings.sensing_margin_mm)
        self._latency_s = placed.latency_s
        speeds = speeds_for(scene.needle, settings)
        self.lab = self._stack.enter_context(opened_lab(scene, placed, speeds, Topics()))
        (node,) = self._stack.enter_context(opened_nodes(["peer"], []))
        self.peer = Bridge(node, self.statuses.append)
        self.peer.hear(
            STATUS, String, lambda one: self.statuses.append(one.data), quality(is_kept=True)
        )
        self._stopper = node.create_client(Trigger, "/ntagen/stop")
        if self._has_clock:
            self.peer.every(0.01, self._tell_clock)
        return self

    def __exit__(self, *error: object) -> None:
        if hasattr(self, "process") and self.process.returncode is None:
            self.process.kill()
            self.process.communicate()
        self._stack.close()

    def start(self, *, at_once: bool = True, options: tuple[str, ...] = ()) -> None:
        """Starts a driver."""
        words = [sys.executable, "-m", "ntagen", "ros", str(self.path), "--json", *options]
        words += ["--at-once"] if at_once else []
        words += _fitting(self._fitted, self._task)
        words += ["--ros-args", "-p", "bevel:=+x", "-p", f"latency_s:={self._latency_s:g}"]
        words += self._arguments
        self.process = subprocess.Popen(
            words,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={
                **os.environ,
                **self._environment,
                "PYTHONPATH": self._path(),
                "PYTHONFAULTHANDLER": "1",
            },
            preexec_fn=_hear_signals,
        )

    def wait_until(self, is_so: Callable[[], bool], seconds: float = 30.0) -> bool:
        """Waits until something is so, or the driver has ended, or the time is over."""
        end_s = time.monotonic() + seconds
        while not is_so():
            if self.process.poll() is not None or time.monotonic() > end_s:
                return is_so()
            time.sleep(0.01)
        return True

    def has_said(self, state: str) -> bool:
        """Whether the driver has told this state."""
        return any(one.startswith(f"{state}:") for one in self.statuses)

    def call(self, service: str) -> tuple[bool, str]:
        """Calls a service of the driver."""
        client = self.peer.node.create_client(Trigger, f"/ntagen/{service}")
        if not client.wait_for_service(10.0):
            return False, "there is no such service"
        answered = threading.Event()
        future = client.call_async(Trigger.Request())
        future.add_done_callback(lambda _: answered.set())
        answered.wait(20.0)
        found = future.result()
        return (False, "no answer") if found is None else (found.success, found.message)

    def stop(self) -> None:
        """Calls the service stop, and does not wait for its answer."""
        self._stopper.call_async(Trigger.Request())

    def depth_mm(self) -> float:
        """How far the stage has inserted the needle now."""
        return self.lab.bench.where().depth_mm

    def finish(self) -> tuple[int, dict[str, Any], str]:
        """Waits for the driver's end: its code, what it summed up, and its errors."""
        try:
            said, errors = self.process.communicate(timeout=_PATIENCE_S)
        except subprocess.TimeoutExpired:
            # With the fault handler, its errors say where its threads are.
            self.process.send_signal(signal.SIGABRT)
            said, errors = self.process.communicate()
            return -1000, {}, f"it did not end within {_PATIENCE_S} s: {errors}"
        return self.process.returncode, json.loads(said) if said else {}, errors

    def _tell_clock(self) -> None:
        if self.clock_stands:
            return
        now_ns = round((1000.0 + self.lab.bench.now_s() + self.clock_shift_s) * 1e9)
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(now_ns, 10**9)
        self.peer.publish("/clock", message, quality(depth=1))

    @staticmethod
    def _path() -> str:
        return os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])


def _hear_signals() -> None:
    """Makes the new process hear signals, also if this one is in the background."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def _set(name: str, value: object) -> Strike:
    return lambda bench, _: setattr(bench.lab.faults, name, value)


def _set_lab(name: str, value: object) -> Strike:
    return lambda bench, _: setattr(bench.lab, name, value)


def _jump(bench: Bench, chance: random.Random) -> None:
    signs = [chance.choice((-1.0, 1.0)) for _ in range(3)]
    bench.lab.faults.jump_mm = (30.0 * signs[0], 30.0 * signs[1], 30.0 * signs[2])


def _second_publisher(bench: Bench, _: random.Random) -> None:
    message = PoseStamped()
    message.header.frame_id = "stage"
    bench.peer.publish(TIP, message, quality(is_reliable=False))


def _move_target(bench: Bench, _: random.Random) -> None:
    head = messages.header(bench.peer.stamp(), "stage")
    point = messages.stamped_point(head, (5.0, -50.0, 0.0), 1000.0)
    bench.peer.publish(TARGET, point, quality(is_kept=True, depth=1))


def _call_stop(bench: Bench, _: random.Random) -> None:
    bench.stop()


def _send(number: signal.Signals) -> Strike:
    return lambda bench, _: bench.process.send_signal(number)


def _shift_clock(seconds: float) -> Strike:
    return lambda bench, _: setattr(bench, "clock_shift_s", seconds)


_RELIABLE = ("-p", "reliability:=reliable")

FAULTS = (
    Fault("nothing", lambda *_: None, frozenset({0})),
    Fault("tip silent", _set("is_silent", True), words=("stale",)),
    Fault("tip lost", _set("is_lost", True), words=("stale",)),
    Fault("tip frozen, old stamp", _set("freeze", Freeze.WHOLE), words=("hangs", "stale")),
    Fault(
        "tip frozen, new stamp",
        _set("freeze", Freeze.STAMPED),
        frozenset({0, 1, 3, 4, 5, 6}),
        shows_at_once=False,
    ),
    Fault("tip is NaN", _set("is_nan", True), words=("not a number",)),
    Fault("tip jumps", _jump, words=("jumped", "off its way", "moved as commanded", "deviat")),
    Fault(
        "tip mirrored",
        _set("signs", (-1.0, 1.0, 1.0)),
        frozenset({0, 1, 3, 4, 5, 6}),
        shows_at_once=False,
    ),
    Fault(
        "tip late by 0.3 s",
        _set("delay_s", 0.3),
        frozenset({0, 1, 3, 4, 5, 6}),
        shows_at_once=False,
    ),
    Fault("tip in another frame", _set_lab("frame", "camera"), words=("frame 'camera'",)),
    Fault("tip in mm for m", _set_lab("factor", 1000.0), words=("unit error", "jumped")),
    Fault("tip in m for mm", _set_lab("factor", 0.001), words=("unit error", "jumped")),
    Fault("two publishers", _second_publisher, words=("publishers", "jumped")),
    Fault("force stands still", _set("force_n", 0.4), frozenset({0, 1, 3, 4, 5, 6})),
    Fault(
        "stage deaf",
        _set_lab("is_deaf", True),
        words=("does not follow", "does not arrive", "stands at"),
    ),
    Fault("stage silent", _set_lab("is_silent", True), words=("silent",)),
    Fault("target moved", _move_target, words=("was moved",)),
    Fault("stop called", _call_stop, frozenset({130}), words=("stop was called",)),
    Fault("SIGTERM", _send(signal.SIGTERM), frozenset({143}), words=("SIGTERM",)),
    Fault("SIGINT", _send(signal.SIGINT), frozenset({130}), words=("operator",)),
    Fault("SIGKILL", _send(signal.SIGKILL), frozenset({-9})),
    Fault("clock goes back", _shift_clock(-5.0), words=("went back",), has_clock=True),
    Fault(
        "clock stands",
        lambda bench, _: setattr(bench, "clock_stands", True),
        words=("stands still",),
        has_clock=True,
    ),
    Fault(
        "best effort for reliable",
        lambda *_: None,
        words=("best effort",),
        arguments=_RELIABLE,
        is_at_start=True,
    ),
    Fault(
        "no publisher at start",
        _set("is_silent", True),
        words=("nothing has come", "silent"),
        is_at_start=True,
    ),
    Fault(
        "another frame at start",
        _set_lab("frame", "camera"),
        words=("frame 'camera'",),
        is_at_start=True,
    ),
    Fault(
        "20 m away at start",
        _set("jump_mm", (20000.0, 0.0, 0.0)),
        words=("unit error",),
        is_at_start=True,
    ),
    Fault("two publishers at start", _second_publisher, words=("publishers",), is_at_start=True),
    Fault(
        "no clock at start",
        lambda bench, _: setattr(bench, "clock_stands", True),
        words=("/clock",),
        is_at_start=True,
        has_clock=True,
    ),
    Fault(
        "stage silent at start",
        _set_lab("is_silent", True),
        words=("stage", "nothing"),
        is_at_start=True,
    ),
)
"""The catalogue; the first one is no fault at all."""


def run(fault: Fault, needle: str, seed: int, folder: Path) -> Finding:
    """Steers a needle, lets a fault happen at a random moment, and looks what came of it."""
    chance = random.Random(f"{fault.name} {seed}")
    with Bench(needle, seed, folder, fault.arguments, has_clock=fault.has_clock) as bench:
        if fault.is_at_start:
            fault.strike(bench, chance)
        bench.start()
        if not fault.is_at_start:
            bench.wait_until(lambda: bench.has_said("initial push"))
            deepest_mm = chance.uniform(0.5, 30.0)
            bench.wait_until(lambda: bench.depth_mm() > deepest_mm, 60.0)
        struck_mm = bench.depth_mm()
        if not fault.is_at_start:
            fault.strike(bench, chance)
        code, said, errors = bench.finish()
        time.sleep(_SETTLE_S)
        return _judged(fault, bench, Finding(code, said.get("reason", errors)), struck_mm)


def _judged(fault: Fault, bench: Bench, found: Finding, struck_mm: float) -> Finding:
    """Notes what must not have been."""
    ended_mm = bench.depth_mm()
    found.deeper_mm = ended_mm - struck_mm
    time.sleep(_SETTLE_S)
    if abs(bench.depth_mm() - ended_mm) > _STILL_MM:
        found.wrong.append("it moves after the end")
    truth = bench.lab.truth()
    if truth.clearance_mm < 0.0:
        found.wrong.append(f"a region was pierced by {-truth.clearance_mm:.2f} mm")
    if found.code not in fault.codes | ({0} if not fault.is_at_start else set()):
        found.wrong.append(f"exit code {found.code}")
    is_over = found.code == 0
    if fault.words and not is_over and not any(word in found.reason for word in fault.words):
        found.wrong.append("the reason does not tell")
    if fault.is_at_start and truth.has_moved:
        found.wrong.append("it moved")
    if fault.shows_at_once and fault.words and found.deeper_mm > STEP_MM:
        found.wrong.append(f"{found.deeper_mm:.1f} mm deeper after the fault")
    if fault.name == "nothing" and truth.target_distance_mm > 0.0:
        found.wrong.append("the target was not reached")
    return found
