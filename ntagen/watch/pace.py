"""The pace of a simulation that is watched: a simulated needle needs no time, so it waits."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from ntagen.drive.records import Record
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene

_LOOK_S: Final = 0.05
"""So often it looks whether the run must end."""


class Pace:
    """A journal that takes each event only when its time has come."""

    def __init__(self, must_end: Callable[[], bool]) -> None:
        """Begins before the first event, for which nothing is waited.

        Args:
            must_end: Whether the run must end; nothing is waited for then.
        """
        self._must_end = must_end
        self._start_s: float | None = None

    def record(self, record: Record) -> None:
        """Waits for the time of the event."""
        if self._start_s is None:
            self._start_s = time.monotonic() - record.time_s
        at_s = self._start_s + record.time_s
        while not self._must_end() and (left_s := at_s - time.monotonic()) > 0.0:
            time.sleep(min(left_s, _LOOK_S))

    def started(self, scene: Scene) -> None:
        """Does nothing."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Does nothing."""
