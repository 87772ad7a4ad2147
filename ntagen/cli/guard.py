"""The limits of a whole command: time and memory in all that it does, also outside of the engine.

The engine ends its searches by itself, and its answer says what is known until then. Everything
else is ended from here: reading of files, evidence, pictures, lists of plans. A thread looks at the
clock and at the memory of this process. When a limit is reached it sends a signal to the main
thread, whose handler raises `LimitReached`; the engine looks for signals while it works. As after
Ctrl-C, no file is left half written.

* Time counts from the start of the command, and for each query after the first from its own start.
* Memory is what the process takes beyond what it had when the command began: libraries that Python
  loads later count a little, so that there are always some megabytes beside the limit.
* From a query on, which the engine ends by itself, a twentieth of the limit is left for printing
  and writing. To draw what random runs said until then takes more, and gets it (`Guard.allow`).
"""

from __future__ import annotations

import contextlib
import functools
import os
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType, TracebackType
from typing import Any, Final

from ntagen import system
from ntagen.cli.signals import Limit, LimitReached, handled
from ntagen.errors import LimitError

_LOOK_EVERY_S: Final = 0.01
_LOOK_CLOSELY_EVERY_S: Final = 0.002
_CLOSE_BYTES: Final = 64 << 20
"""So often the memory is looked at, and when so much is left: a process may take two gigabytes a
second."""

_LEFT: Final = 0.05
"""So much of a limit is left for what comes after an answer."""

_LEAST_LEFT_S: Final = 0.2
_LEAST_LEFT_BYTES: Final = 8 << 20


class Guard:
    """Watches the limits of a command, as long as it is entered.

    Attributes:
        doing: What is done now, for the message; see `doing`.
        reached: The limit that was reached since the last query or its answer.
    """

    def __init__(self, timeout_s: float | None, memory_bytes: int | None) -> None:
        self._timeout_s = timeout_s
        self._memory_bytes = memory_bytes
        self._start_s = time.monotonic()
        self._base_bytes = resident_bytes() or 0
        self._main_thread = threading.main_thread().ident or 0
        self._wake = threading.Condition()
        self._is_over = False
        self._has_query = False
        self._is_told = True
        self._deadline_s: float | None = None
        self._most_bytes: int | None = None
        self._signals = contextlib.ExitStack()
        self.doing = "reading the input"
        self.reached: Limit | None = None

    def __enter__(self) -> Guard:
        is_limited = self._timeout_s is not None or self._memory_bytes is not None
        if is_limited and threading.current_thread() is threading.main_thread():
            self._signals.enter_context(handled({system.ALARM: self._raise}))
            self._arm(self._start_s, self._base_bytes)
            threading.Thread(target=self._watch, daemon=True).start()
        _guards.append(self)
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        _guards.remove(self)
        with self._wake:
            self._is_over = self._is_told = True
            self._wake.notify()
        self._signals.close()
        if isinstance(error, LimitReached):
            raise LimitError(f"{error}\nhint: {_HINT[error.limit]}") from None

    def next_query(self) -> None:
        """A query begins, whose time counts from now on; that of the first one counts already."""
        if self._has_query:
            self._start_s = time.monotonic()
        self._has_query = True
        self._arm(self._start_s, self._base_bytes)

    def left_s(self) -> float | None:
        """How many seconds are left of the limit; at least 0."""
        if self._timeout_s is None:
            return None
        return max(0.0, self._start_s + self._timeout_s - time.monotonic())

    def has_answer(self) -> None:
        """The engine has ended, perhaps by a limit: what is left is for printing and writing."""
        now_s = time.monotonic() - (self._timeout_s or 0)
        self._arm(max(self._start_s, now_s), max(self._base_bytes, self._taken_too_much()))

    def allow(self, more_s: float, more_bytes: int) -> None:
        """What follows gets at least this time and memory, whatever the limits are.

        After an answer that a limit has ended, there is not enough left to load a library.
        """
        with self._wake:
            if self._deadline_s is not None:
                self._deadline_s = max(self._deadline_s, time.monotonic() + more_s)
            if self._most_bytes is not None:
                self._most_bytes = max(self._most_bytes, (resident_bytes() or 0) + more_bytes)
            self._wake.notify()

    def _taken_too_much(self) -> int:
        """What the process would have to have taken at first for what it takes now."""
        return 0 if self._memory_bytes is None else (resident_bytes() or 0) - self._memory_bytes

    def _arm(self, start_s: float, base_bytes: int) -> None:
        """Sets the moment and the memory at which an alarm comes."""
        with self._wake:
            self.reached = None
            self._is_told = False
            share = _LEFT if self._has_query else 0.0
            if self._timeout_s is not None:
                left_s = max(_LEAST_LEFT_S, share * self._timeout_s)
                self._deadline_s = start_s + self._timeout_s + left_s
            if self._memory_bytes is not None:
                left_bytes = max(_LEAST_LEFT_BYTES, int(share * self._memory_bytes))
                self._most_bytes = base_bytes + self._memory_bytes + left_bytes
            self._wake.notify()

    def _watch(self) -> None:
        """Looks, and sends the alarm; one thread does nothing else."""
        with self._wake:
            while not self._is_over:
                now_s = time.monotonic()
                if self.reached is None:
                    self.reached = self._limit(now_s)
                    if self.reached is not None:
                        system.alarm(self._main_thread)
                waits = []
                if self._most_bytes is not None:
                    is_close = self._most_bytes - (resident_bytes() or 0) < _CLOSE_BYTES
                    waits.append(_LOOK_CLOSELY_EVERY_S if is_close else _LOOK_EVERY_S)
                if self._deadline_s is not None:
                    waits.append(max(0.0, self._deadline_s - now_s))
                self._wake.wait(None if self.reached else min(waits))

    def _limit(self, now_s: float) -> Limit | None:
        if self._deadline_s is not None and now_s >= self._deadline_s:
            return "time"
        if self._most_bytes is None:
            return None
        return "memory" if (resident_bytes() or 0) >= self._most_bytes else None

    def _raise(self, _number: int, _frame: FrameType | None) -> None:
        """The handler of the alarm, in the main thread."""
        if self._is_told or self.reached is None:
            return
        self._is_told = True
        raise LimitReached(self.reached, self.text(self.reached))

    def text(self, limit: Limit) -> str:
        """What a limit has stopped, for the user."""
        amount = ""
        if limit == "time" and self._timeout_s is not None:
            amount = f" of {self._timeout_s:g} s"
        elif limit == "memory" and self._memory_bytes is not None:
            amount = f" of {self._memory_bytes / 2**20:g} MiB"
        return f"{self.doing} was stopped by the {limit} limit{amount}"


