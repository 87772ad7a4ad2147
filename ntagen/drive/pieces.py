"""A plan in the pieces in which it is made, each with the pose that is expected after it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from ntagen.needle.kinematics import push, roll
from ntagen.plan.actions import Action, Push, Roll, Wait
from ntagen.scene import Pose, Scene

_SMALL_MM: Final = 1e-9


def moves_of(
    scene: Scene, actions: tuple[Action, ...], spacing_mm: float
) -> Iterator[tuple[Action, Pose]]:
    """A plan in short pieces, each with the pose that is expected after it."""
    # The circle of the pushes since the last roll, and how far on it the tip is.
    start, radius_mm, done_mm, rolled_rad = scene.needle.tip, scene.needle.radius_mm, 0.0, 0.0
    end = tip = start
    for action in actions:
        if isinstance(action, Roll):
            rolled_rad += action.angle_rad
            tip = roll(end, rolled_rad)
            yield action, tip
        elif isinstance(action, Wait):
            yield action, tip
        else:
            for piece_mm in pieces(action.length_mm, spacing_mm):
                if rolled_rad != 0.0:
                    start, done_mm, rolled_rad = tip, 0.0, 0.0
                done_mm += piece_mm
                end = tip = push(start, radius_mm, done_mm)
                yield Push(piece_mm), tip


def pieces(length_mm: float, spacing_mm: float) -> list[float]:
    """A length in equal pieces, none longer than the spacing."""
    if length_mm <= _SMALL_MM:
        return []
    count = math.ceil(length_mm / spacing_mm - _SMALL_MM)
    return [length_mm / count] * count
