"""The estimator against the virtual needle: exact without noise, useful with it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.needle.channels import ENTRY as AT_ENTRY
from ntagen.needle.channels import place
from ntagen.needle.estimate import Estimate, Estimator, Priors, _ends
from ntagen.needle.kinematics import bending_axis, orthonormal, push, roll
from ntagen.needle.measurement import Measurement
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import Fluctuation, PhantomParameters, Sensing, Shape
from ntagen.needle.vectors import add, distance, dot, rotate
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

GOLDEN = (
    (0.5770864, -19.5967612, -6.5452369),
    (-0.9800751, -0.1874107, -0.0658034),
    (29.8913690, 0.5387433),
    0.1718099,
)
"""Position, bevel, radius with its standard deviation, and residual of one estimate."""


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


def test_without_drift_the_curvature_is_one_for_all() -> None:
    # Numbers of the estimator with one curvature and numeric derivatives, before it had stretches,
    # when it searched with tolerances of 1e-15. Today's stops within 0.001 standard deviations.
    errors = Errors(noise_mm=0.1, roll_rad=math.radians(1.0))
    estimate, _ = driven(PULLED, errors, seed=3)
    assert estimate.tip.position_mm == pytest.approx(GOLDEN[0], abs=1e-4)
    assert estimate.tip.bevel == pytest.approx(GOLDEN[1], abs=1e-4)
    assert (estimate.radius_mm, estimate.radius_std_mm) == pytest.approx(GOLDEN[2], abs=1e-4)
    assert estimate.rms_mm == pytest.approx(GOLDEN[3], abs=1e-4)


def test_the_derivatives_are_those_of_the_positions() -> None:
    priors = Priors(curvature_drift=0.1, turn_drift_rad=0.1, lag_rad=0.2)
    priors = replace(priors, first_ratio=0.1, bite_mm=0.8)
    estimator = Estimator(ENTRY, 30.0, priors)
    for kind, value in PULLED:
        getattr(estimator, kind)(value)
    generator = np.random.default_rng(1)
    unknowns = generator.normal(size=len(estimator._stds)) * estimator._stds
    entry = orthonormal(ENTRY)

    def ends(values: np.ndarray) -> np.ndarray:
        _, placed = place(estimator._channels, entry, 1.0 / 30.0, values)
        return np.array([part.positions(np.array([7.0]))[0][0] for p in placed for part in p])

    _, placed = place(estimator._channels, entry, 1.0 / 30.0, unknowns)
    exact = np.array([part.positions(np.array([7.0]))[1][0] for p in placed for part in p])
    # Stretches begin at 0, 5 and 10 mm; at the roll at 14 mm, at 15 and 20 mm; at the new channel
    # at 12 mm; at the roll at 15 mm, and at 20 mm. The new channel has a bite.
    assert len(unknowns) == 7 + 3 + 9 * 2 + 1
    for index in range(len(unknowns)):
        step = np.zeros(len(unknowns))
        step[index] = 1e-6
        slope = (ends(unknowns + step) - ends(unknowns - step)) / 2e-6
        assert slope == pytest.approx(exact[:, :, index], abs=1e-6)
    assert estimator._channels[0].parent == AT_ENTRY


def test_a_predicted_position_errs_as_much_as_the_estimate_says() -> None:
    """Truths are drawn from the priors; normalised squares have the mean 3 of three coordinates."""
    priors = Priors(roll_rad=math.radians(3.0))
    generator = np.random.default_rng(4)
    for length_mm in (0.0, 20.0):
        squares = []
        for seed in range(60):
            spread = generator.normal(size=7)
            heading, bevel = ENTRY.heading, ENTRY.bevel
            stds = (priors.bevel_rad, priors.heading_rad, priors.heading_rad)
            axes = (ENTRY.heading, ENTRY.bevel, bending_axis(ENTRY))
            for axis, angle in zip(axes, spread[3:6] * stds, strict=True):
                heading, bevel = rotate(heading, axis, angle), rotate(bevel, axis, angle)
            x, y, z = (priors.position_mm * float(value) for value in spread[:3])
            start = Pose(add(ENTRY.position_mm, (x, y, z)), heading, bevel)
            radius_mm = 30.0 / math.exp(priors.curvature_ratio * spread[6])
            errors = Errors(priors.noise_mm, priors.roll_rad)
            estimate, true = driven(
                ROLLED, errors, seed, Needle(orthonormal(start), radius_mm, 1.0), priors
            )
            guess = push(estimate.tip, estimate.radius_mm, length_mm).position_mm
            error = np.subtract(push(true, radius_mm, length_mm).position_mm, guess)
            covariance = estimate.position_covariance_mm2(length_mm)
            squares.append(error @ np.linalg.solve(covariance, error))
            largest = np.linalg.eigvalsh(covariance)[-1]
            assert estimate.position_std_mm(length_mm) == pytest.approx(math.sqrt(largest))
        # Four standard deviations of the mean of 60 chi-squares with three degrees of freedom.
        assert np.mean(squares) == pytest.approx(3.0, abs=4.0 * math.sqrt(6.0 / 60.0))


def test_drift_makes_predictions_less_certain() -> None:
    still, _ = driven(ROLLED, Errors(noise_mm=0.1))
    drifting = Priors(curvature_drift=0.1, turn_drift_rad=math.radians(5.0))
    moving, _ = driven(ROLLED, Errors(noise_mm=0.1), priors=drifting)
    for length_mm in (5.0, 20.0):
        assert moving.position_std_mm(length_mm) > 1.5 * still.position_std_mm(length_mm)


def test_a_curvature_that_changes_on_the_way_is_followed() -> None:
    """A needle that bends 1.5 times as much from 20 mm on, as in another layer."""
    tip = ENTRY
    memories = [
        Estimator(ENTRY, 30.0, Priors(noise_mm=0.02)),
        Estimator(ENTRY, 30.0, Priors(noise_mm=0.02, curvature_drift=0.2)),
    ]
    for step in range(160):
        tip = push(tip, 30.0 if step < 80 else 20.0, 0.25)
        for estimator in memories:
            estimator.push(0.25)
            estimator.measure(Measurement(0.0, tip.position_mm, 0.0))
    estimates = [estimator.estimate() for estimator in memories]
    long, short = (abs(estimate.path.arcs[-1].radius_mm - 20.0) for estimate in estimates)
    assert short < 1.0 < 2.0 < long
    # A part of the change may pass.
    assert 20.5 < estimates[1].radius_mm < 29.5
    assert distance(memories[1].estimate().tip.position_mm, tip.position_mm) < 0.02


def test_a_roll_deep_in_the_tissue_is_less_certain() -> None:
    priors = Priors(roll_rad=0.01, lag_rad=0.5)
    assert priors.roll_std_rad(0.0) == 0.01
    assert priors.roll_std_rad(50.0) == pytest.approx(math.hypot(0.01, 0.125))


def test_an_error_shared_by_measurements_is_not_averaged_away() -> None:
    """A hundred measurements with one offset tell about the place as much as one of them."""
    stds = {}
    for distortion_mm in (0.0, 0.1):
        estimator = Estimator(
            ENTRY, 30.0, Priors(noise_mm=0.1, position_mm=10.0, distortion_mm=distortion_mm)
        )
        for _ in range(100):
            estimator.measure(Measurement(0.0, ENTRY.position_mm, 0.0))
        stds[distortion_mm] = estimator.estimate().position_std_mm(0.0)
    assert stds[0.0] == pytest.approx(0.01, rel=0.01)
    assert stds[0.1] == pytest.approx(math.hypot(0.01, 0.1), rel=0.01)


def watched(parameters: PhantomParameters, priors: Priors, seed: int) -> tuple[Estimate, Pose]:
    """What a tracker of directions tells of a phantom, and the truth."""
    needle = Needle(ENTRY, 30.0, 1.0)
    device = PhantomNeedle(needle, (), seed, SimulatedClock(), parameters, reports_pose=True)
    estimator = Estimator(ENTRY, 30.0, priors)
    for _ in range(120):
        device.push(0.25)
        estimator.push(0.25)
        estimator.measure(device.measure())
    return estimator.estimate(), device.true_tip


def test_a_tracker_that_sees_the_bevel_does_not_see_the_bend_plane() -> None:
    """The tissue turns the bend plane by half a radian on 30 mm, and the bevel by nothing."""
    none = Fluctuation(0.0, 30.0, 0.2)
    parameters = PhantomParameters(
        shape=Shape(0.0, none, 0.0, 10.0, math.radians(1.0), none),
        sensing=Sensing(0.02, none, 0.0, latency_s=0.0, lost_ratio=0.0),
    )
    for seed in range(3):
        estimate, true = watched(parameters, Priors(noise_mm=0.02, turn_drift_rad=0.2), seed)
        check_pose(estimate, true, 0.05, math.radians(10.0))
        assert estimate.radius_mm == pytest.approx(30.0, rel=0.05)


def test_what_a_channel_bends_less_at_its_beginning_is_expected() -> None:
    """And shows in the new channel, not in its roll or in the curvature."""
    estimator = Estimator(ENTRY, 30.0, Priors(noise_mm=0.02, bite_mm=0.8))
    tip = ENTRY
    for kind, value in (("push", 20.0), ("pull", 10.0), ("roll", math.pi), ("push", 15.0)):
        if kind != "push":
            getattr(estimator, kind)(value)
            tip = push(tip, 30.0, -value) if kind == "pull" else roll(tip, value)
            continue
        for step in range(round(value / 0.25)):
            bites = estimator.depth_mm < 12.0 and value < 20.0
            tip = push(tip, 50.0 if bites else 30.0, 0.25)
            estimator.push(0.25)
            estimator.measure(Measurement(float(step), tip.position_mm, 0.0))
    estimate = estimator.estimate()
    check_pose(estimate, tip, 0.02, math.radians(0.3))
    assert estimate.radius_mm == pytest.approx(30.0, rel=0.01)


def test_a_measurement_counts_where_the_tip_was() -> None:
    estimator = Estimator(ENTRY, 30.0, Priors(noise_mm=0.02))
    estimator.push(10.0)
    for depth_mm in (9.8, 10.0):
        tip_mm = push(ENTRY, 30.0, depth_mm).position_mm
        estimator.measure(Measurement(0.0, tip_mm, 0.0), depth_mm)
    estimator.pull(4.0)
    for depth_mm in (7.0, 6.0):
        tip_mm = push(ENTRY, 30.0, depth_mm).position_mm
        estimator.measure(Measurement(0.0, tip_mm, 0.0), depth_mm)
    assert estimator.estimate().rms_mm < 1e-6


def test_a_predicted_position_is_right_to_second_order() -> None:
    """Against many needles whose errors are drawn from what the estimate says."""
    priors = Priors(curvature_drift=0.15, turn_drift_rad=math.radians(10.0))
    estimate, _ = driven(ROLLED, Errors(noise_mm=0.1), priors=priors)
    ahead, steps = estimate.ahead, len(estimate.ahead.differences) // 2
    drawn = np.random.default_rng(1).multivariate_normal(
        np.concatenate([np.zeros(6), ahead.differences]), ahead.covariance, 4000, method="eigh"
    )
    # 30 mm are six steps.
    used = np.r_[0:12, 6 + steps : 12 + steps]
    ends = _ends(estimate.tip, estimate.radius_mm, 30.0, drawn[:, used])
    off_mm = ends - np.array(push(estimate.tip, estimate.radius_mm, 30.0).position_mm)
    stated = np.linalg.eigvalsh(estimate.position_covariance_mm2(30.0))
    seen = np.linalg.eigvalsh(off_mm.T @ off_mm / len(off_mm))
    assert np.sqrt(stated) == pytest.approx(np.sqrt(seen), rel=0.1)
