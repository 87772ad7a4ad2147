"""What Windows does otherwise than Linux and macOS; the rest of the package asks here.

It looks for what there is and not at the name of the system, so that tests can take things away.
"""

from __future__ import annotations

import _thread
import contextlib
import errno
import importlib
import os
import signal
import stat
from typing import Any, Final

# In Python no descriptor is passed on to another program, so O_CLOEXEC is needed nowhere.
BINARY: Final[int] = getattr(os, "O_BINARY", 0)
"""A flag of `os.open`: without it Windows changes the ends of lines."""

OWN_TERMINAL: Final[int] = getattr(os, "O_NOCTTY", 0)
"""A flag of `os.open`: a terminal that is opened does not become that of the process."""

AT_ONCE: Final[int] = getattr(os, "O_NONBLOCK", 0)
"""A flag of `os.open`: neither opening nor reading waits."""

KILL: Final[signal.Signals] = getattr(signal, "SIGKILL", signal.SIGTERM)
"""The signal that ends a process at once; Windows has only such ones."""

ALARM: Final[signal.Signals] = getattr(signal, "SIGALRM", signal.SIGABRT)
"""The signal that `alarm` sends; nothing else in the package uses it."""

HANG_UPS: Final[tuple[signal.Signals, ...]] = tuple(
    getattr(signal, name) for name in ("SIGHUP", "SIGBREAK") if hasattr(signal, name)
)
"""What comes when the terminal is closed."""

_LOCK_OFFSET: Final = 2**31 - 2
"""Nobody can read a byte that Windows has locked, so it is one far behind the content."""


def take_lock(descriptor: int) -> None:
    """Locks an open file for as long as it is open.

    Raises:
        BlockingIOError: Another process has locked it.
        OSError: The file system has no locks.
    """
    try:
        import fcntl
    except ImportError:
        _lock_byte(descriptor)
    else:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _lock_byte(descriptor: int) -> None:
    """Locks one byte of a file, as Windows does it."""
    msvcrt: Any = importlib.import_module("msvcrt")
    place = os.lseek(descriptor, 0, os.SEEK_CUR)
    os.lseek(descriptor, _LOCK_OFFSET, os.SEEK_SET)
    try:
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EDEADLK):
            raise BlockingIOError(error.errno, error.strerror) from None
        raise
    finally:
        os.lseek(descriptor, place, os.SEEK_SET)


def wait_for_data(descriptor: int) -> None:
    """Lets reading from a file that was opened with `AT_ONCE` wait for data."""
    if AT_ONCE:
        os.set_blocking(descriptor, True)


def keep_access(descriptor: int, found: os.stat_result) -> None:
    """Gives a file the owner, where that is allowed, and the mode of the one whose place it takes.

    On Windows a new file has the rights of its folder, and there is nothing to do.
    """
    if not hasattr(os, "fchown"):
        return
    if (found.st_uid, found.st_gid) != (os.geteuid(), os.getegid()):
        with contextlib.suppress(OSError):
            os.fchown(descriptor, found.st_uid, found.st_gid)
    os.fchmod(descriptor, stat.S_IMODE(found.st_mode))


def alarm(main_thread: int) -> None:
    """Sends `ALARM` to the main thread, from another one; `main_thread` is its identity."""
    if hasattr(signal, "pthread_kill"):
        # This also ends a system call in which it waits.
        signal.pthread_kill(main_thread, ALARM)
    else:
        _thread.interrupt_main(ALARM)


def core_count() -> int:
    """How many cores this process may use; where that is not known, how many there are."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
