"""The simulated lab: controller, needle, tracker and force sensor, on one clock."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Self

from ntagen.drive.plant import NeedlePlant, simulated_axes, simulated_controller
from ntagen.grbl.axes import Axes
from ntagen.grbl.pseudo import PseudoTerminal
from ntagen.lab.needles import Placed
from ntagen.lab.publisher import Publisher, TrackerFaults
from ntagen.needle.phantom_sensor import Frame
from ntagen.openigtlink.server import Server
from ntagen.scene import Pose, Scene
from ntagen.tracking.simulated import FORCE, NEEDLE

HOST: Final = "127.0.0.1"
"""The lab listens on this machine only."""

RATE_HZ: Final = 40.0
"""Samples of the tracker in a second of the lab's time."""


@dataclass(frozen=True, slots=True)
class Truth:
    """What has really happened in the lab.

    Attributes:
        tip: The true pose of the tip.
        target: The name of the last target.
        target_distance_mm: The distance of the tip to its surface; negative inside.
        clearance_mm: The smallest distance of all that was cut to any actual critical region;
            negative if one was pierced, infinite if there is none.
        time_s: How long the lab has run, on its own clock.
        has_moved: Whether any axis has moved.
    """

    tip: Pose
    target: str
    target_distance_mm: float
    clearance_mm: float
    time_s: float
    has_moved: bool


class Lab:
    """A lab in this process, in threads of its own; use it as a context manager.

    Args:
        scene: The actual scene.
        placed: The needle in it.
        axes: The axes of the controller; ours by default.
        speed: How many seconds pass in the lab in one second outside: for axes, needle and tracker.
        rate_hz: Samples of the tracker in a second of the lab's time.
        listen_port: The port of the tracker's server; 0 for any that is free.

    Attributes:
        emulator: The controller. Use it under `lock`: its thread runs it, too.
        server: The server of the tracker.
        faults: What is wrong with tracker and force sensor.

    Raises:
        InputError: The emulated controller has no such axes.
        DeviceError: The server cannot listen there.
    """

    def __init__(
        self,
        scene: Scene,
        placed: Placed,
        *,
        axes: Axes | None = None,
        speed: float = 1.0,
        rate_hz: float = RATE_HZ,
        listen_port: int = 0,
    ) -> None:
        self._scene = scene
        self._placed = placed
        self._speed = speed
        axes = axes or simulated_axes(scene.needle.speed_mm_per_s)
        self._plant = NeedlePlant(placed.needle, axes)
        self._moved_s: float | None = None
        self.emulator = simulated_controller(self, axes)
        self._stack = contextlib.ExitStack()
        self.server = Server(HOST, listen_port)
        self._stack.callback(self.server.close)
        self._terminal = PseudoTerminal(self.emulator, speed)
        latency_s = placed.latency_s / speed
        self._publisher = Publisher(self.server, self._look, 1.0 / (rate_hz * speed), latency_s)
        self.faults: TrackerFaults = self._publisher.faults

    def __enter__(self) -> Self:
        self._stack.enter_context(self._terminal)
        self._stack.enter_context(self._publisher)
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    @property
    def speed(self) -> float:
        """How many seconds pass in the lab in one second outside."""
        return self._speed

    @property
    def port(self) -> str:
        """The serial port of the controller."""
        return self._terminal.name

    @property
    def lock(self) -> threading.Lock:
        """Who holds it is alone with the controller and the needle."""
        return self._terminal.lock

    @property
    def tracker_address(self) -> str:
        """The words of ``--tracker`` for the lab's tracker."""
        latency_ms = 1e3 * self._placed.latency_s / self._speed
        late = f",latency={latency_ms:g}ms" if latency_ms else ""
        return f"openigtlink:{HOST}:{self.server.port}:{NEEDLE},bevel=+x,force={FORCE}{late}"

    def move(self, steps: Mapping[str, float], seconds: float) -> None:
        """Is told by the controller that axes have moved."""
        self._moved_s = time.monotonic()
        self._plant.move(steps, seconds)

    def idle_s(self) -> float | None:
        """How long nothing has moved, in seconds outside; `None` if nothing ever has."""
        moved_s = self._moved_s
        return None if moved_s is None else time.monotonic() - moved_s

    def truth(self) -> Truth:
        """What has really happened until now."""
        with self.lock:
            self._settle()
            tip = self._placed.needle.true_tip
            target = self._scene.targets[-1]
            return Truth(
                tip=tip,
                target=target.name,
                target_distance_mm=target.distance_mm(tip.position_mm),
                clearance_mm=self._placed.needle.true_clearance_mm(),
                time_s=self.emulator.now_s,
                has_moved=self._moved_s is not None,
            )

    def _look(self) -> Frame:
        """What tracker and force sensor show now, also in the middle of a motion."""
        with self.lock:
            self._settle()
            return self._placed.frame()

    def _settle(self) -> None:
        """Lets the needle come to where the axes are now."""
        self._terminal.catch_up()
        self._placed.clock.set(self.emulator.now_s)
        self._plant.settle()
        # The sensor notes a needle at rest, too: else it would spread the next motion over the
        # time before it.
        self._placed.needle.roll_on(0.0)
