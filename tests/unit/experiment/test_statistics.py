"""Intervals against published values, and spreads."""

from __future__ import annotations

import math

import pytest

from ntagen.experiment.table import rate_of, spread_of


@pytest.mark.parametrize(
    ("count", "of", "low", "high"),
    # 0 of n and n of n have closed forms: 1 - 0.025 ** (1 / n). The others: R, binom.test(k, n).
    [
        (0, 10, 0.0, 1.0 - 0.025**0.1),
        (50, 50, 0.025**0.02, 1.0),
        (1, 10, 0.002528579, 0.445016117),
        (7, 20, 0.153909205, 0.592188754),
        (0, 0, 0.0, 1.0),
    ],
)
def test_intervals(count: int, of: int, low: float, high: float) -> None:
    rate = rate_of(count, of)
    assert (rate.low, rate.high) == pytest.approx((low, high), abs=1e-6)


@pytest.mark.parametrize(("count", "of"), [(3, 10), (47, 50), (1, 200)])
def test_ends_of_intervals_leave_the_tails_of_the_binomial_distribution(
    count: int, of: int
) -> None:
    def upper_tail(rate: float, least: int) -> float:
        return sum(
            math.comb(of, k) * rate**k * (1.0 - rate) ** (of - k) for k in range(least, of + 1)
        )

    rate = rate_of(count, of)
    assert upper_tail(rate.low, count) == pytest.approx(0.025, rel=1e-6)
    assert 1.0 - upper_tail(rate.high, count + 1) == pytest.approx(0.025, rel=1e-6)


def test_impossible_counts_are_refused() -> None:
    with pytest.raises(ValueError, match="3 of 2 is no rate"):
        rate_of(3, 2)


def test_spreads_do_not_depend_on_the_order() -> None:
    values = [0.1 * k for k in range(100)]
    assert spread_of(values) == spread_of(reversed(values))
    assert spread_of([]) is None
