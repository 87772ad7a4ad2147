"""How far the model's path may be from the exact one, and the resolution that is fine enough.

The model computes with whole units of ``1 / resolution``, and cuts the fraction of each product off
(templates/uppaal/motion.c.jinja). The error grows with the radius, the number of pushes and of
rolls. docs/rounding.md derives the bound of `path_error_mm`; its names are used here.

The bound is about everything that the model reaches: up to the *greatest depth*, which is the
needle's length, or less if every path has gone past the targets before.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from typing import Final

from ntagen import rules
from ntagen.scene import Region, Scene, Vector
from ntagen.shapes import HalfSpace
from ntagen.values import dataclass

MOST_ERROR_MM: Final = 0.05
"""A resolution that is not written is one at which the path errs by at most this."""

COARSEST_PER_MM: Final = 1000
"""A resolution that is not written is at least that of the paper."""

USUAL_PER_MM: Final = 1_000_000
"""What is chosen for most tasks."""

_STEPS: Final = (1, 2, 5)
"""A resolution that is not written is one of these, times a power of ten."""

_CUT: Final = 1.0 + 1e-6
"""Units that cutting a fraction off takes away at most; the rest is for the rounding of doubles."""

_ROOT_3: Final = math.sqrt(3.0)
_LARGEST_SINE: Final = 0.35
_LARGEST_UNIT: Final = 0.01
"""With larger errors of directions, or larger units, the derivation of the bound does not hold."""


@dataclass(frozen=True, slots=True)
class Precision:
    """What a resolution gives.

    Attributes:
        per_mm: The resolution: units in one mm.
        path_error_mm: A bound of the distance between the model's path and the exact one, at the
            same number of pushes, down to the greatest depth; infinite if none is known.
        depth_mm: The greatest depth.
        circle_error_mm: The bound on a single circle, down to the targets. With rolls rounding
            seldom does more, as it does not add up in one direction.
    """

    per_mm: int
    path_error_mm: float
    depth_mm: float
    circle_error_mm: float

    @property
    def bound(self) -> str:
        """What is known of the error, in words; the number is rounded up."""
        if not math.isfinite(self.path_error_mm):
            return "no bound of the path's error is known"
        scale = 10.0 ** (2 - math.floor(math.log10(self.path_error_mm)))
        most_mm = math.ceil(self.path_error_mm * scale) / scale
        return f"rounding moves the model's path by at most {most_mm:.3g} mm"


def units_per_mm(scene: Scene) -> int:
    """The resolution of a scene's model: the one that is given, else the one that is chosen."""
    return scene.resolution_per_mm or chosen(scene).per_mm


def precision_of(scene: Scene) -> Precision:
    """What the resolution of a scene's model gives."""
    if scene.resolution_per_mm is None:
        return chosen(scene)
    return _at(scene, scene.resolution_per_mm, _largest_mm(scene))


def chosen(scene: Scene) -> Precision:
    """The coarsest resolution at which the path errs by at most `MOST_ERROR_MM`.

    If none that fits into the model's integers is so fine, it is the one with the least error.
    """
    largest_mm = _largest_mm(scene)
    candidates = list(_candidates(largest_mm))
    for per_mm in candidates:
        if _errs_at_once(scene, per_mm):
            continue
        found = _at(scene, per_mm, largest_mm)
        if found.path_error_mm <= MOST_ERROR_MM:
            return found
    every = [_at(scene, per_mm, largest_mm) for per_mm in candidates or [COARSEST_PER_MM]]
    return min(every, key=lambda one: one.path_error_mm)


def least_margin(scene: Scene) -> tuple[float, str]:
    """The least margin of a task in mm, and whose it is.

    It is half of the least width of a region that is sought or avoided, or the least space between
    a critical region and the detection region around it.
    """
    inner = {region.name: region.shape.depth_mm for region in scene.criticals}
    found = [
        (region.shape.depth_mm, f"half of the least width of `{region.name}`")
        for region in scene.targets + scene.avoided
    ]
    found += [
        (region.shape.depth_mm - inner[region.around], f"the margin of `{region.name}`")
        for region in scene.detections
        if region.around in inner
    ]
    return min((one for one in found if one[0] > 0.0), default=(math.inf, ""))


def _candidates(largest_mm: float) -> Iterator[int]:
    """The resolutions to choose from at which this length fits, the coarsest first."""
    power = COARSEST_PER_MM
    while power <= rules.LARGEST_UNITS:
        for step in _STEPS:
            if step * power * largest_mm > rules.LARGEST_UNITS:
                return
            yield step * power
        power *= 10


