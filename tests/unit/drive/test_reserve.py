"""Whether a plan has enough reserve, and whether the tip is surely in a target."""

from __future__ import annotations

import pytest

from ntagen.drive.prospect import is_enough, is_surely_in
from ntagen.needle.estimate import Estimate, Estimator, Priors
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.plan.certify import Arrival, Certificate, Clearance
from tests.steering import PAPER, sphere

DRIFTING = Priors(curvature_drift=0.2, turn_drift_rad=0.2)


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    """That of a needle that drifts, after 10 mm."""
    needle = PAPER.needle
    estimator = Estimator(needle.tip, needle.radius_mm, DRIFTING)
    path = Path(needle.tip)
    for number in range(40):
        path = path.push(needle.radius_mm, 0.25)
        estimator.push(0.25)
        estimator.measure(Measurement(0.25 * number, path.tip.position_mm, 0.0))
    return estimator.estimate()


def passing(distance_mm: float, at_mm: float, depth_mm: float) -> Certificate:
    """A certificate of a path of 30 mm."""
    return Certificate(
        clearances=(Clearance("C", "critical", distance_mm, at_mm),),
        arrivals=(Arrival("T", 28.0, depth_mm),),
        end_mm=(0.0, -40.0, 0.0),
        end_distance_mm=5.0,
        length_mm=30.0,
        roll_count=0,
    )


def test_a_plan_needs_as_much_reserve_as_the_estimator_may_err(estimate: Estimate) -> None:
    half_way_mm, end_mm = estimate.position_std_mm(15.0), estimate.position_std_mm(30.0)
    assert half_way_mm < 0.5 * end_mm
    assert is_enough(passing(1.01 * half_way_mm, 15.0, 1.01 * end_mm), estimate)
    assert not is_enough(passing(0.99 * half_way_mm, 15.0, 1.01 * end_mm), estimate)
    assert not is_enough(passing(1.01 * half_way_mm, 15.0, 0.99 * end_mm), estimate)
    # What is enough at one place is little farther on.
    assert not is_enough(passing(1.01 * half_way_mm, 30.0, 1.01 * end_mm), estimate)


def test_no_more_reserve_is_asked_for_than_the_most(estimate: Estimate) -> None:
    least_mm = 0.1
    assert not is_enough(passing(least_mm, 20.0, least_mm), estimate)
    assert is_enough(passing(least_mm, 20.0, least_mm), estimate, least_mm)


def test_a_tip_is_surely_in_a_target_three_standard_deviations_deep(estimate: Estimate) -> None:
    x, y, z = estimate.tip.position_mm
    sure_mm = 3.0 * estimate.position_std_mm(0.0)
    just = sphere("T", "target", (x, y - 5.0, z), 5.0 + 1.01 * sure_mm)
    hardly = sphere("T", "target", (x, y - 5.0, z), 5.0 + 0.99 * sure_mm)
    assert is_surely_in(just, estimate, 0.0)
    assert not is_surely_in(hardly, estimate, 0.0)
    assert not is_surely_in(just, estimate, 2.0 * sure_mm)
