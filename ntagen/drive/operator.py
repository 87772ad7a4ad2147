"""The operator, who can end a run from outside: a person at the terminal, or the system.

A signal comes at any moment, also between the two halves of a record. It is only noted here; the
controller looks at points where it can end in an orderly way (`ntagen.drive.controller`).
"""

from __future__ import annotations


class Operator:
    """Notes that the run must end; `listen` then raises the interruption."""

    def __init__(self) -> None:
        self._reason: str | None = None

    @property
    def wants_end(self) -> bool:
        """Whether the run must end."""
        return self._reason is not None

    def end(self, reason: str) -> None:
        """Notes that the run must end; the first reason counts."""
        if self._reason is None:
            self._reason = reason

    def listen(self) -> None:
        """Does nothing, unless the run must end.

        Raises:
            KeyboardInterrupt: The run must end, for this reason.
        """
        if self._reason is not None:
            raise KeyboardInterrupt(self._reason)
