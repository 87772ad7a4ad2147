"""What partial-order reduction gains, and what it costs where there is nothing to gain.

    python tests/benchmarks/orders.py [--limit 120]

Whole state spaces with and without the reduction: sensors that work side by side in urgent steps,
of which every order is as good as any other, then models of which none may be left out. Printed
are stored states and seconds of processor time without and with the reduction, and their ratios;
`limit` is in seconds of wall time for each search.
"""

from __future__ import annotations

import argparse
import time

import models

from ntagen import checker

MODELS = {
    **{f"alarms {number}": models.alarms(number) for number in (4, 6, 7)},
    "entangled 5": models.entangled(5),
    "csmacd 9": models.csmacd(9),
    "train_gate 5": models.train_gate(5),
    "fischer 8": models.fischer(8),
}


def _searched(text: str, partial_order: bool, limit_s: float) -> tuple[checker.Answer, float]:
    """The answer to a query that no state satisfies, and the seconds of processor time."""
    model = checker.load(text, "model.xta")
    start = time.process_time()
    answer = model.check("E<> false", partial_order=partial_order, timeout_s=limit_s)
    return answer, time.process_time() - start


def main() -> None:
    """Prints a line for each model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--limit", type=float, default=120.0)
    limit_s = parser.parse_args().limit
    heads = ("stored, off", "on", "ratio", "s, off", "on", "ratio")
    print("{:14} {:>12} {:>9} {:>7} {:>8} {:>8} {:>7}".format("model", *heads))
    for name, text in MODELS.items():
        full, full_s = _searched(text, False, limit_s)
        reduced, reduced_s = _searched(text, True, limit_s)
        mark = "" if full.verdict == reduced.verdict else f"  ({full.verdict}, {reduced.verdict})"
        print(
            f"{name:14} {full.stored:12} {reduced.stored:9} {full.stored / reduced.stored:7.1f} "
            f"{full_s:8.2f} {reduced_s:8.2f} {full_s / reduced_s:7.2f}{mark}",
            flush=True,
        )


if __name__ == "__main__":
    main()
