"""Processes along the depth: their covariances, and what they expect ahead."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.needle.fluctuations import (
    ALIKE,
    DRIFT_LENGTH_MM,
    Process,
    fluctuating,
    oscillation,
    turning,
)
from ntagen.needle.phantom_parameters import Fluctuation
from ntagen.needle.phantom_tissue import CELL_MM, fluctuation


def test_the_correlation_is_that_of_what_the_phantom_draws() -> None:
    process = Fluctuation(1.0, 20.0, 0.7)
    drawn = fluctuation(np.random.default_rng(1), 200_000, process)
    for cells in (4, 20, 40, 80):
        seen = np.mean(drawn[cells:] * drawn[:-cells])
        expected = oscillation(np.array(cells * CELL_MM), 20.0, 0.7)
        assert seen == pytest.approx(float(expected), abs=0.03)


@pytest.mark.parametrize("kind", [fluctuating, turning])
def test_a_drift_is_the_change_over_10_mm(kind: object) -> None:
    covariance = kind(0.2)  # type: ignore[operator]
    # A bend plane is looked at from the entry on, where it is known.
    one, other = np.array(0.0), np.array(DRIFT_LENGTH_MM)
    change = covariance(one, one) + covariance(other, other) - 2.0 * covariance(one, other)
    assert math.sqrt(float(change)) == pytest.approx(0.2)


def test_the_bend_plane_starts_where_the_bevel_is() -> None:
    assert float(turning(0.2)(np.array(0.0), np.array(30.0))) == pytest.approx(0.0)


@settings(max_examples=50, deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(0, 3), st.integers(0, 12)), min_size=1, max_size=15, unique=True
    ),
    st.sampled_from([fluctuating, turning]),
)
def test_rows_have_the_covariance_of_the_process(
    stretches: list[tuple[int, int]], kind: object
) -> None:
    """Also of stretches of several channels, in any order."""
    covariance = kind(0.15)  # type: ignore[operator]
    process = Process(covariance)
    depths_mm = np.array([2.5 + 5.0 * number for _, number in stretches])
    channels = np.array([channel for channel, _ in stretches])
    rows = np.zeros((len(stretches), 2 * len(stretches)))
    for index, (channel, depth_mm) in enumerate(zip(channels, depths_mm, strict=True)):
        # Every other unknown is that of something else.
        row = process.add(int(channel), float(depth_mm), 2 * index + 1)
        rows[index, : len(row)] = row
    expected = covariance(depths_mm[:, None], depths_mm[None, :])
    expected = expected * np.where(channels[:, None] == channels[None, :], 1.0, ALIKE)
    assert rows @ rows.T == pytest.approx(expected, abs=1e-6)
    ahead, rest = process.ahead(1, np.array([70.0, 72.5]), rows.shape[1])
    own = covariance(np.array([[70.0], [72.5]]), np.array([[70.0, 72.5]]))
    assert ahead @ ahead.T + rest == pytest.approx(own, abs=1e-9)
    assert np.linalg.eigvalsh(rest)[0] > -1e-9


def test_a_curvature_that_is_great_now_is_expected_to_be_small_half_a_wavelength_on() -> None:
    process = Process(fluctuating(0.15))
    process.add(0, 2.5, 0)
    rows, _ = process.ahead(0, np.array([17.5, 62.5]), 1)
    assert rows[0, 0] < -0.3 * 0.1
    assert abs(rows[1, 0]) < 0.02
