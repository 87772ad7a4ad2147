"""Learns a policy around the best plan of a task with chance, and compares both.

The engine learns in the model of `ntagen.render.render_policy`: the tip moves by chance and is seen
with errors, and the policy decides when to roll. Only there, a part of the runs follows the plan
until some push (`IS_LEARNING` in templates/uppaal/policy.c.jinja). Then the policy and the plan
meet the same tissues, which learning has never seen: run 17 has the same factors and errors,
whatever is done. So the difference of each pair of runs counts, and its mean has a narrow interval.

The plan is a candidate, too: if the policy is not better for certain in some tissues, it becomes
silent. What is reported comes from others, so that it is no better than the truth.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import NormalDist, fmean, stdev
from typing import TYPE_CHECKING, Any, Final, Literal

from ntagen.errors import InputError, LimitError, ModelError
from ntagen.plan.actions import Plan
from ntagen.plan.chance import Sampling, actions_of
from ntagen.plan.policy import CONTINUOUS, DISCRETE, WHOLE, Aim, Policy, digest_of, push_mm
from ntagen.render import Around, Seen, render_policy
from ntagen.scene import Scene

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model

WINDOW: Final = 5
"""A roll may come so many pushes before or after its place in the plan; ours."""

SPARE_PUSHES: Final = 3
"""So many pushes more than the plan has are made at most; ours."""

ITERATIONS: Final = 10
"""A policy is learned in so many iterations."""

GUARD_RATIO: Final = 2
"""So many times more tissues than are reported decide whether a policy is kept; ours."""

_INSIDE_RATIO: Final = 0.25
_INSIDE_MM: Final = 0.5
"""The needle stops where the tip is seen so deep in the target: a part of the depth of the target,
but at most so much; ours."""

VALUES: Final[dict[Aim, str]] = {"probability": "is_hit", "miss": "end_miss", "cut": "end_cut"}
"""What a run is worth, by the names of variables in templates/uppaal/policy.c.jinja."""


LEARNED: Final = VALUES | {"probability": "end_loss"}
"""The prices that are learned. Where few random runs arrive, the probability alone tells learning
too little: so failures that are near cost a little less."""


Verdict = Literal["better", "alike", "worse"]


@dataclass(frozen=True, slots=True)
class Mean:
    """A mean and its interval."""

    value: float
    lower: float
    upper: float

    @staticmethod
    def of(values: Sequence[float], risk: float) -> Mean:
        """The mean of the values of runs, with an interval that is right for many runs."""
        mean = fmean(values)
        half = NormalDist().inv_cdf(1.0 - risk / 2.0) * stdev(values) / math.sqrt(len(values))
        return Mean(mean, mean - half, mean + half)


@dataclass(frozen=True, slots=True)
class Comparison:
    """What runs in the same tissues say of a policy and of the plan around which it was learned.

    Attributes:
        plan: The value of the plan, done open loop.
        policy: That of the policy.
        difference: By how much the policy is better; negative if it is worse.
        runs: How many tissues there were.
        confidence: That of each interval.
    """

    plan: Mean
    policy: Mean
    difference: Mean
    runs: int
    confidence: float

    @property
    def verdict(self) -> Verdict:
        """Whether the policy is better or worse; alike if the difference's interval holds 0."""
        if self.difference.lower > 0.0:
            return "better"
        return "worse" if self.difference.upper < 0.0 else "alike"


@dataclass(frozen=True, slots=True)
class Steered:
    """A policy that was learned.

    Attributes:
        policy: The policy; silent if what was learned is not better than the plan.
        plan: The plan around which it was learned: the best of those that were given.
        guard: How what was learned compares with the plan, in the tissues that decide whether it is
            kept.
        aims: For each aim, how the policy compares with the plan in other tissues.
        learning_runs: From how many runs it was learned, with those that judged it.
    """

    policy: Policy
    plan: Plan
    guard: Comparison
    aims: dict[Aim, Comparison]
    learning_runs: int


def steer(
    plans: Sequence[Plan],
    scene: Scene,
    aim: Aim,
    seen: Seen,
    sampling: Sampling,
    listen: Callable[[], None] = lambda: None,
) -> Steered:
    """Learns a policy around the best of some plans.

    Args:
        plans: The plans; at least one.
        scene: The scene, with a stochastic tissue and one target.
        aim: What the plan and the policy are to be the best for.
        seen: How exactly the tip is seen.
        sampling: How runs are made. Learning takes its seed; the runs that decide whether the
            policy is kept take the next one, and those that are reported the one after.
        listen: Is called between two pieces of work, and may raise to end it.

    Raises:
        InputError: The task or the plans are none for a policy.
        LimitError: The engine was stopped.
    """
    around, plan = _best(plans, scene, aim, seen, sampling, listen)
    model = _loaded(scene, around)
    learned = _learned(model.with_constants(IS_LEARNING="true"), around, scene, aim, sampling)
    listen()
    strategy = learned.strategy
    if strategy is None or learned.optimised is None:
        raise ModelError(f"the model of the policy fails: {learned.message}")
    text = strategy.json()
    _keep(model, text)
    guarding = replace(sampling, seed=sampling.seed + 1, runs=GUARD_RATIO * sampling.runs)
    guard = _compared(model, around, scene, guarding, " under Steer")[aim]
    is_kept = guard.verdict == "better"
    listen()
    reported = replace(sampling, seed=sampling.seed + 2)
    aims = _compared(model, around, scene, reported, " under Steer" if is_kept else None)
    values: dict[str, Any] = {name: asdict(one) for name, one in aims.items()}
    around = around if is_kept else replace(around, window=0)
    digest = digest_of(scene, around)
    if is_kept:
        policy = Policy.of(aim, digest, around, json.loads(text), values)
    else:
        policy = Policy.silent(aim, digest, around, values)
    return Steered(policy, plan, guard, aims, learned.optimised.runs)


