"""Takes away what Windows lacks, then is ntagen: `python -m tests.without_posix check …`."""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import multiprocessing.util  # noqa: F401
import os
import signal
import subprocess  # noqa: F401
import sys
import types
from collections.abc import Sequence
from typing import Any

# On Windows this and two of the modules above import other things, which are not here.
import serial  # noqa: F401

MODULES = {"fcntl", "grp", "pty", "pwd", "resource", "termios", "tty"}
OF_OS = {"fchmod", "fchown", "getegid", "geteuid", "openpty", "sched_getaffinity", "set_blocking"}
OF_OS |= {"sysconf", "ttyname", "O_CLOEXEC", "O_NOCTTY", "O_NONBLOCK"}
OF_SIGNAL = {"SIGHUP", "SIGKILL", "SIGPIPE"}


class _Hidden(importlib.abc.MetaPathFinder):
    """Finds none of the modules; those of the standard library that need one get it before."""

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: types.ModuleType | None = None,
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname in MODULES:
            raise ModuleNotFoundError(f"No module named '{fullname}'", name=fullname)
        return None


def fake_msvcrt() -> types.ModuleType:
    """The module of Windows that locks bytes; here through this system's own locks."""
    import fcntl

    module: Any = types.ModuleType("msvcrt")
    module.LK_NBLCK = 2
    exclusively, lockf = fcntl.LOCK_EX | fcntl.LOCK_NB, fcntl.lockf

    def locking(descriptor: int, mode: int, count: int) -> None:
        assert mode == module.LK_NBLCK
        lockf(descriptor, exclusively, count, os.lseek(descriptor, 0, os.SEEK_CUR))

    module.locking = locking
    return module


def hide() -> None:
    """Takes away modules and functions; `msvcrt` is there."""
    msvcrt = fake_msvcrt()
    for name in MODULES:
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, _Hidden())
    for owner, names in ((os, OF_OS), (signal, OF_SIGNAL)):
        for name in names:
            delattr(owner, name)
    sys.modules["msvcrt"] = msvcrt


if __name__ == "__main__":
    hide()
    from ntagen.cli import main

    sys.exit(main())
