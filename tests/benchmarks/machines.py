"""What states with hundreds of integers cost: bytes and microseconds a state, by kind of query.

    python tests/benchmarks/machines.py [--against OTHER/.venv/bin/python] [--limit 120] [NAME]...

The models in ``machines/`` have memories that programs write and faults change: a machine that
sorts (266 integers, no clocks) and one that copies words over a bus (270 integers, two clocks).
Each query has a process of its own and one thread. ``--against`` asks the engine of another
environment, too, and prints the ratios of this one to it. Bytes are those that the engine counts;
MB is the resident memory of the whole process. Verdicts that differ end the program with 1. A query
that takes more than ``limit`` seconds counts until then.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent / "machines"
ROW = "{:<8} {:<56} {:<13} {:>8} {:>8} {:>9} {:>6} {:>6} {:>6}"


@dataclass(frozen=True, slots=True)
class Cost:
    """What a query cost."""

    verdict: str
    states: int
    bytes_of_state: float
    us_of_state: float
    resident_mb: float


def cost(python: str, model: Path, query: str, limit_s: float) -> Cost:
    """Asks a query in a new process."""
    command = [python, "-m", "ntagen", "check", str(model), "--query", query, "--json"]
    command += ["--timeout", str(limit_s)]
    # Python takes packages from the current folder first, which must not be a clone.
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=FOLDER) as run:
        assert run.stdout is not None
        answer = json.loads(run.stdout.read().splitlines()[-1])
        _, run.returncode, usage = os.wait4(run.pid, 0)
    states = max(int(answer["stored"]), 1)
    return Cost(
        answer["verdict"],
        states,
        answer["peak_bytes"] / states,
        answer["seconds"] * 1e6 / max(int(answer["explored"]), 1),
        usage.ru_maxrss / 1024,
    )


def main() -> None:
    """Prints a row for each query."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", help="models by their names; all without one")
    parser.add_argument("--against", help="the interpreter of an environment with another engine")
    parser.add_argument("--limit", type=float, default=120, help="seconds for each query")
    options = parser.parse_args()
    print(
        ROW.format(
            "model", "query", "verdict", "states", "B/state", "us/state", "MB", "bytes", "time"
        )
    )
    is_same = True
    for model in sorted(FOLDER.glob("*.xta")):
        if options.names and model.stem not in options.names:
            continue
        for query in model.with_suffix(".q").read_text(encoding="utf-8").splitlines():
            own = cost(sys.executable, model, query, options.limit)
            ratios = ["", ""]
            if options.against:
                other = cost(options.against, model, query, options.limit)
                is_same &= "unknown" in (own.verdict, other.verdict) or own.verdict == other.verdict
                ratios = [
                    f"{own.bytes_of_state / other.bytes_of_state:.2f}",
                    f"{own.us_of_state / other.us_of_state:.2f}",
                ]
            costs = [
                f"{own.bytes_of_state:.0f}",
                f"{own.us_of_state:.2f}",
                f"{own.resident_mb:.0f}",
            ]
            row = [model.stem, query, own.verdict, own.states, *costs, *ratios]
            print(ROW.format(*row), flush=True)
    if not is_same:
        raise SystemExit("verdicts differ")


if __name__ == "__main__":
    main()
