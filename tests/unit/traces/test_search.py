"""The search for rolls, against all sequences; and the exact fit, against derivatives."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import scipy.optimize  # type: ignore[import-untyped]

from ntagen.needle.path import nearest_on_all
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.scene import Needle, Pose
from ntagen.traces import search
from ntagen.traces.chain import Rolls, chain_points, feet_of
from ntagen.traces.refine import Fitted, Freedom, _Problem, fit_chain
from ntagen.traces.search import Space, Start, best_sequences, misfits
from tests.traces import MAKE, points_of, trace

ANGLES = tuple(math.radians(angle) for angle in (90, 180, 270))
ORIGIN = Pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


def space_of(kind: str, seed: int, length_mm: float = 100.0, step_mm: float = 2.0) -> Space:
    made = trace(points_of(kind, seed, length_mm=length_mm))
    return Space(made.points_mm, made.depths_mm, 1 / 60.0, step_mm, ANGLES, 1, Start())


def rows(*rolls: tuple[float, float]) -> Rolls:
    numbers = np.array(rolls, dtype=np.float64).reshape(1, -1, 2)
    return Rolls(numbers[:, :, 0], numbers[:, :, 1])


def test_a_chain_is_the_path_of_the_exact_kinematics() -> None:
    depths = np.linspace(0.0, 80.0, 33)
    plan = Plan.of([Push(20.0), Roll(1.0), Push(31.0), Roll(4.0), Push(29.0)])
    needle = Needle(ORIGIN, 35.0, 1.0)
    path = plan.arcs(needle)
    places = chain_points(1 / 35.0, rows((20.0, 1.0), (51.0, 4.0)), depths)[0]
    near = nearest_on_all(path, ORIGIN.position_mm, [tuple(p) for p in places.tolist()])
    assert max(one.distance_mm for one in near) < 1e-9
    assert [one.at_mm for one in near] == pytest.approx(depths.tolist(), abs=1e-6)


def test_the_nearest_places_are_those_of_the_exact_kinematics() -> None:
    random = np.random.default_rng(1)
    points = random.normal(scale=30.0, size=(200, 3))
    plan = Plan.of([Push(40.0), Roll(1.0), Push(110.0), Roll(4.0), Push(29.0)])
    needle = Needle(ORIGIN, 35.0, 1.0)
    found = feet_of(points, 1 / 35.0, rows((40.0, 1.0), (150.0, 4.0)), 179.0)
    places = [tuple(p) for p in points.tolist()]
    expected = nearest_on_all(plan.arcs(needle), ORIGIN.position_mm, places)
    away = np.linalg.norm(points - found.points_mm, axis=1)
    assert away == pytest.approx(np.array([one.distance_mm for one in expected]), abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_beam_finds_what_all_sequences_have(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    space = space_of("two_rolls", seed, length_mm=60.0)
    everything = [
        ((a, i), (b, j))
        for a, b in itertools.combinations(space.places, 2)
        for i, j in itertools.product(range(3), repeat=2)
    ]
    best = misfits(space, everything).min()
    monkeypatch.setattr(search, "MOST_EXHAUSTIVE", 0)
    (found,) = best_sequences(space, 2, 1)
    assert misfits(space, [found])[0] == pytest.approx(best)


def test_few_sequences_are_all_tried() -> None:
    space = space_of("one_roll", 2, length_mm=30.0)
    found = best_sequences(space, 1, 10_000)
    assert len(found) == 3 * len(space.places)
    assert list(misfits(space, found)) == sorted(misfits(space, found))


def test_no_sequence_has_rolls_that_are_too_near() -> None:
    space = space_of("two_rolls", 1, length_mm=30.0)
    apart = Space(space.points_mm, space.depths_mm, space.curvature_per_mm, 2.0, ANGLES, 5, Start())
    found = best_sequences(apart, 2, 10_000)
    assert found
    assert all(second[0] - first[0] >= 5 for first, second in found)
    assert best_sequences(apart, 5, 10) == []


def test_the_search_needs_no_start() -> None:
    """The misfit is that of the best start, which another method finds too."""
    space = space_of("one_roll", 5, length_mm=40.0)
    steps = ((9, 1),)
    places = chain_points(space.curvature_per_mm, space.rolls([steps]), space.depths_mm)[0]

    def apart(pose: object) -> object:
        from scipy.spatial.transform import Rotation  # type: ignore[import-untyped]

        vector = np.asarray(pose)
        turned = Rotation.from_rotvec(vector[:3]).apply(places) + vector[3:]
        return (turned - space.points_mm).ravel()

    starts = np.random.default_rng(1).normal(size=(20, 6)) * [2, 2, 2, 40, 40, 40]
    best = min(2.0 * scipy.optimize.least_squares(apart, one).cost for one in starts)
    assert misfits(space, [steps])[0] == pytest.approx(best, rel=1e-6)


def problem(seed: int) -> tuple[_Problem, np.ndarray[tuple[int], np.dtype[np.float64]]]:
    points = points_of("two_rolls", seed)
    local = points - points[0]
    freedom = Freedom(True, True, True, 1 / 60.0)
    made = _Problem(local, rows((31.0, 1.0), (66.0, 3.0)), 101.0, 1 / 55.0, freedom)
    return made, np.random.default_rng(seed).normal(scale=0.2, size=7)


@pytest.mark.parametrize("seed", range(3))
def test_the_gradient_of_the_fit_is_right(seed: int) -> None:
    made, unknowns = problem(seed)
    gradient = made.slopes(unknowns).T @ made.residuals(unknowns)
    for index in range(7):
        step = np.zeros(7)
        step[index] = 1e-6
        costs = [0.5 * np.sum(made.residuals(unknowns + sign * step) ** 2) for sign in (1, -1)]
        quotient = (costs[0] - costs[1]) / 2e-6
        assert gradient[index] == pytest.approx(quotient, rel=1e-3, abs=1e-2)


def test_an_exact_trace_is_fitted_exactly() -> None:
    made = MAKE.make("two_rolls", 4, noise_mm=0.0)
    rolls = rows(*((depth, math.radians(angle)) for depth, angle in made.rolls))
    points = np.array(made.points)
    heading, bevel = np.array(made.heading), np.array(made.bevel)
    frame = np.column_stack([heading, bevel, np.cross(heading, bevel)])
    begin = Fitted(1 / 63.0, points[0] + 0.5, frame)
    found = fit_chain(points, rolls, 101.0, begin, Freedom(True, True, True, 1 / 60.0))
    assert 1.0 / found.curvature_per_mm == pytest.approx(60.0, abs=0.05)
    assert math.sqrt(found.squares_mm2 / len(points)) < 0.01
    assert found.frame == pytest.approx(frame, abs=2e-3)
