"""How long a match takes, against the yardstick of 1 s for a trace of 100 mm.

    python -m tests.benchmarks.matching [SEEDS]

Prints, by the way of the start and the radius, the median and the greatest time over synthetic
traces of all kinds as parts of the yardstick, and for how many of them the rolls came back.
"""

from __future__ import annotations

import math
import sys
import time
from statistics import median

import numpy as np

import ntagen
from tests.traces import BENCH, MAKE

YARDSTICK_S = 1.0
STEP_MM = 2.0


def measure(start: str, radius: str, seeds: int) -> tuple[list[float], int]:
    """The times of matches in s, and how many found the rolls that were made."""
    times_s, right = [], 0
    for kind in MAKE.KINDS:
        for seed in range(seeds):
            made = MAKE.make(kind, seed)
            points = np.array(made.points)
            began_s = time.perf_counter()
            found = ntagen.match(BENCH, points, start=start, radius=radius)  # type: ignore[arg-type]
            times_s.append(time.perf_counter() - began_s)
            rolls = [(depth, math.degrees(angle)) for depth, angle in found.rolls]
            right += len(rolls) == len(made.rolls) and all(
                abs(a[0] - b[0]) <= STEP_MM and abs(a[1] - b[1]) < 1e-6
                for a, b in zip(rolls, made.rolls, strict=True)
            )
    return times_s, right


def main() -> None:
    """Prints the table."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 4
    ntagen.match(BENCH, np.array(MAKE.make("arc", 0).points))  # imports are not counted
    print("start  radius  median/yardstick  greatest/yardstick  rolls right")
    for start in ("free", "fit", "model"):
        for radius in ("scene", "fit"):
            times_s, right = measure(start, radius, seeds)
            parts = [one / YARDSTICK_S for one in (median(times_s), max(times_s))]
            count = len(times_s)
            print(f"{start:6} {radius:6} {parts[0]:17.2f} {parts[1]:19.2f}  {right} of {count}")


if __name__ == "__main__":
    main()
