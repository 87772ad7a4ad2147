"""What ends a command early: Ctrl-C, SIGTERM, and a limit. No file is left half written.

By default SIGTERM ends a process at once. Here it does what Ctrl-C does, so that temporary files
are removed, and a run that drives a needle stops it and completes its log. The exit code tells
which of the two it was. Ending in order may take a moment; whoever does not want to wait for it
sends the signal once more.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, Final, Literal, NoReturn

INTERRUPTED: Final = 128 + signal.SIGINT
TERMINATED: Final = 128 + signal.SIGTERM
"""The exit codes after Ctrl-C and after SIGTERM, as shells show them."""

Handler = Callable[[int, FrameType | None], None]
Limit = Literal["time", "memory"]


class Terminated(KeyboardInterrupt):
    """SIGTERM came."""


class LimitReached(BaseException):
    """A limit of a command is reached; the work at hand ends. See `ntagen.cli.guard`.

    It is no `Exception`, so that no library takes it for a failure of its own.

    Attributes:
        limit: Which limit; the engine reads it, too.
    """

    def __init__(self, limit: Limit, text: str) -> None:
        super().__init__(text)
        self.limit = limit


class Ending:
    """Remembers which signal came first: the exception alone may be turned into another one.

    Args:
        leave: Ends the program at once, with an exit code; half-written files are removed.
    """

    def __init__(self, leave: Callable[[int], NoReturn]) -> None:
        self._leave = leave
        self.came: int | None = None

    def handle(self, number: int, _frame: FrameType | None) -> None:
        """Interrupts the command; if it is being interrupted already, ends the program."""
        if self.came is not None:
            self._leave(128 + self.came)
        self.came = number
        raise Terminated if number == signal.SIGTERM else KeyboardInterrupt


@contextlib.contextmanager
def ending(leave: Callable[[int], NoReturn]) -> Iterator[Ending]:
    """Handles Ctrl-C and SIGTERM, if this thread can handle signals."""
    found = Ending(leave)
    with handled({signal.SIGINT: found.handle, signal.SIGTERM: found.handle}):
        yield found


@contextlib.contextmanager
def handled(handlers: dict[signal.Signals, Handler]) -> Iterator[None]:
    """Installs handlers of signals. Does nothing outside the main thread, or to ignored signals."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    old: dict[signal.Signals, Any] = {}
    try:
        for number, handler in handlers.items():
            if signal.getsignal(number) is not signal.SIG_IGN:
                old[number] = signal.signal(number, handler)
        yield
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)