def _largest_mm(scene: Scene) -> float:
    """The largest length of the model; all of them must fit."""
    needle, limits = scene.needle, scene.limits
    start = needle.tip.position_mm
    largest = max(
        math.hypot(*start) + max(scene.radii_mm),
        needle.length_mm,
        needle.speed_mm_per_s * limits.step_s,
        limits.min_roll_distance_mm,
        *(farthest_mm(region, start) for region in scene.regions),
    )
    return largest + scene.tissue.tip_mm


def farthest_mm(region: Region, start_mm: Vector) -> float:
    """The greatest length of a region in the model, in mm: from its origin, or from the start."""
    center_mm = region.center_mm
    return max(math.dist(start_mm, center_mm), math.hypot(*center_mm)) + _extent_mm(region)


def _extent_mm(region: Region) -> float:
    # A half-space has no end; only its point is in the model.
    extent_mm = 0.0 if isinstance(region.shape, HalfSpace) else region.shape.reach_mm()
    return extent_mm + region.moved_mm


# -------------------------------------------------------------------------------------- the bound


@dataclass(frozen=True, slots=True)
class _Rolls:
    """The greatest chord, sine and versine of the angles that a roll may have."""

    chord: float
    sine: float
    versine: float


@functools.lru_cache(maxsize=16)
def _rolls(angles_rad: tuple[float, ...]) -> _Rolls:
    return _Rolls(
        max((2.0 * abs(math.sin(0.5 * a)) for a in angles_rad), default=0.0),
        max((abs(math.sin(a)) for a in angles_rad), default=0.0),
        max((1.0 - math.cos(a) for a in angles_rad), default=0.0),
    )


@dataclass(frozen=True, slots=True)
class _Travel:
    """What the bound depends on.

    Attributes:
        unit: One unit of the model, as a part of a mm (or of 1, or of a rad), with `_CUT`.
        radius_mm: The largest radius of the motion circle.
        push_mm: The length of a push.
        turn_rad: The largest turn of a push, of the model or exact.
        lost_rad: By how much the model's turn of a push differs from the exact one, at most.
        pushes: The greatest number of pushes.
        folds: How many rolls there may be, those of the tissue included.
        rolls: What rolls may do.
    """

    unit: float
    radius_mm: float
    push_mm: float
    turn_rad: float
    lost_rad: float
    pushes: int
    folds: int
    rolls: _Rolls


def _at(scene: Scene, per_mm: int, largest_mm: float) -> Precision:
    """What a resolution gives; a bound that is not known is infinite."""
    does_fit = per_mm * largest_mm <= rules.LARGEST_UNITS
    travel = _travel(scene, per_mm) if does_fit else None
    length_mm = scene.needle.length_mm
    if travel is None:
        return Precision(per_mm, math.inf, length_mm, math.inf)
    pushes = _most_pushes(scene, travel)
    circle_mm = _bound_mm(travel, _straight_pushes(scene, travel), 0)
    path_mm = _bound_mm(travel, pushes, travel.folds)
    return Precision(per_mm, path_mm, pushes * travel.push_mm, circle_mm)


def _errs_at_once(scene: Scene, per_mm: int) -> bool:
    """Whether the straight way alone makes the error of a resolution too great: a quick look."""
    travel = _travel(scene, per_mm)
    if travel is None:
        return True
    straight = _straight_pushes(scene, travel)
    return _bound_mm(travel, straight, travel.folds) > MOST_ERROR_MM


def _straight_pushes(scene: Scene, travel: _Travel) -> int:
    """The pushes of a path straight down to the end of the targets; no path needs fewer."""
    return max(0, min(travel.pushes, math.ceil(_below_mm(scene) / travel.push_mm)))


def _travel(scene: Scene, per_mm: int) -> _Travel | None:
    """The travel of a scene's model; none if it does not move."""
    needle, limits, tissue = scene.needle, scene.limits, scene.tissue
    push_mm = needle.speed_mm_per_s * limits.step_s
    dt, velocity_mm, _ = rules.time_units(limits.step_s, needle.speed_mm_per_s)
    if dt > rules.LARGEST_UNITS:
        return None
    scale = float(per_mm)
    # As step() of the model computes it, operation by operation.
    insertion = int(((rules.units_of(velocity_mm, per_mm) / scale) * dt) * scale)
    if insertion < 1:
        return None
    turns = []
    for radius_mm in scene.radii_mm:
        circle = rules.units_of(radius_mm, per_mm)
        if circle < 1:
            return None
        turn = int(((insertion / scale) / (circle / scale)) * scale) / scale
        turns.append((turn, push_mm / radius_mm))
    picks = limits.max_rolls + 1 + limits.free_bevel if tissue.is_adversarial else 0
    return _Travel(
        unit=_CUT / scale,
        radius_mm=max(scene.radii_mm) + 1.0 / scale,
        push_mm=push_mm,
        turn_rad=max(max(pair) for pair in turns),
        lost_rad=max(abs(a - b) for a, b in turns),
        pushes=rules.units_of(needle.length_mm, per_mm) // insertion,
        folds=limits.max_rolls + limits.free_bevel + picks,
        rolls=_rolls(limits.roll_angles_rad + tissue.roll_errors_rad),
    )


