"""A plan in the pieces in which it is made, each with the pose that is expected after it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Final

from ntagen.drive.spinning import CYCLE_MM
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
