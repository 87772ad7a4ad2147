"""Whole shapes as measurements: what they tell, how sure the estimate is, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ntagen.errors import DeviceError
from ntagen.needle.estimate import Estimator, Priors
from ntagen.needle.kinematics import Arc, push
from ntagen.needle.measurement import Measurement
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import PhantomParameters
from ntagen.needle.shape import Bounds, Shape, measurement_of, thinned
from ntagen.needle.virtual import SimulatedClock
from ntagen.scene import Needle, Pose
from tests.steering import ENTRY

RADIUS_MM = 60.0
LENGTH_MM = 60.0
NOISE_MM = 0.3
UNKNOWN = Priors(
    position_mm=100.0,
    heading_rad=1.0,
    bevel_rad=1.0,
    curvature_ratio=3.0,
    noise_mm=NOISE_MM,
    shape_spacing_mm=2.0,
)
"""Nothing is known before of where the needle is, and how it bends."""

SEEDS = 40

Places = NDArray[np.float64]


def circle(length_mm: float = LENGTH_MM, spacing_mm: float = 2.0, free_mm: float = 0.0) -> Places:
    """Places on a circle from the entry to the tip, and on a straight line before it."""
    arc = Arc(ENTRY, RADIUS_MM, length_mm)
    at_mm = length_mm - spacing_mm * np.arange(int((length_mm + free_mm) / spacing_mm) + 1)[::-1]
    return np.array(
        [
            arc.position_at(at) if at >= 0.0 else push(ENTRY, math.inf, at).position_mm
            for at in map(float, at_mm)
        ]
    )


def seen(places: Places) -> Measurement:
    return measurement_of(Shape(places, 1.0))


def fisher_std(places: Places) -> float:
    """The least standard deviation of the curvature's logarithm that any estimate can have.

    Cramér and Rao's bound, with derivatives by differences: of each place, what is across the
    circle counts, and of the tip all of it.
    """

    def placed(unknowns: Places) -> Places:
        x, y, z, about_h, about_b, about_s, growth = unknowns
        pose = Pose((0.0, 0.0, 0.0), ENTRY.heading, ENTRY.bevel)
        arc = Arc(pose, RADIUS_MM / math.exp(growth), 1.0)
        found = []
        for at_mm in np.linspace(LENGTH_MM, 0.0, len(places))[::-1]:
            place = np.array(arc.position_at(float(at_mm)))
            h, b = np.array(ENTRY.heading), np.array(ENTRY.bevel)
            turn = about_h * h + about_b * b + about_s * np.cross(b, h)
            found.append(place + np.cross(turn, place) + (x, y, z))
        return np.array(found)

    steps = [(placed(1e-5 * unit) - placed(-1e-5 * unit)) / 2e-5 for unit in np.eye(7)]
    information = np.zeros((7, 7))
    arc = Arc(ENTRY, RADIUS_MM, LENGTH_MM)
    for index in range(len(places)):
        slopes = np.array([step[index] for step in steps]).T
        heading = np.array(arc.pose_at(index * LENGTH_MM / (len(places) - 1)).heading)
        across = np.eye(3) - np.outer(heading, heading)
        kept = np.eye(3) if index == len(places) - 1 else across
        information += slopes.T @ kept @ slopes / NOISE_MM**2
    information += np.diag([1e-4] * 3 + [1.0] * 3 + [1.0 / 9.0])
    return math.sqrt(np.linalg.inv(information)[6, 6])


def test_one_shape_tells_the_curvature_as_well_as_any_estimate_can() -> None:
    """The claimed error is the bound, and the true errors are as the claimed one says."""
    generator, places = np.random.default_rng(1), circle()
    errors, claimed = [], []
    bound = fisher_std(places)
    # The formula of Gluckstern (1963) for places on a line, which knows nothing of a prior.
    per_mm = NOISE_MM / LENGTH_MM**2 * math.sqrt(720.0 / (len(places) + 4.0))
    assert bound == pytest.approx(RADIUS_MM * per_mm, rel=0.15)
    for _ in range(200):
        estimator = Estimator(ENTRY, RADIUS_MM, UNKNOWN)
        estimator.push(LENGTH_MM)
        estimator.measure(seen(places + generator.normal(0.0, NOISE_MM, places.shape)))
        estimate = estimator.estimate()
        claimed.append(estimate.radius_std_mm / estimate.radius_mm)
        errors.append(math.log(RADIUS_MM / estimate.radius_mm))
    assert np.mean(claimed) == pytest.approx(bound, rel=0.02)
    # Four standard deviations of that of 200 errors.
    assert np.std(errors) == pytest.approx(bound, rel=4.0 / math.sqrt(400.0))
    assert abs(np.mean(errors)) < 4.0 * bound / math.sqrt(200.0)


def test_places_that_are_moved_along_the_needle_tell_the_same() -> None:
    """Where along the needle a place of an image lies, nobody knows exactly."""
    places = circle()
    moved = places.copy()
    moved[1:-1] += 0.7 * np.diff(places, axis=0)[1:]
    radii = []
    for one in (places, moved):
        estimator = Estimator(ENTRY, RADIUS_MM, UNKNOWN)
        estimator.push(LENGTH_MM)
        estimator.measure(seen(one))
        radii.append(estimator.estimate().radius_mm)
    assert radii == pytest.approx([RADIUS_MM, RADIUS_MM], rel=3e-3)


def test_what_is_outside_of_the_tissue_tells_nothing() -> None:
    inside, free = circle(30.0), circle(30.0, free_mm=20.0)
    assert len(free) == len(inside) + 10
    found = []
    for places in (inside, free):
        estimator = Estimator(ENTRY, RADIUS_MM, Priors())
        estimator.push(30.0)
        estimator.measure(seen(places))
        found.append(estimator.estimate())
    assert found[0].tip.position_mm == pytest.approx(found[1].tip.position_mm, abs=1e-3)


def test_near_places_count_as_one() -> None:
    """Ten times as many places of the same errors tell no more."""
    dense = np.repeat(circle(), 10, axis=0)
    for places in (circle(), dense):
        estimator = Estimator(ENTRY, RADIUS_MM, UNKNOWN)
        estimator.push(LENGTH_MM)
        estimator.measure(seen(places))
        std = estimator.estimate().radius_std_mm
        assert std == pytest.approx(RADIUS_MM * fisher_std(circle()), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("is_pulled", [False, True])
def test_the_true_tip_lies_in_the_tube_as_often_as_it_says(is_pulled: bool) -> None:
    """Phantoms with their drifts: squares in claimed standard deviations have the mean 3."""
    usual = PhantomParameters()
    sensing = replace(usual.sensing, noise_mm=NOISE_MM, whole_shape=True)
    parameters = replace(usual, sensing=sensing)
    priors = Priors(
        curvature_ratio=0.02,
        noise_mm=NOISE_MM,
        distortion_mm=0.085,
        curvature_drift=0.13,
        turn_drift_rad=0.14,
        first_ratio=0.16,
        bite_mm=0.8,
        shape_spacing_mm=sensing.shape_apart_mm,
    )
    parameters = replace(parameters, torsion=replace(usual.torsion, lag_rad=0.0))
    moves = [("push", 24.0), ("roll", math.pi), ("push", 16.0)]
    if is_pulled:
        moves += [("pull", 12.0), ("roll", 1.5), ("push", 14.0)]
    squares, outside = [], 0
    for seed in range(SEEDS):
        needle = PhantomNeedle(Needle(ENTRY, 30.0, 1.0), (), seed, SimulatedClock(), parameters)
        estimator = Estimator(ENTRY, 30.0, priors)
        for kind, value in moves:
            for _ in range(round(value) if kind == "push" else 1):
                step = 1.0 if kind == "push" else value
                getattr(needle, kind)(step)
                getattr(estimator, kind)(step)
                if kind == "push":
                    needle.wait(sensing.latency_s)
                    estimator.measure(needle.measure())
        estimate = estimator.estimate()
        needle.push(5.0)
        guess = push(estimate.tip, estimate.radius_mm, 5.0).position_mm
        error = np.subtract(needle.true_tip.position_mm, guess)
        squares.append(error @ np.linalg.solve(estimate.position_covariance_mm2(5.0), error))
        outside += math.sqrt(error @ error) > 3.0 * estimate.position_std_mm(5.0)
    # Four standard deviations of the mean of chi-squares with three degrees of freedom.
    assert np.mean(squares) < 3.0 + 4.0 * math.sqrt(6.0 / SEEDS)
    assert outside <= 1


def test_a_phantom_tells_its_shape_late_and_from_the_base_to_the_tip() -> None:
    usual = PhantomParameters()
    sensing = replace(usual.sensing, noise_mm=0.0, step_mm=0.0, whole_shape=True, lost_ratio=0.0)
    exact = replace(sensing, distortion_mm=replace(sensing.distortion_mm, std=0.0))
    parameters = replace(usual, sensing=exact)
    needle = PhantomNeedle(Needle(ENTRY, 30.0, 1.0), (), 1, SimulatedClock(), parameters)
    needle.push(30.0)
    needle.wait(1.0)
    found = needle.measure()
    assert found.shape[-1] == found.position_mm
    assert len(found.shape) == 1 + 30 + 20
    arcs = needle.pierced
    for place in found.shape:
        on_path = min(arc.nearest_to(place).distance_mm for arc in arcs)
        assert on_path < 1e-9 or place[1] > 0.0
    needle.push(10.0)
    late = needle.measure()
    behind = np.subtract(needle.true_tip.position_mm, late.shape[-1])
    assert np.linalg.norm(behind) == pytest.approx(sensing.latency_s, rel=1e-3)


def test_a_shape_does_not_change_what_else_is_random() -> None:
    usual = PhantomParameters()
    both = []
    for whole in (False, True):
        parameters = replace(usual, sensing=replace(usual.sensing, whole_shape=whole))
        needle = PhantomNeedle(Needle(ENTRY, 30.0, 1.0), (), 1, SimulatedClock(), parameters)
        needle.push(20.0)
        both.append((needle.measure().position_mm, needle.true_tip))
    assert both[0] == both[1]


BOUNDS = Bounds(ENTRY, RADIUS_MM, 120.0, NOISE_MM)


def without_numbers(places: Places) -> Places:
    places[7, 1] = math.nan
    return places


def with_a_kink(places: Places) -> Places:
    places[15] += (4.0, 0.0, 0.0)
    return places


def with_a_jump(places: Places) -> Places:
    places[:12] += (0.0, 0.0, 30.0)
    return places


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (without_numbers, r"place 8 of the 41 of the shape is .* not a number"),
        (lambda places: places[::-1], "runs out of the tissue.*is the tip the first one"),
        (lambda places: places / 1000.0, r"0\.07.* mm long, .*is it in mm and not in m"),
        (lambda places: places * 1000.0, "jumps by 2000.0 mm"),
        (lambda places: places[-2:], "has 2 places; 3 to 10000 are allowed"),
        (lambda places: places[-4:], "mm long, and 10 mm is the least"),
        (lambda places: np.concatenate([places[0] + [(0.0, 80.0, 0.0)], places]), "jumps by"),
        (with_a_jump, "jumps by .* between its places 12 and 13"),
        (with_a_kink, "a kink at .* beside its neighbours"),
        (lambda places: places + np.array([15.0, 0.0, 0.0]), "passes the entry .* 15.0 mm"),
        (lambda places: places[:, :2], "an array .places, 3."),
        (lambda places: circle(60.0, free_mm=80.0), "140.0 mm long, and the needle 120 mm"),
    ],
)
def test_a_shape_that_cannot_be_true_is_refused(wrong: object, message: str) -> None:
    places = wrong(circle(free_mm=20.0))  # type: ignore[operator]
    with pytest.raises(DeviceError, match=f"(?s){message}"):
        BOUNDS.require(seen(places))


def test_noise_makes_no_shape_wrong() -> None:
    generator, places = np.random.default_rng(2), circle(spacing_mm=0.5, free_mm=30.0)
    for _ in range(200):
        noisy = places + generator.normal(0.0, NOISE_MM, places.shape)
        BOUNDS.require(seen(noisy))
        # Noise makes it no longer than it is, by much.
        (longest_mm, _), *_ = reversed(thinned(seen(noisy).shape, 5.0))
        assert longest_mm == pytest.approx(90.0, rel=0.05)


def test_a_needle_that_is_hardly_inserted_has_a_shape() -> None:
    for depth_mm in (0.0, 0.5, 3.0):
        BOUNDS.require(seen(circle(depth_mm, spacing_mm=1.0, free_mm=15.0)))
