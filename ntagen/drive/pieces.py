"""A plan in the pieces in which it is made: the pose after each, and when each is due.

A plan says at which phase of the breath each push begins. A roll takes some time, which the plan
does not count: after one, the driver waits until the phase is that of the plan, as certificates
expect. Readings and the ramps of motors take a little time too; a push may begin late by `LATE_S`.
If it is later, the rest of the plan must hold from that time on, or a new plan is made.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Final

from ntagen.drive.spinning import CYCLE_MM
from ntagen.needle.kinematics import push, roll
from ntagen.plan.actions import Action, Push, Roll, Wait
from ntagen.scene import Pose, Scene

_SMALL_MM: Final = 1e-9

LATE_S: Final = 0.05
"""A push may begin this late; ours: regions move by half a millimetre in this time."""


class Moves:
    """A plan in short pieces, each with the pose that is expected after it.

    A pose is computed when its move comes: most plans are replaced before they end.

    Args:
        scene: The scene whose needle makes the plan.
        actions: The plan.
        spacing_mm: No push is longer, but for a cycle of spinning.
    """

    def __init__(
        self, scene: Scene, actions: Iterable[Action] = (), spacing_mm: float = math.inf
    ) -> None:
        moves = tuple(_in_pieces(actions, spacing_mm))
        self._left = deque(moves)
        self._poses = _poses(scene, moves)
        self._next: Pose | None = None

    def __bool__(self) -> bool:
        """Whether a move is left."""
        return bool(self._left)

    @property
    def actions(self) -> Iterable[Action]:
        """The moves that are left."""
        return self._left

    def first(self) -> tuple[Action, Pose]:
        """The next move and the pose after it.

        Raises:
            IndexError: None is left.
        """
        action = self._left[0]
        if self._next is None:
            self._next = next(self._poses)
        return action, self._next

    def drop_first(self) -> None:
        """Goes on to the move after it."""
        self.first()
        self._left.popleft()
        self._next = None


def _poses(scene: Scene, moves: tuple[Action, ...]) -> Iterator[Pose]:
    """The pose after each move."""
    # The circle of the pushes since the last roll or change of the spin, and how far on it the tip
    # is.
    start, radius_mm, done_mm, rolled_rad = scene.needle.tip, scene.needle.radius_mm, 0.0, 0.0
    end, tip, spin = start, start, 0.0
    for move in moves:
        if isinstance(move, Roll):
            rolled_rad += move.angle_rad
            tip = roll(end, rolled_rad)
        elif isinstance(move, Push):
            if rolled_rad != 0.0 or move.spin != spin:
                start, done_mm, rolled_rad, spin = tip, 0.0, 0.0, move.spin
            done_mm += move.length_mm
            end = tip = push(start, move.radius_mm(radius_mm), done_mm)
        yield tip


def _in_pieces(actions: Iterable[Action], spacing_mm: float) -> Iterator[Action]:
    for action in actions:
        if isinstance(action, Push):
            # A cycle of spinning is not divided: each one is a whole turn of the needle.
            longest_mm = max(spacing_mm, CYCLE_MM) if action.spin else spacing_mm
            for piece_mm in pieces(action.length_mm, longest_mm):
                yield Push(piece_mm, action.spin)
        else:
            yield action


def pieces(length_mm: float, spacing_mm: float) -> list[float]:
    """A length in equal pieces, none longer than the spacing."""
    if length_mm <= _SMALL_MM:
        return []
    count = math.ceil(length_mm / spacing_mm - _SMALL_MM)
    return [length_mm / count] * count


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
