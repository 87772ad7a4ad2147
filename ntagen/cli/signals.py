"""Ctrl-C and SIGTERM: both end a command in order, and what it was writing is whole or not there.

By itself SIGTERM ends a process on the spot. Here it does what Ctrl-C does, so that temporary files
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
    """Whether SIGTERM came; code that turns all interruptions into one forgets which it was."""

    def __init__(self) -> None:
        self.came = False

    def handle(self, _number: int, _frame: FrameType | None) -> None:
        """Ends the command as Ctrl-C does."""
        self.came = True
        raise Terminated


@contextlib.contextmanager
def termination() -> Iterator[Termination]:
    """Turns SIGTERM into an interruption, where that can be done."""
    found = Termination()
    with handled({signal.SIGTERM: found.handle}):
        yield found


@contextlib.contextmanager
def handled(handlers: dict[signal.Signals, Handler]) -> Iterator[None]:
    """Handles signals so; only the main thread can, and a signal that is ignored stays so."""
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
