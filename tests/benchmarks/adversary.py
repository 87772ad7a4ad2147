"""How many cluttered scenes have a strategy against a tissue that answers, and what it survives.

    python tests/benchmarks/adversary.py SCENES [--rolls 3] [--free] [--angle 45] [--levels mild]
        [--seconds 60] [--tissues 10000] [--only clutter10]

SCENES is a folder of `ntagen-clutter-1` files. For each level, the table has the scenes with a
strategy that holds on every branch in exact kinematics, those without one, those left open after
the time, and times and states of the engine. The yardstick are plans without an answer that survive
constant errors at all corners: 43, 37 and 17 of 50 (frontier of the project, 45 deg, two rolls).

With `--tissues`, each strategy is followed by code that shares nothing with the model: by so many
tissues that pick corners or the middle, by as many that pick any value between, by as many that
pick the factor anew at each push (a game that no strategy was asked to win), and by the 1,000 worst
of the first.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from ntagen.plan.against_tissue import Defence, defend
from ntagen.scene import Limits, Needle, Pose, Region, Scene, Tissue
from ntagen.shapes import Capsule
from tests.oracles import tissue as oracle

LEVELS = {
    "mild": Tissue("adversarial", 0.05, math.radians(2.0), 0.2),
    "standard": Tissue("adversarial", 0.10, math.radians(5.0), 0.5),
    "hard": Tissue("adversarial", 0.20, math.radians(10.0), 1.0),
}
YARDSTICK = {"mild": 43, "standard": 37, "hard": 17}
WORST = 1000


def scene_of(path: Path, limits: Limits, tissue: Tissue) -> Scene:
    """The scene of a file, with the larger target."""
    given = json.loads(path.read_text("utf-8"))
    needle, target = given["needle"], given["target"]
    position, heading, bevel = (
        tuple(map(float, needle[part])) for part in ("tip", "heading", "bevel")
    )
    tip = Pose(position, heading, bevel)
    balls = [
        Region.ball(f"S{i}", "critical", tuple(one[:3]), one[3])
        for i, one in enumerate(given["spheres"])
    ]
    tubes = [
        Region(f"C{i}", "critical", Capsule(tuple(one[:3]), tuple(one[3:6]), one[6], one[6]))
        for i, one in enumerate(given["capsules"])
    ]
    return Scene(
        name="clutter",
        needle=Needle(tip, needle["radius"], 1.0, needle["max_length"]),
        axis=heading,
        limits=limits,
        targets=(Region.ball("T", "target", tuple(target["center"]), target["radius"]),),
        criticals=(*balls, *tubes),
        tissue=tissue,
        resolution_per_mm=100_000,
        safety="swept",
    )


def followed(found: Defence, count: int) -> dict[str, Any]:
    """How many simulated tissues the strategy survives."""
    assert found.tree is not None
    tree, scene = json.loads(json.dumps(asdict(found.tree))), found.scene
    tip_mm = scene.tissue.tip_mm
    random = np.random.default_rng(1)
    at_corners = oracle.simulate(tree, scene, count, oracle.corners(scene, random))
    within = oracle.simulate(tree, scene, count, oracle.between(scene, random))
    anew = oracle.simulate_pushes(tree, scene, count, random)
    worst = oracle.worst(tree, scene, WORST)
    return {
        "corners": int(at_corners.safe(tip_mm).sum()),
        "between, with the tip error": int(within.safe(tip_mm).sum()),
        "between, without it": int(within.safe(0.0).sum()),
        "at each push, with the tip error": int(anew.safe(tip_mm).sum()),
        "at each push, without it": int(anew.safe(0.0).sum()),
        "worst": int((worst >= tip_mm - 1e-6).sum()),
        "worst of": len(worst),
        "least margin": float(worst[0]),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", type=Path)
    parser.add_argument("--rolls", type=int, default=3)
    parser.add_argument("--free", action="store_true", help="the bevel is chosen before the entry")
    parser.add_argument("--angle", type=int, default=45)
    parser.add_argument("--levels", default="mild,standard,hard")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--tissues", type=int, default=0)
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    angles = tuple(math.radians(a) for a in range(asked.angle, 360, asked.angle))
    limits = Limits(2.0, angles, asked.rolls, 0.0, asked.free)
    for level in asked.levels.split(","):
        count = {"solved": 0, "no": 0, "open": 0}
        seconds, states, survived = [], [], []
        for path in sorted(asked.scenes.glob(f"{asked.only}*.json")):
            scene = scene_of(path, limits, LEVELS[level])
            found = defend(scene, timeout_s=asked.seconds)
            kind = "solved" if found.holds else "no" if found.verdict == "not satisfied" else "open"
            count[kind] += 1
            seconds.append(found.seconds)
            states.append(found.explored)
            line = f"{level} {path.stem}: {kind} {found.stop or ''} {found.seconds:.2f} s"
            print(f"{line}, {found.explored} states", file=sys.stderr, flush=True)
            if asked.tissues and found.holds:
                survived.append(followed(found, asked.tissues))
                print(f"    {survived[-1]}", file=sys.stderr, flush=True)
        print(
            f"{level}: {count['solved']} solved ({YARDSTICK[level]} of 50 without an answer), "
            f"{count['no']} without a strategy, {count['open']} open; engine median "
            f"{statistics.median(seconds):.2f} s, worst {max(seconds):.1f} s; states explored "
            f"median {statistics.median(states):.0f}, most {max(states)}",
            flush=True,
        )
        if survived:
            total = {key: sum(one[key] for one in survived) for key in survived[0]}
            total["least margin"] = min(one["least margin"] for one in survived)
            print(f"  of {asked.tissues * len(survived)} tissues each: {total}", flush=True)


if __name__ == "__main__":
    main()
