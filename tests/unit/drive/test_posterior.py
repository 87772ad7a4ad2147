"""Strategies against all that the estimate leaves open: their bounds, and what they win against."""

from __future__ import annotations

import math
from dataclasses import asdict, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ntagen.drive.posterior import Promise, bounds_of, promise_of
from ntagen.drive.settings import Settings
from ntagen.needle.estimate import Estimate, Estimator
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.needle.priors import Priors
from ntagen.plan.rank import DEFAULT_RANKING, ROBUST_RANKING
from ntagen.scene import Region, Scene, Tissue, Vector
from tests.oracles import tissue as oracle
from tests.steering import ENTRY, scene, sphere

_Array = NDArray[np.float64]

PRIORS = Priors(curvature_drift=0.05, turn_drift_rad=0.03)
SETTINGS = Settings(ranking=ROBUST_RANKING, priors=PRIORS)
RADIUS_MM = 60.0

# The needle bends towards -z, and passes 2 mm beside the middle if nothing turns it.
EASY = scene(
    sphere("C", "critical", (9.0, -20.0, 0.0), 4.0),
    targets=[sphere("T", "target", (2.0, -40.0, -14.0), 7.0)],
)
ROLLED = scene(targets=[sphere("T", "target", (0.0, -40.0, -1.0), 6.0)])


def estimated(priors: Priors = PRIORS) -> Estimate:
    """That of a needle after 10 mm."""
    estimator = Estimator(ENTRY, RADIUS_MM, priors)
    path = Path(ENTRY)
    for number in range(40):
        path = path.push(RADIUS_MM, 0.25)
        estimator.push(0.25)
        estimator.measure(Measurement(0.25 * number, path.tip.position_mm, 0.0))
    return estimator.estimate()


ESTIMATE = estimated()


def at(where: Scene, estimate: Estimate = ESTIMATE) -> Scene:
    return where.with_needle(estimate.tip, estimate.radius_mm, 10.0)


def promised(where: Scene, **changes: object) -> Promise | None:
    return promise_of(at(where), ESTIMATE, replace(SETTINGS, **changes))  # type: ignore[arg-type]


def check_won(promise: Promise) -> None:
    """Tissues of other code pick corners: all reach the target, with the tip error to spare."""
    tree, where = asdict(promise.tree), promise.scene
    tissue = where.tissue
    picks = oracle.corners(where, np.random.default_rng(1))
    outcome = oracle.simulate(tree, where, 2000, picks)
    assert outcome.safe(tissue.tip_mm).all()
    assert outcome.depth_mm.min() >= tissue.tip_mm


def test_an_easy_task_is_won_by_pushing_on() -> None:
    promise = promised(EASY)
    assert promise is not None
    # What is won without a roll is not played with one.
    assert promise.tree.leaves == 3
    assert promise.tree.roll_rad == 0.0
    assert promise.scene.tissue.roll_rad == 0.0
    assert promise.scene.needle.tip == at(EASY).needle.tip
    check_won(promise)


def test_a_task_that_needs_rolls_is_won_with_answers_to_them() -> None:
    promise = promised(ROLLED)
    assert promise is not None
    assert promise.tree.leaves > 3
    assert promise.scene.tissue.roll_rad > math.radians(2.0)
    check_won(promise)


@pytest.mark.parametrize(
    "lost",
    [
        # Less than what the tissue may do; behind a wall; out of reach.
        scene(targets=[sphere("T", "target", (2.0, -40.0, -14.0), 1.5)]),
        scene(sphere("C", "critical", (0.0, -28.0, -7.0), 6.0), targets=EASY.targets),
        scene(targets=[sphere("T", "target", (40.0, -30.0, 0.0), 7.0)]),
    ],
)
def test_a_game_that_is_lost_promises_nothing(lost: Scene) -> None:
    assert promised(lost) is None


def test_nothing_is_promised_where_it_is_not_wanted_or_means_nothing() -> None:
    assert promised(EASY, guarantee=False) is None
    # Needles that bend exactly as planned.
    assert promised(EASY, ranking=DEFAULT_RANKING) is None
    assert promised(replace(EASY, targets=(EASY.targets[0], EASY.targets[0]))) is None
    assert promised(replace(EASY, tissue=Tissue("adversarial", 0.1, 0.1, 0.1))) is None
    inside = sphere("T", "target", ESTIMATE.tip.position_mm, 5.0)
    assert promised(replace(EASY, targets=(inside,))) is None


def test_margins_of_plans_are_kept() -> None:
    wide = replace(SETTINGS.margins, clearance_mm=20.0)
    assert promised(EASY, margins=wide) is None
    deep = replace(SETTINGS.margins, depth_mm=6.5)
    assert promised(EASY, margins=deep) is None


