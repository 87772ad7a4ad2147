"""What it costs to show that there is no deadlock, beside exploring the same states.

    python tests/benchmarks/deadlocks.py [--runs 3] [--limit 300] [--models FOLDER] [NAME]...

Each model is explored whole for ``E<> false`` and for ``A[] not deadlock``, both without
partial-order reduction, so that both searches see the same states where the model has urgent or
committed locations too. Printed are stored states and seconds of processor time of both, the
medians of the runs, and the ratio. ``--models`` adds all models of a folder. ``limit`` is in
seconds of wall time for each search.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path

import models

from ntagen import checker

MODELS = {
    "roll call 12": models.roll_call(12),
    "roll call 16": models.roll_call(16),
    "fischer 7": models.fischer(7),
    "csmacd 8": models.csmacd(8),
    "train gate 4": models.train_gate(4),
    "dining 5": models.dining_philosophers(5),
    "fddi 8": models.fddi(8),
    "corsso 3": models.corsso(3),
    "peterson 4": models.peterson(4),
    "alarms 5": models.alarms(5),
}


def _measured(model: checker.Model, query: str, limit_s: float) -> tuple[checker.Answer, float]:
    """The answer to a query, and the seconds of processor time that it took."""
    start = time.process_time()
    answer = model.check(
        query, reductions="symmetry,live-variables", trace=False, timeout_s=limit_s
    )
    return answer, time.process_time() - start


def main() -> None:
    """Prints a line for each model."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="models to explore; default all")
    parser.add_argument("--runs", type=int, default=3, help="the medians are of so many runs")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for each search")
    parser.add_argument("--models", type=Path, help="a folder with further models")
    arguments = parser.parse_args()
    texts = dict(MODELS)
    if arguments.models:
        files = sorted(arguments.models.rglob("*.xml")) + sorted(arguments.models.rglob("*.xta"))
        texts |= {path.name: path.read_text(encoding="utf-8") for path in files}
    heads = ("stored", "explore s", "deadlock s", "ratio")
    print("{:24} {:>10} {:>10} {:>10} {:>7}".format("", *heads))
    for name, text in texts.items():
        if arguments.names and name not in arguments.names:
            continue
        model = checker.load(text, name if name.endswith((".xml", ".xta")) else "model.xta")
        plain, looking = [], []
        for _ in range(arguments.runs):
            explored, seconds = _measured(model, "E<> false", arguments.limit)
            plain.append(seconds)
            looked, seconds = _measured(model, "A[] not deadlock", arguments.limit)
            looking.append(seconds)
        explore_s, deadlock_s = statistics.median(plain), statistics.median(looking)
        # Where there is a deadlock, the search ends when it is found.
        note = "" if looked.verdict == "satisfied" else f"  {looked.verdict}"
        print(
            f"{name:24} {explored.stored:10} {explore_s:10.2f} {deadlock_s:10.2f} "
            f"{deadlock_s / explore_s:7.2f}{note}",
            flush=True,
        )


if __name__ == "__main__":
    main()