def _most_pushes(scene: Scene, travel: _Travel) -> int:
    """After how many pushes every path has gone past the targets, or the needle has no more.

    The heading turns by at most `turn_rad` a push. So the exact path has descended by at least
    ``r (sin(lean + s / r) - sin lean)`` at a depth s, as long as it cannot be level; the model's
    path by as much but for its error. The model gives a path up below the targets.
    """
    if not scene.targets:
        return travel.pushes
    tip, axis = scene.needle.tip, scene.axis
    lean_rad = math.acos(max(-1.0, min(1.0, _dot(tip.heading, axis))))
    below_mm = _below_mm(scene)
    least_radius_mm = travel.push_mm / travel.turn_rad

    def is_past(pushes: int) -> bool:
        descent = math.sin(lean_rad + pushes * travel.turn_rad) - math.sin(lean_rad)
        return least_radius_mm * descent > below_mm + _bound_mm(travel, pushes, travel.folds)

    low, high = 0, min(travel.pushes, int((0.5 * math.pi - lean_rad) / travel.turn_rad))
    if high < 1 or not is_past(high):
        return travel.pushes
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if is_past(middle) else (middle, high)
    return high


def _below_mm(scene: Scene) -> float:
    """How far below the tip the targets end."""
    tip, axis = scene.needle.tip, scene.axis
    return max(
        (
            _dot(target.center_mm, axis) - _dot(tip.position_mm, axis) + _extent_mm(target)
            for target in scene.targets
        ),
        default=0.0,
    )


def _bound_mm(travel: _Travel, pushes: int, folds: int) -> float:
    """The bound of the error after so many pushes; infinite if the derivation does not hold."""
    unit, radius_mm = travel.unit, travel.radius_mm
    turned = pushes * travel.turn_rad
    if unit > _LARGEST_UNIT:
        return math.inf
    chord = min(turned, 2.0)
    sine, versine = math.sin(min(turned, 0.5 * math.pi)), 1.0 - math.cos(min(turned, math.pi))
    rolls = travel.rolls

    across = along = 0.5 * _ROOT_3 * unit  # β of the columns y and z, and of x.
    frame = 0.0  # θ without what the axis of the bend adds.
    fixed = 4.0 * unit  # The first centre is computed by way of two more products.
    tilts, weights = [], []
    for fold in range(folds + 1):
        seen = across + _ROOT_3 * unit
        axis_sine = across + _ROOT_3 * unit * (2.0 + seen)
        if max(axis_sine, seen) > _LARGEST_SINE:
            return math.inf
        tilt = math.asin(axis_sine)
        tilts.append(tilt)
        weights.append(tilt + math.asin(seen) + frame)
        rest = 8.0 * unit * (seen + tilt)
        fixed += unit * (3.0 + _ROOT_3 * sine) * (1.0 + seen) + 3.0 * _ROOT_3 * unit + rest
        fixed += math.sqrt(6.0) * unit + seen
        if fold == folds:
            break
        # What the circle's matrix, and then that of the roll, add to the columns.
        stretch = max(sine, 2.1 * versine)
        across = _after_product(across, unit, stretch) + rest
        along = _after_product(along, unit, sine) + 8.0 * unit * (along + tilt)
        heading_sine = along + _ROOT_3 * unit * (3.0 + along + 2.0 * _ROOT_3 * unit)
        if max(heading_sine, across) > _LARGEST_SINE:
            return math.inf
        heading = math.asin(heading_sine)
        frame += rolls.chord * heading + unit
        across = _after_product(across, unit, rolls.sine) + 8.0 * unit * (across + heading)
        along = _after_product(along, unit, 2.1 * rolls.versine)

    mixed = min(0.5 * turned * turned * folds / (folds + 1), 2.0 * folds * turned)
    sideways = mixed * tilts[folds - 1] if folds else 0.0
    left = turned
    for weight in reversed(weights):
        part = min(left, chord)
        sideways += part * weight
        left -= part
    lost = travel.lost_rad * (pushes + mixed / travel.turn_rad)
    positions_mm = unit * (0.5 * _ROOT_3 + 2.0 * _ROOT_3 * (folds + 1) + 0.5 * turned)
    return radius_mm * (fixed + sideways + lost) + positions_mm


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _after_product(error: float, unit: float, stretch: float) -> float:
    """The error of a column after a product with a matrix that the model computed."""
    return error + unit * (3.0 + _ROOT_3 * stretch) * (1.0 + error) + 3.0 * _ROOT_3 * unit
