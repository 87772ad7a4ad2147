"""The certificates of many plans at once: the same as `ntagen.plan.certify`, in less time.

Plans that begin in the same way share the arcs of their beginning. All arcs that come after the
same number of others are computed together, as arrays, with the same closed forms. So distances
differ from those of single certificates by rounding errors only, less than 1e-9 mm.

Distances to convex shapes follow by the subdivision of `ntagen.needle.nearest`, with many pieces at
once: they are as exact, but not the same to the last digit.

Cost: about 10 microseconds for a plan with a few spheres, and 10 for each other convex shape.
Distances to ellipsoids and fields are computed plan by plan, and so are whole certificates where
regions move or a target is no sphere.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.nearest import SLOPE_MM, TOLERANCE_MM, is_smooth
from ntagen.needle.poses import Poses, lengths
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.certify import Arrival, Certificate, Clearance, certify, clearance
from ntagen.scene import Region, Scene, Vector
from ntagen.shapes import Shape, Sphere
from ntagen.values import dataclass

_Array = NDArray[np.float64]

_BISECTIONS: Final = 60


def certify_all(plans: Sequence[Plan], scene: Scene) -> list[Certificate]:
    """The certificate of each plan, in their order; see `ntagen.plan.certify.certify`."""
    targets = scene.targets
    is_plain = scene.breath is None and targets and math.isfinite(scene.needle.radius_mm)
    if not is_plain or not all(_is_ball(one) for one in targets):
        return [certify(plan, scene) for plan in plans]
    return _Batch(plans, scene).certificates()


def _is_ball(region: Region) -> bool:
    return isinstance(region.shape, Sphere)


def _balls(regions: Sequence[Region]) -> tuple[_Array, _Array]:
    """The middles of spheres, and their radii."""
    shapes = [one.shape for one in regions if isinstance(one.shape, Sphere)]
    middles = np.array([one.middle_mm for one in shapes]).reshape(-1, 3)
    return middles, np.array([one.radius_mm for one in shapes])


@dataclass(frozen=True, slots=True)
class _Level:
    """What is known at the ends of all arcs that come after the same number of others.

    Attributes:
        end: The poses.
        length_mm: The lengths of the paths.
        near_mm: For each path and point, and then each smooth shape, the least distance.
        near_at_mm: Where that is.
        entered_mm: For each path and target, where it is entered; not a number if it is not.
    """

    end: Poses
    length_mm: _Array
    near_mm: _Array
    near_at_mm: _Array
    entered_mm: _Array


class _Batch:
    """Plans whose certificates are computed together."""

    def __init__(self, plans: Sequence[Plan], scene: Scene) -> None:
        self._plans, self._scene = plans, scene
        self._avoided = [one for one in scene.avoided if _is_ball(one)]
        self._middles, self._radii = _balls([*self._avoided, *scene.targets])
        self._smooth = [one for one in scene.avoided if is_smooth(one.shape)]
        self._levels = [self._start()]
        # Of each plan: the number of its arcs, and the row of the last one.
        self._places = np.zeros((len(plans), 2), dtype=np.intp)
        for level in self._arcs():
            self._levels.append(self._next(*level))

    def _start(self) -> _Level:
        pose = Poses.of([self._scene.needle.tip])
        at_entry = [one.shape.distance_mm(pose.position) for one in self._smooth]
        near = np.column_stack([pose.away(self._middles), *at_entry])
        entered = np.full((1, len(self._scene.targets)), math.nan)
        return _Level(pose, np.zeros(1), near, np.zeros_like(near), entered)

    def _arcs(self) -> Iterator[tuple[NDArray[np.intp], list[tuple[float, ...]], _Array, _Array]]:
        """The arcs of each level: the row of the arc before, the rolls before it, its push.

        A push is the length and the radius.
        """
        nominal_mm = self._scene.needle.radius_mm
        found: list[dict[tuple[int, tuple[float, ...], float, float], int]] = []
        for number, plan in enumerate(self._plans):
            row, depth = 0, 0
            rolls: tuple[float, ...] = ()
            for action in plan.actions:
                if isinstance(action, Roll):
                    rolls = (*rolls, action.angle_rad)
                elif isinstance(action, Push):
                    if depth == len(found):
                        found.append({})
                    key = (row, rolls, action.length_mm, action.radius_mm(nominal_mm))
                    row = found[depth].setdefault(key, len(found[depth]))
                    depth, rolls = depth + 1, ()
            self._places[number] = depth, row
        for level in found:
            rows, rolled, lengths, radii = zip(*level, strict=True)
            yield np.array(rows), list(rolled), np.array(lengths), np.array(radii)

    def _next(
        self,
        rows: NDArray[np.intp],
        rolled: list[tuple[float, ...]],
        length_mm: _Array,
        radius_mm: _Array,
    ) -> _Level:
        before = self._levels[-1]
        start = before.end.at(rows)
        for turn in range(max(map(len, rolled))):
            angles = [rolls[turn] if turn < len(rolls) else 0.0 for rolls in rolled]
            start = start.rolled(np.array(angles))
        end = start.pushed(radius_mm, length_mm)
        since_mm = before.length_mm[rows]
        near_mm, near_at_mm = before.near_mm[rows], before.near_at_mm[rows]
        found = [self._nearest(start, end, length_mm, radius_mm, self._middles)]
        for number, region in enumerate(self._smooth, start=len(self._middles)):
            found.append(_nearest_to(region.shape, start, length_mm, radius_mm, near_mm[:, number]))
        arc_mm, at_mm = (np.column_stack(part) for part in zip(*found, strict=True))
        is_nearer = arc_mm < near_mm
        return _Level(
            end,
            since_mm + length_mm,
            np.where(is_nearer, arc_mm, near_mm),
            np.where(is_nearer, since_mm[:, None] + at_mm, near_at_mm),
            self._entered(before.entered_mm[rows], start, since_mm, length_mm, radius_mm),
        )

    def _nearest(
        self, start: Poses, end: Poses, length_mm: _Array, radius_mm: _Array, middles: _Array
    ) -> tuple[_Array, _Array]:
        """The least distance of each arc to each point, and where; see `Arc.nearest_to`."""
        from_center = middles - (start.position - radius_mm[:, None] * start.bevel)[:, None]
        sine = np.einsum("npi,ni->np", from_center, start.heading)
        cosine = np.einsum("npi,ni->np", from_center, start.bevel)
        turn = np.arctan2(sine, cosine) % (2.0 * math.pi)
        foot_mm = turn * radius_mm[:, None]
        aside = np.cos(turn)[..., None] * start.bevel[:, None]
        aside += np.sin(turn)[..., None] * start.heading[:, None]
        foot_away = lengths(from_center - radius_mm[:, None, None] * aside)
        first, last = start.away(middles), end.away(middles)
        best = np.where(last < first, last, first)
        best_at = np.where(last < first, length_mm[:, None], 0.0)
        is_foot = (foot_mm < length_mm[:, None]) & (foot_away <= best)
        return np.where(is_foot, foot_away, best), np.where(is_foot, foot_mm, best_at)

    def _entered(
        self,
        known_mm: _Array,
        start: Poses,
        start_mm: _Array,
        length_mm: _Array,
        radius_mm: _Array,
    ) -> _Array:
        """Where each target is entered, after the one before it; see `certify`."""
        entered = known_mm.copy()
        since_mm = np.zeros(len(start_mm))
        for number in range(len(self._scene.targets)):
            skipped = np.maximum(0.0, since_mm - start_mm)
            is_open = np.isnan(entered[:, number]) & (skipped <= length_mm)
            rows = np.flatnonzero(is_open)
            if len(rows):
                rest = start.at(rows).pushed(radius_mm[rows], skipped[rows])
                left_mm = length_mm[rows] - skipped[rows]
                at_mm = self._enters(rest, left_mm, radius_mm[rows], number)
                entered[rows, number] = start_mm[rows] + skipped[rows] + at_mm
            since_mm = entered[:, number]
        return entered

    def _enters(self, start: Poses, length_mm: _Array, radius_mm: _Array, number: int) -> _Array:
        """Where arcs first touch a target; not a number if they never do; see `Arc.enters_at`."""
        first = len(self._avoided) + number
        middle, target_mm = self._middles[first : first + 1], self._radii[first]
        end = start.pushed(radius_mm, length_mm)
        near = self._nearest(start, end, length_mm, radius_mm, middle)
        away_mm, at_mm = (one[:, 0] for one in near)
        found = np.where(start.away(middle)[:, 0] <= target_mm, 0.0, math.nan)
        rows = np.flatnonzero(np.isnan(found) & (away_mm <= target_mm))
        if not len(rows):
            return found
        start, high, radius_mm = start.at(rows), at_mm[rows], radius_mm[rows]
        low = np.maximum(0.0, high - math.pi * radius_mm)
        for _ in range(_BISECTIONS):
            half = 0.5 * (low + high)
            is_inside = lengths(start.places(radius_mm, half) - middle) <= target_mm
            low, high = np.where(is_inside, low, half), np.where(is_inside, half, high)
        found[rows] = high
        return found

    def certificates(self) -> list[Certificate]:
        """The certificate of each plan."""
        scene, count = self._scene, len(self._avoided)
        rows = [
            (
                (level.near_mm - self._taken_off()).tolist(),
                level.near_at_mm.tolist(),
                level.entered_mm.tolist(),
                level.end.position.tolist(),
                level.end.away(self._middles[-1:])[:, 0].tolist(),
            )
            for level in self._levels
        ]
        last_radius_mm = float(self._radii[-1])
        certificates = []
        for plan, (depth, row) in zip(self._plans, self._places.tolist(), strict=True):
            near, near_at, entered, ends, end_away = (part[row] for part in rows[depth])
            away = [*near[count : len(self._radii) - 1], end_away - last_radius_mm]
            if depth == 0:
                certificates.append(certify(plan, scene))
                continue
            arrivals = zip(scene.targets, entered, away, strict=True)
            x, y, z = ends
            certificates.append(
                Certificate(
                    clearances=self._clearances(plan, near, near_at),
                    arrivals=tuple(
                        Arrival(one.name, None if at_mm != at_mm else at_mm, -away_mm)
                        for one, at_mm, away_mm in arrivals
                    ),
                    end_mm=(x, y, z),
                    end_distance_mm=end_away,
                    length_mm=plan.length_mm,
                    roll_count=plan.counted_rolls(scene.limits),
                )
            )
        return certificates

    def _taken_off(self) -> _Array:
        """What certificates take off the least distances of `_Level.near_mm`."""
        excess = [TOLERANCE_MM + one.shape.excess_mm for one in self._smooth]
        return np.concatenate([self._radii, excess])

    def _clearances(
        self, plan: Plan, near: list[float], near_at: list[float]
    ) -> tuple[Clearance, ...]:
        places = list(zip(near, near_at, strict=True))
        balls, smooth = iter(places), iter(places[len(self._radii) :])
        entry_mm: Vector = self._scene.needle.tip.position_mm
        return tuple(
            Clearance(one.name, one.kind, *next(balls))
            if _is_ball(one)
            else Clearance(one.name, one.kind, *next(smooth))
            if is_smooth(one.shape)
            else clearance(plan.arcs(self._scene.needle), entry_mm, one)
            for one in self._scene.avoided
        )


def _nearest_to(
    shape: Shape, start: Poses, length_mm: _Array, radius_mm: _Array, most_mm: _Array
) -> tuple[_Array, _Array]:
    """The least distance of each arc to a convex shape, and where, if it is less than this.

    See `ntagen.needle.nearest`: pieces that can hold no nearer place are dropped.
    """
    best_mm, best_at_mm = most_mm.copy(), np.zeros(len(most_mm))
    owner = np.flatnonzero(length_mm > 0.0)
    half_mm = 0.5 * length_mm[owner]
    at_mm = half_mm.copy()
    while len(owner):
        from_, circle_mm = start.at(owner), radius_mm[owner]
        away_mm = shape.distance_mm(from_.places(circle_mm, at_mm))
        # The nearest of each arc comes last, and so it stays.
        order = np.argsort(-away_mm, kind="stable")
        nearer = order[away_mm[order] < best_mm[owner[order]]]
        best_mm[owner[nearer]], best_at_mm[owner[nearer]] = away_mm[nearer], at_mm[nearer]
        next_mm = shape.distance_mm(from_.places(circle_mm, at_mm + SLOPE_MM))
        slope = (next_mm - away_mm) / SLOPE_MM + 0.5 * SLOPE_MM / circle_mm
        bend_mm = 0.5 * half_mm**2 / circle_mm
        pieces = []
        for side in (-1.0, 1.0):
            least_mm = away_mm - np.minimum(half_mm, bend_mm - side * slope * half_mm)
            rows = np.flatnonzero(least_mm < best_mm[owner] - 0.5 * TOLERANCE_MM)
            quarter_mm = 0.5 * half_mm[rows]
            pieces.append((owner[rows], at_mm[rows] + side * quarter_mm, quarter_mm))
        owner, at_mm, half_mm = (np.concatenate(part) for part in zip(*pieces, strict=True))
    return best_mm, best_at_mm
