"""A plan in the pieces in which it is made, each with the pose that is expected after it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Final

from ntagen.needle.kinematics import push, roll
from ntagen.plan.actions import Action, Push, Roll
from ntagen.scene import Pose, Scene

_SMALL_MM: Final = 1e-9


class Moves:
    """A plan in short pieces, each with the pose that is expected after it.

    A pose is computed when its move comes: most plans are replaced before they end.

    Args:
        scene: The scene whose needle makes the plan.
        actions: The plan.
        spacing_mm: No push is longer.
    """

    def __init__(
        self, scene: Scene, actions: Iterable[Action] = (), spacing_mm: float = math.inf
    ) -> None:
        self._left = deque(_in_pieces(actions, spacing_mm))
        self._tip = self._start = scene.needle.tip
        self._radius_mm = scene.needle.radius_mm
        # How far the tip is on the circle of the pushes since the last roll, and the rolls since.
        self._done_mm = self._rolled_rad = 0.0
        self._end = self._start
        self._next: tuple[Action, Pose] | None = None

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
        if self._next is None:
            action = self._left[0]
            self._next = action, self._after(action)
        return self._next

    def drop_first(self) -> None:
        """Goes on to the move after it."""
        self.first()
        self._left.popleft()
        self._next = None

    def _after(self, action: Action) -> Pose:
        if isinstance(action, Roll):
            self._rolled_rad += action.angle_rad
            self._tip = roll(self._end, self._rolled_rad)
        elif isinstance(action, Push):
            if self._rolled_rad != 0.0:
                self._start, self._done_mm, self._rolled_rad = self._tip, 0.0, 0.0
            self._done_mm += action.length_mm
            self._end = self._tip = push(self._start, self._radius_mm, self._done_mm)
        return self._tip


def _in_pieces(actions: Iterable[Action], spacing_mm: float) -> Iterator[Action]:
    for action in actions:
        if isinstance(action, Push):
            yield from map(Push, pieces(action.length_mm, spacing_mm))
        else:
            yield action


def pieces(length_mm: float, spacing_mm: float) -> list[float]:
    """A length in equal pieces, none longer than the spacing."""
    if length_mm <= _SMALL_MM:
        return []
    count = math.ceil(length_mm / spacing_mm - _SMALL_MM)
    return [length_mm / count] * count
