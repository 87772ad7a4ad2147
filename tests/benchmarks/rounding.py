"""Whether rounding decides: verdicts of random tasks at several resolutions, and on exact circles.

    python tests/benchmarks/rounding.py [--count 100] [--first 0] [--radii 100,200] [--slack 0.1]

Each task has a target 40 to 100 mm deep and up to seven regions. Its verdict at the resolution that
is chosen is compared with those at 1,000 and 1,000,000 units per mm, and with all plans on exact
circles (`tests.oracles.exact_plans`): where plans keep the slack from everything, the verdict must
be yes; where none does even if it may err by the slack, no. Printed are the verdicts that differ,
the bound of the error, and what a synthesis takes, as a ratio.
"""

from __future__ import annotations

import argparse
import math
import random
import statistics
from collections import Counter
from dataclasses import replace

from ntagen import checker, nsl
from ntagen.render import render
from ntagen.rounding import chosen
from ntagen.scene import Scene
from tests.oracles.exact_plans import Ball, Block, Rod, Solid, Steering, has_plan

QUERY = "control: A<> Checker.Final_TR_Reached"
COARSE, FINE = 1000, 1_000_000


def drawn_task(number: int, radii: tuple[float, float]) -> Steering:
    """A random task."""
    numbers = random.Random(f"rounding {number}")
    depth = numbers.uniform(40.0, 100.0)
    target = Ball(
        (round(numbers.uniform(-10, 10), 2), -round(depth, 2), round(numbers.uniform(-10, 10), 2)),
        numbers.choice((3.0, 4.0, 5.0, 8.0)),
    )
    solids: list[Solid] = []
    for _ in range(numbers.randint(1, 7)):
        x, z = (round(numbers.uniform(-12, 12), 2) for _ in range(2))
        y = -round(numbers.uniform(12.0, depth - 12.0), 2)
        size = [round(numbers.uniform(2.0, 6.0), 2) for _ in range(3)]
        reach = [round(numbers.uniform(-10.0, 10.0), 2) for _ in range(3)]
        solid = numbers.choice(
            (
                Ball((x, y, z), numbers.choice((2.0, 3.0, 5.0))),
                Rod((x, y, z), (x + reach[0], y + 0.5 * reach[1], z + reach[2]), 2.0),
                Block((x, y, z), (size[0], size[1], size[2])),
            )
        )
        if solid.away(_array(target.center)) > target.radius + 1 and solid.away(_array()) > 2:
            solids.append(solid)
    return Steering(
        radius=round(numbers.uniform(*radii), numbers.choice((0, 1, 3))),
        push=2.0,
        length=120.0,
        angles=numbers.choice(((90, 180, 270), (60, 120, 180, 240, 300))),
        most_rolls=numbers.choice((1, 2, 2)),
        between=2,
        target=target,
        avoided=tuple(solids),
    )


def _array(point: tuple[float, float, float] = (0.0, 0.0, 0.0)):  # noqa: ANN202
    import numpy as np

    return np.array(point)


def text_of(task: Steering) -> str:
    """The task as an environment."""
    lines = [
        "environment drawn {",
        f"  needle {{ radius {task.radius} mm  speed 1 mm/s  length {task.length} mm }}",
        f"  motion {{ step {task.push} s  roll by {', '.join(map(str, task.angles))} deg  "
        f"at most {task.most_rolls} times  at least {task.between * task.push} mm apart  "
        + (f"spin {', '.join(map(str, task.spins))} }}" if task.spins else "}"),
        f"  target T sphere {task.target.center} mm  radius {task.target.radius} mm",
    ]
    for number, solid in enumerate(task.avoided):
        match solid:
            case Ball():
                shape = f"sphere {solid.center} mm  radius {solid.radius} mm"
            case Rod():
                shape = f"capsule {solid.start} mm to {solid.end} mm  radius {solid.radius} mm"
            case Block():
                shape = f"box {solid.center} mm  size {solid.size} mm"
        lines.append(f"  critical C{number} {shape}")
    return "\n".join([*lines, "  safety swept", "}", ""])


def verdict(scene: Scene, per_mm: int) -> tuple[bool, float]:
    """Whether there is a strategy, and the seconds that the engine took."""
    model = checker.load(render(replace(scene, resolution_per_mm=per_mm), only_plans=True))
    answer = model.check(QUERY)
    if answer.satisfied is None:
        raise SystemExit(f"no verdict: {answer}")
    return answer.satisfied, answer.seconds


def main() -> None:
    """Compares the verdicts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--radii", default="100,200")
    parser.add_argument("--slack", type=float, default=0.1)
    arguments = parser.parse_args()
    least, most = map(float, arguments.radii.split(","))
    found: Counter[str] = Counter()
    ratios, bounds = [], []
    for number in range(arguments.first, arguments.first + arguments.count):
        task = drawn_task(number, (least, most))
        scene = nsl.loads(text_of(task))
        best = chosen(scene)
        bounds.append(best.path_error_mm)
        said, seconds = verdict(scene, best.per_mm)
        coarse, coarse_seconds = verdict(scene, COARSE)
        ratios.append(seconds / coarse_seconds)
        found["tasks"] += 1
        found[f"resolution {best.per_mm}"] += 1
        found["with a plan"] += said
        found["differ from 1,000 per mm"] += said != coarse
        found["differ from 1,000,000 per mm"] += said != verdict(scene, FINE)[0]
        must = has_plan(task, arguments.slack)
        may = must or has_plan(task, -arguments.slack)
        found["within the slack"] += must != may
        for name, one in (("chosen", said), ("1,000 per mm", coarse)):
            if (must and not one) or (one and not may):
                found[f"WRONG on exact circles: {name}"] += 1
                print(f"task {number}, radius {task.radius} mm, {name}: {one}, exactly {may}")
    print(", ".join(f"{name}: {count}" for name, count in found.items()))
    print(f"largest bound of the error: {max(bounds):.3f} mm")
    print(
        f"synthesis at the chosen resolution / at 1,000: median {statistics.median(ratios):.2f}, "
    )
    print(f"geometric mean {math.exp(statistics.fmean(map(math.log, ratios))):.2f}")


if __name__ == "__main__":
    main()
