"""Rates with intervals, and spreads."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

CONFIDENCE: Final = 0.95


@dataclass(frozen=True, slots=True)
class Rate:
    """How often something happened.

    Attributes:
        count: How many times.
        of: In how many runs.
        low: The lower end of the interval of the true rate.
        high: Its upper end.
    """

    count: int
    of: int
    low: float
    high: float

    @property
    def rate(self) -> float | None:
        """The part of the runs; None without a run."""
        return self.count / self.of if self.of else None


@dataclass(frozen=True, slots=True)
class Spread:
    """Least, mean and greatest value."""

    min: float
    avg: float
    max: float


def rate_of(count: int, of: int, confidence: float = CONFIDENCE) -> Rate:
    """A rate with its interval of Clopper and Pearson (1934), which is never too narrow.

    Args:
        count: How many times it happened.
        of: In how many runs; with none, the rate can be anything.
        confidence: The probability with which such an interval has the true rate in it, at least.

    Raises:
        ValueError: A number is negative, or the first is the greater one.
    """
    if not 0 <= count <= of:
        raise ValueError(f"{count} of {of} is no rate")
    # Importing the statistics of SciPy takes 0.5 s; these two functions are all of it.
    from scipy.special import betaincinv  # type: ignore[import-untyped]

    rest = 0.5 * (1.0 - confidence)
    low = float(betaincinv(count, of - count + 1, rest)) if count else 0.0
    high = float(betaincinv(count + 1, of - count, 1.0 - rest)) if count < of else 1.0
    return Rate(count, of, low, high)


def spread_of(values: Iterable[float]) -> Spread | None:
    """The spread of values, in whatever order they come; None if there are none."""
    found = list(values)
    if not found:
        return None
    # An exact sum does not depend on the order of the runs.
    return Spread(min(found), math.fsum(found) / len(found), max(found))