def around_of(plan: Plan, scene: Scene, seen: Seen) -> Around:
    """How far a policy may deviate from a plan."""
    actions = actions_of(plan, scene)
    depth_mm = scene.targets[-1].shape.depth_mm
    most = int(scene.needle.length_mm / push_mm(scene) + WHOLE)
    return Around(
        actions=actions,
        window=WINDOW,
        most_pushes=min(actions.count(0) + SPARE_PUSHES, most),
        inside_mm=min(_INSIDE_MM, _INSIDE_RATIO * depth_mm),
        seen=seen,
    )


def _best(
    plans: Sequence[Plan],
    scene: Scene,
    aim: Aim,
    seen: Seen,
    sampling: Sampling,
    listen: Callable[[], None],
) -> tuple[Around, Plan]:
    """The best plan with a roll, by the runs that all of them meet."""
    found: list[tuple[float, int]] = []
    arounds = [around_of(plan, scene, seen) for plan in plans]
    for place, around in enumerate(arounds):
        listen()
        if around.rolls:
            runs = _runs(_fixed(_loaded(scene, around)), around, scene, "", sampling)
            found.append((-_sign(aim) * fmean(runs[aim]), place))
    if not found:
        raise InputError(
            "none of the plans has a roll, so there is nothing that a policy could decide\n"
            "hint: drive without a policy"
        )
    place = min(found)[1]
    return arounds[place], plans[place]


def _loaded(scene: Scene, around: Around) -> Model:
    from ntagen import checker

    return checker.load(render_policy(scene, around))


def _fixed(model: Model) -> Model:
    """The model in which the plan itself is done."""
    return model.with_constants(IS_FIXED="true")


def _bound(around: Around, scene: Scene) -> str:
    from ntagen import rules

    dt, _, _ = rules.time_units(scene.limits.step_s, scene.needle.speed_mm_per_s)
    return f"[<={dt * (around.most_pushes + 1)}]"


def _learned(model: Model, around: Around, scene: Scene, aim: Aim, sampling: Sampling) -> Answer:
    """The answer of the query that learns."""
    sees = f"{{{', '.join(DISCRETE)}}} -> {{{', '.join(CONTINUOUS)}}}"
    kind, goal = f"minE({LEARNED[aim]})", "Insertion.Done"
    runs = max(2, sampling.learning_runs // ITERATIONS)
    answer = model.check(
        f"strategy Steer = {kind}{_bound(around, scene)} {sees}: <> {goal}",
        good_runs=runs,
        eval_runs=max(2, runs // 3),
        max_iterations=ITERATIONS,
        reset_no_better=ITERATIONS,
        # What it is worth is estimated below, beside the plan.
        runs=2,
        seed=sampling.seed,
        threads=sampling.threads,
    )
    return _checked(answer)


def _keep(model: Model, strategy: str) -> None:
    """Keeps what was learned under its name in a model without runs that are led."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "steer.json").write_text(strategy, encoding="utf-8")
        query = 'strategy Steer = loadStrategy("steer.json")'
        _checked(model.check(query, folder=Path(folder)))


def _checked(answer: Answer) -> Answer:
    if answer.verdict == "unknown":
        raise LimitError(f"no answer from the engine: stopped by {answer.stop}")
    if answer.verdict == "error":
        raise ModelError(f"the model of the policy fails: {answer.message}")
    return answer


def _runs(
    model: Model, around: Around, scene: Scene, under: str, sampling: Sampling
) -> dict[Aim, list[float]]:
    """What each run comes to, by aim."""
    shown = ", ".join(VALUES.values())
    query = f"simulate {_bound(around, scene)[:-1]}; {sampling.runs}] {{{shown}}}{under}"
    answer = _checked(model.check(query, seed=sampling.seed, threads=sampling.threads))
    return {
        aim: [float(run.values[name][-1]) for run in answer.trajectories]
        for aim, name in VALUES.items()
    }


def _compared(
    model: Model, around: Around, scene: Scene, sampling: Sampling, under: str | None
) -> dict[Aim, Comparison]:
    """How a policy and the plan compare in the same tissues; None is the silent policy."""
    plan = _runs(_fixed(model), around, scene, "", sampling)
    policy = plan if under is None else _runs(model, around, scene, under, sampling)
    risk = sampling.risk
    compared: dict[Aim, Comparison] = {}
    for aim in VALUES:
        pairs = zip(policy[aim], plan[aim], strict=True)
        gains = [_sign(aim) * (one - other) for one, other in pairs]
        compared[aim] = Comparison(
            plan=Mean.of(plan[aim], risk),
            policy=Mean.of(policy[aim], risk),
            difference=Mean.of(gains, risk),
            runs=len(gains),
            confidence=1.0 - risk,
        )
    return compared


def _sign(aim: Aim) -> int:
    """Whether more is better."""
    return 1 if aim == "probability" else -1
