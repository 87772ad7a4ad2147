"""The orientation of a start on a grid, as the model gives it (Rogalla et al., 2020).

The earlier work that the paper compares with lets the model choose the needle's first orientation,
from finitely many. Here they are: the pose of a circle fit of the first part, tilted about its two
transverse axes and then rolled, each by a multiple of `GRID_DEG`. The best one is found by steps on
the grid, from the place that is nearest to the best orientation of all.
"""

from __future__ import annotations

import itertools
import math
from typing import Final

import numpy as np

from ntagen.traces.chain import Array, Rolls, feet_of
from ntagen.traces.refine import Fitted

GRID_DEG: Final = 1.0
"""The step of the grid: that of angles in the model, which are whole degrees."""

Place = tuple[int, int, int]


def oriented_on_grid(
    points_mm: Array, rolls: Rolls, length_mm: float, free: Fitted, base: Array
) -> Array:
    """The frame on the grid that explains the points best.

    Args:
        points_mm: The measured points.
        rolls: The rolls of the chain.
        length_mm: Its length.
        free: The chain with the best orientation of all.
        base: The frame at which the grid begins.
    """
    known: dict[Place, float] = {}

    def squares(place: Place) -> float:
        if place not in known:
            local = (points_mm - free.position_mm) @ frame_at(base, place)
            feet = feet_of(local, free.curvature_per_mm, rolls, length_mm)
            known[place] = float(np.sum((local - feet.points_mm) ** 2))
        return known[place]

    place = _nearest(base, free.frame)
    while True:
        around = [
            (place[0] + a, place[1] + b, place[2] + c)
            for a, b, c in itertools.product((-1, 0, 1), repeat=3)
        ]
        best = min(around, key=squares)
        if squares(best) >= squares(place):
            return frame_at(base, place)
        place = best


def frame_at(base: Array, place: Place) -> Array:
    """The frame at a place of the grid: tilted about y, then about z, then rolled about x."""
    tilt_y, tilt_z, roll = (math.radians(GRID_DEG * number) for number in place)
    return np.asarray(base @ _about(1, tilt_y) @ _about(2, tilt_z) @ _about(0, roll))


def _nearest(base: Array, frame: Array) -> Place:
    """The place of the grid that is nearest to a frame."""
    # R = Ry(a) Rz(b) Rx(c): its first column is (cos a cos b, sin b, -sin a cos b), and its second
    # row is (sin b, cos b cos c, -cos b sin c).
    turned = base.T @ frame
    tilt_y = math.atan2(-turned[2, 0], turned[0, 0])
    tilt_z = math.asin(max(-1.0, min(1.0, float(turned[1, 0]))))
    roll = math.atan2(-turned[1, 2], turned[1, 1])
    y, z, x = (round(math.degrees(angle) / GRID_DEG) for angle in (tilt_y, tilt_z, roll))
    return (y, z, x)


def _about(axis: int, angle_rad: float) -> Array:
    """The rotation about a coordinate axis."""
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    rotation = np.eye(3)
    one, other = (axis + 1) % 3, (axis + 2) % 3
    rotation[one, one] = rotation[other, other] = cosine
    rotation[one, other], rotation[other, one] = -sine, sine
    return rotation
