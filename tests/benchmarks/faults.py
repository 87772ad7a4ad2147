"""Random faults at random moments: does every run end well?

    python -m tests.benchmarks.faults [--runs 30] [--first 0] [--needle virtual phantom]
        [--fault WORDS …]

Each run steers a needle in a random scene behind an emulated stepper controller, on a simulated
clock, with one fault at a random moment (`tests.faults.catalogue` has all of them). Whatever the
fault: nothing moves after the end, not even when somebody presses the resume button; no region that
the driver knows is pierced; the records tell how the run ended. A fault that can be noticed at once
must end the run as it should, with the right words, and the needle must go no deeper than one step
after it. Printed are counts for each fault and needle, how far the axes went deeper after it, and
how long the run went on. The yardstick is 0 wrong runs. Ends with 1 if any is wrong.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
from collections import Counter
from collections.abc import Sequence

from tests.faults.catalogue import FAULTS, Fault
from tests.faults.runs import NEEDLES, OVER, Finding, run


def made(job: tuple[str, str, int]) -> Finding:
    """Makes a run with the fault of this name."""
    name, needle, seed = job
    return run(next(fault for fault in FAULTS if fault.name == name), needle, seed)


def tell(fault: Fault, needle: str, first: int, findings: Sequence[Finding]) -> int:
    """Prints a line about the runs with one fault; returns how many are wrong."""
    counts = Counter(one.outcome for one in findings)
    shown = ", ".join(f"{count} {outcome}" for outcome, count in sorted(counts.items()))
    struck = [one for one in findings if one.late_s > 0.0 or one.deeper_mm > 0.0]
    deeper_mm = max((one.deeper_mm for one in struck), default=0.0)
    late_s = max((one.late_s for one in struck), default=0.0)
    print(f"{fault.name:32} {needle:8} {deeper_mm:5.2f} mm {late_s:6.1f} s  {shown}", flush=True)
    wrong = [(first + i, what) for i, one in enumerate(findings) for what in one.wrong]
    for seed, what in wrong[:5]:
        print(f"    WRONG: seed {seed}: {what}", flush=True)
    return sum(bool(one.wrong) for one in findings)


def main() -> int:
    """Makes the runs and prints a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--runs", type=int, default=30, help="for each fault and needle")
    parser.add_argument("--first", type=int, default=0, metavar="SEED")
    parser.add_argument("--needle", nargs="+", choices=NEEDLES, default=list(NEEDLES))
    parser.add_argument("--fault", nargs="+", default=[""], help="words in the names of faults")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    chosen = [fault for fault in FAULTS if any(words in fault.name for words in asked.fault)]
    wrong = total = struck = 0
    print(f"{'fault':32} needle     deeper  lasted  ends")
    with multiprocessing.Pool(asked.workers) as pool:
        for fault in chosen:
            for needle in asked.needle:
                seeds = range(asked.first, asked.first + asked.runs)
                findings = pool.map(made, [(fault.name, needle, seed) for seed in seeds], 1)
                wrong += tell(fault, needle, asked.first, findings)
                total += len(findings)
                struck += sum(one.outcome != OVER for one in findings)
    print(f"{total} runs, {struck} with the fault before the end, {wrong} wrong (yardstick: 0)")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
