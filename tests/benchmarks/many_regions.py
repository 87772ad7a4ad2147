"""How long a task with a thousand regions takes: reading it, its model, and a plan.

    python tests/benchmarks/many_regions.py [--count 1000] [--repeats 5]

For each shape, a task with so many critical regions beside the way is read, rendered and solved.
Printed is the median processor time of each phase, and its ratio to a yardstick: 0.5 s for reading
(the language's front end), 0.15 s for the engine (loading the model and finding a winning plan). A
ratio of at most 1 is wanted.
"""

from __future__ import annotations

import argparse
import random
import statistics
import time
from collections.abc import Callable
from pathlib import Path

from ntagen import checker, nsl
from ntagen.render import render

READ_S, ENGINE_S = 0.5, 0.15
QUERY = "control: A<> Checker.Final_TR_Reached"
LEAST_FROM_WAY_MM = 14.0
FORMS = {
    "sphere": "sphere ({x:.2f}, {y:.2f}, {z:.2f}) mm radius 0.8 mm",
    "box": "box ({x:.2f}, {y:.2f}, {z:.2f}) mm size (1, 2, 1.5) mm turned 30 deg about +z",
    "capsule": "capsule ({x:.2f}, {y:.2f}, {z:.2f}) mm to ({w:.2f}, {y:.2f}, {z:.2f}) mm"
    " radius 0.8 mm to 0.5 mm",
    "cylinder": "cylinder ({x:.2f}, {y:.2f}, {z:.2f}) mm to ({w:.2f}, {y:.2f}, {z:.2f}) mm"
    " radius 1 mm",
    "ellipsoid": "ellipsoid ({x:.2f}, {y:.2f}, {z:.2f}) mm radii (1, 2, 1.5) mm",
}


def text(form: str, count: int) -> str:
    """A task with regions beside the way."""
    numbers = random.Random(1)
    lines = []
    while len(lines) < count:
        x, y, z = (numbers.uniform(-60.0, 60.0) for _ in range(3))
        if abs(x) > LEAST_FROM_WAY_MM:
            lines.append(f"  critical C{len(lines)} {form.format(x=x, y=y, z=z, w=1.1 * x)}")
    return "\n".join(
        [
            "environment many {",
            "  needle { radius 30 mm speed 1 mm/s }",
            "  target T1 sphere (0, -50, 0) mm radius 10 mm",
            *lines,
            "}",
        ]
    )


def median(repeats: int, act: Callable[[], object]) -> float:
    """The median processor time of an action in seconds, after one that does not count."""
    times = []
    for _ in range(repeats + 1):
        begin = time.process_time()
        act()
        times.append(time.process_time() - begin)
    return statistics.median(times[1:])


def solve(files: object) -> None:
    """Loads a model and finds one winning plan."""
    answer = checker.load(files).check(QUERY)  # type: ignore[arg-type]
    if answer.verdict != "satisfied":
        raise SystemExit("there is no plan: the benchmark's task is wrong")


def main() -> None:
    """Prints a line for each shape."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    nsl.load(Path(__file__).parents[2] / "examples" / "paper.nsl")
    print(f"{options.count} regions; ratios to {READ_S:g} s (read) and {ENGINE_S:g} s (engine)")
    for name, form in FORMS.items():
        task = text(form, options.count)
        scene = nsl.loads(task)
        files = render(scene)
        read = median(options.repeats, lambda task=task: nsl.loads(task))
        made = median(options.repeats, lambda scene=scene: render(scene))
        engine = median(options.repeats, lambda files=files: solve(files))
        print(
            f"{name:<10} read {read:6.3f} s  ratio {read / READ_S:5.2f}   "
            f"render {made:6.3f} s   engine {engine:6.3f} s  ratio {engine / ENGINE_S:5.2f}"
        )


if __name__ == "__main__":
    main()
