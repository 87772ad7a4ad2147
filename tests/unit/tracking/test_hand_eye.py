"""Where a stage lies for a tracker, against exact transforms, a numeric minimum and refits."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ntagen.errors import InputError
from ntagen.tracking.hand_eye import LEAST_POSES, HandEye, find_stage, rotation_vectors
from ntagen.tracking.poses import Poses

Array = npt.NDArray[np.float64]

X_TURN, X_MM = Rotation.from_rotvec([0.3, 0.2, -1.0]), np.array([5.0, 10.0, 40.0])
Y_TURN, Y_MM = Rotation.from_rotvec([1.0, -0.4, 2.0]), np.array([100.0, -300.0, 900.0])


def both(
    count: int = 12,
    *,
    seed: int = 0,
    noise_mm: float = 0.0,
    noise_deg: float = 0.0,
    vectors: Array | None = None,
) -> tuple[Poses, Poses]:
    """Poses of a stage, turned by 25 deg about all axes or by given vectors, and of its sensor."""
    random = np.random.default_rng(seed)
    turns = np.radians(random.uniform(-25.0, 25.0, (count, 3))) if vectors is None else vectors
    stage, places = Rotation.from_rotvec(turns), random.uniform(-60.0, 60.0, (count, 3))
    seen = Y_TURN.inv() * stage * X_TURN
    seen_mm = Y_TURN.inv().apply(stage.apply(X_MM) + places - Y_MM)
    errors = Rotation.from_rotvec(math.radians(noise_deg) * random.normal(size=(count, 3)))
    seen_mm += noise_mm * random.normal(size=(count, 3))
    return made("s.csv", stage, places), made("t.csv", seen * errors, seen_mm)


def made(path: str, rotations: Rotation, positions: Array) -> Poses:
    names = tuple(f"line {at + 2}" for at in range(len(positions)))
    return Poses(Path(path), "", names, False, rotations.as_matrix(), positions)


def turned_by(found: HandEye) -> float:
    """The error of the rotation in deg."""
    offset = Rotation.from_matrix(np.array(found.transform.rotation)) * Y_TURN.inv()
    return math.degrees(float(offset.magnitude()))


def test_exact_poses_give_the_exact_transforms() -> None:
    found = find_stage(*both())
    assert np.allclose(found.transform.rotation, Y_TURN.as_matrix(), atol=1e-12)
    assert found.transform.translation_mm == pytest.approx(Y_MM, abs=1e-9)
    assert np.allclose(found.sensor.rotation, X_TURN.as_matrix(), atol=1e-12)
    assert found.sensor.translation_mm == pytest.approx(X_MM, abs=1e-9)
    assert (found.transform.source, found.transform.target) == ("tracker", "stage")
    assert max(found.residuals_mm) == pytest.approx(0.0, abs=1e-9)
    assert max(found.left_out_deg) == pytest.approx(0.0, abs=1e-5)
    assert found.suspect is None


def test_frames_of_the_files_are_kept() -> None:
    stage, tracker = both()
    found = find_stage(replace(stage, frame="bench"), replace(tracker, frame="Reference"))
    assert (found.transform.source, found.transform.target) == ("Reference", "bench")


def test_half_turns_between_poses_do_not_matter() -> None:
    vectors = np.radians([[0, 0, 0], [180, 0, 0], [0, 40, 0], [0, 0, 60], [30, 20, 0], [175, 0, 9]])
    found = find_stage(*both(6, noise_deg=0.1, vectors=vectors))
    assert turned_by(found) < 0.5


def test_a_numeric_search_finds_nearly_the_same() -> None:
    # The search weighs 1 deg as 1 mm, and so is another estimate with about the same errors.
    stage, tracker = both(20, noise_mm=0.1, noise_deg=0.1, seed=2)

    def misfits(unknown: Array) -> Array:
        x_turn, y_turn = (Rotation.from_rotvec(unknown[at : at + 3]) for at in (0, 6))
        place = stage.rotations @ unknown[3:6] + stage.positions_mm
        place -= y_turn.apply(tracker.positions_mm) + unknown[9:]
        left = Rotation.from_matrix(stage.rotations) * x_turn
        right = y_turn * Rotation.from_matrix(tracker.rotations)
        return np.concatenate([place.ravel(), np.degrees((left.inv() * right).as_rotvec().ravel())])

    start = np.concatenate([X_TURN.as_rotvec() + 0.05, X_MM, Y_TURN.as_rotvec() - 0.05, Y_MM])
    search = least_squares(misfits, start).x
    found = find_stage(stage, tracker)
    offset = Rotation.from_rotvec(search[6:9]).inv() * Rotation.from_matrix(
        np.array(found.transform.rotation)
    )
    assert math.degrees(offset.magnitude()) < 0.2
    seen = tracker.positions_mm.mean(axis=0)
    at = Rotation.from_rotvec(search[6:9]).apply(seen) + search[9:]
    assert math.dist(found.transform.point(tuple(seen)), at) < 0.2
    assert found.sensor.translation_mm == pytest.approx(search[3:6], abs=0.5)


@pytest.mark.parametrize("count", [6, 12, 40])
def test_errors_fall_with_the_number_of_poses(count: int) -> None:
    errors_deg, errors_mm = [], []
    for seed in range(30):
        stage, tracker = both(count, noise_mm=0.3, noise_deg=0.2, seed=seed)
        found = find_stage(stage, tracker)
        errors_deg.append(turned_by(found))
        middle = tracker.positions_mm.mean(axis=0)
        truth = Y_TURN.apply(middle) + Y_MM
        errors_mm.append(math.dist(found.transform.point(tuple(middle)), truth))
    # Three angles with errors of 0.2 deg in each pose, over motions with a sine of about 0.4.
    expected_deg = math.sqrt(3.0) * 0.2 / (0.36 * math.sqrt(count))
    assert 0.6 * expected_deg < np.sqrt(np.mean(np.square(errors_deg))) < 1.6 * expected_deg
    # Six unknowns of which each has the weight of a pose, and the rotation over the stage's way.
    expected_mm = math.hypot(0.3 * math.sqrt(18 / count), math.radians(expected_deg) * 60.0)
    assert 0.4 * expected_mm < np.sqrt(np.mean(np.square(errors_mm))) < 1.5 * expected_mm


def test_what_is_left_out_is_predicted_by_a_fit_to_the_others() -> None:
    stage, tracker = both(8, noise_mm=0.3, noise_deg=0.2, seed=4)
    whole = find_stage(stage, tracker)
    kept = [0, 1, 2, 4, 5, 6, 7]
    alone = find_stage(stage.chosen(kept), tracker.chosen(kept))
    put = stage.rotations[3] @ np.array(alone.sensor.translation_mm) + stage.positions_mm[3]
    seen = alone.transform.point(tuple(tracker.positions_mm[3]))
    assert whole.left_out_mm[3] == pytest.approx(math.dist(put, seen))
    left = stage.rotations[3] @ np.array(alone.sensor.rotation)
    right = np.array(alone.transform.rotation) @ tracker.rotations[3]
    angle = Rotation.from_matrix(left.T @ right).magnitude()
    assert whole.left_out_deg[3] == pytest.approx(math.degrees(angle))


def test_what_the_others_do_not_determine_is_not_predicted() -> None:
    # Only the last pose turns about another axis.
    vectors = np.radians([[20, 0, 0], [-20, 0, 0], [10, 0, 0], [-5, 0, 0], [0, 40, 0]])
    found = find_stage(*both(5, vectors=vectors))
    assert [math.isnan(one) for one in found.left_out_mm] == [False] * 4 + [True]
    assert turned_by(found) < 1e-6


def test_a_bad_pose_is_named() -> None:
    stage, tracker = both(12, noise_mm=0.1, noise_deg=0.05)
    positions = tracker.positions_mm.copy()
    positions[4] += [3.0, 3.0, 3.0]
    assert find_stage(stage, replace(tracker, positions_mm=positions)).suspect == "line 6"
    rotations = tracker.rotations.copy()
    rotations[7] = rotations[7] @ Rotation.from_rotvec([0.05, 0.0, 0.0]).as_matrix()
    assert find_stage(stage, replace(tracker, rotations=rotations)).suspect == "line 9"


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, 3.0, math.pi - 1e-7, math.pi])
def test_rotation_vectors_are_those_of_scipy(angle: float) -> None:
    axis = np.array([2.0, -1.0, 0.5]) / np.linalg.norm([2.0, -1.0, 0.5])
    given = Rotation.from_rotvec(angle * axis)
    (found,) = rotation_vectors(given.as_matrix()[None])
    assert np.linalg.norm(found) == pytest.approx(angle, abs=1e-7)
    assert (Rotation.from_rotvec(found) * given.inv()).magnitude() < 1e-7


# What is refused.


def refused(stage: Poses, tracker: Poses, match: str) -> str:
    with pytest.raises(InputError, match=match) as caught:
        find_stage(stage, tracker)
    assert str(caught.value).startswith("s.csv")
    assert str(caught.value).count("\nhint: ") == 1
    return str(caught.value)


@pytest.mark.parametrize("count", [0, LEAST_POSES - 1])
def test_too_few_poses_are_refused(count: int) -> None:
    refused(*both(count), f"there are {count} poses, and {LEAST_POSES} or more are needed")


@pytest.mark.parametrize("noise_deg", [0.0, 0.2])
def test_rotations_about_one_axis_are_refused(noise_deg: float) -> None:
    vectors = np.outer(np.radians(np.linspace(-40.0, 40.0, 10)), [0.0, 0.6, 0.8])
    said = refused(
        *both(10, vectors=vectors, noise_deg=noise_deg),
        r"about nearly one axis, \(-?0\.00, 0\.60, 0\.80\) in the stage's frame",
    )
    assert "cover 80.0 deg" in said


def test_small_rotations_are_refused() -> None:
    vectors = np.radians(np.random.default_rng(1).uniform(-2.0, 2.0, (12, 3)))
    said = refused(*both(12, vectors=vectors), "the rotations are too small: the poses cover")
    assert "register it by points instead" in said
    refused(*both(12, vectors=0.0 * vectors), r"cover 0\.0 deg")


def test_half_turns_alone_are_refused() -> None:
    vectors = np.pi * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    refused(*both(4, vectors=vectors), "half turns")


def test_exchanged_lines_are_named() -> None:
    stage, tracker = both(12, noise_mm=0.2, noise_deg=0.1, seed=1)
    order = [0, 1, 2, 7, 4, 5, 6, 3, 8, 9, 10, 11]
    said = refused(stage, tracker.chosen(order), r"s\.csv and t\.csv do not fit: ")
    assert "Look at line 5, line 9 first." in said


def test_a_sensor_that_is_not_fixed_is_refused() -> None:
    stage, tracker = both()
    loose = Rotation.from_rotvec(np.random.default_rng(3).normal(size=(12, 3))).as_matrix()
    said = refused(stage, replace(tracker, rotations=loose), "do not fit")
    assert "is the sensor fixed to the carriage?" in said


def test_a_tracker_that_hangs_is_refused() -> None:
    stage, tracker = both()
    hung = tracker.chosen([0] * 12)
    refused(stage, hung, "do not fit")
    with pytest.raises(InputError, match=r"t\.csv: the rotations are too small"):
        find_stage(hung, stage)


def test_inverse_rotations_are_named() -> None:
    stage, tracker = both(seed=1)
    inverse = replace(tracker, rotations=tracker.rotations.transpose(0, 2, 1))
    assert "the inverse rotations of one file fit better" in refused(stage, inverse, "do not fit")


def test_positions_in_another_unit_are_refused() -> None:
    stage, tracker = both()
    refused(stage, replace(tracker, positions_mm=1e-3 * tracker.positions_mm), "do not fit")
