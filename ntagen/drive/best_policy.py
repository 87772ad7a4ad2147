"""The best policy for a task: plans are found, and a policy is learned around the best of them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from ntagen.drive.configure import configure
from ntagen.drive.settings import Settings, engine_for
from ntagen.errors import InputError
from ntagen.nsl import Task
from ntagen.plan.anytime import Best, best_plans
from ntagen.plan.chance import Sampling
from ntagen.plan.policy import Aim
from ntagen.plan.rank import ROBUST_RANKING
from ntagen.plan.steering import Steered, steer
from ntagen.render import Seen
from ntagen.scene import Scene

BUDGET_S: Final = 20.0
"""The search for plans ends after this time, which is enough to end by itself: so the same seed
gives the same policy."""

_PLANS: Final = 10
"""A policy is learned around the best of this number of plans."""

_COMPARED_PART: Final = 10
"""A tenth as many runs as a policy is learned from compare it with the plan."""


def sampling_of(runs: int, seed: int) -> Sampling:
    """How a policy is learned from so many runs, and compared."""
    return Sampling(max(2, runs // _COMPARED_PART), seed, learning_runs=runs)


def best_policy(
    task: Task,
    aim: Aim,
    sampling: Sampling,
    budget_s: float = BUDGET_S,
    listen: Callable[[], None] = lambda: None,
) -> tuple[Best, Steered | None]:
    """Finds the best plans by reserve, and learns a policy around the best of them by runs.

    Args:
        task: The task, with a tissue with chance.
        aim: What the policy is to be the best for.
        sampling: How runs are made.
        budget_s: The time for the search for plans.
        listen: Is called between two pieces of work, and may raise to end it.

    Returns:
        The plans, and what was learned; None if there are no plans.

    Raises:
        InputError: The task is none for a policy.
        LimitError: The engine was stopped.
    """
    scene = task.scene
    if not scene.tissue.is_stochastic:
        raise InputError(
            f"there is nothing to optimise in a tissue that is {scene.tissue.kind}\n"
            "hint: write `tissue stochastic`, with its spreads if you know them"
        )
    settings = configure(task.given, scene).settings
    engine = replace(engine_for(settings), ranking=ROBUST_RANKING)
    *_, best = best_plans(scene, engine, clock=time.monotonic, count=_PLANS, budget_s=budget_s)
    if best.verdict != "found":
        return best, None
    plans = [one.plan for one in best.candidates]
    return best, steer(plans, scene, aim, seen_by(settings, scene), sampling, listen)


def seen_by(settings: Settings, scene: Scene) -> Seen:
    """How exactly the driver knows the tip when it asks a policy.

    Of the bevel it knows no more than what the last roll may have erred.
    """
    priors = settings.priors
    bevel_rad = math.hypot(priors.bevel_rad, scene.tissue.roll_rad)
    return Seen(priors.noise_mm, priors.heading_rad, bevel_rad)
