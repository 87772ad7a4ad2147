"""Which plan to follow, and whether it has enough reserve for what the estimator does not know.

The driver follows one after whose first part the target can still be reached if it fails.

Plans are ranked by the `Prospects` of the place at which the driver looks at its plan again, and
among those that are alike as before. Beside the plans that the engine has found, those are looked
at that begin with each roll, at once or half way to that place: the engine lists few plans, and
they often begin alike.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from ntagen.drive.settings import Settings
from ntagen.needle.estimate import Estimate
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.certify import Certificate, certify
from ntagen.plan.prospects import Judged, Place, Prospects, first_part
from ntagen.plan.rank import Candidate, rank
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Region, Scene

_MOST_RATIO: Final = 0.5
"""The driver looks at a plan again when half of the way is left, at the latest."""

_STEP: Final = 0.04
"""Prospects are compared in steps of this size: two errors of the end in 48."""


def by_prospect(
    synthesis: Synthesis, estimate: Estimate, settings: Settings, left_s: float
) -> Synthesis:
    """The plans, those with the best prospect first.

    Args:
        synthesis: The plans that were found.
        estimate: What is known of the needle.
        settings: How to drive.
        left_s: The time that is left.
    """
    scene = synthesis.scene
    if not Prospects.suits(scene):
        return synthesis
    judge = _Judge(scene, estimate, settings, left_s)
    candidates = list(synthesis.candidates)
    for plan in judge.wholes(list(_firsts(scene, judge.look_mm))):
        certificate = certify(plan, scene)
        if settings.margins.allow(certificate):
            candidates.append(Candidate(plan, certificate))
    ranked = rank(candidates, synthesis.ranking)
    steps = [-round(prospect / _STEP) for prospect in judge.prospects(ranked)]
    order = sorted(range(len(ranked)), key=lambda index: (steps[index], index))
    return synthesis.with_candidates(ranked[index] for index in order)


def _firsts(scene: Scene, length_mm: float) -> Iterator[Plan]:
    """What a plan may do until the driver looks at it again."""
    for spin in scene.limits.spun_fractions:
        yield Plan.of([Push(length_mm, spin)])
    for before_mm in (0.0, 0.5 * length_mm):
        for angle_rad in scene.limits.roll_angles_rad:
            for spin in scene.limits.spun_fractions:
                then = (Roll(angle_rad), Push(length_mm - before_mm, spin))
                yield Plan.of([Push(before_mm), *then])


class _Judge:
    """The prospects of a scene, each computed once.

    Attributes:
        look_mm: The driver looks at a plan again after this length.
    """

    def __init__(self, scene: Scene, estimate: Estimate, settings: Settings, left_s: float) -> None:
        needle = scene.needle
        straight_mm = math.dist(needle.tip.position_mm, scene.targets[-1].center_mm)
        self.look_mm = min(settings.review_mm, _MOST_RATIO * straight_mm)
        self._scene = scene
        self._prospects = Prospects(scene, settings.margins.depth_mm)
        self._left_mm = min(needle.length_mm, left_s * needle.speed_mm_per_s) - self.look_mm
        covariance = estimate.position_covariance_mm2(straight_mm - self.look_mm)
        noise_mm2 = settings.priors.noise_mm**2 + settings.priors.distortion_mm**2
        self._covariance_mm2 = covariance + noise_mm2 * np.eye(3)
        self._known: dict[Plan, Judged] = {}

    def prospects(self, candidates: Sequence[Candidate]) -> list[float]:
        """The prospect after the first part of each plan."""
        firsts = [first_part(one.plan, self.look_mm) for one in candidates]
        return [one.prospect for one in self._judged(firsts)]

    def wholes(self, firsts: Sequence[Plan]) -> list[Plan]:
        """Plans that begin like these; none for those after which there is no way."""
        return [
            Plan.of([*first.actions, *one.way.actions])
            for first, one in zip(firsts, self._judged(firsts), strict=True)
            if one.way is not None
        ]

    def _judged(self, firsts: Sequence[Plan]) -> list[Judged]:
        # Each is judged once, in the order in which they come.
        new = [one for one in dict.fromkeys(firsts) if one not in self._known]
        if new:
            places = [self._place(one) for one in new]
            judged = self._prospects.judge(places, self._left_mm, self._covariance_mm2)
            self._known.update(zip(new, judged, strict=True))
        return [self._known[one] for one in firsts]

    def _place(self, first: Plan) -> Place:
        """Where the needle is after this."""
        since_mm, spin = math.inf, None
        for action in first.actions:
            if isinstance(action, Push):
                since_mm += action.length_mm
                spin = action.spin
            elif isinstance(action, Roll):
                since_mm, spin = 0.0, None
        return Place(
            first.end(self._scene.needle),
            since_mm,
            self._scene.limits.max_rolls - first.roll_count - first.spin_changes,
            spin,
        )


_SIGMAS: Final = 1.0
"""So many standard deviations of the tip's position are enough reserve."""

_SURE_SIGMAS: Final = 3.0
"""The tip is surely in a target if it is this many standard deviations deep in it."""


def is_enough(certificate: Certificate, estimate: Estimate, most_mm: float = math.inf) -> bool:
    """Whether a plan from the tip has enough reserve, at each region and in the last target.

    The needle will be off its plan by about what the estimator says of a push that long
    (`Estimate.position_std_mm`). A plan whose distances to regions, and whose depth in the last
    target, are not greater than that will probably fail. It may hold now. But when it fails, the
    tip can be at a place from which there is no other plan, and the needle must be pulled back. So
    the driver looks for a better plan early.

    Args:
        certificate: The plan's certificate.
        estimate: The estimate of the tip, or of one that is known as well.
        most_mm: More than this is never needed.
    """

    def needed_mm(length_mm: float) -> float:
        return min(most_mm, _SIGMAS * estimate.position_std_mm(length_mm))

    end_mm = needed_mm(certificate.length_mm)
    if certificate.target_depth_mm < end_mm:
        return False
    return all(
        # A path is never known worse on the way than at its end.
        one.distance_mm >= end_mm or one.distance_mm >= needed_mm(one.at_mm)
        for one in certificate.clearances
    )


def is_surely_in(target: Region, estimate: Estimate, depth_mm: float) -> bool:
    """Whether the tip is surely in a target, and at least this deep."""
    inside_mm = -target.distance_mm(estimate.tip.position_mm)
    return inside_mm >= max(depth_mm, _SURE_SIGMAS * estimate.position_std_mm(0.0))
