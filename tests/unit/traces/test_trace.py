"""Traces made ready: outliers, pull-outs, depths, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ntagen.errors import InputError
from ntagen.traces.chain import Array
from ntagen.traces.face import samples_of
from ntagen.traces.trace import CHORD_MM, first_part, trace_of
from tests.traces import points_of, trace


def line(length_mm: float, spacing_mm: float = 0.5) -> Array:
    along = np.arange(0.0, length_mm + 1e-9, spacing_mm)
    return np.column_stack([0.0 * along, -along, 0.0 * along])


def straight_on(points: Array, length_mm: float = 80.0) -> Array:
    """Another rest of a trace: straight on in the last direction."""
    way = points[-1] - points[-20]
    return points[-1] + np.outer(np.arange(0.5, length_mm, 0.5), way / np.linalg.norm(way))


def check_refused(points: Array, *words: str) -> None:
    with pytest.raises(InputError) as refusal:
        trace(points)
    assert all(word in str(refusal.value) for word in (*words, "hint: ")), str(refusal.value)


def test_points_of_a_trace_are_a_chord_apart() -> None:
    thinned = trace(points_of("arc")).points_mm
    steps_mm = np.linalg.norm(np.diff(thinned, axis=0), axis=1)
    assert steps_mm.min() >= CHORD_MM
    assert 70 <= len(thinned) <= 101


@pytest.mark.parametrize("noise_mm", [0.0, 0.05, 0.1])
def test_noise_does_not_make_a_trace_longer(noise_mm: float) -> None:
    assert trace(points_of("arc", noise_mm=noise_mm)).length_mm == pytest.approx(99.5, abs=1.0)


def test_a_jump_back_is_the_pull_out() -> None:
    points = points_of("arc")
    found = trace(np.vstack([points, points[140] + 0.1, points[139]]))
    assert found.pulled_out_at == len(points)
    assert found.indices == trace(points).indices


@pytest.mark.parametrize("spacing_mm", [8.0, 12.0])
def test_a_needle_that_is_seen_seldom_jumps_forward(spacing_mm: float) -> None:
    found = trace(line(96.0, spacing_mm))
    assert found.pulled_out_at is None
    assert found.length_mm == pytest.approx(96.0)


def test_a_spike_is_left_out() -> None:
    points = points_of("one_roll")
    spiked = points.copy()
    spiked[90] += 30.0
    found = trace(spiked)
    assert found.outliers == 1
    assert 90 not in found.indices
    assert found.length_mm == pytest.approx(trace(points).length_mm, abs=0.1)


def test_a_resting_needle_adds_no_depth() -> None:
    points = line(40.0)
    noise = np.random.default_rng(1).normal(scale=0.1, size=(200, 3))
    found = trace(np.vstack([points, points[-1] + noise]))
    assert found.length_mm < 40.7


def test_a_trace_may_end_at_a_depth() -> None:
    found = trace_of(samples_of(line(40.0)), until_mm=25.0)
    assert 24.0 <= found.length_mm <= 25.0


def test_a_trace_may_begin_at_a_depth_and_other_depths_count_from_there() -> None:
    unsteady = np.vstack([line(12.0), line(12.0)[::-1], line(60.0)])
    with pytest.raises(InputError, match=r"turns back(.|\n)*--from LENGTH"):
        trace_of(samples_of(unsteady))
    found = trace_of(samples_of(unsteady), until_mm=20.0, from_mm=30.0)
    assert 19.0 <= found.length_mm <= 20.0
    # The rest is the line alone, and its first sample is where the depth begins.
    assert found.depths_mm[0] == 0.0
    assert found.samples.lines[0] > 2 * len(line(12.0))
    assert len(found.samples.points_mm) < len(line(60.0))


def test_a_beginning_beyond_the_end_is_refused() -> None:
    with pytest.raises(InputError, match=r"has 40.0 mm(.|\n)*smaller --from"):
        trace_of(samples_of(line(40.0)), from_mm=50.0)


def test_the_first_part_ends_at_its_depth() -> None:
    part, end_mm = first_part(trace(points_of("arc")), 30.0)
    assert 30.0 <= end_mm <= 32.0
    assert 29.0 <= part.length_mm <= end_mm


def test_the_first_part_depends_on_nothing_behind_it() -> None:
    points = points_of("two_rolls", 3)
    part, end_mm = first_part(trace(points), 30.0)
    count = len(part.samples.points_mm)
    rest = straight_on(points[:count])
    other, other_mm = first_part(trace(np.vstack([points[:count], rest])), 30.0)
    assert other_mm == end_mm
    assert np.array_equal(other.points_mm, part.points_mm)
    assert np.array_equal(other.depths_mm, part.depths_mm)


def test_a_spike_at_the_end_of_the_first_part_is_left_out() -> None:
    points = points_of("one_roll")
    last = first_part(trace(points), 30.0)[0].indices[-1]
    spiked = points.copy()
    spiked[last] += 20.0
    part, end_mm = first_part(trace(spiked), 30.0)
    assert last not in part.indices
    assert 30.0 <= end_mm <= 32.0


def test_no_positions_are_refused() -> None:
    check_refused(np.zeros((0, 3)), "no positions")


def test_a_short_trace_is_refused() -> None:
    check_refused(line(8.0), "moves by 8 mm", "at least 10 mm")


def test_metres_are_told_from_mm() -> None:
    check_refused(line(100.0) / 1000.0, "look like metres", "100 mm", "--unit m")


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_a_number_that_is_not_finite_is_refused_with_its_place(wrong: float) -> None:
    points = line(50.0)
    points[6, 1] = wrong
    check_refused(points, "row 7", "not finite")


def test_a_position_that_is_too_far_is_refused_with_its_place() -> None:
    points = line(50.0)
    points[6, 1] = 1e30
    check_refused(points, "row 7", "1e+30 mm away", "hint:")


def test_a_hint_about_a_trace_that_turns_back_leaves_enough_of_it() -> None:
    forth = line(6.0)
    with pytest.raises(InputError, match="turns back") as refusal:
        trace_of(samples_of(np.vstack([forth, forth[::-1], line(40.0)])))
    assert "--until" not in str(refusal.value)


def test_a_trace_that_turns_back_is_refused_with_its_place() -> None:
    forth = line(30.0)
    check_refused(np.vstack([forth, forth[::-1]]), "row 61", "turns back", "30.0 mm", "--until 30")


def test_a_pull_of_the_driver_turns_back() -> None:
    forth = line(30.0)
    check_refused(np.vstack([forth, forth[-10:][::-1], forth[-10:]]), "turns back")


def test_noise_to_the_side_does_not_turn_back() -> None:
    points = line(60.0)
    points[:, 0] += np.random.default_rng(2).normal(scale=0.4, size=len(points))
    assert trace(points).length_mm == pytest.approx(60.0, abs=3.0)


def test_a_jump_back_at_the_beginning_is_refused() -> None:
    check_refused(np.vstack([line(8.0), line(60.0)]), "jumps back", "8.0 mm")
