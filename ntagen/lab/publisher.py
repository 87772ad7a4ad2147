"""The lab's tracker and force sensor: they publish what they see, all the time, right or wrong."""

from __future__ import annotations

import enum
import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from ntagen.needle.measurement import Measurement
from ntagen.needle.phantom_sensor import Frame
from ntagen.needle.vectors import add
from ntagen.openigtlink.messages import Transform
from ntagen.openigtlink.packets import Packet
from ntagen.openigtlink.server import Server
from ntagen.scene import Vector
from ntagen.tracking.simulated import NEEDLE, packets_of

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
        self, server: Server, look: Callable[[], Frame], period_s: float, latency_s: float
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
        x, y, z = (a * b for a, b in zip(signs, vector, strict=True))
        return (x, y, z)

    x, y, z, origin = content.columns
    return Transform((column(x), column(y), column(z), column(origin)))
