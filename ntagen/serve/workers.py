"""A process of `ntagen serve` that answers requests: lines of JSON, in and out."""

from __future__ import annotations

import contextlib
import json
import queue
import subprocess
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from ntagen.serve.processes import Limits, ended, started

_LATE: Final = 1.1
"""A process that answers no sooner than after its time, and this part of it more, is killed."""

_LEAST_S: Final = 3.0
"""It has at least this much time for an answer, in which it also loads the model."""


class Gone(Exception):  # noqa: N818  it reports an event, not an error
    """The process ended without an answer; the text says why."""


class Worker:
    """A process that answers.

    Attributes:
        is_cancelled: Whether the user ended it.
    """

    def __init__(self, arguments: Sequence[str], folder: Path, limits: Limits) -> None:
        """Starts `ntagen` with these arguments in a folder."""
        # One part of the time is for the process to end by itself.
        self._wait_s = max(_LEAST_S, _LATE * limits.timeout_s)
        # Warnings about the model are told by the page of queries.
        pipes = subprocess.PIPE, subprocess.PIPE, subprocess.DEVNULL
        self._process = started(arguments, folder, limits, *pipes)
        self._answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        threading.Thread(target=self._read, daemon=True).start()
        self.is_cancelled = False

    @property
    def is_running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """What it answers.

        Raises:
            Gone: It does not.
        """
        answer: dict[str, Any] = json.loads(self.line(request))
        return answer

    def line(self, request: dict[str, Any]) -> bytes:
        """The same as the line that it has written.

        Raises:
            Gone: It does not answer.
        """
        stdin = self._process.stdin
        if stdin is not None:
            # If it has ended, the answer says so.
            with contextlib.suppress(OSError):
                stdin.write(json.dumps(request).encode() + b"\n")
                stdin.flush()
        try:
            line = self._answers.get(timeout=self._wait_s)
        except queue.Empty:
            self.end()
            raise Gone(f"it did not answer within {self._wait_s:g} s") from None
        if not line:
            self.end()
            if self.is_cancelled:
                raise Gone("it was cancelled")
            code = self._process.returncode
            raise Gone(f"it ended with {code}; it may lack memory")
        return line

    def end(self) -> None:
        """Kills it."""
        ended(self._process)
        with contextlib.suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()

    def _read(self) -> None:
        out = self._process.stdout
        if out is not None:
            with out:
                for line in out:
                    self._answers.put(line)
        # An empty line says that no more come.
        self._answers.put(b"")
