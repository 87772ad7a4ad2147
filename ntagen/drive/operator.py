"""Whoever may end a run from outside: a person at the terminal, or the system.

A signal comes at any moment, also between the two halves of a record. It is only taken down here;
the controller listens where it can end in order (`ntagen.drive.controller`).
"""

from __future__ import annotations


class Operator:
    """Is told that the run is to end, and says so when it is listened to."""

    def __init__(self) -> None:
        self._reason: str | None = None

    @property
    def wants_end(self) -> bool:
        """Whether the run is to end."""
        return self._reason is not None

    def end(self, reason: str) -> None:
        """Wants the run to end; the first reason counts."""
        if self._reason is None:
            self._reason = reason

    def listen(self) -> None:
        """Does nothing, unless the run is to end.

        Raises:
            KeyboardInterrupt: It is, for this reason.
        """
        if self._reason is not None:
            raise KeyboardInterrupt(self._reason)
