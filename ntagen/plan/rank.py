"""The ranking of plans: which certified plan is the best.

Criteria are compared one after the other, in the order that the user gives. Clearances above
`USEFUL_CLEARANCE_MM` count as equal: among plans that are far enough from all critical regions, the
simpler one is better.

The reserve of a plan is how far the needle may be off it without harm: the least of its depth in
its targets and of its distances to regions, which count more the sooner it passes them. A plan with
much clearance and no depth in the target fails when the needle bends a little less than expected,
and then it is often too late for another one.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, islice
from typing import Final

from ntagen.errors import InputError
from ntagen.plan.actions import Plan
from ntagen.plan.certify import Certificate, certify
from ntagen.scene import Scene
from ntagen.values import dataclass

USEFUL_CLEARANCE_MM: Final = 5.0
"""More clearance is not better: this is twice the error of a needle in a phantom (2 to 3 mm)."""

USEFUL_RESERVE_MM: Final = 4.0
"""More reserve is not better: a needle in a phantom errs about so much in 30 mm."""

MOST_RESERVE_RATIO: Final = 3.0
"""Distances to regions that are near the start count at most this much more."""

_FEW: Final = 1000
"""Fewer plans are certified one after the other: numpy takes a tenth of a second."""

_FEW_WITH_NUMPY: Final = 24
"""The same where numpy is loaded already: making the arrays takes a millisecond."""

_PAGE_PLANS: Final = 4096
"""So many plans are certified together."""

_PAGE_PLANS_IN_TIME: Final = 64
"""So many where regions move: their certificates are made one by one, for 50 ms each, and limits
are looked at after each page."""

DEFAULT_RANKING: Final = ("clearance", "rolls", "length")

PROBABILITY: Final = "probability"
"""The criterion that random runs estimate, in a tissue with chance (`ntagen.plan.chance`)."""

ROBUST_RANKING: Final = ("reserve", "length", "rolls")
"""The usual ranking for needles that do not bend exactly as planned."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A plan with its certificate."""

    plan: Plan
    certificate: Certificate


def reserve_of(certificate: Certificate) -> float:
    """How far the needle may be off a plan without harm, in mm at its end; negative if it fails.

    What is off by 1 mm at the end of a path is off by less before: an error of the direction grows
    with the length. So a distance to a region counts by the length of the path divided by the
    length up to there, at most `MOST_RESERVE_RATIO` times.

    More than `USEFUL_RESERVE_MM` counts as that, and so much less too.
    """
    least_mm = certificate.target_depth_mm
    for one in certificate.clearances:
        nearer = certificate.length_mm / one.at_mm if one.at_mm > 0.0 else MOST_RESERVE_RATIO
        ratio = min(MOST_RESERVE_RATIO, nearer) if one.distance_mm > 0.0 else 1.0
        least_mm = min(least_mm, ratio * one.distance_mm)
    return max(-USEFUL_RESERVE_MM, min(USEFUL_RESERVE_MM, least_mm))


CRITERIA: Final[dict[str, Callable[[Certificate], float]]] = {
    "clearance": lambda one: -min(USEFUL_CLEARANCE_MM, one.critical_clearance_mm),
    "rolls": lambda one: one.roll_count,
    "length": lambda one: one.length_mm,
    "target": lambda one: one.end_distance_mm,
    "reserve": lambda one: -reserve_of(one),
}
"""The criteria; smaller is better. ``target`` is the distance of the end to the target's centre."""

_STEPS_MM: Final = {"clearance": 0.1, "reserve": 0.25}
"""Clearances and reserves are compared in steps of this size: no sensor sees a smaller difference
of clearances, and a roll more costs about one step of the reserve."""


def parse_ranking(text: str) -> tuple[str, ...]:
    """The criteria of a text such as ``clearance,rolls,length``.

    Raises:
        InputError: A criterion is unknown or given twice, or there is none.
    """
    names = tuple(name.strip() for name in text.split(","))
    known = ", ".join(CRITERIA)
    for name in names:
        if name == PROBABILITY:
            raise InputError(
                "plans are ranked by probability by `ntagen plan` only, and before all else\n"
                f"hint: `ntagen plan TASK --rank {PROBABILITY}`, or choose from {known}"
            )
        if name not in CRITERIA:
            raise InputError(f"unknown ranking criterion '{name}'\nhint: choose from {known}")
        if names.count(name) > 1:
            raise InputError(f"ranking criterion '{name}' is given twice\nhint: name each once")
    return names


def split_ranking(text: str) -> tuple[bool, tuple[str, ...]]:
    """Whether a ranking begins with `PROBABILITY`, and its other criteria.

    Without others, the plans whose probability is estimated are those with the most reserve.

    Raises:
        InputError: A criterion is unknown or given twice, or there is none.
    """
    first, _, rest = text.partition(",")
    if first.strip() != PROBABILITY:
        return False, parse_ranking(text)
    return True, parse_ranking(rest) if rest.strip() else ROBUST_RANKING


def certified(
    plans: Iterable[Plan], scene: Scene, ranking: Sequence[str] = DEFAULT_RANKING
) -> tuple[Candidate, ...]:
    """The plans with their certificates, best first, whether they hold or not."""
    return rank(chain.from_iterable(in_pages(plans, scene)), ranking)


def in_pages(plans: Iterable[Plan], scene: Scene) -> Iterator[list[Candidate]]:
    """The plans with their certificates, in their order: one page at a time is computed."""
    rest = iter(plans)
    if scene.breath is not None:
        while page := list(islice(rest, _PAGE_PLANS_IN_TIME)):
            yield [Candidate(plan, certify(plan, scene)) for plan in page]
        return
    is_first = True
    while page := list(islice(rest, _PAGE_PLANS)):
        few = _FEW_WITH_NUMPY if "numpy" in sys.modules else _FEW
        if is_first and len(page) < few:
            yield [Candidate(plan, certify(plan, scene)) for plan in page]
            return
        is_first = False
        from ntagen.plan.certify_many import certify_all

        certificates = certify_all(page, scene)
        yield [Candidate(*one) for one in zip(page, certificates, strict=True)]


def rank(
    candidates: Iterable[Candidate], ranking: Sequence[str] = DEFAULT_RANKING
) -> tuple[Candidate, ...]:
    """The candidates, best first; equal ones in the order of their actions as text."""

    def key(candidate: Candidate) -> tuple[tuple[float, ...], str]:
        places = (place_of(name, candidate.certificate) for name in ranking)
        return tuple(places), str(candidate.plan)

    return tuple(sorted(candidates, key=key))


def place_of(name: str, certificate: Certificate) -> float:
    """The value of a criterion by which plans are ranked: in whole steps if it has them."""
    badness = CRITERIA[name](certificate)
    return round(badness / _STEPS_MM[name]) if name in _STEPS_MM else badness
