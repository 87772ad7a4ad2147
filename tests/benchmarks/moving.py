"""What moving regions cost: the same tasks with regions that move and that keep still.

    python tests/benchmarks/moving.py [--repeats 5]

Printed are medians of processor time: of the model's first winning plan (loading and solving), and
of its certificate; and the ratio to the same task without the motions, the yardstick.
"""

from __future__ import annotations

import argparse
import re
import statistics
import time
from pathlib import Path

from ntagen import checker, nsl
from ntagen.plan.certify import certify
from ntagen.plan.extract import extract
from ntagen.render import render
from ntagen.scene import Scene

QUERY, GUIDE = "control: A<> Checker.Final_TR_Reached", "get_miss()"
EXAMPLES = Path(__file__).parents[2] / "examples"
TARGET = "sphere (0, -50, 0) mm  radius 10 mm"
MOTION = "  moves 12 mm along +z every 4 s"
CLAUSES = re.compile(r"  moves [^\n]*? every \d+ s|\n *wait [^\n]*|\n *push only [^\n]*")


def tasks() -> dict[str, str]:
    """Environments with moving regions."""
    paper = (EXAMPLES / "paper.nsl").read_text("utf-8")
    ribs = (EXAMPLES / "ribs" / "ribs.nsl").read_text("utf-8")
    return {
        "paper, target moves": re.sub(r"(target[^\n]*10 mm)", rf"\1{MOTION}", paper, count=1),
        "ribs, 31 regions move": ribs,
    }


def measured(scene: Scene, repeats: int) -> tuple[float, float]:
    """Seconds of a first plan, and of its certificate; medians."""
    solving, certifying = [], []
    text = render(scene, only_plans=True)
    for _ in range(repeats):
        start = time.process_time()
        answer = checker.load(text).check(QUERY, plans="all", max_plans=1, guide=GUIDE)
        solving.append(time.process_time() - start)
        (plan,) = extract(answer.plans, scene)
        start = time.process_time()
        certify(plan, scene)
        certifying.append(time.process_time() - start)
    return statistics.median(solving), statistics.median(certifying)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    for name, text in tasks().items():
        moving = measured(nsl.loads(text), repeats)
        still = measured(nsl.loads(CLAUSES.sub("", text)), repeats)
        for what, seconds, yardstick in zip(
            ("first plan", "certificate"), moving, still, strict=True
        ):
            ratio = seconds / yardstick if yardstick > 0.0 else float("inf")
            times = f"{1e3 * seconds:.1f} ms, still {1e3 * yardstick:.1f} ms"
            print(f"{name}: {what} {times}: {ratio:.1f}")


if __name__ == "__main__":
    main()
