"""How many cluttered scenes are solved, and how soon: against the rate of sampling planners.

    python -m tests.benchmarks.clutter FOLDER [--angle 45] [--rolls 3] [--free] [--radius tight]
        [--safety sampled] [--timeout 10] [--enumerate]

FOLDER has scenes as JSON in the format ``ntagen-clutter-1``: a needle, a target with two radii, and
spheres and capsules to be avoided, in mm. A scene is solved if a plan holds in exact kinematics.
Printed are the number of scenes solved of each class, the time of the engine until then (median,
90th percentile, most), the time of the whole synthesis, and the part of the engine's time of the
limits of 50 ms (90th percentile) and 1 s.

With ``--enumerate``, an independent brute-force planner answers the same question for each scene,
with a look at every quarter of a step, and the scenes with another answer are listed.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path

from ntagen.plan.anytime import best_plans
from ntagen.plan.synthesise import EngineSynthesiser, Margins
from ntagen.scene import Limits, Needle, Pose, Region, Scene
from ntagen.shapes import Capsule
from tests.oracles import planner

LIMIT_P90_S, LIMIT_S = 0.05, 1.0
SAMPLES = 4
MARGINS = Margins(depth_mm=0.0)


@dataclass(frozen=True)
class Outcome:
    """The answer for a scene, and the seconds that it took."""

    is_solved: bool | None
    engine_s: float
    whole_s: float


def scene_of(path: Path, limits: Limits, radius: str, safety: str, resolution: int) -> Scene:
    """The scene of a file."""
    data = json.loads(path.read_text())
    if data["format"] != "ntagen-clutter-1":
        raise SystemExit(f"{path}: unknown format {data['format']}")
    needle, target = data["needle"], data["target"]
    heading = tuple(map(float, needle["heading"]))
    tip = Pose(tuple(needle["tip"]), heading, tuple(map(float, needle["bevel"])))
    spheres = [
        Region.ball(f"C{i}", "critical", (x, y, z), radius_mm)
        for i, (x, y, z, radius_mm) in enumerate(data["spheres"])
    ]
    capsules = [
        Region(f"V{i}", "critical", Capsule(tuple(c[:3]), tuple(c[3:6]), c[6], c[6]))
        for i, c in enumerate(data["capsules"])
    ]
    key = "tight_radius" if radius == "tight" else "radius"
    return Scene(
        name=path.stem.replace("-", "_"),
        needle=Needle(tip, needle["radius"], 1.0, needle["max_length"]),
        axis=heading,
        limits=limits,
        targets=(Region.ball("T", "target", tuple(target["center"]), target[key]),),
        criticals=(*spheres, *capsules),
        resolution_per_mm=resolution,
        safety=safety,
    )


def solve(scene: Scene, timeout_s: float) -> Outcome:
    """Whether a scene has a plan that holds; None if the engine did not find out in time."""
    engine = EngineSynthesiser(MARGINS)
    answers = best_plans(scene, engine, clock=time.perf_counter, budget_s=timeout_s)
    first = next(answers)
    is_solved = {"found": True, "none": False, "unknown": None}[first.verdict]
    return Outcome(is_solved, first.engine_seconds, first.seconds)


def percentile(values: list[float], part: float) -> float:
    """The value below which this part lies (nearest rank)."""
    return sorted(values)[max(0, math.ceil(part * len(values)) - 1)]


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--angle", type=int, default=45, help="rolls are multiples of this")
    parser.add_argument("--rolls", type=int, default=3)
    parser.add_argument("--free", action="store_true", help="the bevel is free before the entry")
    parser.add_argument("--radius", choices=["tight", "wide"], default="tight")
    parser.add_argument("--safety", choices=["sampled", "swept"], default="swept")
    parser.add_argument("--step", type=float, default=2.0, help="a step in mm")
    parser.add_argument("--apart", type=float, default=0.0, help="mm between two rolls")
    parser.add_argument("--resolution", type=int, default=10_000, help="units of the model per mm")
    parser.add_argument("--timeout", type=float, default=10.0)
    parser.add_argument("--enumerate", action="store_true")
    options = parser.parse_args()
    angles = tuple(math.radians(a) for a in range(options.angle, 360, options.angle))
    limits = Limits(options.step, angles, options.rolls, options.apart, options.free)
    classes: defaultdict[str, list[Outcome]] = defaultdict(list)
    differing = []
    for path in sorted(options.folder.glob("*.json")):
        scene = scene_of(path, limits, options.radius, options.safety, options.resolution)
        outcome = solve(scene, options.timeout)
        classes[path.stem.rpartition("-")[0]].append(outcome)
        if options.enumerate:
            expected = bool(planner.plans(replace(scene, safety="swept"), samples=SAMPLES))
            if expected is not outcome.is_solved:
                differing.append(f"{path.stem}: brute force {expected}, here {outcome.is_solved}")
    if not classes:
        raise SystemExit(f"no scenes in {options.folder}")
    print("class       solved      engine ms: median    90 %    most   whole ms: median    most")
    every = [outcome for outcomes in classes.values() for outcome in outcomes]
    for name, outcomes in [*classes.items(), ("all", every)]:
        engine = [1e3 * outcome.engine_s for outcome in outcomes]
        whole = [1e3 * outcome.whole_s for outcome in outcomes]
        solved = sum(outcome.is_solved is True for outcome in outcomes)
        print(
            f"{name:<10} {solved:>3} of {len(outcomes):<3} {percentile(engine, 0.5):>20.1f} "
            f"{percentile(engine, 0.9):>7.1f} {max(engine):>7.1f} {percentile(whole, 0.5):>18.1f} "
            f"{max(whole):>7.1f}"
        )
    seconds = [outcome.engine_s for outcome in every]
    print(
        f"90th percentile of the engine's time, ratio to 50 ms: "
        f"{percentile(seconds, 0.9) / LIMIT_P90_S:.2f}; most, ratio to 1 s: "
        f"{max(seconds) / LIMIT_S:.2f}"
    )
    unknown = sum(outcome.is_solved is None for outcome in every)
    if unknown:
        print(f"no answer in {options.timeout:g} s: {unknown}")
    if options.enumerate:
        print(f"other answers than by brute force: {len(differing)}")
        print("\n".join(f"  {line}" for line in differing))


if __name__ == "__main__":
    main()
