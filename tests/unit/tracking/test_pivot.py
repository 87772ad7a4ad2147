"""The tip of a tool, against exact poses, a numeric minimum, refits and many repetitions."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from ntagen.errors import InputError
from ntagen.tracking.pivot import LEAST_POSES, LEAST_TURN_DEG, find_rest, find_tip, turns_of
from ntagen.tracking.poses import Poses

Array = npt.NDArray[np.float64]

TIP = np.array([2.0, -3.0, 150.0])
DIVOT = np.array([100.0, -50.0, -900.0])


def poses(
    count: int = 30,
    *,
    seed: int = 0,
    tilt_deg: float = 30.0,
    noise_mm: float = 0.0,
    noise_deg: float = 0.0,
) -> Poses:
    """Poses of a tool that is tilted about the divot and spun about its own axis."""
    random = np.random.default_rng(seed)
    angles = random.uniform(0.0, 2.0 * math.pi, count)
    tilts = math.radians(tilt_deg) * np.sqrt(random.uniform(size=count))
    tilted = np.stack([tilts * np.cos(angles), tilts * np.sin(angles), np.zeros(count)], axis=1)
    spun = np.stack([np.zeros(count), np.zeros(count), random.uniform(-3.0, 3.0, count)], axis=1)
    rotations = Rotation.from_rotvec(tilted) * Rotation.from_rotvec(spun)
    positions = DIVOT - rotations.apply(TIP) + noise_mm * random.normal(size=(count, 3))
    errors = math.radians(noise_deg) * random.normal(size=(count, 3))
    return made((rotations * Rotation.from_rotvec(errors)).as_matrix(), positions)


def made(rotations: Array, positions: Array) -> Poses:
    names = tuple(f"line {at + 2}" for at in range(len(positions)))
    return Poses(Path("poses.csv"), "", names, False, rotations, positions)


def shifted(given: Poses, offsets: dict[int, tuple[float, float, float]]) -> Poses:
    positions = given.positions_mm.copy()
    for at, offset in offsets.items():
        positions[at] += offset
    return replace(given, positions_mm=positions)


def test_exact_poses_give_the_exact_tip() -> None:
    found = find_tip(poses())
    assert found.tip_mm == pytest.approx(TIP, abs=1e-9)
    assert found.divot_mm == pytest.approx(DIVOT, abs=1e-9)
    assert max(found.residuals_mm) == pytest.approx(0.0, abs=1e-9)
    assert max(found.left_out_mm) == pytest.approx(0.0, abs=1e-9)
    assert found.tip_error_mm == pytest.approx(0.0, abs=1e-9)


def test_the_tip_is_where_a_numeric_search_finds_the_least_squares() -> None:
    given = poses(20, noise_mm=0.3, noise_deg=0.2, seed=3)

    def squares(unknown: Array) -> float:
        away = given.rotations @ unknown[:3] + given.positions_mm - unknown[3:]
        return float(np.sum(away**2))

    start = np.concatenate([TIP + 3.0, DIVOT - 3.0])
    search = minimize(squares, start, method="BFGS", options={"gtol": 1e-9})
    found = find_tip(given)
    assert found.tip_mm == pytest.approx(search.x[:3], abs=1e-3)
    assert found.divot_mm == pytest.approx(search.x[3:], abs=1e-3)
    assert found.rms_mm == pytest.approx(math.sqrt(search.fun / 20))


def test_what_is_left_out_is_predicted_by_a_fit_to_the_others() -> None:
    given = poses(9, noise_mm=0.3, seed=4)
    found = find_tip(given)
    for at in range(9):
        kept = [other for other in range(9) if other != at]
        rest = find_rest(given.rotations[kept], given.positions_mm[kept])
        away = given.rotations[at] @ rest.own_mm + given.positions_mm[at] - rest.place_mm
        assert found.left_out_mm[at] == pytest.approx(np.linalg.norm(away))
        assert found.left_out_mm[at] > found.residuals_mm[at]


@pytest.mark.parametrize("count", [LEAST_POSES, 12, 40])
def test_errors_are_those_of_many_repetitions(count: int) -> None:
    # No repetition is refused, though each has the chance to look like one with a bad pose.
    repeats, error2, expected2, rms2 = 300, 0.0, 0.0, 0.0
    for seed in range(repeats):
        found = find_tip(poses(count, noise_mm=0.3, seed=seed))
        error2 += float(np.sum((np.array(found.tip_mm) - TIP) ** 2)) / repeats
        expected2 += found.tip_error_mm**2 / repeats
        rms2 += found.rms_mm**2 / repeats
    # Six unknowns for three equations a pose.
    assert rms2 == pytest.approx(3 * 0.3**2 * (1.0 - 2.0 / count), rel=0.1)
    assert expected2 == pytest.approx(error2, rel=0.3)


def test_errors_of_the_rotations_stay_in_the_tip() -> None:
    # 0.2 deg at 150 mm are 0.5 mm; both errors together, over the turns of 40 poses.
    given = [poses(40, noise_mm=0.3, noise_deg=0.2, seed=seed) for seed in range(100)]
    found = [find_tip(one) for one in given]
    errors = [math.dist(one.tip_mm, TIP) for one in found]
    sigma_mm = math.hypot(0.3, math.radians(0.2) * 150.0)
    sines2 = [np.sin(np.radians(one.turns_deg)) ** 2 for one in found]
    expected = np.mean([sigma_mm * math.sqrt(float(np.sum(1.0 / one)) / 40) for one in sines2])
    assert 0.6 * expected < np.sqrt(np.mean(np.square(errors))) < 1.3 * expected


def test_turns_are_those_of_a_cone() -> None:
    # A direction on a cone of 20 deg about its mean has the root mean square sin 20 deg.
    around = np.linspace(0.0, 2.0 * math.pi, 36, endpoint=False)
    tilt = math.radians(20.0)
    vectors = np.stack([tilt * np.cos(around), tilt * np.sin(around), 0.0 * around], axis=1)
    turns_deg, directions = turns_of(Rotation.from_rotvec(vectors).as_matrix())
    z = int(np.argmax(np.abs(directions[:, 2])))
    assert turns_deg[z] == pytest.approx(20.0)
    assert turns_deg[0] <= turns_deg[1] <= turns_deg[2]


# What is refused.


def refused(given: Poses, match: str) -> str:
    with pytest.raises(InputError, match=match) as caught:
        find_tip(given)
    assert str(caught.value).startswith("poses.csv: ")
    assert str(caught.value).count("\nhint: ") == 1
    return str(caught.value)


@pytest.mark.parametrize("count", [0, 1, LEAST_POSES - 1])
def test_too_few_poses_are_refused(count: int) -> None:
    refused(poses(count), f"there are {count} poses, and {LEAST_POSES} or more are needed")


def test_a_tool_that_is_only_spun_is_refused_with_its_axis() -> None:
    said = refused(poses(tilt_deg=1.0, noise_deg=0.2), r"not determined along \(0\.0., -?0\.0., 1")
    assert "tilt the tool by 30 deg" in said
    assert "In all, they cover 3" in said


@pytest.mark.parametrize("noise_deg", [0.0, 0.2])
def test_a_tool_that_rests_is_refused(noise_deg: float) -> None:
    errors = np.radians(noise_deg) * np.random.default_rng(1).normal(size=(20, 3))
    given = made(Rotation.from_rotvec(errors).as_matrix(), np.tile(DIVOT - TIP, (20, 1)))
    refused(given, r"cover [01]\.\d deg in all.*not determined in any direction")


def test_just_enough_motion_is_taken() -> None:
    # The root mean square of a disc of tilts is the greatest one divided by the root of 2.
    found = find_tip(poses(400, tilt_deg=1.1 * LEAST_TURN_DEG * math.sqrt(2.0)))
    assert found.turns_deg[0] == pytest.approx(1.1 * LEAST_TURN_DEG, rel=0.1)
    assert found.least_turned[2] ** 2 == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("count", [8, 12, 40, 300])
def test_one_bad_pose_is_named(count: int) -> None:
    given = shifted(poses(count, noise_mm=0.3, noise_deg=0.2, seed=5), {3: (9.0, -9.0, 9.0)})
    said = refused(given, f"1 of {count} poses do not fit the others")
    assert "line 5 (" in said


def test_several_bad_poses_are_named() -> None:
    offsets = {at: (8.0, 8.0 - at, 8.0) for at in (0, 7, 8, 21, 39)}
    said = refused(shifted(poses(40, noise_mm=0.3, seed=6), offsets), "5 of 40 poses do not fit")
    assert [f"line {at + 2} (" in said for at in offsets] == [True] * 5
    assert said.count(" mm)") == 5


@pytest.mark.parametrize("noise_mm", [0.0, 0.3])
def test_the_few_poses_that_determine_the_tip_are_not_bad(noise_mm: float) -> None:
    # Most poses only spin the tool: without the others, the tip could be anywhere on its axis.
    spun, tilted = (
        poses(48, tilt_deg=0.0, noise_mm=noise_mm),
        poses(12, tilt_deg=60.0, noise_mm=noise_mm, seed=3),
    )
    found = find_tip(
        made(
            np.concatenate([tilted.rotations, spun.rotations]),
            np.concatenate([tilted.positions_mm, spun.positions_mm]),
        )
    )
    assert math.dist(found.tip_mm, TIP) < 4.0 * noise_mm + 1e-9


def test_small_misfits_are_no_outliers() -> None:
    found = find_tip(shifted(poses(20), {4: (0.8, 0.0, 0.0)}))
    assert max(found.residuals_mm) == found.residuals_mm[4] > 0.5


def test_a_tip_that_did_not_rest_is_refused() -> None:
    wander = 20.0 * np.random.default_rng(8).normal(size=(30, 3))
    given = poses()
    refused(replace(given, positions_mm=given.positions_mm + wander), "the tip did not rest")


def test_inverse_rotations_are_named() -> None:
    given = poses(noise_mm=0.3)
    said = refused(replace(given, rotations=given.rotations.transpose(0, 2, 1)), "did not rest")
    assert "the inverse rotations fit better" in said


def test_a_sensor_in_the_tip_is_taken() -> None:
    given = poses(30, seed=2)
    noise = 0.3 * np.random.default_rng(9).normal(size=(30, 3))
    found = find_tip(replace(given, positions_mm=DIVOT + noise))
    assert math.hypot(*found.tip_mm) < 1.0
