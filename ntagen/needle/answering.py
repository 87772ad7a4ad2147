"""A tissue that answers, for simulated needles: in each segment it picks how the needle bends.

A segment is what the tip travels from the entry, or from a roll, to the next roll. The tissue picks
a factor of the curvature for it, and the error of the roll before it, within the bounds of
`ntagen.scene.Tissue`, or draws them with its spreads.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import chain, repeat
from typing import Final

import numpy as np

from ntagen.scene import Tissue

Pick = tuple[float, float]
"""A factor of the curvature, and the error of the roll before in rad."""

Answers = Iterator[Pick]
"""The picks of a tissue, one for each segment."""

EXPECTED: Final[Pick] = (1.0, 0.0)


def corners(tissue: Tissue, seed: int) -> Answers:
    """A tissue that picks corners of its bounds or their middle."""
    random = np.random.default_rng([seed, 1])
    while True:
        yield float(random.choice(tissue.factors)), float(random.choice(tissue.roll_errors_rad))


def between(tissue: Tissue, seed: int) -> Answers:
    """A tissue that picks any value within its bounds."""
    random = np.random.default_rng([seed, 2])
    x, y = tissue.curvature_ratio, tissue.roll_rad
    while True:
        yield 1.0 + float(random.uniform(-x, x)), float(random.uniform(-y, y))


def drawn(tissue: Tissue, seed: int) -> Answers:
    """A tissue with chance: the logarithm of the factor and the error are normal."""
    random = np.random.default_rng([seed, 3])
    while True:
        factor = math.exp(random.normal(0.0, tissue.curvature_ratio))
        yield factor, float(random.normal(0.0, tissue.roll_rad))


def given(picks: Iterable[Pick] = ()) -> Answers:
    """A tissue whose picks are given, and that does what is expected after them."""
    return chain(picks, repeat(EXPECTED))
