"""How fast a strategy is learned: moves a second while learning, beside those of random runs.

    python tests/benchmarks/learning.py [--repetitions 3] [--only moods]

Three models whose runs all have the same number of moves: a controller that chooses after each of
100 moves of the environment, one that waits as long as it likes, 20 times, and a pump that fills a
tank, whose level is a differential equation. Of each, `ntagen check` learns a strategy on one
thread. Its seconds are those of the whole query: runs to learn from, runs that judge each
iteration, the values of all actions, and fresh runs for the answer. Random runs of the same model
are the yardstick: the engine makes them in the same process, without a decision to remember. They
and learning take turns; the best of the repetitions counts.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

RANDOM_RUNS = 100_000
TABLE = "{:<8} {:>16} {:>12} {:>20} {:>7}"


@dataclass(frozen=True, slots=True)
class Task:
    """A model, what is learned, until when runs go, and how many moves each has."""

    name: str
    model: str
    features: str
    bound: str
    moves: int


TASKS = (
    Task(
        "moods",
        """
        int[0, 3] mood; int left = 50; double cost; clock t;
        process Agent() {
          state Rest { t <= 2 }, Choose, Done;
          commit Choose;
          init Rest;
          trans Rest -u-> Choose { select m : int[0, 3]; guard t >= 1 && left > 0;
                                   assign mood = m, left--; },
                Choose -> Rest { assign cost = cost + mood + t, t = 0; },
                Choose -> Rest { assign cost = cost + 4 - mood, t = 0; },
                Rest -u-> Done { guard t >= 1 && left == 0; };
        }
        system Agent;
        """,
        "{mood} -> {t}",
        "150",
        101,
    ),
    Task(
        "waits",
        """
        int left = 20; double cost; clock x;
        double price() { return x + 4 * exp(-x); }
        process Agent() {
          state Inside { x <= 5 }, Done;
          init Inside;
          trans Inside -> Inside { guard left > 1; assign cost = cost + price(), x = 0, left--; },
                Inside -> Done { guard left == 1; assign cost = cost + price(), left--; };
        }
        system Agent;
        """,
        "{left} -> {x}",
        "101",
        20,
    ),
    Task(
        "tank",
        """
        int left = 50; double cost; clock t, level = 3.0; double flow;
        process Agent() {
          state Rest { t <= 1 && level' == flow - 0.2 * level }, Choose, Done { level' == 0 };
          commit Choose;
          init Rest;
          trans Rest -u-> Choose { guard t >= 1 && left > 0;
                                   assign cost = cost + fabs(level - 2.0),
                                          flow = random(1.0) - 0.5; },
                Choose -> Rest { assign left--, t = 0; },
                Choose -> Rest { assign flow = flow + 0.8, left--, t = 0; },
                Rest -u-> Done { guard t >= 1 && left == 0; };
        }
        system Agent;
        """,
        "{} -> {level}",
        "52",
        101,
    ),
)


@dataclass(frozen=True, slots=True)
class Measured:
    """Moves a second while learning and in random runs, and what both are worth."""

    learning: float
    random: float
    value: float
    uniform: float


def measure(task: Task, seed: int) -> Measured:
    """Learns, and makes random runs."""
    queries = (
        f"strategy Best = minE(cost)[<={task.bound}]{task.features}: <> Agent.Done\n"
        f"E[<={task.bound}; {RANDOM_RUNS}](max: cost)\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        model, asked = Path(folder) / "model.xta", Path(folder) / "model.q"
        model.write_text(task.model, encoding="utf-8")
        asked.write_text(queries, encoding="utf-8")
        command = [sys.executable, "-m", "ntagen", "check", str(model), str(asked), "--json"]
        said = subprocess.run(
            [*command, "--threads", "1", "--seed", str(seed)],
            capture_output=True,
            text=True,
            check=True,
        )
    learned, random = (json.loads(line) for line in said.stdout.splitlines())
    # The answer comes from fresh runs under the strategy, and from as many that choose uniformly.
    made = learned["learning_runs"] + 2 * learned["runs"]
    return Measured(
        made * task.moves / learned["seconds"],
        random["runs"] * task.moves / random["seconds"],
        learned["value"],
        random["value"],
    )


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--only", choices=[task.name for task in TASKS])
    given = parser.parse_args()
    print(TABLE.format("model", "learned", "M moves/s", "random, M moves/s", "ratio"))
    for task in TASKS:
        if given.only not in (None, task.name):
            continue
        all_measured = [measure(task, seed=1) for _ in range(given.repetitions)]
        learning = max(one.learning for one in all_measured)
        random = max(one.random for one in all_measured)
        first = all_measured[0]
        value = f"{first.value:.2f} < {first.uniform:.2f}"
        figures = f"{learning / 1e6:.2f}", f"{random / 1e6:.2f}", f"{learning / random:.2f}"
        print(TABLE.format(task.name, value, *figures))


if __name__ == "__main__":
    main()
