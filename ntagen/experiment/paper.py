"""What the paper reports (section 4): Experiment 2, virtual needle, 50 runs a line.

Times are seconds on the paper's computer; overall times have the needle's motion in them. The
paper does not say whether plans are counted for a run or for all; the numbers are as printed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

Spread = tuple[float, float, float]
"""Minimum, average, maximum."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the paper's table.

    Attributes:
        reach_rate: The part of the runs that reached the target.
        hit_rate: The part of the runs that hit a critical region.
        adjustments: How often the needle was pulled back in a run.
        plans: The number of motion plans.
        synthesis_s: The time of a synthesis.
        overall_s: The time of a run.
        runs: The number of runs; None where the paper says 5 to 7.
    """

    reach_rate: float
    hit_rate: float
    adjustments: Spread
    plans: int
    synthesis_s: Spread
    overall_s: Spread
    runs: int | None = 50


_VIRTUAL: Final = {
    "No_CR/-": Line(1.0, 0.0, (0, 0.0, 0), 232, (7.53, 7.60, 8.00), (18.26, 24.94, 34.16)),
    "Small/All": Line(1.0, 0.0, (0, 0.0, 0), 150, (6.83, 6.92, 7.16), (19.05, 23.42, 31.51)),
    "Small/None": Line(1.0, 0.0, (0, 0.0, 0), 150, (6.63, 6.71, 6.96), (18.84, 23.82, 33.30)),
    "Large/All": Line(0.0, 0.0, (0, 0.0, 0), 0, (0.03, 0.04, 0.05), (5.17, 5.18, 5.20)),
    "Large/None": Line(0.0, 0.0, (1, 1.0, 1), 150, (0.04, 3.39, 6.86), (19.97, 20.15, 20.43)),
    "Surface/All": Line(1.0, 0.0, (0, 0.06, 1), 27, (0.10, 5.67, 6.96), (20.22, 27.44, 115.02)),
    "Surface/None": Line(0.4, 0.0, (0, 0.65, 3), 93, (0.04, 2.41, 6.17), (19.30, 88.03, 120.0)),
    "Tunnel/All": Line(1.0, 0.0, (0, 0.16, 1), 166, (0.09, 1.85, 2.31), (13.91, 17.51, 38.42)),
    "Tunnel/None": Line(0.94, 0.0, (0, 0.83, 3), 525, (0.04, 4.94, 9.38), (20.72, 34.23, 110.51)),
}

_REAL: Final = {
    "real/No_CR": Line(
        0.6667, 0.0, (1, 6.0, 13), 469, (0.05, 1.14, 7.87), (34.16, 99.30, 120.0), None
    ),
    "real/Small": Line(0.4, 0.0, (1, 1.2, 2), 346, (0.06, 2.38, 9.53), (22.97, 42.62, 61.12), None),
    "real/Large": Line(0.0, 0.0, (0, 0.0, 0), 0, (0.04, 0.06, 0.09), (6.70, 6.79, 6.95), None),
    "real/Surface": Line(
        0.5714, 0.0, (1, 2.86, 7), 267, (0.08, 3.09, 12.28), (38.18, 89.25, 120.0), None
    ),
    "real/Tunnel": Line(
        0.0, 0.0, (0, 1.33, 2), 317, (0.07, 2.45, 10.49), (6.85, 61.06, 120.0), None
    ),
}
"""Experiment 3, the real needle, all regions known."""

PAPER: Final[Mapping[str, Line]] = {**_VIRTUAL, **_REAL}
"""The lines by name: SCENARIO/KNOWN of Experiment 2, real/SCENARIO of Experiment 3."""
