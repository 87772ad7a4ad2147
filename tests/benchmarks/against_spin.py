"""Peterson's algorithm without clocks, against SPIN: seconds and bytes of the same states.

    python tests/benchmarks/against_spin.py [--processes 4,5] [--runs 3]

Both programs explore the same transition system, without reductions of orders, in turn: the counts
of states must be the same, or the program ends with 1. SPIN's verifier is compiled as its manual
says for safety (``-O2 -DSAFETY -DNOREDUCE``), once as it is and once with ``-DCOLLAPSE``. ``spin``
and ``gcc`` must be on the PATH.

Seconds are those of the clock, the compilation of both models not counted; the medians are printed.
Bytes of SPIN are what it says that states take, without its hash table; those of the engine are all
that it counts, its tables included.
"""

from __future__ import annotations

import argparse
import json
import re
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import models

PROMELA = """
#define N {processes}
byte level[N];
byte last[N];
active [N] proctype P() {{
    byte rung, other;
outside:
    rung = 1;
claiming:
    level[_pid] = rung;
    d_step {{ last[rung] = _pid; other = 0 }};
looking:
    if
    :: d_step {{ other < N && (other == _pid || level[other] < rung || last[rung] != _pid)
        -> other = other + 1 }}; goto looking
    :: d_step {{ other < N && other != _pid && level[other] >= rung && last[rung] == _pid
        -> other = 0 }}; goto looking
    :: d_step {{ other == N && rung < N - 1 -> rung = rung + 1; other = 0 }}; goto claiming
    :: d_step {{ other == N && rung == N - 1 -> other = 0 }}
    fi;
    if
    :: d_step {{ true -> level[_pid] = 0; rung = 0 }}
    fi;
    goto outside
}}
"""


@dataclass(frozen=True, slots=True)
class Cost:
    """What an exploration took."""

    states: int
    seconds: float
    bytes_of_state: float


def of_spin(verifier: Path) -> Cost:
    """Runs a verifier that SPIN has made."""
    run = subprocess.run(
        [verifier, "-m20000000", "-w24"], capture_output=True, text=True, check=True
    )

    def number(pattern: str) -> float:
        found = re.search(pattern, run.stdout)
        assert found is not None, run.stdout
        return float(found[1])

    states = number(r"(\S+) states, stored")
    seconds = number(r"elapsed time (\S+) seconds")
    # SPIN says hundredths of seconds.
    return Cost(
        int(states), max(seconds, 0.01), number(r"(\S+)\s+actual memory usage") * 2**20 / states
    )


def of_engine(model: Path) -> Cost:
    """Asks this engine."""
    command = [
        sys.executable,
        "-m",
        "ntagen",
        "check",
        str(model),
        "--query",
        "E<> false",
        "--json",
    ]
    run = subprocess.run(command, capture_output=True, text=True, check=False, cwd=model.parent)
    answer = json.loads(run.stdout)
    states = int(answer["stored"])
    return Cost(states, answer["seconds"], answer["peak_bytes"] / states)


def compiled(folder: Path, processes: int, name: str, *options: str) -> Path:
    """A verifier of the model for so many processes."""
    (folder / "model.pml").write_text(PROMELA.format(processes=processes))
    subprocess.run(["spin", "-a", "model.pml"], cwd=folder, check=True)
    flags = ["-O2", "-DSAFETY", "-DNOREDUCE", *options]
    subprocess.run(["gcc", *flags, "-o", name, "pan.c"], cwd=folder, check=True)
    return folder / name


def median(costs: list[Cost]) -> Cost:
    """The run of medium length."""
    seconds = statistics.median_low(cost.seconds for cost in costs)
    return next(cost for cost in costs if cost.seconds == seconds)


def main() -> None:
    """Prints a row for each number of processes and program."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--processes", default="4,5")
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    row = "{:<9} {:<15} {:>10} {:>9} {:>10} {:>7} {:>7}"
    print(row.format("processes", "program", "states", "seconds", "states/s", "bytes", "ratios"))
    agree = True
    for processes in map(int, arguments.processes.split(",")):
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            plain = compiled(folder, processes, "plain")
            collapse = compiled(folder, processes, "collapse", "-DCOLLAPSE")
            model = folder / "model.xta"
            model.write_text(models.peterson(processes))
            programs = {
                "SPIN": partial(of_spin, plain),
                "SPIN -DCOLLAPSE": partial(of_spin, collapse),
                "this engine": partial(of_engine, model),
            }
            rounds = [
                {name: ask() for name, ask in programs.items()} for _ in range(arguments.runs)
            ]
            costs = {name: median([one[name] for one in rounds]) for name in programs}
        first = costs["SPIN"]
        for name, cost in costs.items():
            agree &= cost.states == first.states
            speed, of_first = cost.states / cost.seconds, first.states / first.seconds
            ratios = f"{speed / of_first:.2f} {cost.bytes_of_state / first.bytes_of_state:.2f}"
            seconds, size = f"{cost.seconds:.2f}", f"{cost.bytes_of_state:.0f}"
            print(row.format(processes, name, cost.states, seconds, f"{speed:.0f}", size, ratios))
    sys.exit(0 if agree else 1)


if __name__ == "__main__":
    main()
