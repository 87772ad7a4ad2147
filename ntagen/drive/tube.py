"""How sure it is that the next part of a plan touches nothing: the tube around it.

A plan is a line, and the tip is somewhere around it. How far is known: the estimator's covariance,
with what the tissue may do until there, and the errors of rolls on the way. The *tube* of a plan is
the ball of this uncertainty along the way until the driver looks at the plan again. What comes
after is planned anew from what will be measured then, so it is no part of the tube: the prospect of
that place counts instead (`ntagen.plan.prospects`).

The *confidence* of a plan is the probability that the tip stays clear of all known critical regions
in its tube, as if each region were a plane where the tube comes nearest to it. The union of the
regions is bounded by the sum.
"""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import Final

import numpy as np

from ntagen.drive.settings import Settings
from ntagen.needle.estimate import Estimate
from ntagen.needle.kinematics import Arc
from ntagen.plan.actions import Plan, Roll
from ntagen.plan.prospects import first_part
from ntagen.scene import Region, Scene

_SAMPLE_MM: Final = 0.5
"""Ways are sampled this densely."""

_LEAST_STD_MM: Final = 1e-6

_NORMAL: Final = NormalDist()


class Tube:
    """What is around the ways from one place.

    Args:
        scene: The known scene, with the needle where it is.
        estimate: The estimate of the needle there.
        settings: How to drive.
        regions: The regions that must not be touched.
    """

    def __init__(
        self, scene: Scene, estimate: Estimate, settings: Settings, regions: tuple[Region, ...]
    ) -> None:
        self._needle = scene.needle
        self._regions = regions
        self._length_mm = settings.review_mm
        self._roll_rad = settings.priors.roll_std_rad(estimate.path.depth_mm)
        # The spread grows evenly enough between three places.
        self._at_mm = (0.0, 0.5 * self._length_mm, self._length_mm)
        self._std_mm = [estimate.position_std_mm(at_mm) for at_mm in self._at_mm] if regions else []
        # Many plans begin alike.
        self._known: dict[Plan, float] = {}

    def confidence(self, plan: Plan) -> float:
        """The probability that the tip touches no region until the driver looks again."""
        if not self._regions:
            return 1.0
        first = first_part(plan, self._length_mm)
        if first not in self._known:
            self._known[first] = self._confidence(first)
        return self._known[first]

    def _confidence(self, first: Plan) -> float:
        """That of what is done until the driver looks again."""
        is_rolled = any(isinstance(action, Roll) for action in first.actions)
        points, std_mm, way_mm = [], [], 0.0
        for arc in first.arcs(self._needle) or (Arc(self._needle.tip, math.inf, 0.0),):
            count = max(1, math.ceil(arc.length_mm / _SAMPLE_MM))
            for along_mm in np.linspace(0.0, arc.length_mm, count + 1):
                points.append(arc.pose_at(float(along_mm)).position_mm)
                at_mm = way_mm + float(along_mm)
                # A roll that errs turns the bend after it to the side.
                aside_mm = self._roll_rad * at_mm**2 / (2.0 * self._needle.radius_mm)
                known_mm = float(np.interp(at_mm, self._at_mm, self._std_mm))
                std_mm.append(math.hypot(known_mm, aside_mm if is_rolled else 0.0))
            way_mm += arc.length_mm
        places, stds_mm = np.array(points), np.maximum(_LEAST_STD_MM, std_mm)
        touched = 0.0
        for region in self._regions:
            sigmas = float(np.min(region.shape.distance_mm(places) / stds_mm))
            touched += _NORMAL.cdf(-sigmas)
        return max(0.0, 1.0 - touched)


def confidence_in(target: Region, estimate: Estimate) -> float:
    """The probability that the tip is in a target, as if its surface were a plane."""
    inside_mm = -target.distance_mm(estimate.tip.position_mm)
    return _NORMAL.cdf(inside_mm / max(_LEAST_STD_MM, estimate.position_std_mm(0.0)))
