"""Predictions: nothing of the rest is known, and exact traces are predicted."""

from __future__ import annotations

import numpy as np
import pytest

from ntagen.traces.matching import Options
from ntagen.traces.prediction import Prediction, predict
from ntagen.traces.trace import first_part
from tests.traces import BENCH, MAKE, points_of, trace


def test_an_exact_arc_is_predicted() -> None:
    found = predict(BENCH, trace(points_of("arc", noise_mm=0.0)), Options(radius="fit"))
    assert [one.from_mm for one in found] == [20.0, 30.0, 40.0]
    assert [a.ahead_mm for a in found[0].ahead] == [10.0, 20.0, 40.0]
    assert max(ahead.max_mm for one in found for ahead in one.ahead) < 0.1


def test_predictions_get_worse_with_the_distance() -> None:
    for one in predict(BENCH, trace(points_of("drift", 2)), Options(radius="fit")):
        greatest = [ahead.max_mm for ahead in one.ahead]
        assert greatest == sorted(greatest)
        assert all(ahead.at_mm <= ahead.max_mm for ahead in one.ahead)


def test_a_roll_in_the_first_part_is_found() -> None:
    points = points_of("one_roll", 3, length_mm=80.0, noise_mm=0.02)
    (depth_mm, _), *_ = MAKE.make("one_roll", 3, length_mm=80.0, noise_mm=0.02).rolls
    (found,) = predict(BENCH, trace(points), from_mm=(depth_mm + 18.0,), ahead_mm=(10.0,))
    assert len(found.match.rolls) == 1
    assert found.ahead[0].max_mm < 1.0


@pytest.mark.parametrize("seed", range(3))
def test_nothing_of_the_rest_leaks_into_a_prediction(seed: int) -> None:
    """The rest of a trace is replaced by another one: the same is predicted, bit by bit."""
    points = points_of("two_rolls", seed)
    options = Options(radius="fit")
    part, _ = first_part(trace(points), 30.0)
    count = len(part.samples.points_mm)
    way = points[count - 1] - points[count - 20]
    steps = way / np.linalg.norm(way) + np.random.default_rng(seed).normal(scale=0.2, size=(80, 3))
    other = points[count - 1] + np.cumsum(steps, axis=0)
    (before,) = predict(BENCH, trace(points), options, from_mm=(30.0,))
    (after,) = predict(BENCH, trace(np.vstack([points[:count], other])), options, from_mm=(30.0,))
    assert after.match.needle == before.match.needle
    assert after.match.plan == before.match.plan
    assert after.match.distances_mm == before.match.distances_mm
    assert after.ahead != before.ahead


def test_the_last_sample_of_the_first_part_counts() -> None:
    """So the test of leaks can fail: a change of what is known changes the match."""
    points = points_of("arc", 1)
    count = len(first_part(trace(points), 30.0)[0].samples.points_mm)
    changed = points.copy()
    changed[count - 8 : count] += 0.3
    (before,), (after,) = (predict(BENCH, trace(p), from_mm=(30.0,)) for p in (points, changed))
    assert after.match.needle != before.match.needle


def test_what_is_too_short_is_not_predicted() -> None:
    def lengths(found: list[Prediction]) -> list[tuple[float, list[float]]]:
        return [(one.from_mm, [ahead.ahead_mm for ahead in one.ahead]) for one in found]

    found = lengths(predict(BENCH, trace(points_of("arc", length_mm=46.0))))
    assert found == [(20.0, [10.0, 20.0]), (30.0, [10.0])]
    assert predict(BENCH, trace(points_of("arc", length_mm=25.0))) == []


def test_a_number_of_rolls_is_the_greatest_number() -> None:
    points = points_of("two_rolls", 1)
    found = predict(BENCH, trace(points), Options(rolls=0))
    assert all(not one.match.rolls for one in found)
