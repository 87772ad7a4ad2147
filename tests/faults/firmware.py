"""A needle behind real firmware, in real time: one of the `tests.faults.controllers`.

The controller counts steps and knows no needle: the positions in its status reports move a phantom
here, which a tracker publishes as in `ntagen.lab`. The driver opens a pseudo-terminal, as at
hardware. The switches of limit and door are pins of the controller.
"""

from __future__ import annotations

import contextlib
import os
import pty
import re
import select
import socket
import threading
import time
import tty
from collections.abc import Callable
from pathlib import Path
from typing import Self

from ntagen.drive.configure import configure
from ntagen.drive.plant import NeedlePlant
from ntagen.drive.steppers import axes_for, described
from ntagen.lab.lab import HOST, RATE_HZ, Publisher
from ntagen.lab.needles import place
from ntagen.needle.phantom_sensor import Frame
from ntagen.nsl import load_task
from ntagen.openigtlink.server import Server
from ntagen.tracking.simulated import FORCE, NEEDLE
from tests.faults.controllers import Controller

_TASK = """\
environment firmware {
  needle {
    tip (0, 0, 0) mm  heading -y  bevel +z
    radius 30 mm  speed 1 mm/s
  }

  motion {
    step 1 s
    roll by 90, 180, 270 deg  at most 2 times  at least 2 mm apart
  }

  target   T1  sphere (0, -28, 0) mm  radius 10 mm
  critical C1  sphere (0, -13, 0) mm  radius 1 mm

  device grbl "/dev/ttyACM0" { insert X 80 steps/mm  roll {roll} 5 steps/deg }

  tissue static
  safety sampled
}
"""
"""A short way, since it takes real time."""

PUSH, REST, REFUSED = "in a push", "at rest", "a line is refused"
"""Moments in which something can happen."""

_REPORT = re.compile(rb"<(\w+)(?::\d)?\|MPos:([-0-9.,]+)[^<>]*>")
_KEPT_BYTES = 4096
_BEGINS_MM = 0.15
"""A push that has begun, and is not yet over: it has pieces of 0.25 mm or more."""

_LOOK_S = 0.02
_PATIENCE_S = 20.0


