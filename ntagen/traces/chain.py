"""Chains of arcs as arrays: many of them at once, in the frame of their start.

A chain is what the tip draws when it is pushed and rolled (`ntagen.needle.kinematics`), with one
curvature for all arcs. It begins at the origin with the heading along x and the bevel along y. A
frame is a matrix with the columns heading, bevel, heading x bevel; in it a push by ``s`` with the
curvature ``k`` moves the tip by ``(sin(k s) / k, (cos(k s) - 1) / k, 0)``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation  # type: ignore[import-untyped]

Array = NDArray[np.float64]

LEAST_CURVATURE_PER_MM: Final = 1e-7
"""A radius of 10 km: a straighter chain gets this curvature, so that its arcs have a centre."""


@dataclass(frozen=True, slots=True)
class Rolls:
    """The rolls of many chains.

    Attributes:
        depths_mm: The depth of each roll; one chain a row, and in it from the entry on.
        angles_rad: The angle of each roll.
    """

    depths_mm: Array
    angles_rad: Array


def chain_points(curvature_per_mm: float, rolls: Rolls, depths_mm: Array) -> Array:
    """The places of the tip at some depths: an array (chains, depths, 3)."""
    points = np.empty((len(rolls.depths_mm), len(depths_mm), 3))
    for number, (begin_mm, frame, origin) in enumerate(_arcs(curvature_per_mm, rolls)):
        along_mm = depths_mm - begin_mm[:, None]
        x, y = _on_arc(curvature_per_mm, along_mm)
        there = origin[:, None, :] + x[..., None] * frame[:, None, :, 0]
        there += y[..., None] * frame[:, None, :, 1]
        points = there if number == 0 else np.where(along_mm[..., None] >= 0.0, there, points)
    return points


def _arcs(curvature_per_mm: float, rolls: Rolls) -> list[tuple[Array, Array, Array]]:
    """Of each arc of the chains: the depth of its beginning, and the frame and place there."""
    count = len(rolls.depths_mm)
    begin_mm = np.zeros(count)
    frame = np.broadcast_to(np.eye(3), (count, 3, 3))
    origin = np.zeros((count, 3))
    arcs = [(begin_mm, frame, origin)]
    for depth_mm, angle_rad in zip(rolls.depths_mm.T, rolls.angles_rad.T, strict=True):
        length_mm = depth_mm - begin_mm
        x, y = _on_arc(curvature_per_mm, length_mm)
        origin = origin + x[:, None] * frame[:, :, 0] + y[:, None] * frame[:, :, 1]
        # The push turns the heading away from the bevel; then the frame rolls about the heading.
        angles_rad = np.column_stack([-curvature_per_mm * length_mm, angle_rad])
        frame = frame @ Rotation.from_euler("ZX", angles_rad).as_matrix()
        begin_mm = depth_mm
        arcs.append((begin_mm, frame, origin))
    return arcs


def _on_arc(curvature_per_mm: float, along_mm: Array) -> tuple[Array, Array]:
    """The way along heading and bevel of a push; with half the angle it is exact for all."""
    half_rad = 0.5 * curvature_per_mm * along_mm
    chord_mm = along_mm * np.sinc(half_rad / math.pi)
    return chord_mm * np.cos(half_rad), -chord_mm * np.sin(half_rad)


@dataclass(frozen=True, slots=True)
class Feet:
    """The places of a chain that are nearest to given points.

    Attributes:
        points_mm: The places.
        depths_mm: Their depths.
        tangents: The headings there; zero where the nearest place is an end of the chain.
    """

    points_mm: Array
    depths_mm: Array
    tangents: Array


def feet_of(points_mm: Array, curvature_per_mm: float, rolls: Rolls, length_mm: float) -> Feet:
    """The nearest places of one chain, with one row of rolls, to points in its own frame."""
    arcs = _arcs(curvature_per_mm, rolls)
    ends_mm = [*(float(begin[0]) for begin, _, _ in arcs[1:]), length_mm]
    best_mm = np.full(len(points_mm), math.inf)
    places, tangents = np.zeros_like(points_mm), np.zeros_like(points_mm)
    depths_mm = np.zeros(len(points_mm))
    for (begin, frames, origins), end_mm in zip(arcs, ends_mm, strict=True):
        begin_mm, frame, origin = float(begin[0]), frames[0], origins[0]
        local = (points_mm - origin) @ frame
        turn_rad = (end_mm - begin_mm) * curvature_per_mm
        at_rad = np.arctan2(local[:, 0], local[:, 1] + 1.0 / curvature_per_mm)
        # The far side of the circle parts what is nearer to the arc's end from what is nearer to
        # its beginning.
        middle_rad = 0.5 * turn_rad
        at_rad = (at_rad - middle_rad + math.pi) % (2.0 * math.pi) - math.pi + middle_rad
        along_mm = np.clip(at_rad / curvature_per_mm, 0.0, end_mm - begin_mm)
        x, y = _on_arc(curvature_per_mm, along_mm)
        there = origin + np.outer(x, frame[:, 0]) + np.outer(y, frame[:, 1])
        away_mm = np.linalg.norm(points_mm - there, axis=1)
        nearer = away_mm < best_mm
        best_mm = np.where(nearer, away_mm, best_mm)
        depths_mm = np.where(nearer, begin_mm + along_mm, depths_mm)
        places = np.where(nearer[:, None], there, places)
        angle_rad = along_mm * curvature_per_mm
        heading = np.outer(np.cos(angle_rad), frame[:, 0]) - np.outer(
            np.sin(angle_rad), frame[:, 1]
        )
        tangents = np.where(nearer[:, None], heading, tangents)
    is_end = (depths_mm <= 0.0) | (depths_mm >= length_mm)
    return Feet(places, depths_mm, np.where(is_end[:, None], 0.0, tangents))
