"""How runs by a strategy end in tissues that answer, and how runs by plans end in the same ones.

    python tests/benchmarks/answering.py TASK... [--runs 100] [--noise 0.0]
        [--tissues corners,between] [--by strategy,plans]

TASK is an environment (`examples/answering/answering.nsl`), or a scene of `adversary.py` with
`--level mild --rolls 2`. For each tissue and each way to drive, the table has the runs whose
guarantee held up to the target, those that reached the target in truth, and those that touched
something. The yardstick are plans for the expected tissue, made anew when the needle leaves them:
they have no guarantee.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from ntagen.drive.fitting import settings_for
from ntagen.drive.following import Course
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import Result, answering, simulate, synthesiser_for
from ntagen.needle.virtual import Errors
from ntagen.nsl import load_task
from ntagen.plan.against_tissue import defend
from ntagen.plan.closed_loop import Segment
from ntagen.scene import Limits, Scene
from tests.benchmarks.adversary import LEVELS, scene_of
from tests.drive.runs import Diary


def run(scene: Scene, tree: Segment | None, tissue: str, seed: int, noise_mm: float) -> Result:
    """One run; by plans without a strategy."""
    errors = Errors(noise_mm)
    settings = settings_for(Settings(), errors, scene, "all")
    course = None if tree is None else Course(tree)
    return simulate(
        scene,
        synthesiser_for(settings),
        settings,
        Diary(),
        errors=errors,
        make=answering(errors, scene, tissue, tree),
        seed=seed,
        course=course,
    )


def line(results: list[Result], seconds: float) -> str:
    """How so many runs ended."""
    held = sum(one.guaranteed is not None and not one.guaranteed.reason for one in results)
    inside = sum(one.target_distance_mm <= 0.0 for one in results)
    touched = sum(one.clearance_mm <= 0.0 for one in results)
    kept = [one.guaranteed.most_off_mm for one in results if one.guaranteed is not None]
    off = f", at most {max(kept):.3f} mm off while it held" if kept else ""
    return (
        f"{held} guaranteed to the end{off}; {inside} of {len(results)} in the target, "
        f"{touched} touched something; {seconds / len(results):.2f} s a run"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tasks", type=Path, nargs="+")
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--noise", type=float, default=0.0, help="of each coordinate, in mm")
    parser.add_argument("--tissues", default="corners,between")
    parser.add_argument("--by", default="strategy,plans")
    parser.add_argument("--level", default="mild", choices=sorted(LEVELS))
    parser.add_argument("--rolls", type=int, default=2)
    asked = parser.parse_args()
    angles = tuple(math.radians(angle) for angle in range(45, 360, 45))
    total: dict[tuple[str, str], list[Result]] = {}
    spent: dict[tuple[str, str], float] = {}
    for path in asked.tasks:
        if path.suffix == ".nsl":
            scene = load_task(path).scene
        else:
            scene = scene_of(path, Limits(2.0, angles, asked.rolls, 0.0), LEVELS[asked.level])
        found = defend(scene)
        if not found.holds:
            print(f"{path}: no strategy that holds", file=sys.stderr)
            continue
        for tissue in asked.tissues.split(","):
            for by in asked.by.split(","):
                tree = found.tree if by == "strategy" else None
                begin = time.perf_counter()
                results = [run(scene, tree, tissue, i, asked.noise) for i in range(asked.runs)]
                seconds = time.perf_counter() - begin
                print(f"{path.name}, {tissue}, by {by}: {line(results, seconds)}", flush=True)
                total.setdefault((tissue, by), []).extend(results)
                spent[tissue, by] = spent.get((tissue, by), 0.0) + seconds
    for (tissue, by), results in total.items():
        print(f"all, {tissue}, by {by}: {line(results, spent[tissue, by])}")


if __name__ == "__main__":
    main()
