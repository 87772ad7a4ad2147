"""A controller that speaks GRBL, without hardware: bytes in, bytes and motions out.

It stands for GRBL 1.1h or grblHAL (`dialects`), with the motion times of their planner. It has no
clock of its own: `Emulator.advance` says what time it is, so that it runs in real time, faster, or
on a simulated clock. What the axes do is told to a `Plant`, in small pieces and in order.

It gives the firmwares' answers to the lines that were recorded from both; the tests compare them.
Real-time bytes act when they arrive; lines wait in the receive buffer until they are read.
"""

from __future__ import annotations

import heapq
import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final, Protocol

from ntagen.grbl.dialects import Dialect
from ntagen.grbl.machine import Machine
from ntagen.grbl.memory import Memory

TICK_S: Final = 0.01
"""Motion is told to the plant in pieces of at most this time."""

_RESET: Final = 0x18


class Plant(Protocol):
    """What the axes move."""

    def move(self, steps: Mapping[str, float], seconds: float) -> None:
        """Is told that axes have moved, each by so many mm or degrees, in so much time."""


class NoPlant:
    """Axes that move nothing."""

    def move(self, steps: Mapping[str, float], seconds: float) -> None:
        """Does nothing."""


@dataclass(slots=True)
class Faults:
    """What is wrong with the hardware; it may be changed at any time.

    Attributes:
        is_silent: It sends nothing.
        pace: Axes move at this share of the planned speed; at 0 they stay, but the state is Run.
        lost: For each axis, the share of its motion that does not arrive at the plant: 1 is an
            axis that is stuck. The controller counts its steps and notices nothing.
        delay_s: What it says comes later by this time.
    """

    is_silent: bool = False
    pace: float = 1.0
    lost: dict[str, float] = field(default_factory=dict)
    delay_s: float = 0.0


