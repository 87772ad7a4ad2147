"""What the reductions gain, and what they cost where there is nothing to gain.

    python tests/benchmarks/reductions.py [--limit 120]

Whole state spaces without and with a reduction. Partial orders: sensors that work side by side in
urgent steps, of which every order is as good as any other, and sensors that all begin again at
one time. Live variables: controllers that read
inputs one after the other and work out from them what to do next. Then, for both, models in which
nothing may be left out. Printed are stored states and seconds of processor time without and with
the reduction, and their ratios; `limit` is in seconds of wall time for each search.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import TypeAlias

import models

from ntagen import checker

Ask: TypeAlias = Callable[[checker.Model, float, bool], checker.Answer]


def _without(reduction: str) -> str:
    return ",".join(one for one in checker.REDUCTIONS if one != reduction)


def _partial_orders(model: checker.Model, limit_s: float, reduced: bool) -> checker.Answer:
    reductions = "all" if reduced else _without("partial-order")
    return model.check("E<> false", timeout_s=limit_s, reductions=reductions)


def _live_variables(model: checker.Model, limit_s: float, reduced: bool) -> checker.Answer:
    reductions = "all" if reduced else _without("live-variables")
    return model.check("E<> false", timeout_s=limit_s, reductions=reductions)


WITHOUT_GAIN = {
    "csmacd 9": models.csmacd(9),
    "train_gate 5": models.train_gate(5),
    "fischer 8": models.fischer(8),
}

REDUCTIONS: dict[str, tuple[Ask, dict[str, str]]] = {
    "partial orders": (
        _partial_orders,
        {f"alarms {number}": models.alarms(number) for number in (4, 6, 7)}
        | {f"roll call {number}": models.roll_call(number) for number in (12, 16)}
        | {"entangled 5": models.entangled(5)}
        | WITHOUT_GAIN,
    ),
    "live variables": (
        _live_variables,
        {f"samplers {number}": models.samplers(number) for number in (2, 3)} | WITHOUT_GAIN,
    ),
}


def _searched(ask: Ask, text: str, limit_s: float, reduced: bool) -> tuple[checker.Answer, float]:
    """The answer to a query that no state satisfies, and the seconds of processor time."""
    model = checker.load(text, "model.xta")
    start = time.process_time()
    answer = ask(model, limit_s, reduced)
    return answer, time.process_time() - start


def main() -> None:
    """Prints a line for each reduction and model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--limit", type=float, default=120.0)
    limit_s = parser.parse_args().limit
    heads = ("stored, off", "on", "ratio", "s, off", "on", "ratio")
    for reduction, (ask, texts) in REDUCTIONS.items():
        print("{:14} {:>12} {:>9} {:>7} {:>8} {:>8} {:>7}".format(reduction, *heads))
        for name, text in texts.items():
            full, full_s = _searched(ask, text, limit_s, False)
            reduced, reduced_s = _searched(ask, text, limit_s, True)
            same = full.verdict == reduced.verdict
            mark = "" if same else f"  ({full.verdict}, {reduced.verdict})"
            print(
                f"{name:14} {full.stored:12} {reduced.stored:9} "
                f"{full.stored / reduced.stored:7.1f} "
                f"{full_s:8.2f} {reduced_s:8.2f} {full_s / reduced_s:7.2f}{mark}",
                flush=True,
            )


if __name__ == "__main__":
    main()
