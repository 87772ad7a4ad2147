"""Runs that are cut off at random moments and resumed: does the needle ever move wrongly?

    python -m tests.benchmarks.cuts [--runs 56] [--first 0] [--cut WORDS …]

Each run steers a needle in a random scene behind an emulated stepper controller, on a simulated
clock, and is cut off at a random moment (`tests.faults.cuts` has all ways). Then a new driver goes
on from the log. Nothing may move before somebody agrees; a driver goes on only if it knows how deep
the needle is and how its bevel stands; no region that it knows is pierced; what it calls reached is
reached. Printed are, for each way, how the resumed runs ended, and why some were not resumed. The
yardstick is 0 wrong runs. Ends with 1 if any is wrong.
"""

from __future__ import annotations

import argparse
import functools
import multiprocessing
import os
import re
import sys
from collections import Counter

from ntagen.drive.states import State
from tests.faults.cuts import CUTS, Trial, attempt

_COLUMNS = {
    "target": {State.TARGET_REACHED.value},
    "pulled back": {State.PULLED_OUT.value},
    "refused": {"refused", "not begun"},
    "nothing to resume": {"over before the cut", "not inserted by its log", "no log"},
}
"""The columns of the table, by the outcomes in them; all other ends have a column, too."""


def tell(cut: str, trials: list[Trial]) -> int:
    """Prints the row of a way to cut runs off; returns how many are wrong."""
    counts = [sum(one.outcome in outcomes for one in trials) for outcomes in _COLUMNS.values()]
    counts.append(len(trials) - sum(counts))
    wrong = sum(bool(one.wrong) for one in trials)
    print(f"{cut:26}" + "".join(f"{count:>19}" for count in (*counts, wrong)), flush=True)
    return wrong


def why(trials: list[Trial]) -> None:
    """Prints why runs were not resumed, or did not reach the target."""
    reasons = Counter(
        (one.outcome, re.sub(r"\(?-?[0-9.]+[^a-z]*", "… ", one.reason.splitlines()[0]))
        for one in trials
        if one.reason and one.outcome != State.TARGET_REACHED.value
    )
    for (outcome, reason), count in sorted(reasons.items(), key=lambda item: -item[1]):
        print(f"  {count:4} {outcome}: {reason}")


def main() -> int:
    """Makes the runs and prints a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--runs", type=int, default=56, help="for each way to cut a run off")
    parser.add_argument("--first", type=int, default=0, metavar="SEED")
    parser.add_argument("--cut", nargs="+", default=[""], help="words in the names of the ways")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    print(
        f"{'cut off by':26}" + "".join(f"{name:>19}" for name in (*_COLUMNS, "other ends", "wrong"))
    )
    found: list[Trial] = []
    wrong = 0
    with multiprocessing.Pool(asked.workers) as pool:
        for cut in (one for one in CUTS if any(words in one for words in asked.cut)):
            seeds = range(asked.first, asked.first + asked.runs)
            trials = pool.map(functools.partial(attempt, cut), seeds, 1)
            wrong += tell(cut, trials)
            for seed, one in zip(seeds, trials, strict=True):
                for what in one.wrong:
                    print(f"    WRONG: seed {seed}: {what}", flush=True)
            found += trials
    print(f"{len(found)} cuts, {wrong} wrong (yardstick: 0)")
    why(found)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
