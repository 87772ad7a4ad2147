"""Whether a run keeps step with the breath: when each move of a plan is due.

A plan says at which phase of the breath each push begins. A roll takes some time, which the plan
does not count: after one, the driver waits until the phase is that of the plan, as certificates
expect. Readings and the ramps of motors take a little time too; a push may begin late by `LATE_S`.
If it is later, the rest of the plan must hold from that time on, or a new plan is made.
"""

from __future__ import annotations

from typing import Final

from ntagen.plan.actions import Action, Push, Roll, Wait
from ntagen.scene import Scene

LATE_S: Final = 0.05
"""A push may begin this late; ours: regions move by half a millimetre in this time."""


class Pace:
    """When the moves of a plan are due.

    Args:
        scene: The scene of the plan: its breath, and the speed of pushes.

    Attributes:
        late_s: How late the last move began.
    """

    def __init__(self, scene: Scene) -> None:
        self._breath = scene.breath
        self._speed_mm_per_s = scene.needle.speed_mm_per_s
        self._due_s = 0.0 if scene.breath is None else scene.breath.clock_s
        self._may_wait = True
        self.late_s = 0.0

    def wait_s(self, action: Action, clock_s: float) -> float | None:
        """How long to wait before a move; None if it is too late for it.

        Args:
            action: The move.
            clock_s: The time of the breath now.
        """
        breath = self._breath
        if breath is None or isinstance(action, Roll):
            return 0.0
        ahead_s = breath.until_s(clock_s, self._due_s)
        self.late_s = breath.until_s(self._due_s, clock_s)
        if self.late_s <= LATE_S:
            return 0.0
        self.late_s = 0.0
        return ahead_s if self._may_wait else None

    def begin(self, action: Action) -> None:
        """Notes that a move begins."""
        if isinstance(action, Push):
            self._due_s += action.length_mm / self._speed_mm_per_s
        elif isinstance(action, Wait):
            self._due_s += action.seconds
        # After a roll, and at the start of a plan, the needle rests for as long as it takes.
        self._may_wait = isinstance(action, Roll)
