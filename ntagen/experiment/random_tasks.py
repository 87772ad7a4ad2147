"""Random tasks with chance: a needle, a target, and critical regions on the way to it."""

from __future__ import annotations

import random
from typing import Final

_TEXT: Final = """\
environment {name} {{
  needle {{ radius {radius} mm  speed 1 mm/s }}
  motion {{ step 2 s  roll by 90, 180, 270 deg  at most 2 times }}
  target T  sphere ({x}, {y}, {z}) mm  radius {size} mm
{criticals}
  tissue stochastic  curvature {curvature} %  roll {roll} deg  tip {tip} mm
}}
"""


def name_of(seed: int) -> str:
    """The name of the random task with a seed."""
    return f"random_{seed}"


def random_task(seed: int) -> str:
    """The text of a random task; the same seed gives the same one.

    A target 40 to 70 mm deep, and up to 8 mm beside the axis; one to three critical regions about
    half the way to it, each so near the straight way that the needle must mind it; and a tissue
    that is kind or unkind.
    """
    draw = random.Random(f"task with chance {seed}")

    def number(low: float, high: float) -> float:
        return round(draw.uniform(low, high), 1)

    depth_mm = number(40.0, 70.0)
    criticals = []
    for place in range(1, draw.randint(1, 3) + 1):
        y = -round(depth_mm * draw.uniform(0.35, 0.75), 1)
        x, z = number(-9.0, 9.0), number(-9.0, 9.0)
        if draw.random() < 0.5:
            shape = f"sphere ({x}, {y}, {z}) mm  radius {number(2.0, 5.0)} mm"
        else:
            shape = f"capsule (-20, {y}, {z}) mm to (20, {y}, {z}) mm  radius {number(1.5, 3.5)} mm"
        criticals.append(f"  critical C{place}  {shape}")
    return _TEXT.format(
        name=name_of(seed),
        radius=draw.randint(35, 80),
        x=number(-8.0, 8.0),
        y=-depth_mm,
        z=number(-8.0, 8.0),
        size=number(3.0, 5.0),
        criticals="\n".join(criticals),
        curvature=number(2.0, 8.0),
        roll=number(2.0, 10.0),
        tip=number(0.1, 0.4),
    )
