"""The processes of `ntagen serve`: what they may take, how they begin, and how they are ended."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any, Final

from ntagen.values import dataclass

_MEMORY_BESIDE: Final = 4 << 30
"""A worker may have so much address space beside the memory of its search."""

_FILE_BYTES: Final = 256 << 20


@dataclass(frozen=True, slots=True)
class Limits:
    """What one server allows.

    Attributes:
        timeout_s: A worker ends after this time; one that does not is killed a little later.
        memory_bytes: A worker ends when it takes this much.
        upload_bytes: The greatest size of a file.
        jobs: At most so many workers at a time.
        files: At most so many files are kept; the oldest goes first.
        simulations: At most so many simulations have a process, and so many models that are edited;
            that of the one that was not used for the longest time ends first.
    """

    timeout_s: float = 60.0
    memory_bytes: int = 1 << 30
    upload_bytes: int = 32 << 20
    jobs: int = 2
    files: int = 20
    simulations: int = 50


def started(
    arguments: Sequence[str],
    folder: Path,
    limits: Limits,
    stdin: int,
    stdout: int | IO[Any],
    stderr: int | IO[Any],
) -> subprocess.Popen[bytes]:
    """Starts `ntagen` with these arguments in a folder, as a process of its own."""
    process = subprocess.Popen(
        # -P: a file in this folder is no module of Python.
        [sys.executable, "-P", "-m", "ntagen", *arguments],
        stdin=stdin,
        stdout=stdout,
        stderr=stderr,
        cwd=folder,
        env={**os.environ, "NO_COLOR": "1", "PYTHONPATH": _import_path()},
        start_new_session=True,
    )
    _restrict(process.pid, limits)
    return process


def ended(process: subprocess.Popen[bytes]) -> None:
    """Kills a process with all that it has started."""
    with contextlib.suppress(OSError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
    process.wait()


def _import_path() -> str:
    """Where a worker finds this package, also if it is not installed but used in place."""
    here = str(Path(__file__).parents[2])
    return os.pathsep.join(dict.fromkeys([here, *filter(None, [os.environ.get("PYTHONPATH")])]))


def _restrict(process: int, limits: Limits) -> None:
    """Limits what a worker may take, where the system can."""
    if sys.platform != "linux":
        return
    import resource

    most = limits.memory_bytes + _MEMORY_BESIDE
    with contextlib.suppress(OSError):
        resource.prlimit(process, resource.RLIMIT_AS, (most, most))
        resource.prlimit(process, resource.RLIMIT_FSIZE, (_FILE_BYTES, _FILE_BYTES))
