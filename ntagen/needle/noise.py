"""What noise alone does to measured positions."""

from __future__ import annotations


def squared_length_bound(probability: float, freedom: float = 3.0) -> float:
    """The squared length that a noise vector passes with this probability.

    The vector has independent coordinates with mean 0 and standard deviation 1, so that its squared
    length has a chi-square distribution. Its degrees of freedom are their number, three by default.
    """
    # scipy.stats has it under its name, and takes half a second to import.
    from scipy.special import chdtri  # type: ignore[import-untyped]

    return float(chdtri(freedom, probability))
