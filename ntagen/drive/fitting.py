"""The settings that fit a needle and a scene, as after a calibration.

What a needle does when it is driven is not needed for this, and is not imported.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from ntagen.drive.force import fitting_spacing_mm
from ntagen.drive.settings import Settings
from ntagen.drive.shells import sensing_margin_mm
from ntagen.needle.errors import Errors
from ntagen.needle.priors import Priors
from ntagen.scene import Scene, Tissue

if TYPE_CHECKING:
    from ntagen.needle.phantom_parameters import PhantomParameters, Shape

_REACTION_S: Final = 0.07
"""From a sample to the stop byte at most 20 ms; and GRBL has computed 50 ms of motion ahead."""

_SLOWEST_RAMP_MM_PER_S2: Final = 10.0
"""The acceleration that GRBL has if nobody sets another one."""


def overrun_mm(
    speed_mm_per_s: float, acceleration_mm_per_s2: float = _SLOWEST_RAMP_MM_PER_S2
) -> float:
    """How far a needle goes on after it was seen that it must stop: reaction, then v²/2a."""
    v = speed_mm_per_s
    return v * _REACTION_S + v * v / (2.0 * acceleration_mm_per_s2)


def settings_for(settings: Settings, errors: Errors, scene: Scene, known: str) -> Settings:
    """The settings that fit the virtual needle and the scene, as after a calibration.

    The priors are at least the needle's errors, and the bounds or spreads of the tissue. The
    sensing margin is that of the thinnest shell in the scene. If the driver does not know all
    regions, pushes become so short that it feels a region before it can pierce it.

    Raises:
        InputError: No push is short enough for that.
    """
    priors = replace(
        settings.priors,
        roll_rad=max(settings.priors.roll_rad, errors.roll_rad),
        noise_mm=max(settings.priors.noise_mm, errors.noise_mm or 0.0),
    )
    if scene.tissue.kind != "static":
        priors = _expecting(priors, scene.tissue)
    otherwise_mm = settings.sensing_margin_mm
    margins_mm = (
        sensing_margin_mm(region, scene.detections, otherwise_mm) for region in scene.criticals
    )
    margin_mm = min([otherwise_mm, *margins_mm])
    settings = replace(settings, priors=priors, sensing_margin_mm=margin_mm)
    if known == "all" or not settings.force_sensing:
        return settings
    return settings.with_spacing(fitting_spacing_mm(settings, margin_mm, scene.needle.length_mm))


def _expecting(priors: Priors, tissue: Tissue) -> Priors:
    """The priors of an estimator in such a tissue: what it may do is no surprise."""
    x, y = tissue.curvature_ratio, tissue.roll_rad
    return replace(
        priors,
        curvature_ratio=max(priors.curvature_ratio, x),
        curvature_drift=max(priors.curvature_drift, x),
        roll_rad=max(priors.roll_rad, y),
    )


def settings_for_phantom(
    settings: Settings,
    parameters: PhantomParameters,
    scene: Scene,
    known: str,
) -> Settings:
    """The settings that fit a phantom needle and the scene, as after a calibration.

    Predictions then err as much as the estimator says (`tests/benchmarks/filters.py`). If rolls are
    compensated, the spread of the friction is left of the lag.

    Raises:
        InputError: No push is short enough to feel a hidden region before it is pierced.
    """
    sensing, torsion, shape = parameters.sensing, parameters.torsion, parameters.shape
    curvature_drift, turn_drift_rad = drifts_of(shape)
    spread_rad = torsion.lag_rad * torsion.spread_ratio
    reinsertion = parameters.reinsertion
    priors = replace(
        settings.priors,
        curvature_ratio=shape.curvature_ratio,
        noise_mm=math.hypot(sensing.noise_mm, sensing.step_mm),
        distortion_mm=sensing.distortion_mm.std,
        curvature_drift=curvature_drift,
        turn_drift_rad=turn_drift_rad,
        lag_rad=math.hypot(spread_rad, torsion.lag_rad - settings.compensated_lag_rad),
        first_ratio=shape.first_ratio,
        bite_mm=(1.0 - reinsertion.bite_ratio) * reinsertion.bite_mm,
        shape_spacing_mm=sensing.shape_apart_mm,
    )
    calibrated = replace(settings, priors=priors, force_noise_n=sensing.noise_n)
    return settings_for(calibrated, Errors(), scene, known)


def drifts_of(shape: Shape) -> tuple[float, float]:
    """`Priors.curvature_drift` and `Priors.turn_drift_rad` of needles that bend like this."""
    # It takes NumPy, which a plan does without.
    from ntagen.needle.fluctuations import DRIFT_LENGTH_MM, DRIFT_RATIO

    wobble_rad = DRIFT_RATIO * shape.turn_rad.std
    steady_rad = DRIFT_LENGTH_MM * shape.turn_rad_per_mm
    return DRIFT_RATIO * shape.curvature.std, math.hypot(wobble_rad, steady_rad)
