"""An emulated controller on a pseudo-terminal: to the other side it is a serial port."""

from __future__ import annotations

import contextlib
import os
import select
import threading
import time
from types import TracebackType
from typing import Final, Self

from ntagen.errors import DeviceError
from ntagen.grbl.emulator import Emulator

_LONGEST_WAIT_S: Final = 0.01
"""Motion is told to the plant at least so often."""

_READ_BYTES: Final = 4096


class PseudoTerminal:
    """Runs an emulator in a thread of its own, in real time or faster.

    Args:
        emulator: The controller; it should be switched on. Other threads use it under `lock` only.
        speed: How many seconds pass on its clock in one second.

    Raises:
        DeviceError: This system has no pseudo-terminals.
    """

    def __init__(self, emulator: Emulator, speed: float = 1.0) -> None:
        self.lock = threading.Lock()
        self._emulator = emulator
        self._speed = speed
        self._began_s, self._offset_s = time.monotonic(), emulator.now_s
        self._controller, self._client = _opened()
        os.set_blocking(self._controller, False)
        self.name = os.ttyname(self._client)
        self._wake_read, self._wake_write = os.pipe()
        self._thread = threading.Thread(target=self._run, name="grbl emulator", daemon=True)

    def __enter__(self) -> Self:
        self._began_s = time.monotonic()
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.hang_up()
        for number in (self._wake_read, self._wake_write):
            os.close(number)

    def hang_up(self) -> None:
        """Closes the terminal, as when the cable is pulled: the other side gets an error."""
        if self._thread.is_alive():
            os.write(self._wake_write, b"x")
            self._thread.join()
        for number in (self._controller, self._client):
            with contextlib.suppress(OSError):
                os.close(number)
        self._controller = self._client = -1

    def catch_up(self) -> None:
        """Lets the emulator run until now; for others, who hold `lock`."""
        time_s = self._offset_s + (time.monotonic() - self._began_s) * self._speed
        self._emulator.advance(max(time_s, self._emulator.now_s))

    def _run(self) -> None:
        while True:
            ready, _, _ = select.select([self._controller, self._wake_read], [], [], self._wait_s())
            if self._wake_read in ready:
                return
            try:
                data = os.read(self._controller, _READ_BYTES) if ready else b""
                self._turn(data)
            except OSError:
                return

    def _wait_s(self) -> float:
        """How long nothing will happen."""
        with self.lock:
            due_s = (self._emulator.next_event_s() - self._offset_s) / self._speed
        return min(_LONGEST_WAIT_S, max(0.0, due_s - (time.monotonic() - self._began_s)))

    def _turn(self, data: bytes) -> None:
        with self.lock:
            self.catch_up()
            self._emulator.feed(data)
            answer = self._emulator.take()
        if answer:
            # Nobody reads: a real controller's answers are lost then, too.
            with contextlib.suppress(BlockingIOError):
                os.write(self._controller, answer)


def _opened() -> tuple[int, int]:
    """Both ends of a new pseudo-terminal that passes on all bytes: the controller's and the other.

    Raises:
        DeviceError: This system has no pseudo-terminals.
    """
    try:
        import pty
        import tty
    except ImportError:
        raise DeviceError(
            "this system has no pseudo-terminals, on which other programs could reach the emulated "
            "controller\nhint: use Linux, macOS or WSL; `ntagen drive --needle grbl+sim` works here"
        ) from None
    controller, client = pty.openpty()
    tty.setraw(client)
    return controller, client