_HINT: Final[dict[Limit, str]] = {
    "time": "give more time with --timeout",
    "memory": "give more memory with --memory",
}

_guards: list[Guard] = []


@contextlib.contextmanager
def doing(what: str) -> Iterator[None]:
    """Says what a command does now, such as ``loading the model``, for the message of a limit."""
    if not _guards:
        yield
        return
    guard = _guards[-1]
    before, guard.doing = guard.doing, what
    yield
    # After an error it says still what has failed.
    guard.doing = before


def guarded(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Runs a command within its options `timeout_s` and `memory_bytes`, in everything it does.

    They are options of the command itself, or among its options of the engine (`given`).
    """

    @functools.wraps(command)
    def within(**values: Any) -> int | None:  # noqa: ANN401  click's values
        given = values | values.get("given", {})
        with Guard(given["timeout_s"], given["memory_bytes"]):
            return command(**values)

    return within


def current() -> Guard:
    """The guard of the command that runs; one without limits if it has none."""
    return _guards[-1] if _guards else Guard(None, None)


def resident_bytes() -> int | None:
    """The memory that this process takes; ``None`` where the system does not say it."""
    return taken_bytes(1)


def taken_bytes(column: int) -> int | None:
    """The virtual (0) or the resident memory (1) of this process, where the system says it."""
    try:
        descriptor = os.open("/proc/self/statm", os.O_RDONLY)
    except OSError:
        return None
    try:
        return int(os.read(descriptor, 64).split()[column]) * _PAGE_BYTES
    finally:
        os.close(descriptor)


_PAGE_BYTES: Final = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096