def test_bounds_grow_with_the_length_and_the_confidence() -> None:
    here = at(EASY)
    near, far = (bounds_of(here, ESTIMATE, SETTINGS, length_mm) for length_mm in (10.0, 30.0))
    assert near.tip_mm < far.tip_mm
    surer = bounds_of(here, ESTIMATE, replace(SETTINGS, accept=0.99), 30.0)
    assert far.tip_mm < surer.tip_mm
    assert far.curvature_ratio < surer.curvature_ratio
    assert far.roll_rad < surer.roll_rad
    # Without rolls there is less that may err, so that the rest gets less.
    none = replace(here, limits=replace(here.limits, max_rolls=0))
    without = bounds_of(none, ESTIMATE, SETTINGS, 30.0)
    assert without.roll_rad == 0.0
    assert without.curvature_ratio < far.curvature_ratio


def drawn(estimate: Estimate, length_mm: float, count: int) -> tuple[_Array, _Array]:
    """Where needles end that the estimate expects, and their mean curvatures, by other code.

    The mean is a logarithm, weighted by how much each place counts for the end.
    """
    ahead, tip = estimate.ahead, estimate.tip
    random = np.random.default_rng(2)
    errors = random.multivariate_normal(np.zeros(len(ahead.covariance)), ahead.covariance, count)
    errors[:, 6:] += ahead.differences
    steps, piece_mm = len(ahead.differences) // 2, 0.1
    poses = oracle.Poses(
        np.array(tip.position_mm) + errors[:, :3],
        *(_turned(errors[:, 3:6], np.array(v)) for v in (tip.heading, tip.bevel)),
    )
    mean, turned_rad = np.zeros(count), np.zeros(count)
    for number in range(round(length_mm / piece_mm)):
        step = min(int((number * piece_mm + 1e-9) / 5.0), steps - 1)
        poses = poses.rolled(errors[:, 6 + steps + step] - turned_rad)
        turned_rad = errors[:, 6 + steps + step]
        poses = poses.pushed(np.exp(errors[:, 6 + step]) / estimate.radius_mm, piece_mm)
        left_mm = length_mm - (number + 0.5) * piece_mm
        mean += errors[:, 6 + step] * 2.0 * left_mm * piece_mm / length_mm**2
    return poses.position, mean


def _turned(rotations: _Array, vector: _Array) -> _Array:
    """A vector after many rotations."""
    angles = np.linalg.norm(rotations, axis=1)[:, None]
    axes = rotations / np.maximum(1e-12, angles)
    along = (axes @ vector)[:, None] * axes
    turned: _Array = np.cos(angles) * vector + np.sin(angles) * np.cross(axes, vector)
    return turned + (1.0 - np.cos(angles)) * along


@pytest.mark.parametrize("length_mm", [12.0, 25.0])
def test_the_bounds_hold_as_often_as_they_say(length_mm: float) -> None:
    priors = Priors(curvature_drift=0.15, turn_drift_rad=0.15)
    estimate = estimated(priors)
    settings = replace(SETTINGS, priors=priors, accept=0.9)
    here = at(EASY, estimate)
    here = replace(here, limits=replace(here.limits, max_rolls=0))
    bounds = bounds_of(here, estimate, settings, length_mm)
    ends, means = drawn(estimate, length_mm, 4000)
    factors = np.array(bounds.factors)
    tip = [np.array([part] * 3) for part in (estimate.tip.position_mm, *_directions(estimate))]
    corners = oracle.Poses(*tip).pushed(factors / estimate.radius_mm, length_mm).position
    off_mm = np.linalg.norm(ends[:, None] - corners, axis=2).min(axis=1)
    within = (np.exp(means) >= factors[0]) & (np.exp(means) <= factors[-1])
    # Never less sure than asked for, and no more than a few times as wide as what is usual.
    assert np.mean(within & (off_mm <= bounds.tip_mm)) >= 0.9
    usual_mm = math.sqrt(np.mean(np.sum((ends - ends.mean(axis=0)) ** 2, axis=1)))
    assert bounds.tip_mm < 4.0 * usual_mm


def _directions(estimate: Estimate) -> tuple[Vector, Vector]:
    return estimate.tip.heading, estimate.tip.bevel


def test_a_region_that_nobody_told_is_no_part_of_it() -> None:
    promise = promised(EASY)
    assert promise is not None
    told = replace(
        EASY, criticals=(*EASY.criticals, Region.ball("W", "critical", (0.0, -28.0, -7.0), 6.0))
    )
    assert promised(told) is None
