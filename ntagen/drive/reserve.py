"""Whether a plan has enough reserve for what the estimator does not know.

The needle will be off its plan by about what the estimator says of a push that long
(`Estimate.position_std_mm`). A plan whose distances to regions, and whose depth in the last target,
are not greater than that will probably fail. It may hold now. But when it fails, the tip can be at
a place from which there is no other plan, and the needle must be pulled back. So the driver looks
for a better plan early.
"""

from __future__ import annotations

import math
from typing import Final

from ntagen.needle.estimate import Estimate
from ntagen.plan.certify import Certificate
from ntagen.scene import Region

_SIGMAS: Final = 1.0
"""So many standard deviations of the tip's position are enough reserve."""

_SURE_SIGMAS: Final = 3.0
"""The tip is surely in a target if it is this many standard deviations deep in it."""


def is_enough(certificate: Certificate, estimate: Estimate, most_mm: float = math.inf) -> bool:
    """Whether a plan from the tip has enough reserve, at each region and in the last target.

    Args:
        certificate: The plan's certificate.
        estimate: The estimate of the tip, or of one that is known as well.
        most_mm: More than this is never needed.
    """

    def needed_mm(length_mm: float) -> float:
        return min(most_mm, _SIGMAS * estimate.position_std_mm(length_mm))

    end_mm = needed_mm(certificate.length_mm)
    if certificate.target_depth_mm < end_mm:
        return False
    return all(
        # A path is never known worse on the way than at its end.
        one.distance_mm >= end_mm or one.distance_mm >= needed_mm(one.at_mm)
        for one in certificate.clearances
    )


def is_surely_in(target: Region, estimate: Estimate, depth_mm: float) -> bool:
    """Whether the tip is surely in a target, and at least this deep."""
    inside_mm = -target.distance_mm(estimate.tip.position_mm)
    return inside_mm >= max(depth_mm, _SURE_SIGMAS * estimate.position_std_mm(0.0))
