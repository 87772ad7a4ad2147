"""Whether a target is large enough for what can be known of the tip, before anything moves.

At best, the needle bends as expected, is never rolled or pulled back, and is measured all along the
way. What the estimator then knows of the tip at the target is not exceeded in a run: in random
tasks with the phantom needle, runs end with the same standard deviation, or up to 7 % more.
"""

from __future__ import annotations

import math
from statistics import NormalDist

from ntagen.drive.settings import Settings
from ntagen.errors import InputError
from ntagen.scene import Scene


def require_knowable(settings: Settings, scene: Scene) -> None:
    """Refuses a last target in which no tip is with the confidence that is asked for.

    Only needles that do not bend exactly as planned need the confidence, and only where the target
    keeps still.

    Raises:
        InputError: The target is too small.
    """
    target = scene.targets[-1]
    if not settings.counts_reserve or target.motion is not None:
        return
    depth_mm, std_mm = target.shape.depth_mm, _best_std_mm(settings, scene)
    normal = NormalDist()
    needed_mm, confidence = normal.inv_cdf(settings.accept) * std_mm, normal.cdf(depth_mm / std_mm)
    if depth_mm >= needed_mm:
        return
    raise InputError(
        f"the target '{target.name}' is too small for what measures the tip: its middle is "
        f"{depth_mm:.3g} mm deep, and the tip is known to {std_mm:.3g} mm at best (one standard "
        f"deviation); it would be in there with a confidence of {confidence:.3f}, and "
        f"{settings.accept:g} is asked for\n"
        f"hint: a target that is {math.ceil(100.0 * needed_mm) / 100.0:g} mm deep would do, "
        f"a tracker with less noise, or --set 'accept {math.floor(100.0 * confidence) / 100.0:g}'"
    )


def _best_std_mm(settings: Settings, scene: Scene) -> float:
    """The standard deviation of the tip at the last target, in the direction known worst."""
    # They take NumPy, which a first plan does without.
    from ntagen.needle.estimate import Estimator
    from ntagen.needle.measurement import Measurement
    from ntagen.needle.path import Path

    tip, radius_mm = scene.needle.tip, scene.needle.radius_mm
    away_mm = math.dist(tip.position_mm, scene.targets[-1].center_mm)
    length_mm = max(away_mm, settings.initial_push_mm)
    count = max(1, round(length_mm / settings.spacing_mm))
    estimator, path = Estimator(tip, radius_mm, settings.priors), Path(tip)
    for number in range(count):
        path = path.push(radius_mm, length_mm / count)
        estimator.push(length_mm / count)
        estimator.measure(Measurement(float(number), path.tip.position_mm, 0.0))
    return estimator.estimate().position_std_mm(0.0)
