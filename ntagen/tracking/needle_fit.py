"""How a needle bends, from insertions of a recipe: radius, bevel, and lag of rolls.

Each insertion is estimated by itself (`ntagen.needle.estimate`), with nothing assumed of how the
needle bends and of the errors of its rolls, and with what tissue was measured to do: curvature and
bend plane swing along the depth (`ntagen.needle.phantom_parameters` has the sources). That gives
for each insertion the angle of the bevel, the curvature, and by how much each roll of the tip fell
short, with their covariance.

All insertions together then give three numbers by generalised least squares: the bevel, the
logarithm of the curvature, and the lag at a depth of 100 mm, which grows with the square of the
depth (Reed, Okamura and Cowan, 2009). A roll of the base by an angle turns the tip by less, by the
lag, whatever its direction. So rolls in both directions are needed: a bend plane that the tissue
turns looks like a lag in one of them, and like less than none in the other.

Insertions differ by more than each errs: curvature and friction have a spread between them. If the
insertions differ by more than all that explains, all errors are made larger by the same factor (the
root of the reduced chi-square; R. T. Birge, "The calculation of errors by the method of least
squares", Phys. Rev. 40, 1932).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.drive.fitting import drifts_of
from ntagen.errors import DeviceError, InputError
from ntagen.needle.estimate import Estimator
from ntagen.needle.kinematics import push, roll
from ntagen.needle.measurement import Measurement
from ntagen.needle.phantom_parameters import PhantomParameters
from ntagen.needle.priors import Priors
from ntagen.needle.vectors import distance
from ntagen.scene import Needle, Pose
from ntagen.tracking.insertions import Insertion
from ntagen.tracking.recipe import is_seen, measured_noise_mm, require_plausible, require_recipe
from ntagen.units import deg_from_rad

_Array = NDArray[np.float64]

MOST_NOISE_MM: Final = 1.0
MOST_RADIUS_RATIO: Final = 0.2
MOST_BEVEL_RAD: Final = math.radians(10.0)
MOST_LAG_RAD: Final = math.radians(20.0)
"""Results with larger standard deviations are refused: plans with them would err too much. That of
the lag is for the depth of the insertions."""

SUSPECT: Final = 4.0
"""An insertion is bad if it is so many standard deviations from the others: once in 10^4."""

_MEASURED: Final = PhantomParameters()

TISSUE: Final = Priors(
    position_mm=2.0,
    heading_rad=math.radians(5.0),
    bevel_rad=math.radians(90.0),
    curvature_ratio=1.5,
    roll_rad=math.radians(60.0),
    curvature_drift=drifts_of(_MEASURED.shape)[0],
    turn_drift_rad=drifts_of(_MEASURED.shape)[1],
    distortion_mm=_MEASURED.sensing.distortion_mm.std,
    first_ratio=_MEASURED.shape.first_ratio,
)
"""What is assumed of an insertion: the swings of measured insertions, and little of the rest."""

SPREAD_RATIO: Final = _MEASURED.shape.curvature_ratio
FRICTION_RATIO: Final = _MEASURED.torsion.spread_ratio
BASE_RAD: Final = math.radians(1.0)
"""The spread of curvature, friction and angle of the base between insertions: those of measured
insertions, and ours for the last two."""


@dataclass(frozen=True, slots=True)
class Known:
    """A number and its standard deviation."""

    value: float
    std: float


@dataclass(frozen=True, slots=True)
class Found:
    """The needle that was found.

    Attributes:
        needle: The needle of the scene with the radius and the bevel that were found.
        radius_mm: The radius, and its error.
        bevel_rad: The angle about the heading from the bevel of the scene to the true one.
        lag_rad: The lag of rolls at a depth of 100 mm.
        noise_mm: The standard deviation of each measured coordinate, from neighbouring positions.
        names: The names of the insertions.
        alone: The radius in mm, the bevel and the lag in rad that each insertion shows by itself;
            nan for the lag of one without a roll that shows it.
        residuals_mm: Root mean square of the distances of the positions from the path of each.
        left_out_mm: How far the tip ends from where a needle would be that is known from all other
            insertions only.
        scatter: By this factor all errors were made larger, since insertions differ by more than
            was assumed; at least 1.
        suspect: The insertion that does not fit the others; empty if all do.
    """

    needle: Needle
    radius_mm: Known
    bevel_rad: Known
    lag_rad: Known
    noise_mm: float
    names: tuple[str, ...]
    alone: tuple[tuple[float, float, float], ...]
    residuals_mm: tuple[float, ...]
    left_out_mm: tuple[float, ...]
    scatter: float
    suspect: str


@dataclass(frozen=True, slots=True)
class _Shown:
    """What one insertion shows: values, their covariance, how far each is by the lag of 1 rad."""

    values: _Array
    covariance: _Array
    lags: _Array
    rms_mm: float


def find_needle(needle: Needle, insertions: Sequence[Insertion]) -> Found:
    """Radius, bevel and lag of a needle.

    Args:
        needle: The needle as the scene describes it; its radius is a first guess only.
        insertions: The insertions; each begins at the entry of the scene.

    Raises:
        InputError: The insertions do not tell the three, or are not of this scene.
    """
    require_recipe(insertions)
    for one in insertions:
        require_plausible(one, needle.tip)
    noise_mm = measured_noise_mm(insertions)
    if noise_mm > MOST_NOISE_MM:
        raise InputError(
            f"the measured positions have a noise of {noise_mm:.2f} mm in each coordinate, and "
            f"{MOST_NOISE_MM:g} mm is allowed\nhint: is the tracker far away, or metal near it? "
            "Rest at each depth, and take the mean of some samples"
        )
    shown = [_shown(one, needle, noise_mm) for one in insertions]
    theta, covariance, scatter = _joined(shown)
    names = tuple(one.name for one in insertions)
    found = Found(
        needle=_with(needle, theta),
        radius_mm=_radius(needle, theta, covariance),
        bevel_rad=Known(float(theta[0]), math.sqrt(covariance[0, 0])),
        lag_rad=Known(float(theta[2]), math.sqrt(covariance[2, 2])),
        noise_mm=noise_mm,
        names=names,
        alone=tuple(_alone(one, needle) for one in shown),
        residuals_mm=tuple(one.rms_mm for one in shown),
        left_out_mm=tuple(_left_out_mm(needle, insertions, shown)),
        scatter=scatter,
        suspect=_suspect(names, shown),
    )
    _require_sure(found, max(one.depth_mm for one in insertions))
    return found


def _with(needle: Needle, theta: _Array) -> Needle:
    """The needle with this bevel and curvature."""
    tip = roll(needle.tip, float(theta[0]))
    return replace(needle, tip=tip, radius_mm=needle.radius_mm * math.exp(-float(theta[1])))


def _radius(needle: Needle, theta: _Array, covariance: _Array) -> Known:
    radius_mm = _with(needle, theta).radius_mm
    return Known(radius_mm, radius_mm * math.sqrt(covariance[1, 1]))


# What each insertion shows.


def _shown(insertion: Insertion, needle: Needle, noise_mm: float) -> _Shown:
    """The estimate of one insertion, with nothing assumed of the needle.

    Raises:
        InputError: There is none.
    """
    estimator = Estimator(needle.tip, needle.radius_mm, replace(TISSUE, noise_mm=noise_mm))
    turns = list(insertion.turns)
    depth_mm = 0.0
    for at_mm, place_mm in zip(insertion.depths_mm, insertion.places_mm, strict=True):
        while turns and turns[0].depth_mm < at_mm:
            turn = turns.pop(0)
            estimator.push(turn.depth_mm - depth_mm)
            depth_mm = max(depth_mm, turn.depth_mm)
            estimator.roll(turn.angle_rad)
        estimator.push(at_mm - depth_mm)
        depth_mm = max(depth_mm, at_mm)
        estimator.measure(Measurement(at_mm, place_mm, 0.0))
    try:
        rms_mm = estimator.estimate().rms_mm
    except DeviceError as error:
        raise InputError(f"{insertion.name}: {error}") from error
    values, covariance = estimator.learned()
    made = insertion.turns[: len(values) - 2]
    # The tip turns by less than the base, so the error of a roll has the sign against it.
    squares = [-math.copysign((one.depth_mm / 100.0) ** 2, one.angle_rad) for one in made]
    values = values.copy()
    values[2:] += insertion.compensated_rad * np.array(squares)
    kept = [0, 1, *(2 + index for index, one in enumerate(made) if is_seen(insertion, one))]
    lags = np.array([0.0, 0.0, *squares])[kept]
    return _Shown(values[kept], covariance[np.ix_(kept, kept)], lags, rms_mm)


def _alone(shown: _Shown, needle: Needle) -> tuple[float, float, float]:
    """Radius, bevel and lag that an insertion shows by itself."""
    bevel_rad, growth, *rolls = shown.values.tolist()
    weights = shown.lags[2:]
    lag_rad = float(weights @ rolls / (weights @ weights)) if len(rolls) else math.nan
    return needle.radius_mm * math.exp(-growth), bevel_rad, lag_rad


# All insertions together.


def _joined(shown: Sequence[_Shown]) -> tuple[_Array, _Array, float]:
    """Bevel, logarithm of the curvature and lag; their covariance; and the scatter.

    The spread of the friction grows with the lag itself, so all three are looked for again with the
    lag that was found.
    """
    theta: _Array = np.zeros(3)
    for _ in range(3):
        normal: _Array
        normal, right, squares, count = np.zeros((3, 3)), np.zeros(3), 0.0, 0
        for one in shown:
            design, weights = _weighed(one, float(theta[2]))
            normal += design.T @ weights @ design
            right += design.T @ weights @ one.values
        theta = np.asarray(np.linalg.solve(normal, right))
        for one in shown:
            design, weights = _weighed(one, float(theta[2]))
            off = one.values - design @ theta
            squares += float(off @ weights @ off)
            count += len(off)
    scatter = max(1.0, math.sqrt(squares / max(1, count - 3)))
    return theta, np.asarray(scatter**2 * np.linalg.inv(normal)), scatter


def _weighed(shown: _Shown, lag_rad: float) -> tuple[_Array, _Array]:
    """How the values of an insertion depend on the three numbers, and their weights."""
    count = len(shown.values)
    design = np.zeros((count, 3))
    design[0, 0] = design[1, 1] = 1.0
    design[:, 2] = shown.lags
    spread = np.full(count, BASE_RAD**2)
    spread[1] = SPREAD_RATIO**2
    friction = FRICTION_RATIO * lag_rad * shown.lags
    covariance = shown.covariance + np.diag(spread) + np.outer(friction, friction)
    return design, np.asarray(np.linalg.inv(covariance))


def _suspect(names: Sequence[str], shown: Sequence[_Shown]) -> str:
    """The insertion that is farthest from the others, if it is too far; empty if none is."""
    worst, name = SUSPECT, ""
    for index, one in enumerate(shown):
        rest = [other for other in shown if other is not one]
        if not any(np.any(other.lags) for other in rest):
            continue
        theta, covariance, _ = _joined(rest)
        design, weights = _weighed(one, float(theta[2]))
        off = one.values - design @ theta
        total = np.linalg.inv(weights) + design @ covariance @ design.T
        sigmas = math.sqrt(float(off @ np.linalg.solve(total, off)) / len(off))
        if sigmas > worst:
            worst, name = sigmas, names[index]
    return name


def _left_out_mm(
    needle: Needle, insertions: Sequence[Insertion], shown: Sequence[_Shown]
) -> list[float]:
    """How far the tip of each ends from where the others say; not finite if they say nothing."""
    found = []
    for index, one in enumerate(insertions):
        rest = [*shown[:index], *shown[index + 1 :]]
        if not any(np.any(other.lags) for other in rest):
            found.append(math.nan)
            continue
        theta, _, _ = _joined(rest)
        end = _predicted(_with(needle, theta), one, float(theta[2]))
        found.append(distance(end.position_mm, one.places_mm[-1]))
    return found


def _predicted(needle: Needle, insertion: Insertion, lag_rad: float) -> Pose:
    """Where the tip of a needle would be after an insertion."""
    pose, depth_mm = needle.tip, 0.0
    for turn in insertion.turns:
        pose = push(pose, needle.radius_mm, turn.depth_mm - depth_mm)
        depth_mm = turn.depth_mm
        short_rad = (lag_rad - insertion.compensated_rad) * (depth_mm / 100.0) ** 2
        pose = roll(pose, turn.angle_rad - math.copysign(short_rad, turn.angle_rad))
    return push(pose, needle.radius_mm, insertion.depth_mm - depth_mm)


def _require_sure(found: Found, depth_mm: float) -> None:
    """Refuses a result that is known too badly to plan with.

    Raises:
        InputError: It is.
    """
    degrees = deg_from_rad(1.0)
    lag_rad = found.lag_rad.std * (depth_mm / 100.0) ** 2
    known = (
        ("radius", found.radius_mm.std, MOST_RADIUS_RATIO * found.radius_mm.value, "mm", 1.0),
        ("bevel", found.bevel_rad.std, MOST_BEVEL_RAD, "deg", degrees),
        (f"lag at a depth of {depth_mm:.0f} mm", lag_rad, MOST_LAG_RAD, "deg", degrees),
    )
    for name, std, most, unit, factor in known:
        if std > most:
            raise InputError(
                f"the {name} is known to {factor * std:.1f} {unit} only (one standard deviation), "
                f"and {factor * most:.1f} {unit} is allowed\nhint: {_way_out(found)}"
            )


def _way_out(found: Found) -> str:
    """What makes a needle better known."""
    if found.suspect:
        return f"{found.suspect} does not fit the others; make it again"
    return "insert deeper, roll deeper, make more insertions, or use a tracker with less noise"
