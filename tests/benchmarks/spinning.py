"""What spinning the needle gives on random tasks: tasks with a plan, and drives that arrive.

    python tests/benchmarks/spinning.py [--count 100] [--first 0] [--radii 30,164]
        [--spins 20,40,60] [--drives 1] [--needle phantom] [--timeout 60] [--oracle]

Each task has one target 40 to 100 mm deep, and up to seven spheres, capsules and boxes to avoid.
Printed are the tasks that have a plan without and with `spin`, what both syntheses take, and how
the drives with `spin` end: all of them, and those of the tasks that have a plan with it only.
Drives have ten minutes on the needle's clock. Whether a region was touched is computed here from
the arcs that were really cut.

A task has a plan if the model has a strategy. With --oracle the verdicts with `spin` of tasks with
one roll are compared with all plans on exact circles: where a plan keeps 0.1 mm from everything,
there must be a strategy, and none where there is no plan even if it may err by 0.1 mm.
"""

from __future__ import annotations

import argparse
import statistics
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ntagen import checker, nsl
from ntagen.drive.needles import NAMES, choose
from ntagen.drive.records import Journals
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import Result, simulate, synthesiser_for
from ntagen.needle.virtual import Errors
from ntagen.render import render
from ntagen.scene import Scene
from tests.benchmarks.rounding import QUERY, drawn_task, text_of
from tests.oracles.exact_plans import Steering, has_plan

SLACK_MM = 0.1
SPACING_MM = 0.05
MINUTES_10_S = 600.0


@dataclass
class Found:
    """What was found in all tasks."""

    counts: Counter[str] = field(default_factory=Counter)
    seconds: dict[str, list[float]] = field(default_factory=lambda: {"without": [], "with": []})
    drives: Counter[str] = field(default_factory=Counter)
    only_with: Counter[str] = field(default_factory=Counter)


def verdict(scene: Scene, timeout_s: float) -> tuple[bool | None, float]:
    """Whether there is a strategy, or None if that takes too long; and the engine's seconds."""
    model = checker.load(render(scene, only_plans=True))
    answer = model.check(QUERY, timeout_s=timeout_s, memory_bytes=4 << 30)
    return answer.satisfied, answer.seconds


def least_mm(task: Steering, result: Result) -> float:
    """The least distance of all arcs that were cut to what must be avoided."""
    least = np.inf
    for arc in result.pierced:
        start, count = arc.start, max(2, int(arc.length_mm / SPACING_MM) + 2)
        along: NDArray[np.float64] = np.linspace(0.0, arc.length_mm, count)[:, None]
        turn = along / arc.radius_mm
        points = np.array(start.position_mm) + arc.radius_mm * (
            np.sin(turn) * np.array(start.heading) - (1.0 - np.cos(turn)) * np.array(start.bevel)
        )
        least = min([least, *(float(one.away(points).min()) for one in task.avoided)])
    return float(least)


def driven(task: Steering, scene: Scene, name: str, seed: int) -> str:
    """How a drive ends, in words."""
    needle = choose(name, Errors())
    usual = needle.usual(Settings(timeout_s=MINUTES_10_S), scene)
    settings = needle.fitting(usual, scene, "all")
    result = simulate(
        scene, synthesiser_for(settings), settings, Journals(), make=needle.make, seed=seed
    )
    if least_mm(task, result) < 0.0:
        return "A REGION WAS TOUCHED"
    if result.ended.outcome == "target reached" and result.target_distance_mm > 0.0:
        return "NOT TRULY REACHED"
    return result.ended.outcome


def compare(task: Steering, satisfied: bool | None, found: Found) -> None:
    """Compares the verdict with all plans on exact circles."""
    if satisfied is None or task.most_rolls > 1:
        return
    if not satisfied and has_plan(task, SLACK_MM):
        found.counts["WRONG: no strategy, but a plan"] += 1
    if satisfied and not has_plan(task, -SLACK_MM):
        found.counts["WRONG: a strategy, but no plan"] += 1
    found.counts["compared with all plans"] += 1


def main() -> None:
    """Makes the tasks, asks and drives."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--radii", default="30,164")
    parser.add_argument("--spins", default="20,40,60")
    parser.add_argument("--drives", type=int, default=1)
    parser.add_argument("--needle", choices=NAMES, default="phantom")
    parser.add_argument("--timeout", type=float, default=60.0)
    parser.add_argument("--oracle", action="store_true")
    arguments = parser.parse_args()
    least, most = map(float, arguments.radii.split(","))
    spins = tuple(float(one) / 100.0 for one in arguments.spins.split(","))
    found = Found()
    for number in range(arguments.first, arguments.first + arguments.count):
        task = replace(drawn_task(number, (least, most)), spins=spins)
        scene = nsl.loads(text_of(task))
        plain = replace(scene, limits=replace(scene.limits, spins=()))
        verdicts = {}
        for word, one in (("without", plain), ("with", scene)):
            verdicts[word], seconds = verdict(one, arguments.timeout)
            found.seconds[word].append(seconds)
            found.counts[f"{word}: {verdicts[word]}"] += 1
        if verdicts["without"] and not verdicts["with"]:
            found.counts["LOST: a plan without, and none with"] += 1
        if arguments.oracle:
            compare(task, verdicts["with"], found)
        ends = [
            driven(task, scene, arguments.needle, 100 * number + drive)
            for drive in range(arguments.drives if verdicts["with"] else 0)
        ]
        found.drives.update(ends)
        if verdicts["without"] is False:
            found.only_with.update(ends)
        print(f"{number}: radius {task.radius}, {verdicts}, {ends}", flush=True)
    for word, seconds_of in found.seconds.items():
        middle, longest = statistics.median(seconds_of), max(seconds_of)
        print(f"synthesis {word} spin: median {middle:.3f} s, at most {longest:.1f} s")
    for words, counts in (
        ("tasks", found.counts),
        ("drives with spin", found.drives),
        ("drives where only spin gives a plan", found.only_with),
    ):
        print(f"{words}: {dict(sorted(counts.items()))}")


if __name__ == "__main__":
    main()