class Emulator:
    """An emulated controller.

    Args:
        dialect: The firmware.
        plant: What its axes move; nothing by default.
        memory: Its stored settings; by default the firmware's own. They survive resets.
    """

    def __init__(
        self, dialect: Dialect, plant: Plant | None = None, memory: Memory | None = None
    ) -> None:
        self.faults = Faults()
        self.memory = memory or Memory(dialect)
        self._dialect = dialect
        self._plant: Plant = plant or NoPlant()
        self._now_s = 0.0
        self._machine = Machine(dialect, self.memory, self)
        self._partial = bytearray()
        self._ended_by_return = False
        self._lines: deque[str | None] = deque()
        self._line_due_s = 0.0
        self._deaf_until_s = 0.0
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self._event_count = 0
        self._output: deque[tuple[float, bytes]] = deque()

    @property
    def now_s(self) -> float:
        """The time until which it has run."""
        return self._now_s

    @property
    def position(self) -> tuple[float, ...]:
        """Where its axes are, in mm or degrees."""
        return self._machine.planner.position

    @property
    def bytes_free(self) -> int:
        """How much it can receive before it has read a line."""
        waiting = sum(len(line or "") + 1 for line in self._lines) + len(self._partial)
        return self._dialect.receive_bytes - waiting

    def power_on(self) -> None:
        """Starts with the position 0, as after a power cut; it says its banner."""
        self._machine.power_on()

    def raise_alarm(self, code: int) -> None:
        """Stops at once and locks itself, as when a switch is hit."""
        self._machine.raise_alarm(code)

    def press(self, pins: str) -> None:
        """Sets which input pins are active: ``X`` is the limit of that axis, ``D`` the door."""
        is_opened = "D" in pins and "D" not in self._machine.pins
        self._machine.pins = pins
        if is_opened:
            self._machine.open_door()

    def send(self, noise: bytes) -> None:
        """Sends bytes, which need not belong to the protocol."""
        self._output.append((self._now_s, noise))

    def say(self, text: str) -> None:
        """Sends a line."""
        self.send(f"{text}\r\n".encode("ascii"))

    def after(self, seconds: float, action: Callable[[], None]) -> None:
        """Does something later, on its clock."""
        self._event_count += 1
        heapq.heappush(self._events, (self._now_s + seconds, self._event_count, action))

    def forget(self, deaf_s: float | None = None) -> None:
        """Forgets what was received.

        Args:
            deaf_s: With a time, it also forgets what it was about to do, and receives nothing for
                so long, as when it starts.
        """
        self._lines.clear()
        self._partial.clear()
        if deaf_s is not None:
            self._events.clear()
            self._deaf_until_s = self._now_s + deaf_s

    # What comes in.

    def feed(self, data: bytes) -> None:
        """Takes bytes from the wire."""
        for byte in data:
            if self._now_s < self._deaf_until_s and byte != _RESET:
                continue
            action = self._realtime(byte)
            if action is not None:
                action()
            elif byte >= 0x80 or self.bytes_free <= 0:
                continue
            elif byte in b"\r\n":
                self._end_line(byte)
            else:
                self._partial.append(byte)

    def _realtime(self, byte: int) -> Callable[[], None] | None:
        """What a real-time byte does; bytes above 0x7f that are not known do nothing."""
        actions: dict[int, Callable[[], None]] = {
            0x3F: lambda: self.after(self._dialect.status_s, self._machine.report),
            0x21: self._machine.hold,
            0x7E: self._machine.resume,
            _RESET: self._machine.reset,
            0x84: self._machine.open_door,
            0x85: self._machine.cancel_jog,
        }
        return actions.get(byte)

    def _end_line(self, byte: int) -> None:
        if byte == 0x0A and not self._partial and self._ended_by_return:
            self._ended_by_return = False
            return
        self._ended_by_return = byte == 0x0D
        text = self._partial.decode("ascii").strip()
        self._partial.clear()
        if not self._lines:
            self._line_due_s = self._now_s + self._dialect.line_s
        self._lines.append(text if len(text.replace(" ", "")) <= self._dialect.max_line else None)

    # Time.

    def next_event_s(self) -> float:
        """When it does something by itself, at the earliest; infinite if never."""
        sent_s = self._output[0][0] + self.faults.delay_s if self._output else math.inf
        return min(sent_s, self._next_action_s())

    def _next_action_s(self) -> float:
        """When it acts the next time; that output has arrived is no action."""
        times = [self._events[0][0]] if self._events else []
        if self._machine.planner.is_moving and self.faults.pace > 0.0:
            rest_s = self._machine.planner.end_s - self._machine.planner.now_s
            times.append(self._now_s + max(0.0, rest_s) / self.faults.pace)
        if self._lines and not self._machine.is_busy():
            times.append(max(self._line_due_s, self._now_s))
        if self._machine.dwell_end_s > self._now_s:
            times.append(self._machine.dwell_end_s)
        return min(times, default=math.inf)

    def advance(self, time_s: float) -> None:
        """Lets time pass until `time_s`."""
        while (due_s := self._next_action_s()) <= time_s:
            self._move(due_s)
            self._act()
        self._move(time_s)

    def take(self) -> bytes:
        """What it has sent until now; each byte is given once."""
        sent = bytearray()
        while self._output and self._output[0][0] + self.faults.delay_s <= self._now_s:
            sent += self._output.popleft()[1]
        return b"" if self.faults.is_silent else bytes(sent)

    def _move(self, time_s: float) -> None:
        """Moves the axes until a time, piece by piece."""
        while self._now_s < time_s:
            before = self._machine.planner.position
            step_s = (
                min(TICK_S, time_s - self._now_s) if self._machine.planner.is_moving else math.inf
            )
            next_s = min(time_s, self._now_s + step_s)
            passed_s = (next_s - self._now_s) * self.faults.pace
            self._machine.planner.advance(self._machine.planner.now_s + passed_s)
            self._tell_plant(before, next_s - self._now_s)
            self._now_s = next_s

    def _tell_plant(self, before: tuple[float, ...], seconds: float) -> None:
        after = self._machine.planner.position
        if after == before:
            return
        moved = {
            axis: (b - a) * (1.0 - self.faults.lost.get(axis, 0.0))
            for axis, a, b in zip(self._dialect.axes, before, after, strict=True)
            if a != b
        }
        self._plant.move(moved, seconds)
        if self.memory.number(21) and set(self._machine.pins) & set(self._dialect.axes):
            self._machine.raise_alarm(1)

    def _act(self) -> None:
        """Does what is due now."""
        while self._events and self._events[0][0] <= self._now_s:
            heapq.heappop(self._events)[2]()
        if not self._machine.planner.is_moving:
            self._machine.arrive()
        if self._lines and not self._machine.is_busy() and self._line_due_s <= self._now_s:
            self._machine.answer(self._lines.popleft())
            self._line_due_s = self._now_s + self._dialect.line_s


class SimulatedPort:
    """A port to an emulator whose clock advances only while somebody waits: runs take no real time.

    Args:
        emulator: The controller; it should be switched on.
    """

    def __init__(self, emulator: Emulator) -> None:
        self._emulator = emulator

    @property
    def name(self) -> str:
        """What users call it."""
        return "sim"

    def now_s(self) -> float:
        """The emulator's clock."""
        return self._emulator.now_s

    def read(self, timeout_s: float) -> bytes:
        """Lets time pass until there is something to read, or the time is over."""
        end_s = self._emulator.now_s + timeout_s
        while not (data := self._emulator.take()):
            if self._emulator.now_s >= end_s:
                break
            self._emulator.advance(min(end_s, self._emulator.next_event_s()))
        return data

    def write(self, data: bytes) -> None:
        """Gives bytes to the emulator now."""
        self._emulator.feed(data)

    def close(self) -> None:
        """Gives the port back; the emulator stays as it is."""
