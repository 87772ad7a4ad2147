"""How sure it is that the next part of a plan touches nothing: the tube around it.

A plan is a line, and the tip is somewhere around it. How far is known: the estimator's covariance,
with what the tissue may do until there, and the errors of rolls on the way. The *tube* of a plan is
the ball of this uncertainty along the way until the driver looks at the plan again. What comes
after is planned anew from what will be measured then, so it is no part of the tube: the prospect of
that place counts instead (`ntagen.plan.prospects`).

The *confidence* of a plan is the probability that the tip stays clear of all known critical regions
in its tube, as if each region were a plane where the tube comes nearest to it. The union of the
regions is bounded by the sum.

The model plans in the scene that `Tube.asked` gives: regions in reach are larger by the width of
the tube, and the target is smaller. So its plans are nearly always those that are followed.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from statistics import NormalDist
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.drive.records import Foreseen
from ntagen.drive.settings import Settings
from ntagen.needle.estimate import Estimate
from ntagen.needle.kinematics import Arc
from ntagen.plan.actions import Plan, Roll
from ntagen.plan.prospects import first_part
from ntagen.plan.stricter import deeper
from ntagen.rounding import MOST_ERROR_MM
from ntagen.scene import Region, Scene

_Array = NDArray[np.float64]

_SAMPLE_MM: Final = 0.5
"""Ways are sampled this densely."""

_LEAST_STD_MM: Final = 1e-6

_NORMAL: Final = NormalDist()

_FREE_MM: Final = 2.0 * MOST_ERROR_MM
"""So far from the tip a region that is made larger ends: a model that starts in it has no plan."""


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
        self._scene = scene
        self._needle = scene.needle
        self._regions = regions
        self._settings = settings
        self._length_mm = settings.review_mm
        self._roll_rad = settings.priors.roll_std_rad(estimate.path.depth_mm)
        # The spread grows evenly enough between three places.
        self._at_mm = (0.0, 0.5 * self._length_mm, self._length_mm)
        # Many plans begin alike.
        self._known: dict[Plan, float] = {}
        self._estimate = estimate

    @cached_property
    def _std_mm(self) -> list[float]:
        return [self._estimate.position_std_mm(at_mm) for at_mm in self._at_mm]

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
        _, places, stds_mm = self._along(first)
        touched = 0.0
        for region in self._regions:
            sigmas = float(np.min(region.shape.distance_mm(places) / stds_mm))
            touched += _NORMAL.cdf(-sigmas)
        return max(0.0, 1.0 - touched)

    def foreseen(self, plan: Plan, time_s: float, depth_mm: float) -> Foreseen:
        """The record of the tube of a plan that begins at this time and depth."""
        lengths_mm, places, stds_mm = self._along(first_part(plan, self._length_mm))
        x_mm, y_mm, z_mm = places.T.tolist()
        return Foreseen(
            time_s=time_s,
            depth_mm=depth_mm,
            length_mm=tuple(lengths_mm.tolist()),
            std_mm=tuple(stds_mm.tolist()),
            x_mm=tuple(x_mm),
            y_mm=tuple(y_mm),
            z_mm=tuple(z_mm),
            confidence=self.confidence(plan),
        )

    def _along(self, first: Plan) -> tuple[_Array, _Array, _Array]:
        """Samples of a plan's first part: lengths from the tip, places, standard deviations."""
        is_rolled = any(isinstance(action, Roll) for action in first.actions)
        lengths_mm, points, std_mm, way_mm = [], [], [], 0.0
        for arc in first.arcs(self._needle) or (Arc(self._needle.tip, math.inf, 0.0),):
            count = max(1, math.ceil(arc.length_mm / _SAMPLE_MM))
            for along_mm in np.linspace(0.0, arc.length_mm, count + 1):
                points.append(arc.pose_at(float(along_mm)).position_mm)
                at_mm = way_mm + float(along_mm)
                lengths_mm.append(at_mm)
                # A roll that errs turns the bend after it to the side.
                aside_mm = self._roll_rad * at_mm**2 / (2.0 * self._needle.radius_mm)
                known_mm = float(np.interp(at_mm, self._at_mm, self._std_mm))
                std_mm.append(math.hypot(known_mm, aside_mm if is_rolled else 0.0))
            way_mm += arc.length_mm
        return np.array(lengths_mm), np.array(points), np.maximum(_LEAST_STD_MM, std_mm)

    def asked(self) -> Scene:
        """The scene that the model is asked for plans of: nearly all of them hold in the tube.

        A region that the tube can reach is larger by the width of the tube there, at the confidence
        that is asked for; where there are several, each has a part of the doubt. It is larger for
        what comes after the tube, too. So there may be plans in the scene itself, and none here.
        The margins and the rounding of the model (`MOST_ERROR_MM`, also where the file has a
        coarser resolution) are allowed for everywhere, and paths are checked between steps.
        """
        tip_mm, margins = self._needle.tip.position_mm, self._settings.margins
        away_mm = {one.name: one.distance_mm(tip_mm) for one in self._regions}
        near = max(1, sum(self._reaches(one, 1) for one in away_mm.values()))
        wider_mm = {
            name: min(self._width_mm(one, near), one - _FREE_MM)
            for name, one in away_mm.items()
            if self._reaches(one, near)
        }
        criticals = tuple(
            one.grown(max(0.0, margins.clearance_mm + MOST_ERROR_MM, wider_mm.get(one.name, 0.0)))
            for one in self._scene.criticals
        )
        smaller = deeper(self._scene, margins.depth_mm + MOST_ERROR_MM)
        return replace(smaller, criticals=criticals, safety="swept", resolution_per_mm=None)

    def _reaches(self, away_mm: float, near: int) -> bool:
        """Whether the tube may touch a region at this distance from the tip."""
        return away_mm < self._length_mm + self._width_mm(away_mm, near)

    def _width_mm(self, away_mm: float, near: int) -> float:
        """How far from the plan the tip may be at this distance, if so many regions are near."""
        std_mm = float(np.interp(away_mm, self._at_mm, self._std_mm))
        return -_NORMAL.inv_cdf((1.0 - self._settings.accept) / near) * std_mm


def confidence_in(target: Region, estimate: Estimate) -> float:
    """The probability that the tip is in a target, as if its surface were a plane."""
    inside_mm = -target.distance_mm(estimate.tip.position_mm)
    return _NORMAL.cdf(inside_mm / max(_LEAST_STD_MM, estimate.position_std_mm(0.0)))
