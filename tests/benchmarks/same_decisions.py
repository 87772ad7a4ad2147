"""Whether the way to the needle changes what the driver decides.

    python tests/benchmarks/same_decisions.py [--task FILE] [--seeds N]

The same phantom is driven three times with each seed: directly; with its measurements sent through
OpenIGTLink on this machine; and also behind an emulated stepper controller. The yardstick is the
direct run: the printed share of the others has the same end and the same commands. Steps of a motor
and numbers of 32 bits on the network change lengths a little, so commands may differ by 0.01.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from ntagen.drive.reading import read_log
from ntagen.drive.records import Command

ROOT = Path(__file__).parents[2]
WAYS = {
    "through OpenIGTLink": ["--needle", "phantom", "--tracker", "openigtlink+sim"],
    "behind an emulated controller": ["--needle", "grbl+sim"],
    "both": ["--needle", "grbl+sim", "--tracker", "openigtlink+sim"],
}
SAME = 0.01


def drive(task: Path, seed: int, options: list[str]) -> tuple[str, list[Command]]:
    """The end of a run and its commands."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.mcap"
        command = [sys.executable, "-m", "ntagen", "drive", str(task), "--seed", str(seed)]
        run = subprocess.run(
            [*command, "--json", "--log", str(log), *options],
            capture_output=True,
            text=True,
            check=False,
            cwd=ROOT,
        )
        summary: dict[str, Any] = json.loads(run.stdout)
        commands = [record for record in read_log(log).records if isinstance(record, Command)]
    return summary["outcome"], commands


def are_same(one: list[Command], other: list[Command]) -> bool:
    """Whether two runs have the same commands."""
    return len(one) == len(other) and all(
        a.kind == b.kind and abs(a.value - b.value) <= SAME for a, b in zip(one, other, strict=True)
    )


def main() -> None:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--task", type=Path, default=ROOT / "examples" / "paper.nsl")
    parser.add_argument("--seeds", type=int, default=10)
    options = parser.parse_args()
    same_end, same_commands = dict.fromkeys(WAYS, 0), dict.fromkeys(WAYS, 0)
    for seed in range(1, options.seeds + 1):
        end, commands = drive(options.task, seed, ["--needle", "phantom"])
        for way, words in WAYS.items():
            other_end, other = drive(options.task, seed, words)
            same_end[way] += end == other_end
            same_commands[way] += are_same(commands, other)
    for way in WAYS:
        print(
            f"{way}: {same_end[way]} of {options.seeds} runs end as the direct one, "
            f"{same_commands[way]} of {options.seeds} with the same commands"
        )


if __name__ == "__main__":
    main()
