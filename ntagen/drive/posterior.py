"""Strategies against all that the estimate leaves open: the run is won whatever the tissue does.

The estimate says how much the needle may still bend more or less than expected, how much rolls may
err, and how far the tip may be off for other reasons: the pose that is not known exactly, a bend
plane that the tissue turns, a curvature that changes on the way. Each of these is bounded so that
all bounds hold together with the confidence that is asked for (`Settings.accept`). Within the
bounds the tissue is an opponent, as in a task with `tissue adversarial`: the engine decides the
game from where the needle is. If it is won, a strategy reaches the target, and touches no known
region, whatever the tissue does within the bounds (`docs/adversary.md`).

The game ends after a number of states and not after a time, so a replay decides the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.drive.settings import Settings
from ntagen.errors import NtagenError
from ntagen.needle.estimate import Estimate
from ntagen.needle.measurement import squared_length_bound
from ntagen.plan.against_tissue import defend
from ntagen.plan.closed_loop import Segment
from ntagen.scene import Scene, Tissue

_MOST_STATES: Final = 20_000
"""A game ends undecided when it has stored so many states: after about a second."""

_LONGEST_RATIO: Final = 1.1
"""Strategies are at most this much longer than the straight way to the middle of the target. The
bounds are for this length."""

_MOST_RATIO: Final = 0.9
"""With a greater error of the curvature nothing is known of the needle."""

_NORMAL: Final = NormalDist()


@dataclass(frozen=True, slots=True)
class Promise:
    """A game that is won.

    Attributes:
        scene: The scene that was played, with the needle where it is, and the bounds as tissue.
        tree: The strategy.
    """

    scene: Scene
    tree: Segment


def bounds_of(scene: Scene, estimate: Estimate, settings: Settings, length_mm: float) -> Tissue:
    """What the tissue may do over the next part of the way, with the confidence that is asked for.

    Args:
        scene: The known scene, with the needle where it is.
        estimate: The estimate of the needle there.
        settings: How to drive.
        length_mm: The length of that part, greater than 0.
    """
    rolls = scene.limits.max_rolls
    risk = (1.0 - settings.accept) / (2 + rolls)
    sigmas = _NORMAL.inv_cdf(1.0 - 0.5 * risk)
    bend = estimate.bend(length_mm)
    curvature_ratio = min(_MOST_RATIO, math.expm1(abs(bend.mean) + sigmas * bend.std))
    # A roll later on errs more, but the needle bends for a shorter way after it.
    middle_mm = estimate.path.depth_mm + 0.5 * length_mm
    roll_rad = sigmas * settings.priors.roll_std_rad(middle_mm) if rolls else 0.0
    off_mm = _length_bound_mm(bend.rest_mm2, risk)
    # The strategy has answers to corners and the middle. What lies between is half a step off.
    between_mm = length_mm**2 / (4.0 * estimate.radius_mm) * (curvature_ratio + roll_rad)
    return Tissue("adversarial", curvature_ratio, roll_rad, off_mm + between_mm)


def _length_bound_mm(moments_mm2: NDArray[np.float64], risk: float) -> float:
    """The length that an error with these second moments passes with this probability.

    Its square has about a chi-square distribution with the same mean and variance (F. E.
    Satterthwaite, "An approximate distribution of estimates of variance components", 1946).
    """
    mean = float(np.trace(moments_mm2))
    squares = float(np.sum(moments_mm2**2))
    if squares <= 0.0:
        return 0.0
    return math.sqrt(squares / mean * squared_length_bound(risk, mean**2 / squares))


def promise_of(
    scene: Scene,
    estimate: Estimate,
    settings: Settings,
    listen: Callable[[], None] = lambda: None,
) -> Promise | None:
    """A strategy that wins from here against all that the estimate leaves open, if there is one.

    Args:
        scene: The known scene, with the needle where it is.
        estimate: The estimate of the needle there.
        settings: How to drive.
        listen: Is called regularly, and raises `KeyboardInterrupt` to end the search.
    """
    target = scene.targets[-1]
    is_static = scene.tissue.kind == "static" and scene.breath is None
    is_played = settings.guarantee and settings.counts_reserve
    if not (is_played and is_static and len(scene.targets) == 1):
        return None
    tip_mm = scene.needle.tip.position_mm
    straight_mm = math.dist(tip_mm, target.center_mm)
    length_mm = min(scene.needle.length_mm, _LONGEST_RATIO * straight_mm)
    if length_mm <= 0.0 or target.distance_mm(tip_mm) <= 0.0:
        return None
    needle = replace(scene.needle, length_mm=length_mm)
    # A strategy that rolls less is better, and its bounds are nearer for the same confidence.
    for rolls in range(scene.limits.max_rolls + 1):
        limits = replace(scene.limits, max_rolls=rolls, spins=())
        shorter = replace(scene, limits=limits, needle=needle)
        bounds = bounds_of(shorter, estimate, settings, length_mm)
        if bounds.tip_mm + settings.margins.depth_mm >= target.shape.depth_mm:
            break
        promise = _played(shorter, bounds, settings, listen)
        if promise is not None:
            return promise
    return None


def _played(
    scene: Scene, bounds: Tissue, settings: Settings, listen: Callable[[], None]
) -> Promise | None:
    """The strategy of one game, if it is won with the margins that plans must have, too."""
    from ntagen.checker import Options

    margins = settings.margins
    harder = replace(scene, tissue=replace(bounds, tip_mm=bounds.tip_mm + margins.depth_mm))
    try:
        found = defend(harder, timeout_s=None, listen=listen, options=Options(states=_MOST_STATES))
    except NtagenError:
        # A game that the model cannot tell says nothing, and the run goes on by plans.
        return None
    if found.tree is None or found.reach is None or not found.holds:
        return None
    kept_mm = max(margins.clearance_mm, margins.detection_mm)
    if found.reach.clearance_mm < bounds.tip_mm + kept_mm:
        return None
    return Promise(harder, found.tree)
