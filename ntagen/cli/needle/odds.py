"""What `ntagen plan` says of plans in a tissue with chance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.options import gathered
from ntagen.cli.terminal import say_idle
from ntagen.errors import InputError
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Estimate
    from ntagen.plan.chance import Odds, Rated
    from ntagen.plan.rank import Candidate
    from ntagen.scene import Scene

_OPTIONS: Final = {"runs": "--runs", "seed": "--seed"}

_AMONG: Final = 10
"""How many plans are ranked by their probability, if only the best is wanted."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is to be known of plans.

    Attributes:
        runs: How many are made of each; None for as many as are usual.
        seed: That of the runs.
        by_odds: Whether plans are ranked by their probability.
        is_random: Whether runs are made.
        shown: How many plans are shown.
    """

    runs: int | None
    seed: int
    by_odds: bool = False
    is_random: bool = False
    shown: int = 1

    @property
    def looked_for(self) -> int:
        """How many plans are looked for; of all of them runs are made."""
        return _AMONG if self.by_odds and self.shown == 1 else self.shown

    def checked(self, scene: Scene, count: int, *, by_odds: bool) -> Wanted:
        """The same for a scene, of which `count` plans are to be shown.

        Raises:
            InputError: Plans are to be ranked by probability, and the tissue has no chance.
        """
        is_random = scene.tissue.is_stochastic
        if by_odds and not is_random:
            raise InputError(
                f"plans have no probability in a tissue that is {scene.tissue.kind}\n"
                "hint: write `tissue stochastic`, with its spreads if you know them"
            )
        if not is_random:
            say_idle(_OPTIONS, f"in a tissue that is {scene.tissue.kind}")
        return replace(self, by_odds=by_odds, is_random=is_random, shown=count)


odds_options = gathered(
    "wanted",
    {
        "runs": click.option(
            "--runs",
            metavar="N",
            default=None,
            type=click.IntRange(min=2),
            help="With tissue stochastic: how many random runs are made of each plan; with "
            "--optimise: from how many a policy is learned, and a tenth as many compare it.  "
            "[default: 2000; with --optimise: 100000]",
        ),
        "seed": click.option(
            "--seed",
            metavar="N",
            default=0,
            show_default=True,
            type=click.IntRange(min=0),
            help="With tissue stochastic: the same seed gives the same runs.",
        ),
    },
    Wanted,
)
"""Adds the options; the command gets their values as `wanted`."""


def rate(candidates: Sequence[Candidate], scene: Scene, wanted: Wanted) -> tuple[Rated, ...]:
    """What runs say of some plans, in the order that is wanted; none if no runs are made."""
    if not wanted.is_random or not candidates:
        return ()
    from ntagen.plan.chance import DEFAULT_RUNS, Sampling, rated

    runs = DEFAULT_RUNS if wanted.runs is None else wanted.runs
    found = rated(candidates, scene, Sampling(runs=runs, seed=wanted.seed))
    if wanted.by_odds:
        return found
    by_plan = {one.candidate.plan: one for one in found}
    return tuple(by_plan[candidate.plan] for candidate in candidates)


def with_odds(document: dict[str, Any], found: Sequence[Rated]) -> dict[str, Any]:
    """The document of these plans with what runs say of each."""
    if not found:
        return document
    plans = [
        plan | {"chance": _record(one)} for plan, one in zip(document["plans"], found, strict=True)
    ]
    return document | {"plans": plans}


def _record(one: Rated) -> dict[str, Any]:
    odds = one.odds
    estimates = {"reach": odds.reach, "touch": odds.touch, "clearance_mm": odds.clearance_mm}
    named = {name: None if value is None else asdict(value) for name, value in estimates.items()}
    return {**named, "is_apart": one.is_apart}


def odds_lines(found: Sequence[Rated], count: int, *, by_odds: bool) -> Iterator[str]:
    """What runs say of the first plans, for people; if ranked, which may be as good as the best."""
    if not found:
        return
    best = found[0]
    runs, confidence = best.odds.reach.runs, best.odds.reach.confidence
    risk = (1.0 - confidence) * len(found)
    whose = "of the plan" if len(found) == 1 else f"of each of {len(found)} plans"
    held = "each interval holds" if len(found) == 1 else "for all plans together, intervals hold"
    yield f"{runs:,} random runs {whose}, open loop; {held} at {1.0 - risk:.4g} confidence:"
    for place, one in enumerate(found[:count], start=1):
        yield f"  {place:>3}. {one.candidate.plan}"
        yield from (f"       {line}" for line in _facts(one.odds))
        if by_odds and one is not best:
            word = "less likely than" if one.is_apart else "not distinguishable from"
            yield f"       {word} the best"
    rivals = sum(not one.is_apart for one in found[count:])
    if by_odds and rivals:
        plans = "1 plan more is" if rivals == 1 else f"{rivals} plans more are"
        yield f"{plans} not distinguishable from the best: --best shows them"


def _facts(odds: Odds) -> Iterator[str]:
    if odds.touch is None or odds.clearance_mm is None:
        yield f"reaches the target: {_percent(odds.reach)}"
        return
    yield f"reaches the target, and touches nothing: {_percent(odds.reach)}"
    yield f"touches a critical region: {_percent(odds.touch)}"
    yield f"comes to one as near as: {_span(odds.clearance_mm, 1.0, ' mm')} in the mean"


def _percent(estimate: Estimate) -> str:
    return _span(estimate, 100.0, " %")


def _span(estimate: Estimate, scale: float, unit: str) -> str:
    """A value and its interval."""
    if estimate.lower is None or estimate.upper is None:
        return f"{scale * estimate.value:.4g}{unit}"
    low, high = scale * estimate.lower, scale * estimate.upper
    return f"{scale * estimate.value:.4g}{unit} (from {low:.4g} to {high:.4g}{unit})"
