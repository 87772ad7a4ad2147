"""The first push without a plan: whether it is free of known regions for every start error.

Where the needle is known only by the scene's description, its tip is after ``s`` mm within a ball
around the expected place. The ball's radius adds up what each start error does at most (`SIGMAS`
standard deviations of the estimator's priors): the entry is moved, the heading is turned, and over
the sideways part ``s^2 / 2r`` of the arc the bevel is turned and the curvature differs.
"""

from __future__ import annotations

from typing import Final

from ntagen.needle.estimate import Priors
from ntagen.needle.kinematics import Arc
from ntagen.plan.certify import clearance
from ntagen.scene import Scene

SIGMAS: Final = 3.0
"""Start errors count up to this many standard deviations."""


def start_error_mm(length_mm: float, radius_mm: float, priors: Priors) -> float:
    """The radius of the ball in which the tip is after a push from the entry."""
    sideways_mm = length_mm**2 / (2.0 * radius_mm)
    return SIGMAS * (
        priors.position_mm
        + length_mm * priors.heading_rad
        + sideways_mm * (priors.bevel_rad + priors.curvature_ratio)
    )


def is_free(scene: Scene, length_mm: float, priors: Priors) -> bool:
    """Whether a push of this length keeps out of all critical, detection and unexplored regions."""
    needle = scene.needle
    arcs = (Arc(needle.tip, needle.radius_mm, length_mm),)
    reach_mm = start_error_mm(length_mm, needle.radius_mm, priors)
    return all(
        clearance(arcs, needle.tip.position_mm, region).distance_mm > reach_mm
        for region in scene.avoided
    )
