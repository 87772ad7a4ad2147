"""The simulated lab: controller, needle, tracker and force sensor, on one clock."""

from __future__ import annotations

import contextlib
import enum
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final, Protocol, Self

from ntagen.drive.plant import NeedlePlant, simulated_axes, simulated_controller
from ntagen.grbl.axes import Axes
from ntagen.grbl.pseudo import PseudoTerminal
from ntagen.lab.needles import Placed
from ntagen.needle.measurement import Measurement
from ntagen.needle.phantom_sensor import Frame
from ntagen.needle.vectors import add
from ntagen.openigtlink.messages import Transform
from ntagen.openigtlink.packets import Packet
from ntagen.openigtlink.server import Server
from ntagen.scene import Pose, Scene, Vector
from ntagen.shapes import vector_of
from ntagen.tracking.simulated import FORCE, NEEDLE, packets_of

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

    @staticmethod
    def of(scene: Scene, placed: Placed, time_s: float, *, has_moved: bool) -> Truth:
        """What a needle knows that was placed in a scene."""
        tip, target = placed.needle.true_tip, scene.targets[-1]
        return Truth(
            tip=tip,
            target=target.name,
            target_distance_mm=target.distance_mm(tip.position_mm),
            clearance_mm=placed.needle.true_clearance_mm(),
            time_s=time_s,
            has_moved=has_moved,
        )


class Lab:
    """A lab in this process, in threads of its own; use it as a context manager.

    Args:
        scene: The actual scene.
        placed: The needle in it.
        axes: The axes of the controller; ours by default.
        speed: How many seconds pass in the lab in one second outside: for axes, needle and tracker.

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
    ) -> None:
        self._scene = scene
        self._placed = placed
        self._speed = speed
        axes = axes or simulated_axes(scene.needle.speed_mm_per_s)
        self._plant = NeedlePlant(placed.needle, axes)
        self._moved_s: float | None = None
        self.emulator = simulated_controller(self, axes)
        self._stack = contextlib.ExitStack()
        self.server = Server(HOST)
        self._stack.callback(self.server.close)
        self._terminal = PseudoTerminal(self.emulator, speed)
        latency_s = placed.latency_s / speed
        self._publisher = Publisher(self.server, self._look, 1.0 / (RATE_HZ * speed), latency_s)
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
            has_moved = self._moved_s is not None
            return Truth.of(self._scene, self._placed, self.emulator.now_s, has_moved=has_moved)

    @property
    def true_tip(self) -> Pose:
        """The true pose of the tip."""
        return self.truth().tip

    def true_clearance_mm(self) -> float:
        """The smallest distance of all that was cut to any actual critical region."""
        return self.truth().clearance_mm

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


SHORTEST_PERIOD_S: Final = 0.002
"""Samples do not follow each other faster than that, however fast the lab runs."""


class Freeze(enum.Enum):
    """How a tracker hangs."""

    NO = "it does not"
    STAMPED = "the last sample again, with a fresh time stamp"
    WHOLE = "the last sample again, with its old time stamp"


@dataclass(slots=True)
class TrackerFaults:
    """What is wrong with tracker and force sensor; it may be changed at any time.

    Attributes:
        is_silent: Nothing is sent, but the connection stands.
        is_lost: The tracker does not see the needle; the force is sent all the same.
        freeze: The tracker sends its last sample again.
        signs: Factors of the coordinates of positions and directions: one -1 is a frame that
            mirrors, two are a frame that was taken for another one, as LPS for RAS.
        jump_mm: Positions are off by this.
        is_nan: Positions are not numbers.
        delay_s: Everything is sent later by this time.
        force_n: The force sensor shows this, whatever the force is: 0, or its full scale.
        stamp_shift_s: The clock of the time stamps is ahead by this.
    """

    is_silent: bool = False
    is_lost: bool = False
    freeze: Freeze = Freeze.NO
    signs: Vector = (1.0, 1.0, 1.0)
    jump_mm: Vector = (0.0, 0.0, 0.0)
    is_nan: bool = False
    delay_s: float = 0.0
    force_n: float | None = None
    stamp_shift_s: float = 0.0


class Sends(Protocol):
    """What sends messages to whoever listens."""

    def send(self, *packets: Packet) -> None:
        """Sends them, in this order."""


class Publisher:
    """Publishes what is seen, in a thread of its own; use it as a context manager.

    Args:
        server: Sends it.
        look: Looks at the needle now.
        period_s: The time between two samples.
        latency_s: How old a sample is when it is sent.

    Attributes:
        faults: What is wrong with it.
    """

    def __init__(
        self, server: Sends, look: Callable[[], Frame], period_s: float, latency_s: float
    ) -> None:
        self.faults = TrackerFaults()
        self._server = server
        self._look = look
        self._period_s = max(SHORTEST_PERIOD_S, period_s)
        self._latency_s = latency_s
        self._late: deque[tuple[float, tuple[Packet, ...]]] = deque()
        self._last: Packet | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._work, name="lab tracker", daemon=True)

    def __enter__(self) -> Publisher:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.set()
        self._thread.join()

    def _work(self) -> None:
        due_s = time.monotonic()
        while not self._closing.wait(max(0.0, due_s - time.monotonic())):
            self._late.append((time.monotonic() + self.faults.delay_s, self._packets(self._look())))
            while self._late and self._late[0][0] <= time.monotonic():
                packets = self._late.popleft()[1]
                if packets and not self.faults.is_silent:
                    self._server.send(*packets)
            # After a pause of the process nothing is made up for.
            due_s = max(due_s + self._period_s, time.monotonic())

    def _packets(self, frame: Frame) -> tuple[Packet, ...]:
        """The messages of a frame: the force, and the pose unless it is lost."""
        faults, now_s = self.faults, time.time()
        measurement = frame.measurement
        if faults.force_n is not None:
            measurement = replace(measurement, force_n=faults.force_n)
        stamp_s = max(0.0, now_s - self._latency_s + faults.stamp_shift_s)
        force, pose = (
            replace(packet, stamp_s=stamp_s) for packet in packets_of(_wrong(measurement, faults))
        )
        if faults.freeze is not Freeze.NO and self._last is not None:
            pose = self._last
            if faults.freeze is Freeze.STAMPED:
                pose = replace(pose, stamp_s=stamp_s)
        else:
            pose = replace(pose, content=_signed(pose.content, faults.signs))
        self._last = pose
        return (force,) if frame.is_lost or faults.is_lost else (force, pose)


def _wrong(measurement: Measurement, faults: TrackerFaults) -> Measurement:
    """A measurement as a tracker with these faults makes it."""
    position_mm = add(measurement.position_mm, faults.jump_mm)
    if faults.is_nan:
        position_mm = (math.nan, math.nan, math.nan)
    return replace(measurement, position_mm=position_mm)


def _signed(content: object, signs: Vector) -> Transform:
    """A pose with its coordinates multiplied by factors."""
    if not isinstance(content, Transform):
        raise TypeError(f"the lab publishes the pose of {NEEDLE}, not {content}")

    def column(vector: Vector) -> Vector:
        return vector_of(a * b for a, b in zip(signs, vector, strict=True))

    x, y, z, origin = content.columns
    return Transform((column(x), column(y), column(z), column(origin)))
