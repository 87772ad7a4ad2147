"""What others learned, learned again: our values and seconds beside theirs.

    python tests/benchmarks/published.py [--seeds 1 2 3] [--only pole]

Each case of `tests/oracles/learning/published` that others learned a strategy for is learned from
each seed, in a process of its own, on one thread. The yardstick is the published value with its
margin. Learning takes UPPAAL Stratego minutes in these papers (Brorholt et al., Shielded
Reinforcement Learning for Hybrid Systems, 2023: 12,000 runs).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.oracles.learning.published.cases import LEARNED, Published

TABLE = "{:<8} {:<52} {:<8} {:>16} {:>26} {:>9} {:>8} {:>7}"


def answers_of(case: Published, seed: int) -> list[dict[str, object]]:
    """The answers to the strategies of a case, and to its query under the last one."""
    query = case.query
    if case.strategies:
        query += f" under {case.strategies[-1].split()[1]}"
    with tempfile.NamedTemporaryFile("w", suffix=".q") as queries:
        queries.write("\n".join([*case.strategies, query, ""]))
        queries.flush()
        command = (sys.executable, "-m", "ntagen", "check", str(case.path), queries.name)
        options = ("--seed", str(seed), "--threads", "1", "--json")
        run = subprocess.run([*command, *options], capture_output=True, text=True, check=True)
    return [json.loads(line) for line in run.stdout.splitlines()]


def compare(case: Published, seed: int) -> bool:
    """Prints a line, and returns whether the value is as good as the published one."""
    *learned, answer = answers_of(case, seed)
    value, low, high = (float(str(answer[key])) for key in ("value", "lower", "upper"))
    is_reached = low <= case.value + case.margin
    runs = sum(int(str(one.get("learning_runs") or 0)) for one in learned)
    seconds = sum(float(str(one["seconds"])) for one in learned)
    print(
        TABLE.format(
            case.model,
            case.query,
            (case.strategies or ("- -",))[-1].split()[1],
            f"{case.value:g} ± {case.margin:g}",
            f"{value:.3f} [{low:.3f}, {high:.3f}]",
            runs or "-",
            f"{seconds:.1f}",
            "yes" if is_reached else "no",
        ),
        flush=True,
    )
    return is_reached


def main() -> None:
    """Learns all of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    parser.add_argument("--only", choices=sorted({case.model for case in LEARNED}))
    options = parser.parse_args()
    print(
        TABLE.format("model", "query", "under", "published", "ours", "runs", "seconds", "reached")
    )
    cases = [case for case in LEARNED if options.only in (None, case.model)]
    reached = [compare(case, seed) for case in cases for seed in options.seeds]
    print(f"{sum(reached)} of {len(reached)} are as good as published")


if __name__ == "__main__":
    main()