class Firmware:
    """A controller, the needle that its axes move, and the tracker; use it as a context manager.

    Args:
        controller: The controller.
        folder: Where it keeps its settings, and where the task is written.
        soft: Whether it has soft limits.
        seed: The seed of the phantom.

    Attributes:
        task: The file with the task.
        depth_mm: How deep the needle is.
        struck_mm: How deep the needle was when something happened; `None` before.
        tell: Is called with each of the moments `PUSH`, `REST`, `REFUSED`, before the driver knows.
    """

    def __init__(
        self, controller: Controller, folder: Path, *, soft: bool = False, seed: int = 1
    ) -> None:
        self.task = folder / "firmware.nsl"
        self.task.write_text(_TASK.replace("{roll}", controller.roll))
        task = load_task(self.task)
        settings = configure(task.given, task.scene, "all", "phantom").settings
        self._placed = place("phantom", task.scene, seed, settings.sensing_margin_mm)
        axes = axes_for(described(task, self.task), task.scene.needle, settings)
        self._plant = NeedlePlant(self._placed.needle, axes)
        self._controller, self._folder, self._soft = controller, folder, soft
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._is_placed = self._has_driver = False
        self._heard = b""
        self._state = ""
        self._last: tuple[float, float] | None = None
        self.depth_mm = self._stood_mm = 0.0
        self.struck_mm: float | None = None
        self.tell: Callable[[str], None] = lambda _: None
        self._server = Server(HOST)
        self._publisher = Publisher(self._server, self._look, 1.0 / RATE_HZ, self._placed.latency_s)
        self._began_s = time.monotonic()
        self._thread = threading.Thread(target=self._work, daemon=True)

    def __enter__(self) -> Self:
        with contextlib.ExitStack() as stack:
            stack.callback(self._server.close)
            self._switch_on()
            stack.callback(self._switch_off)
            self.plug_in()
            self._thread.start()
            stack.callback(self._thread.join)
            stack.callback(self._closing.set)
            one = self._controller
            self._until(lambda: one.banner in self._heard, "the power")
            # Errors of a blank memory follow the greeting.
            self._until(self._stands, "the power")
            for line in (*one.settings, *(one.soft_limits if self._soft else ())):
                self.command(line)
                self._until(self._stands, "the end of a motion")
            self._is_placed = True
            stack.enter_context(self._publisher)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    @property
    def port(self) -> str:
        """What the driver opens."""
        return os.ttyname(self._theirs)

    @property
    def tracker(self) -> str:
        """The words of ``--tracker``; the tracker does not see how the needle is turned."""
        late_ms = 1e3 * self._placed.latency_s
        where = f"openigtlink:{HOST}:{self._server.port}:{NEEDLE}"
        return f"{where},force={FORCE},latency={late_ms:g}ms"

    @property
    def true_clearance_mm(self) -> float:
        """The least distance of all that was cut to a critical region."""
        self._look()
        return self._placed.needle.true_clearance_mm()

    def send(self, data: bytes) -> None:
        """Sends bytes as somebody else: a pendant, or a button of the controller."""
        self._wire.sendall(data)

    def command(self, line: str) -> None:
        """Sends a line as somebody else, and waits until it is accepted."""
        self._heard = b""
        self.send(line.encode() + b"\n")
        self._until(lambda: b"ok" in self._heard or b"error" in self._heard, line)
        assert b"error" not in self._heard, f"{line}: {self._heard!r}"

    def press(self, key: str) -> None:
        """Turns a switch over: x is the limit of X, d the safety door."""
        assert self._process.stdin is not None
        self._process.stdin.write(key.encode())
        self._process.stdin.flush()

    def pull_cable(self) -> None:
        """Nothing passes any more, and the driver's port is gone."""
        self._has_driver = False
        os.close(self._theirs)
        os.close(self._ours)

    def plug_in(self) -> None:
        """The port is there, with a new name."""
        self._ours, self._theirs = pty.openpty()
        tty.setraw(self._ours)
        tty.setraw(self._theirs)
        self._has_driver = True

    def lose_power(self) -> None:
        """The controller is switched off and on: its motors stand, and it counts from 0."""
        self._switch_off()
        self._last = None
        self._switch_on()

    def settle(self) -> None:
        """Waits until the axes stand, and lets the needle come to where they are."""
        before = None
        while before != self.depth_mm:
            before = self.depth_mm
            time.sleep(0.3)
            self._ask()

    def _ask(self) -> None:
        """Asks for the status as the driver would, when there is none."""
        self._heard = b""
        self.send(b"?")
        self._until(lambda: _REPORT.search(self._heard) is not None, "?")

    def _stands(self) -> bool:
        self._ask()
        return self._state == "Idle"

    def _until(self, is_so: Callable[[], bool], what: str) -> None:
        end_s = time.monotonic() + _PATIENCE_S
        while not is_so():
            assert time.monotonic() < end_s, f"no answer to {what}: {self._heard!r}"
            time.sleep(_LOOK_S)

    def _switch_on(self) -> None:
        with socket.socket() as free:
            free.bind((HOST, 0))
            number = free.getsockname()[1]
        self._process = self._controller.start(self._folder, number)
        end_s = time.monotonic() + _PATIENCE_S
        while True:
            try:
                self._wire = socket.create_connection((HOST, number))
                return
            except ConnectionRefusedError:
                assert time.monotonic() < end_s, "the controller does not listen"
                time.sleep(_LOOK_S)

    def _switch_off(self) -> None:
        self._process.kill()
        self._process.communicate()
        self._wire.close()

    def _work(self) -> None:
        """Passes bytes on, and moves the needle by the reports among them."""
        while not self._closing.is_set():
            ends = [self._wire, *([self._ours] if self._has_driver else [])]
            try:
                ready, _, _ = select.select(ends, [], [], _LOOK_S)
                if self._wire in ready and (data := self._wire.recv(4096)):
                    self._hear(data)
                    if self._has_driver:
                        os.write(self._ours, data)
                if self._ours in ready:
                    self._wire.sendall(os.read(self._ours, 4096))
            except (OSError, ValueError):
                # A cable or the power is gone; or no driver has opened the port.
                time.sleep(_LOOK_S)

    def _hear(self, data: bytes) -> None:
        heard = self._heard = self._heard[-_KEPT_BYTES:] + data
        for found in _REPORT.finditer(heard):
            if found.end() > len(heard) - len(data):
                at = dict(zip(self._controller.axes, map(float, found[2].split(b",")), strict=True))
                self._move(found[1].decode(), at["X"], at[self._controller.roll])
        if b"error:" in data:
            self.tell(REFUSED)

    def _move(self, state: str, x_mm: float, roll_deg: float) -> None:
        """Moves the needle to where a report says that the axes are."""
        last_mm, last_deg = self._last or (x_mm, roll_deg)
        self._state, self._last = state, (x_mm, roll_deg)
        if not self._is_placed:
            return
        with self._lock:
            self.depth_mm += x_mm - last_mm
            moved = {"X": x_mm - last_mm, self._controller.roll: roll_deg - last_deg}
            self._plant.move(moved, _LOOK_S)
        if state == "Idle":
            self._stood_mm = x_mm
            self.tell(REST)
        elif last_mm < x_mm < self._stood_mm + _BEGINS_MM:
            self.tell(PUSH)

    def _look(self) -> Frame:
        """What the tracker shows now, also in the middle of a motion."""
        with self._lock:
            self._placed.clock.set(time.monotonic() - self._began_s)
            self._plant.settle()
            self._placed.needle.roll_on(0.0)
            return self._placed.frame()
