"""Scenes that tests start from, and strategies that draw others."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from hypothesis import assume
from hypothesis import strategies as st

from ntagen.scene import Limits, Needle, Pose, Region, Scene, Vector

PAPER = Scene(
    name="paper",
    needle=Needle(Pose((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)), 30.0, 1.0),
    axis=(0.0, -1.0, 0.0),
    limits=Limits(2.0, tuple(math.radians(angle) for angle in (90, 180, 270)), 2, 2.0),
    targets=(Region.ball("T1", "target", (0.0, -50.0, 0.0), 10.0),),
    criticals=(Region.ball("C1", "critical", (0.0, -25.0, 0.0), 2.0),),
    detections=(Region.ball("D1", "detection", (0.0, -25.0, 0.0), 5.0, "C1"),),
    resolution_per_mm=1000,
)
"""The instance that the paper publishes as numbers."""


def paper(**changes: Any) -> Scene:  # noqa: ANN401  any field of a scene
    """The paper's scene with some fields replaced."""
    return replace(PAPER, **changes)


def with_limits(scene: Scene, **changes: Any) -> Scene:  # noqa: ANN401
    """A scene with some limits replaced."""
    return replace(scene, limits=replace(scene.limits, **changes))


def lengths(low_mm: float, high_mm: float) -> st.SearchStrategy[float]:
    """Lengths in mm, some with more digits than the model keeps."""
    return st.floats(low_mm, high_mm, allow_nan=False) | st.integers(
        math.ceil(low_mm), math.floor(high_mm)
    ).map(float)


@st.composite
def poses(draw: st.DrawFn) -> Pose:
    """Poses whose heading leans at most 60 degrees away from -y, with any bevel."""
    lean, turn, roll = (draw(st.floats(0.0, high)) for high in (math.pi / 3, math.tau, math.tau))
    side: Vector = (math.cos(turn), 0.0, math.sin(turn))
    heading: Vector = (
        math.sin(lean) * side[0],
        -math.cos(lean),
        math.sin(lean) * side[2],
    )
    # Two unit vectors at right angles to the heading: one in the plane of the lean, one across it.
    first: Vector = (
        math.cos(lean) * side[0],
        math.sin(lean),
        math.cos(lean) * side[2],
    )
    second: Vector = (-side[2], 0.0, side[0])
    x, y, z = (math.cos(roll) * a + math.sin(roll) * b for a, b in zip(first, second, strict=True))
    position = draw(st.tuples(*(lengths(-20.0, 20.0) for _ in range(3))))
    return Pose(position, heading, (x, y, z))


@st.composite
def spheres(draw: st.DrawFn, kind: str, name: str) -> Region:
    """Regions ahead of the needle."""
    center = draw(st.tuples(lengths(-30.0, 30.0), lengths(-90.0, -5.0), lengths(-30.0, 30.0)))
    radius = draw(lengths(1.0, 12.0))
    return Region.ball(name, kind, center, radius)  # type: ignore[arg-type]


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    """Scenes along -y in steps of whole seconds, with 1 or 2 targets and up to 3 other regions."""
    angles = draw(st.lists(st.integers(1, 359), min_size=1, max_size=4, unique=True))
    limits = Limits(
        step_s=float(draw(st.integers(1, 4))),
        roll_angles_rad=tuple(math.radians(angle) for angle in angles),
        max_rolls=draw(st.integers(0, 4)),
        min_roll_distance_mm=draw(lengths(0.0, 8.0)),
    )
    needle = Needle(draw(poses()), draw(lengths(15.0, 120.0)), draw(lengths(0.5, 3.0)))
    resolution_per_mm = draw(st.sampled_from((100, 1000, 2500, 10_000)))
    # A push must turn the tip by two units at least: with one, rounding may leave none.
    angle_rad = limits.step_s * needle.speed_mm_per_s / needle.radius_mm
    assume(angle_rad * resolution_per_mm >= 2.0)
    return Scene(
        name="drawn",
        needle=needle,
        axis=(0.0, -1.0, 0.0),
        limits=limits,
        targets=tuple(draw(spheres("target", f"T{i}")) for i in range(draw(st.integers(1, 2)))),
        criticals=tuple(draw(spheres("critical", f"C{i}")) for i in range(draw(st.integers(0, 2)))),
        unexplored=tuple(
            draw(spheres("unexplored", f"U{i}")) for i in range(draw(st.integers(0, 1)))
        ),
        safe=tuple(draw(spheres("safe", f"S{i}")) for i in range(draw(st.integers(0, 1)))),
        detections=tuple(
            draw(spheres("detection", f"D{i}")) for i in range(draw(st.integers(0, 1)))
        ),
        resolution_per_mm=resolution_per_mm,
    )


def choices() -> st.SearchStrategy[list[int]]:
    """Decisions of a path: each number picks one of the moves that are allowed at its turn."""
    return st.lists(st.integers(0, 11), max_size=40)
