"""The ranking of plans: which certified plan is the best.

Criteria are compared one after the other, in the order that the user gives. Clearances above
`USEFUL_CLEARANCE_MM` count as equal: among plans that are far enough from all critical regions, the
simpler one is better.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from ntagen.errors import InputError
from ntagen.plan.actions import Plan
from ntagen.plan.certify import Certificate, certify
from ntagen.scene import Scene

USEFUL_CLEARANCE_MM: Final = 5.0
"""More clearance is not better: this is twice the error of a needle in a phantom (2 to 3 mm)."""

_CLEARANCE_STEP_MM: Final = 0.1
"""Clearances are compared in steps of this size: no sensor sees a smaller difference."""

DEFAULT_RANKING: Final = ("clearance", "rolls", "length")


@dataclass(frozen=True, slots=True)
class Candidate:
    """A plan with its certificate."""

    plan: Plan
    certificate: Certificate


def _by_clearance(candidate: Candidate) -> float:
    clipped_mm = min(USEFUL_CLEARANCE_MM, candidate.certificate.critical_clearance_mm)
    return -round(clipped_mm / _CLEARANCE_STEP_MM)


def _by_target(candidate: Candidate) -> float:
    return candidate.certificate.end_distance_mm


CRITERIA: Final[dict[str, Callable[[Candidate], float]]] = {
    "clearance": _by_clearance,
    "rolls": lambda candidate: candidate.certificate.roll_count,
    "length": lambda candidate: candidate.certificate.length_mm,
    "target": _by_target,
}
"""The criteria; smaller is better. ``target`` is the distance of the end to the target's centre."""


def parse_ranking(text: str) -> tuple[str, ...]:
    """The criteria of a text such as ``clearance,rolls,length``.

    Raises:
        InputError: A criterion is unknown or given twice, or there is none.
    """
    names = tuple(name.strip() for name in text.split(","))
    known = ", ".join(CRITERIA)
    for name in names:
        if name not in CRITERIA:
            raise InputError(f"unknown ranking criterion '{name}'\nhint: choose from {known}")
        if names.count(name) > 1:
            raise InputError(f"ranking criterion '{name}' is given twice\nhint: name each once")
    return names


def certified(
    plans: Iterable[Plan], scene: Scene, ranking: Sequence[str] = DEFAULT_RANKING
) -> tuple[Candidate, ...]:
    """The plans with their certificates, best first, whether they hold or not."""
    return rank((Candidate(plan, certify(plan, scene)) for plan in plans), ranking)


def rank(
    candidates: Iterable[Candidate], ranking: Sequence[str] = DEFAULT_RANKING
) -> tuple[Candidate, ...]:
    """The candidates, best first; equal ones in the order of their actions as text."""

    def key(candidate: Candidate) -> tuple[tuple[float, ...], str]:
        return tuple(CRITERIA[name](candidate) for name in ranking), str(candidate.plan)

    return tuple(sorted(candidates, key=key))
