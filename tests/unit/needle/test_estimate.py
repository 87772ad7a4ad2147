"""The estimator against the virtual needle: exact without noise, useful with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.needle.estimate import Estimate, Estimator, Priors, pose_from_points
from ntagen.needle.vectors import distance, dot
from ntagen.needle.virtual import Errors, SimulatedClock, VirtualNeedle
from ntagen.scene import Needle, Pose
from tests.steering import ENTRY

Moves = list[tuple[str, float]]

INITIAL: Moves = [("push", 5.0)]
ROLLED: Moves = [("push", 14.0), ("roll", math.pi), ("push", 10.0)]
PULLED: Moves = [
    *ROLLED,
    ("pull", 12.0),
    ("roll", -math.pi),
    ("push", 3.0),
    ("roll", 1.57),
    ("push", 6.0),
]


def driven(
    moves: Moves,
    errors: Errors,
    seed: int = 1,
    true_needle: Needle | None = None,
    priors: Priors | None = None,
) -> tuple[Estimate, Pose]:
    """The estimate after these moves, measured every 0.25 mm of a push, and the true pose."""
    needle = VirtualNeedle(
        true_needle or Needle(ENTRY, 30.0, 1.0), (), errors, seed, SimulatedClock()
    )
    estimator = Estimator(ENTRY, 30.0, priors or Priors())
    for kind, value in moves:
        steps = round(value / 0.25) if kind == "push" else 1
        for _ in range(steps):
            getattr(needle, kind)(value / steps)
            getattr(estimator, kind)(value / steps)
            if kind == "push":
                estimator.measure(needle.measure())
    return estimator.estimate(), needle.true_tip


def check_pose(estimate: Estimate, true: Pose, position_mm: float, angle_rad: float) -> None:
    tip = estimate.tip
    assert distance(tip.position_mm, true.position_mm) <= position_mm
    assert math.acos(min(1.0, dot(tip.heading, true.heading))) <= angle_rad
    assert math.acos(min(1.0, dot(tip.bevel, true.bevel))) <= angle_rad


@pytest.mark.parametrize("moves", [INITIAL, ROLLED, PULLED, [], [("roll", 1.0)]])
def test_without_errors_the_estimate_is_the_truth(moves: Moves) -> None:
    estimate, true = driven(moves, Errors())
    check_pose(estimate, true, 1e-6, 1e-6)
    assert estimate.radius_mm == pytest.approx(30.0, rel=1e-6)


@pytest.mark.parametrize("moves", [INITIAL, ROLLED, PULLED])
@pytest.mark.parametrize("seed", range(5))
def test_noise_leaves_the_estimate_near_the_truth(moves: Moves, seed: int) -> None:
    estimate, true = driven(moves, Errors(noise_mm=0.1), seed)
    check_pose(estimate, true, 0.15, math.radians(2.5))
    assert estimate.radius_mm == pytest.approx(30.0, rel=0.1)


def test_a_wrong_radius_is_learned_on_the_way() -> None:
    true_needle = Needle(ENTRY, 36.0, 1.0)
    priors = Priors(curvature_ratio=0.3)
    estimate, true = driven(ROLLED, Errors(noise_mm=0.05), 1, true_needle, priors)
    assert estimate.radius_mm == pytest.approx(36.0, abs=3.0 * estimate.radius_std_mm + 0.1)
    check_pose(estimate, true, 0.2, math.radians(3.0))


def test_an_error_of_a_roll_is_seen_in_the_arc_after_it() -> None:
    errors = Errors(noise_mm=0.02, roll_rad=math.radians(8.0))
    priors = Priors(roll_rad=math.radians(8.0), noise_mm=0.02)
    longer: Moves = [("push", 14.0), ("roll", math.pi), ("push", 20.0)]
    for seed in range(5):
        estimate, true = driven(longer, errors, seed, priors=priors)
        check_pose(estimate, true, 0.05, math.radians(1.5))


def test_the_path_of_the_estimate_is_the_channel_that_was_cut() -> None:
    estimate, _ = driven(PULLED, Errors())
    # 14 + 10 - 12 + 3 + 6 mm: what was left beyond the pull is no part of it.
    assert estimate.path.depth_mm == pytest.approx(21.0)


def test_the_same_history_gives_the_same_estimate() -> None:
    first, _ = driven(PULLED, Errors(noise_mm=0.1))
    second, _ = driven(PULLED, Errors(noise_mm=0.1))
    assert first == second


@settings(max_examples=25, deadline=None)
@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("push"), st.floats(0.5, 10.0)),
            st.tuples(st.just("roll"), st.floats(-math.pi, math.pi)),
            st.tuples(st.just("pull"), st.floats(0.5, 15.0)),
        ),
        max_size=8,
    )
)
def test_any_history_without_errors_is_followed_exactly(moves: Moves) -> None:
    estimate, true = driven(moves, Errors())
    check_pose(estimate, true, 1e-5, 1e-5)


def test_points_alone_give_the_pose_of_a_long_arc() -> None:
    needle = VirtualNeedle(Needle(ENTRY, 30.0, 1.0), (), Errors(0.1), 1, SimulatedClock())
    points = []
    for _ in range(80):
        needle.push(0.25)
        points.append(needle.measure().position_mm)
    pose, radius_mm = pose_from_points(np.array(points), 0.1)
    assert radius_mm == pytest.approx(30.0, abs=3.0)
    assert dot(pose.heading, needle.true_tip.heading) > math.cos(math.radians(3.0))
