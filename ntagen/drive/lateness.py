"""Where the tip was when a position was measured that is reported now.

A tracker is late: its values hold for `Measurement.time_s`, and the needle may have moved since.
The motions that were commanded tell how far it was then. Only times are used that the log has, so
that a replay finds the same.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

_KEPT: Final = 16
"""So many motions are kept: those of some seconds, and no tracker is believed that is so late."""


@dataclass(frozen=True, slots=True)
class _Motion:
    began_s: float
    from_mm: float
    to_mm: float
    speed_mm_per_s: float


class Lateness:
    """The last motions along the channel."""

    def __init__(self) -> None:
        self._motions: deque[_Motion] = deque(maxlen=_KEPT)

    def note(self, began_s: float, from_mm: float, to_mm: float, speed_mm_per_s: float) -> None:
        """Notes a push or a pull from one depth to another, when it is over."""
        self._motions.append(_Motion(began_s, from_mm, to_mm, speed_mm_per_s))

    def depth_mm(self, time_s: float) -> float | None:
        """The depth of the tip at a time; None before the motions that are known."""
        for motion in reversed(self._motions):
            if time_s >= motion.began_s:
                went_mm = motion.speed_mm_per_s * (time_s - motion.began_s)
                if motion.to_mm > motion.from_mm:
                    return min(motion.to_mm, motion.from_mm + went_mm)
                return max(motion.to_mm, motion.from_mm - went_mm)
        return self._motions[0].from_mm if self._motions else None
