"""Faults of the process of the driver, and of what it is connected to: does every run end well?

    python -m tests.benchmarks.lab_faults [--runs 2] [--first 0] [--fault WORDS …]

`ntagen drive` runs in a process of its own, on the pseudo-terminal and the tracker of a lab that
runs ten times as fast as real time. At a random moment the process gets a signal, is suspended or
killed, its disk is full, or what it is connected to fails (`tests.faults.live` has all faults).
Whatever it is: the axes go on by no more than a step, nothing moves after the end, no known region
is pierced, the exit code and the words are right, and the log can be read. After SIGKILL, a driver
that is started again must not move a needle that is in the tissue. A run takes about ten seconds.
The yardstick is 0 wrong runs. Ends with 1 if any is wrong.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

from tests.faults.live import LIVE, run_live
from tests.faults.runs import NEEDLES


def main() -> int:
    """Makes the runs, one after the other, and prints a line for each fault and needle."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--runs", type=int, default=2, help="for each fault and needle")
    parser.add_argument("--first", type=int, default=0, metavar="SEED")
    parser.add_argument("--fault", nargs="+", default=[""], help="words in the names of faults")
    asked = parser.parse_args()
    wrong = total = 0
    print(f"{'fault':24} needle     deeper  exit codes")
    for fault in LIVE:
        if not any(words in fault.name for words in asked.fault):
            continue
        for needle in NEEDLES:
            with tempfile.TemporaryDirectory() as folder:
                seeds = range(asked.first, asked.first + asked.runs)
                findings = [run_live(fault, needle, seed, Path(folder)) for seed in seeds]
            counts = Counter(one.code for one in findings)
            shown = ", ".join(f"{count} x {code}" for code, count in sorted(counts.items()))
            deeper_mm = max(one.deeper_mm for one in findings)
            print(f"{fault.name:24} {needle:8} {deeper_mm:6.2f} mm  {shown}", flush=True)
            for seed, one in zip(seeds, findings, strict=True):
                for what in one.wrong:
                    print(f"    WRONG: seed {seed}: {what}", flush=True)
            wrong += sum(bool(one.wrong) for one in findings)
            total += len(findings)
    print(f"{total} runs, {wrong} wrong (yardstick: 0)")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
