"""A tissue that answers, for simulated needles: in each segment it picks how the needle bends.

A segment is what the tip travels from the entry, or from a roll, to the next roll. The tissue picks
a factor of the curvature for it, and the error of the roll before it, within the bounds of
`ntagen.scene.Tissue`, or draws them with its spreads.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final, Protocol

import numpy as np

from ntagen.scene import Tissue

Pick = tuple[float, float]
"""A factor of the curvature, and the error of the roll before in rad."""

EXPECTED: Final[Pick] = (1.0, 0.0)


class Answers(Protocol):
    """Picks of a tissue."""

    def pick(self, *, rolls_err: bool) -> Pick:
        """The pick for the next segment.

        Args:
            rolls_err: Whether there was a roll before it that may err.
        """


class Corners:
    """A tissue that picks corners of its bounds or their middle.

    Args:
        tissue: The bounds.
        seed: The seed of its choices.
    """

    def __init__(self, tissue: Tissue, seed: int) -> None:
        self._tissue = tissue
        self._random = np.random.default_rng([seed, 1])

    def pick(self, *, rolls_err: bool) -> Pick:
        """See `Answers`."""
        factor = float(self._random.choice(self._tissue.factors))
        error = float(self._random.choice(self._tissue.roll_errors_rad))
        return factor, error if rolls_err else 0.0


class Between:
    """A tissue that picks any value within its bounds.

    Args:
        tissue: The bounds.
        seed: The seed of its choices.
    """

    def __init__(self, tissue: Tissue, seed: int) -> None:
        self._tissue = tissue
        self._random = np.random.default_rng([seed, 2])

    def pick(self, *, rolls_err: bool) -> Pick:
        """See `Answers`."""
        x, y = self._tissue.curvature_ratio, self._tissue.roll_rad
        factor = 1.0 + float(self._random.uniform(-x, x))
        error = float(self._random.uniform(-y, y))
        return factor, error if rolls_err else 0.0


class Drawn:
    """A tissue with chance: the logarithm of the factor and the error are normal.

    The model of a plan draws the same (`templates/uppaal/chance.c.jinja`), with other numbers.

    Args:
        tissue: Its spreads.
        seed: The seed of what it draws.
    """

    def __init__(self, tissue: Tissue, seed: int) -> None:
        self._tissue = tissue
        self._random = np.random.default_rng([seed, 3])

    def pick(self, *, rolls_err: bool) -> Pick:
        """See `Answers`."""
        factor = math.exp(self._random.normal(0.0, self._tissue.curvature_ratio))
        error = float(self._random.normal(0.0, self._tissue.roll_rad))
        return factor, error if rolls_err else 0.0


class Given:
    """A tissue whose picks are given, and that does what is expected after them."""

    def __init__(self, picks: Sequence[Pick] = ()) -> None:
        self._picks: Iterator[Pick] = iter(picks)

    def pick(self, *, rolls_err: bool) -> Pick:
        """See `Answers`."""
        factor, error = next(self._picks, EXPECTED)
        return factor, error if rolls_err else 0.0
