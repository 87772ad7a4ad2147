"""How fast the engine finds all plans of the paper's instance, against a hand-written enumerator.

    python tests/benchmarks/needle.py [--runs 7] [--rolls 2] [--yardstick needle.c]

The yardstick is a C program that knows this one model only (`needle.c` beside this file, built with
``cc -O2``). Both are run in turn in this process's run; the medians and their ratio are printed,
and the most memory that this process took. With ``--rolls 3`` there are 3.3 million states at which
a decision is due.
"""

from __future__ import annotations

import argparse
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from ntagen import checker
from ntagen.nsl import load
from ntagen.render import render

ROOT = Path(__file__).resolve().parents[2]
QUERY = "control: A<> Checker.Final_TR_Reached"


def _yardstick_seconds(program: Path, rolls: int) -> tuple[float, int]:
    """Seconds and plans that the yardstick reports."""
    command = [program, str(rolls)]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    match = re.search(r"plans (\d+) .*seconds ([0-9.]+)", output)
    if match is None:
        raise SystemExit(f"the yardstick printed something else: {output}")
    return float(match[2]), int(match[1])


def _engine_seconds(xml: str, max_plans: int) -> tuple[float, float, int | None]:
    """Seconds of the search, seconds of loading, and plans of a model loaded afresh."""
    model = checker.load(xml)
    answer = model.check(QUERY, plans="all", max_plans=max_plans)
    return answer.seconds, answer.load_seconds, answer.plan_count


def _command_seconds() -> float:
    """Seconds from process start to the verdict on the command line."""
    command = [sys.executable, "-m", "ntagen", "check", str(ROOT / "examples/paper.nsl"), "--json"]
    start = time.perf_counter()
    subprocess.run(command, capture_output=True, check=True)
    return time.perf_counter() - start


def main() -> None:
    """Runs both in turn and prints medians and ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--rolls", type=int, default=2, help="how many rolls a plan may hold")
    parser.add_argument("--yardstick", type=Path, default=Path(__file__).with_name("needle.c"))
    arguments = parser.parse_args()
    scene = load(ROOT / "examples/paper.nsl")
    xml = render(replace(scene, limits=replace(scene.limits, max_rolls=arguments.rolls)))
    rows: list[tuple[float, float, float, float, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "needle"
        subprocess.run(["cc", "-O2", "-o", program, arguments.yardstick, "-lm"], check=True)
        for _ in range(arguments.runs):
            yardstick, expected = _yardstick_seconds(program, arguments.rolls)
            everything, loading, count = _engine_seconds(xml, 1_000_000)
            if count != expected:
                raise SystemExit(f"the engine has {count} plans, the yardstick {expected}")
            first, _, _ = _engine_seconds(xml, 1)
            rows.append((yardstick, everything, first, loading, _command_seconds()))
    medians = [statistics.median(column) for column in zip(*rows, strict=True)]
    ratios = [statistics.median(row[i] / row[0] for row in rows) for i in range(5)]
    names = ("yardstick, all plans", "engine, all plans", "engine, first plan", "engine, loading")
    for name, median, ratio in zip(
        (*names, "command line, verdicts"), medians, ratios, strict=True
    ):
        print(f"{name:<24} {1000 * median:9.2f} ms   ratio {ratio:6.3f}")
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"{'memory at most':<24} {peak_mb:9.2f} MB")


if __name__ == "__main__":
    main()
