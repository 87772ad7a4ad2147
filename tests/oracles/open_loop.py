"""Plans that are done open loop on the virtual needle, in a tissue with chance.

An independent route to what the model of a plan estimates: the kinematics are those of the virtual
needle, distances those of the shapes, and random numbers those of numpy. The engine has no part in
it. The tip's offset at the ends of pushes is drawn here, as the virtual needle has none.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ntagen.needle.answering import drawn
from ntagen.needle.kinematics import pushed_to
from ntagen.needle.virtual import Errors, SimulatedClock, VirtualNeedle
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.scene import Scene, Vector

SPACING_MM = 0.2
"""Places on the way of the tip are at most so far apart."""


@dataclass(frozen=True)
class Result:
    """What a run was like.

    Attributes:
        miss_mm: By how much the tip missed the worst of its targets; not greater than 0: none.
        clearance_mm: The least distance of its way to critical and unexplored regions.
    """

    miss_mm: float
    clearance_mm: float

    @property
    def has_reached(self) -> bool:
        """Whether the targets were reached, and nothing was touched."""
        return self.miss_mm <= 0.0 and self.clearance_mm > 0.0


def runs(plan: Plan, scene: Scene, count: int, seed: int) -> list[Result]:
    """The results of `count` runs."""
    return [_run(plan, scene, 1_000_003 * seed + number) for number in range(count)]


def _run(plan: Plan, scene: Scene, seed: int) -> Result:
    needle = VirtualNeedle(
        scene.needle,
        (),
        Errors(),
        seed,
        SimulatedClock(),
        answers=drawn(scene.tissue, seed),
        free_bevel=scene.limits.free_bevel,
    )
    offsets = np.random.default_rng([seed, 9])
    step_mm = scene.needle.speed_mm_per_s * scene.limits.step_s
    offset: Vector = (0.0, 0.0, 0.0)
    unsafe = scene.criticals + scene.unexplored
    way = [scene.needle.tip.position_mm]
    for action in plan.actions:
        if isinstance(action, Roll):
            needle.roll(action.angle_rad)
        elif isinstance(action, Push):
            for _ in range(round(action.length_mm / step_mm)):
                x, y, z = offsets.normal(0.0, scene.tissue.tip_mm, 3)
                way += _places(needle, step_mm, offset, (x, y, z))
                offset = (float(x), float(y), float(z))
    clearance_mm = min(
        (region.distance_mm(place) for region in unsafe for place in way), default=math.inf
    )
    *before, last = scene.targets
    misses = [min(target.distance_mm(place) for place in way) for target in before]
    return Result(max([*misses, last.distance_mm(way[-1])]), clearance_mm)


def _places(
    needle: VirtualNeedle, length_mm: float, start: Vector, end: Vector
) -> Iterator[Vector]:
    """The places of the tip during a push; its offset goes straight from one to the other."""
    needle.push(length_mm)
    arc = needle.pierced[-1]
    count = math.ceil(length_mm / SPACING_MM)
    for number in range(1, count + 1):
        part = number / count
        behind_mm = arc.length_mm - (1.0 - part) * length_mm
        on_arc = pushed_to(arc.start, arc.radius_mm, behind_mm)
        yield _sum(on_arc, [(1.0 - part) * a + part * b for a, b in zip(start, end, strict=True)])


def _sum(place: Vector, offset: Sequence[float]) -> Vector:
    x, y, z = (a + b for a, b in zip(place, offset, strict=True))
    return (x, y, z)
