"""Rigid registration, against scipy and against many random repetitions of the same measurement."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ntagen.errors import InputError
from ntagen.scene import Vector
from ntagen.tracking.frames import IDENTITY, LPS, RAS, Transform
from ntagen.tracking.registration import LEAST_POINTS, Fit, Pairs, register

Array = npt.NDArray[np.float64]

CUBE = np.array(
    [[0, 0, 0], [80, 0, 0], [0, 60, 0], [0, 0, 40], [80, 60, 5], [70, 10, 45]], dtype=float
)
TURN = Rotation.from_euler("xyz", [0.4, -1.1, 2.5]).as_matrix()
SHIFT = np.array([100.0, -20.0, 7.0])


def pairs(source: Array, target: Array) -> Pairs:
    names = tuple(f"F-{i + 1}" for i in range(len(source)))
    return Pairs(names, "tracker", "scene", vectors(source), vectors(target))


def vectors(points: Array) -> tuple[Vector, ...]:
    return tuple((float(x), float(y), float(z)) for x, y, z in points)


def moved(points: Array, noise_mm: float = 0.0, seed: int = 0) -> Array:
    noise = np.random.default_rng(seed).normal(0.0, 1.0, points.shape)
    return np.asarray(points @ TURN.T + SHIFT + noise_mm * noise)


def test_exact_points_give_the_exact_transform() -> None:
    fit = register(pairs(CUBE, moved(CUBE)))
    assert np.allclose(fit.transform.rotation, TURN, atol=1e-12)
    assert np.allclose(fit.transform.translation_mm, SHIFT, atol=1e-10)
    assert fit.fre_mm == pytest.approx(0.0, abs=1e-10)
    assert fit.transform.point((1.0, 2.0, 3.0)) == pytest.approx(TURN @ [1, 2, 3] + SHIFT)
    assert not fit.is_flat


@given(st.integers(3, 12), st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_the_rotation_is_that_of_scipy(count: int, seed: int, noise_mm: float) -> None:
    random = np.random.default_rng(seed)
    source = random.uniform(-60.0, 60.0, (count, 3))
    target = moved(source, noise_mm, seed)
    try:
        fit = register(pairs(source, target))
    except InputError as error:
        # A small set may be nearly a line, or shrink by its noise.
        assume("on a line" not in str(error) and "times as far" not in str(error))
        raise
    middle = source.mean(axis=0), target.mean(axis=0)
    other, rssd = Rotation.align_vectors(target - middle[1], source - middle[0])
    assert np.allclose(fit.transform.rotation, other.as_matrix(), atol=1e-6)
    assert fit.fre_mm == pytest.approx(rssd / math.sqrt(count), abs=1e-5)
    assert np.linalg.det(np.array(fit.transform.rotation)) == pytest.approx(1.0)


@pytest.mark.slow
def test_errors_are_those_of_many_repetitions() -> None:
    # An experiment of 400 calibrations with a known localisation error.
    fle_mm, count = 0.5, 400
    at = np.array([40.0, -70.0, 30.0])
    fre2, tre2, estimated2, left2 = 0.0, 0.0, 0.0, 0.0
    truth = TURN @ at + SHIFT
    for seed in range(count):
        target = moved(CUBE, fle_mm / math.sqrt(3.0), seed)
        fit = register(pairs(CUBE, target))
        fre2 += fit.fre_mm**2 / count
        tre2 += (
            float(np.sum((np.array(fit.transform.point(vectors(at[None])[0])) - truth) ** 2))
            / count
        )
        estimated2 += fit.tre_mm((truth[0], truth[1], truth[2])) ** 2 / count
        left2 += fit.fle_mm**2 / count
    n = len(CUBE)
    assert fre2 == pytest.approx((1.0 - 2.0 / n) * fle_mm**2, rel=0.1)
    assert left2 == pytest.approx(fle_mm**2, rel=0.1)
    assert tre2 == pytest.approx(estimated2, rel=0.1)


def test_a_point_that_was_left_out_is_predicted_by_the_others() -> None:
    target = moved(CUBE)
    target[2] += [3.0, 0.0, 0.0]
    fit = register(pairs(CUBE, target))
    others = [i for i in range(len(CUBE)) if i != 2]
    alone = register(pairs(CUBE[others], target[others]))
    predicted = alone.transform.point(vectors(CUBE)[2])
    assert fit.left_out_mm[2] == pytest.approx(math.dist(predicted, target[2]))
    assert fit.left_out_mm[2] == pytest.approx(3.0)
    assert max(fit.residuals_mm) < 3.0


def test_what_the_others_do_not_determine_is_not_predicted() -> None:
    three = register(pairs(CUBE[:3], moved(CUBE[:3])))
    assert three.left_out_mm == (None, None, None)
    line = np.array([[0, 0, 0], [30, 0, 0], [60, 0, 0], [30, 50, 0]], dtype=float)
    found = register(pairs(line, moved(line)))
    assert found.left_out_mm[3] is None
    assert found.left_out_mm[0] == pytest.approx(0.0, abs=1e-9)
    assert found.is_flat
    assert three.is_flat


def test_the_error_grows_away_from_the_points() -> None:
    fit = register(pairs(CUBE, moved(CUBE, 0.3)))
    x, y, z = fit.center_mm
    near, far = fit.tre_mm(fit.center_mm), fit.tre_mm((x + 200.0, y, z))
    assert near == pytest.approx(fit.fle_mm / math.sqrt(len(CUBE)))
    assert far > 2.0 * near


# What is refused.


def refused(source: Array, target: Array, match: str) -> None:
    with pytest.raises(InputError, match=match) as caught:
        register(pairs(source, target))
    assert "hint:" in str(caught.value)


def test_too_few_points_are_refused() -> None:
    refused(CUBE[:2], moved(CUBE[:2]), "there are 2 pairs")


def test_points_on_a_line_are_refused() -> None:
    line = np.array([[0, 0, 0], [30, 1, 0], [60, 0, 1], [90, 0, 0]], dtype=float)
    refused(line, moved(line), "on a line in the frame tracker")


def test_the_same_place_twice_is_refused() -> None:
    twice = np.vstack([CUBE, CUBE[:1]])
    refused(twice, moved(twice), "F-1 and F-7 are the same place")


def test_all_points_at_one_place_are_refused() -> None:
    tiny = CUBE * 1e-3
    refused(tiny, moved(tiny), "all points are within")


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_mirrored_set_is_refused(axis: int) -> None:
    mirrored = CUBE.copy()
    mirrored[:, axis] *= -1.0
    refused(mirrored, moved(CUBE, 0.3), "mirror image")


def test_exchanged_axes_are_refused() -> None:
    refused(CUBE[:, [1, 0, 2]], moved(CUBE, 0.3), "mirror image")


@pytest.mark.parametrize(
    ("factor", "unit"), [(1e-3, "in metres"), (0.1, "in centimetres"), (1 / 25.4, "in inches")]
)
def test_another_unit_is_named(factor: float, unit: str) -> None:
    refused(CUBE * factor, moved(CUBE, 0.3), f"as in tracker.*\n.*in tracker {unit}")
    refused(CUBE, moved(CUBE) * factor, f"as in scene.*\n.*in scene {unit}")


def test_another_size_is_refused() -> None:
    refused(CUBE * 1.3, moved(CUBE), "1.3 times as far apart")


def test_two_exchanged_points_are_named() -> None:
    target = moved(CUBE, 0.3)
    target[[1, 4]] = target[[4, 1]]
    refused(CUBE, target, "F-2 and F-5 exchanged")


def test_points_that_are_not_the_same_are_refused() -> None:
    random = np.random.default_rng(5)
    target = random.uniform(-1.0, 1.0, CUBE.shape)
    target *= np.linalg.norm(CUBE - CUBE.mean(axis=0)) / np.linalg.norm(
        target - target.mean(axis=0)
    )
    refused(CUBE, target, "do not fit|mirror image")


def test_a_position_that_is_no_number_is_refused() -> None:
    target = moved(CUBE)
    target[3, 1] = math.nan
    with pytest.raises(InputError, match="F-4 has no position in the frame scene"):
        register(pairs(CUBE, target))


# Frames.


def test_ras_and_lps_are_turned_into_each_other() -> None:
    fit: Fit = register(pairs(CUBE, moved(CUBE)))
    transform = Transform(RAS, LPS, fit.transform.rotation, fit.transform.translation_mm)
    other = transform.between(LPS, RAS)
    x, y, z = transform.point((1.0, 2.0, 3.0))
    assert other.point((-1.0, -2.0, 3.0)) == pytest.approx((-x, -y, z))
    assert other.between(RAS, LPS).rotation == transform.rotation
    assert np.linalg.det(np.array(other.rotation)) == pytest.approx(1.0)


def test_other_frames_are_not_guessed() -> None:
    assert IDENTITY.between("scene", "scene") == IDENTITY
    with pytest.raises(InputError, match="nothing says how RAS lies in it"):
        IDENTITY.between("scene", RAS)


def test_more_points_than_anybody_measures_are_refused() -> None:
    many = np.random.default_rng(1).uniform(-1e3, 1e3, (201, 3))
    with pytest.raises(InputError, match="201 pairs of points, and 200 are allowed"):
        register(pairs(many, moved(many)))


def test_the_pages_and_the_program_advise_the_same_number_of_points() -> None:
    docs = Path(__file__).parents[3] / "docs"
    for page in ("tracking.md", "tutorials/hardware.md"):
        assert "six points or more" in (docs / page).read_text("utf-8"), page
    assert "Three are the least" in (docs / "tracking.md").read_text("utf-8")
    assert LEAST_POINTS == 3
    with pytest.raises(InputError, match="six points around the target"):
        register(pairs(CUBE[:2], CUBE[:2]))
