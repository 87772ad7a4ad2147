"""What random runs say of plans in a tissue with chance: `tissue stochastic`.

A plan is done open loop: nothing is measured on the way, and nothing is corrected. The model of a
plan (`ntagen.render.render_plan`) moves the true tip, and the engine makes runs of it.

Plans are compared on the same runs: a run of one number has the same tissue in each segment,
whatever the plan. Their intervals hold together, with the confidence that is stated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from ntagen.errors import InputError, LimitError, ModelError
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.extract import step_length_mm
from ntagen.plan.rank import Candidate
from ntagen.scene import Scene
from ntagen.units import deg_from_rad

if TYPE_CHECKING:
    from ntagen.checker import Estimate

DEFAULT_RUNS: Final = 2000
"""The half-width of the interval of a probability is then at most 2.3 %."""

_WHOLE: Final = 1e-6
"""Pushes are whole steps and rolls whole degrees, up to rounding."""


@dataclass(frozen=True, slots=True)
class Sampling:
    """How runs are made.

    Attributes:
        runs: How many for each plan.
        seed: The same seed gives the same runs.
        risk: The risk that any of the intervals misses.
        threads: They share the runs; results do not depend on their number.
        learning_runs: From how many runs a policy is learned.
    """

    runs: int = DEFAULT_RUNS
    seed: int = 0
    risk: float = 0.05
    threads: int | Literal["all"] = "all"
    learning_runs: int = 100_000


@dataclass(frozen=True, slots=True)
class Odds:
    """What runs say of a plan.

    Attributes:
        reach: The probability that the true tip ends in the last target, was in those before, and
            has touched no critical or unexplored region.
        touch: The probability that it touches one; None if there are none.
        clearance_mm: The mean of its least distance from them; None if there are none.
    """

    reach: Estimate
    touch: Estimate | None
    clearance_mm: Estimate | None


@dataclass(frozen=True, slots=True)
class Rated:
    """A plan with what runs say of it.

    Attributes:
        candidate: The plan and its certificate.
        odds: What runs say of it.
        is_apart: Whether the interval of `Odds.reach` lies below that of the best plan.
    """

    candidate: Candidate
    odds: Odds
    is_apart: bool = False


def odds_of(plan: Plan, scene: Scene, sampling: Sampling | None = None, together: int = 1) -> Odds:
    """What runs say of a plan.

    Args:
        plan: Pushes of whole steps, and rolls by whole degrees.
        scene: The scene, with a stochastic tissue.
        sampling: How runs are made; the usual way if it is None.
        together: The intervals of a kind hold together with those of so many plans.

    Raises:
        InputError: The tissue is another one, or the plan is none of the model.
    """
    from ntagen import checker
    from ntagen.render import render_plan

    sampling = sampling or Sampling()
    model = checker.load(render_plan(scene, actions_of(plan, scene), sampling.runs))
    found: list[Estimate] = []
    for query in model.queries:
        answer = model.check(
            query.text,
            runs=sampling.runs,
            seed=sampling.seed,
            alpha=sampling.risk / together,
            threads=sampling.threads,
        )
        if answer.verdict == "unknown":
            raise LimitError(f"no answer from the engine: stopped by {answer.stop}")
        if answer.estimate is None:
            raise ModelError(f"the model of the plan fails: {answer.message}")
        found.append(answer.estimate)
    reach, *others = found
    touch, clearance_mm = others if others else (None, None)
    return Odds(reach, touch, clearance_mm)


def rated(
    candidates: Sequence[Candidate],
    scene: Scene,
    sampling: Sampling | None = None,
    listen: Callable[[], None] = lambda: None,
) -> tuple[Rated, ...]:
    """The plans with what runs say of them, the most probable first.

    Of plans that are equally probable, the one with more clearance comes first, then the one that
    was given first.

    Args:
        candidates: The plans.
        scene: The scene, with a stochastic tissue.
        sampling: How runs are made; the usual way if it is None.
        listen: Is called before each plan, and may raise to end the work.
    """
    found = []
    for candidate in candidates:
        listen()
        odds = odds_of(candidate.plan, scene, sampling, len(candidates))
        found.append(Rated(candidate, odds))
    found.sort(key=lambda one: (-one.odds.reach.value, -_clearance_mm(one.odds)))
    least = found[0].odds.reach.lower if found else None
    return tuple(Rated(one.candidate, one.odds, _is_below(one.odds, least)) for one in found)


def actions_of(plan: Plan, scene: Scene) -> tuple[int, ...]:
    """A plan as its model has it: 0 is a push of one step, else a roll by that number of degrees.

    Raises:
        InputError: It has a wait, a spin, a part of a step, or a part of a degree.
    """
    step_mm = step_length_mm(scene)
    actions: list[int] = []
    for action in plan.actions:
        if isinstance(action, Push):
            if action.spin:
                raise InputError(
                    f"the plan pushes {action.length_mm:g} mm with a spin, and a tissue with chance"
                    " has none\nhint: leave `spin` out of the task"
                )
            count = action.length_mm / step_mm
            if abs(count - round(count)) > _WHOLE:
                raise InputError(f"a push of {action.length_mm:g} mm is no number of whole steps")
            actions += [0] * round(count)
        elif isinstance(action, Roll):
            angle_deg = deg_from_rad(action.angle_rad)
            whole = round(angle_deg)
            if abs(angle_deg - whole) > _WHOLE or whole == 0:
                raise InputError(f"a roll by {angle_deg:g} deg is none of the model")
            actions.append(whole)
        else:
            raise InputError("a plan with waits is for regions that move, and not for chance")
    return tuple(actions)


def _clearance_mm(odds: Odds) -> float:
    return 0.0 if odds.clearance_mm is None else odds.clearance_mm.value


def _is_below(odds: Odds, least: float | None) -> bool:
    """Whether a plan is less probable than one whose interval begins there."""
    return least is not None and odds.reach.upper is not None and odds.reach.upper < least
