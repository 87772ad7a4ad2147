"""The circle fit: exact on exact points, unbiased on short noisy arcs, helped by a prior."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from ntagen.needle.circle import CurvaturePrior, fit_circle
from ntagen.needle.kinematics import Arc, circle_center
from ntagen.needle.vectors import distance
from ntagen.scene import Pose
from tests.steering import ENTRY
from tests.unit.needle.test_kinematics import poses


def points_on(arc: Arc, count: int) -> NDArray[np.float64]:
    lengths = np.linspace(0.0, arc.length_mm, count)
    return np.array([arc.pose_at(s).position_mm for s in lengths])


@given(poses(), st.floats(10.0, 300.0), st.floats(0.3, 5.0), st.integers(3, 40))
def test_exact_points_give_the_circle_and_the_pose(
    pose: Pose, radius_mm: float, turn_rad: float, count: int
) -> None:
    arc = Arc(pose, radius_mm, turn_rad * radius_mm)
    fit = fit_circle(points_on(arc, count))
    assert fit.radius_mm == pytest.approx(radius_mm, rel=1e-5)
    assert distance(fit.center_mm, circle_center(pose, radius_mm)) < 1e-4 * radius_mm
    if turn_rad / (count - 1) < 3.0:
        found = fit.pose_at(arc.end.position_mm)
        assert distance(found.heading, arc.end.heading) < 1e-4
        assert distance(found.bevel, arc.end.bevel) < 1e-4
    assert fit.rms_mm < 1e-5 * radius_mm


def test_points_on_a_line_give_a_huge_radius() -> None:
    fit = fit_circle(np.array([[0.0, -s, 0.0] for s in range(10)]))
    assert fit.radius_mm > 1e6
    assert fit.pose_at((0.0, -9.0, 0.0)).heading == pytest.approx((0.0, -1.0, 0.0), abs=1e-5)


@pytest.mark.parametrize("noise_mm", [0.1, 0.3])
def test_an_arc_of_20_mm_is_fitted_without_bias(noise_mm: float) -> None:
    random = np.random.default_rng(1)
    points = points_on(Arc(ENTRY, 30.0, 20.0), 41)
    fits = [fit_circle(points + random.normal(0.0, noise_mm, points.shape)) for _ in range(200)]
    median = np.median([fit.radius_mm for fit in fits])
    assert median == pytest.approx(30.0, rel=0.03)


def test_deviation_of_the_curvature_is_the_one_observed() -> None:
    random = np.random.default_rng(2)
    points = points_on(Arc(ENTRY, 30.0, 20.0), 41)
    fits = [fit_circle(points + random.normal(0.0, 0.1, points.shape)) for _ in range(300)]
    observed = np.std([fit.curvature_per_mm for fit in fits])
    assert np.median([fit.curvature_std_per_mm for fit in fits]) == pytest.approx(observed, rel=0.2)


def test_a_prior_holds_the_radius_on_a_short_arc_where_a_free_fit_fails() -> None:
    random = np.random.default_rng(3)
    points = points_on(Arc(ENTRY, 30.0, 5.0), 21)
    prior = CurvaturePrior(mean_per_mm=1 / 30, std_per_mm=0.1 / 30)
    noisy = [points + random.normal(0.0, 0.1, points.shape) for _ in range(100)]
    errors = [abs(fit_circle(p, 0.1, prior).radius_mm - 30.0) for p in noisy]
    free = [abs(fit_circle(p, 0.1).radius_mm - 30.0) for p in noisy]
    assert max(errors) < 4.0
    assert np.median(free) > 4.0


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((2, 3)),
        np.zeros((5, 3)),
        np.zeros((5, 2)),
        np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [np.nan, 0.0, 0.0]]),
    ],
)
def test_points_without_a_circle_are_refused(points: NDArray[np.float64]) -> None:
    with pytest.raises(ValueError, match=r"point|circle"):
        fit_circle(points)
