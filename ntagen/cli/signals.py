"""Ctrl-C and SIGTERM: both end a command in an orderly way; no file is left half written.

By default SIGTERM ends a process at once. Here it does what Ctrl-C does, so that temporary files
are removed, and a run that drives a needle stops it and completes its log. The exit code tells
which of the two it was.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, Final

TERMINATED: Final = 128 + signal.SIGTERM
"""The exit code after SIGTERM, as shells show it."""

Handler = Callable[[int, FrameType | None], None]


class Terminated(KeyboardInterrupt):
    """SIGTERM came."""


class Termination:
    """Remembers whether SIGTERM came: the exception alone may be turned into another one."""

    def __init__(self) -> None:
        self.came = False

    def handle(self, _number: int, _frame: FrameType | None) -> None:
        """Ends the command as Ctrl-C does."""
        self.came = True
        raise Terminated


@contextlib.contextmanager
def termination() -> Iterator[Termination]:
    """Turns SIGTERM into an interruption, if this thread can handle signals."""
    found = Termination()
    with handled({signal.SIGTERM: found.handle}):
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


@contextlib.contextmanager
def ending_at_once_next_time() -> Iterator[None]:
    """Lets the first Ctrl-C interrupt as always, and the second one end the program at once.

    The engine ends its work in an orderly way after the first one, which may take a moment.
    """

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        raise KeyboardInterrupt

    with handled({signal.SIGINT: interrupt}):
        yield
