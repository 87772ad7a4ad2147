"""A plan in the pieces in which it is made, each with the pose that is expected after it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from ntagen.needle.path import Path
from ntagen.plan.actions import Action, Push, Roll, Wait
from ntagen.scene import Pose, Scene

_SMALL_MM: Final = 1e-9


def moves_of(
    scene: Scene, actions: tuple[Action, ...], spacing_mm: float
) -> Iterator[tuple[Action, Pose]]:
    """A plan in short pieces, each with the pose that is expected after it."""
    path = Path(scene.needle.tip)
    for action in actions:
        if isinstance(action, Roll):
            path = path.roll(action.angle_rad)
            yield action, path.tip
            continue
        if isinstance(action, Wait):
            yield action, path.tip
            continue
        for piece_mm in pieces(action.length_mm, spacing_mm):
            path = path.push(scene.needle.radius_mm, piece_mm)
            yield Push(piece_mm), path.tip


def pieces(length_mm: float, spacing_mm: float) -> list[float]:
    """A length in equal pieces, none longer than the spacing."""
    if length_mm <= _SMALL_MM:
        return []
    count = math.ceil(length_mm / spacing_mm - _SMALL_MM)
    return [length_mm / count] * count
