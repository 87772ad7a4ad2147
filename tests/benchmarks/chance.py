"""Whether the engine's estimates of plans agree with open-loop runs of the virtual needle.

    .venv/bin/python tests/benchmarks/chance.py [TASK.nsl…] --runs 8000

A TASK is an environment with `tissue stochastic`, whose best plan is done; without one, the tasks
of `tests/integration/test_chance.py` are. For each number the line has the estimate of the engine,
that of the needle with half of its interval at 95 %, and how many standard errors lie between.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from ntagen.nsl import load, loads
from ntagen.plan.actions import Plan
from ntagen.plan.anytime import best_plans
from ntagen.plan.chance import Sampling, odds_of
from ntagen.plan.rank import ROBUST_RANKING
from ntagen.plan.synthesise import EngineSynthesiser
from ntagen.scene import Scene
from tests.integration.test_chance import CASES
from tests.oracles import open_loop


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tasks", nargs="*", type=Path)
    parser.add_argument("--runs", type=int, default=8000, help="of the virtual needle")
    parser.add_argument("--engine-runs", type=int, default=200_000)
    parser.add_argument("--seed", type=int, default=7)
    given = parser.parse_args()
    tasks = [(path.stem, load(path), None) for path in given.tasks]
    for name, (text, plan) in CASES.items() if not tasks else ():
        tasks.append((name, loads(text), plan))
    for name, scene, plan in tasks:
        compare(name, scene, plan or best_plan(scene), given)


def best_plan(scene: Scene) -> Plan:
    """The plan with the most reserve."""
    engine = EngineSynthesiser(ranking=ROBUST_RANKING)
    *_, best = best_plans(scene, engine, clock=time.monotonic, budget_s=20.0)
    return best.candidates[0].plan


def compare(name: str, scene: Scene, plan: Plan, given: argparse.Namespace) -> None:
    """Prints the numbers of a plan."""
    start = time.monotonic()
    odds = odds_of(plan, scene, Sampling(runs=given.engine_runs, seed=given.seed))
    middle = time.monotonic()
    found = open_loop.runs(plan, scene, given.runs, given.seed)
    rates = given.engine_runs / (middle - start), given.runs / (time.monotonic() - middle)
    print(f"{name}: {plan}")
    print(f"  runs a second: engine {rates[0]:.0f} (three queries), needle {rates[1]:.0f}")
    line("reaches", odds.reach.value, np.array([one.has_reached for one in found], float))
    if odds.touch is not None and odds.clearance_mm is not None:
        clearances = np.array([one.clearance_mm for one in found])
        line("touches", odds.touch.value, (clearances <= 0.0).astype(float))
        line("mean clearance, mm", odds.clearance_mm.value, clearances)


def line(what: str, engine: float, needle: np.ndarray) -> None:
    """Prints one number by both routes."""
    error = float(needle.std()) / math.sqrt(len(needle))
    apart = (float(needle.mean()) - engine) / error if error > 0.0 else 0.0
    print(f"  {what}: {engine:.4f}, needle {needle.mean():.4f} ± {1.96 * error:.4f} ({apart:+.1f})")


if __name__ == "__main__":
    main()
