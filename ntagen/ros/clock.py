"""The clock of a node: that of the machine, or with ``use_sim_time`` that of the topic ``/clock``.

A machine's clock never jumps here, since it counts on by itself. The other one may: a bag begins
anew, a simulation is reset or paused. The driver must not go on then.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

_BACK_S: Final = 1e-6
_STILL_S: Final = 2.0
"""A clock that has not gone on for so long, on the machine's clock, stands still."""

_AHEAD_S: Final = 1.0
_FASTEST: Final = 100.0
"""A simulated clock goes at most so many times as fast as that of the machine."""


class Clock:
    """A clock that begins at 0 and never goes back.

    Args:
        simulated_s: The time of ``/clock``; None for the clock of the machine.
        tell: Is told what is wrong with it.
    """

    def __init__(
        self, simulated_s: Callable[[], float] | None, tell: Callable[[str], None]
    ) -> None:
        self._simulated_s = simulated_s
        self._tell = tell
        self._lock = threading.Lock()
        self._shown_s = 0.0
        self._last_s: float | None = None
        self._changed_s = self._began_s = time.monotonic()

    @property
    def is_simulated(self) -> bool:
        """Whether it is that of ``/clock``."""
        return self._simulated_s is not None

    def begin(self) -> None:
        """Begins anew: what the clock did before is forgotten."""
        with self._lock:
            self._last_s = None
            self._shown_s, self._began_s = 0.0, time.monotonic()

    def now_s(self) -> float:
        """The time now."""
        if self._simulated_s is None:
            return time.monotonic() - self._began_s
        trouble = ""
        with self._lock:
            now_s, machine_s = self._simulated_s(), time.monotonic()
            last_s, self._last_s = self._last_s, now_s
            passed_s = machine_s - self._changed_s
            # A time of 0 says that nobody has told it yet.
            if not last_s or now_s != last_s:
                self._changed_s = machine_s
            if last_s:
                trouble = _trouble(now_s - last_s, passed_s)
                # Whoever measures a time by differences must not see the jump.
                self._shown_s += 0.0 if trouble else now_s - last_s
        if trouble:
            self._tell(trouble)
        return self._shown_s


def _trouble(went_s: float, passed_s: float) -> str:
    """What is wrong with a clock that went on by so much in some time of the machine."""
    hint = "hint: arm again when /clock goes on; does a bag begin anew, or was a simulation reset?"
    if went_s < -_BACK_S:
        return f"the ROS time went back by {-went_s:.2f} s\n{hint}"
    if went_s > _AHEAD_S + _FASTEST * passed_s:
        return f"the ROS time went on by {went_s:.1f} s in {passed_s:.2f} s\n{hint}"
    if went_s == 0.0 and passed_s > _STILL_S:
        return f"the ROS time stands still for {passed_s:.1f} s: /clock is silent\n{hint}"
    return ""
