"""An emulated controller on a simulated clock, in this process: runs take no real time."""

from __future__ import annotations

from ntagen.grbl.emulator import Emulator


class SimulatedPort:
    """A port to an emulator whose clock advances only while somebody waits.

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
