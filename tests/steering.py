"""Scenes for tests, made without the environment language."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ntagen.scene import Limits, Needle, Pose, Region, Scene

ENTRY = Pose(position_mm=(0.0, 0.0, 0.0), heading=(0.0, -1.0, 0.0), bevel=(0.0, 0.0, 1.0))


def sphere(name: str, kind: str, center_mm: tuple[float, float, float], radius_mm: float) -> Region:
    return Region.ball(name, kind, center_mm, radius_mm)  # type: ignore[arg-type]


TARGET = sphere("T1", "target", (0.0, -50.0, 0.0), 10.0)
CRITICAL = sphere("C1", "critical", (0.0, -25.0, 0.0), 2.0)
DETECTION = Region.ball("D1", "detection", (0.0, -25.0, 0.0), 5.0, around="C1")


def scene(*regions: Region, targets: Sequence[Region] = (TARGET,), name: str = "test") -> Scene:
    """The paper's needle, limits and resolution with these critical and detection regions."""
    return Scene(
        name=name,
        needle=Needle(tip=ENTRY, radius_mm=30.0, speed_mm_per_s=1.0),
        axis=(0.0, -1.0, 0.0),
        limits=Limits(
            step_s=2.0,
            roll_angles_rad=tuple(math.radians(a) for a in (90, 180, 270)),
            max_rolls=2,
            min_roll_distance_mm=2.0,
        ),
        targets=tuple(targets),
        resolution_per_mm=1000,
    ).with_regions(*regions)


PAPER = scene(CRITICAL, DETECTION, name="paper")

HIDDEN = replace(
    PAPER, criticals=(*PAPER.criticals, sphere("C2", "critical", (0.0, -28.0, -8.0), 2.0))
)
"""The paper's scene with a region more, on its best plan and not in the way of all others."""
