"""How likely a needle still arrives from a place, if it is steered by what will be measured.

A needle that is not exact ends off every plan. What matters then is whether another plan leads to
the target. From a place, all ways with the rolls that are allowed are arcs that branch off from
each other. What is off at the end moves the target relative to all of them by about the same. So
the *prospect* of a place is the share of the errors, as the estimator expects them, after which
some way that touches nothing still passes through the target.

A place from which one way alone leads to the middle of the target has a worse prospect than one
from which ways lead to all sides of it: at the greatest bend, nothing makes up for a needle that
bends a little less. The prospect is no probability: errors show little by little, and what is done
about the first ones is not undone for the last. It says which of two places is better.

Rolls are looked at in a few places (`ROLL_PLACES`), and ways are sampled for what they touch; so a
way of a prospect still needs its certificate. Of the spins, none and the greatest are looked at.

Places are judged together: their ways are rows of the same arrays, which is sooner done.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.poses import Poses, lengths
from ntagen.plan.actions import Action, Plan, Push, Roll
from ntagen.scene import Pose, Scene

_Array = NDArray[np.float64]
_Rows = NDArray[np.intp]
_Flags = NDArray[np.bool_]

ERRORS: Final = 48
"""So many errors of the end are looked at, always the same ones."""

ROLL_PLACES: Final = (10, 6)
"""Along an arc, the first roll is looked at in so many places, and each later one."""

SPUN_PLACES: Final = (8, 4)
"""The same where the needle may spin: then there are several arcs after each roll."""

_LEAST_APART_MM: Final = 4.0
"""Two rolls that are nearer to each other are much like one."""

_SAMPLE_MM: Final = 2.0
"""Ways are sampled this densely for what they touch."""

_PIECE_MM: Final = 8.0
"""Ways are looked at in pieces of this length first."""

_ROWS: Final = 64
"""So many arcs of a place are compared with the target at once."""

SOFT_MM: Final = 1.0
"""Over this length at the surface of the target, an error counts in part: a prospect that jumps
would make the driver jump."""

_LONGEST_RATIO: Final = 1.5
"""Ways are at most this much longer than the straight one."""

_TINY_MM: Final = 1e-9

_LEAST_MM: Final = 0.2
"""A target is at least this wide."""


def _normal_points(count: int) -> _Array:
    """Points that are spread like a normal distribution in three dimensions.

    One half are those of the additive recurrence with the powers of the root of ``x^4 = x + 1``
    (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018); the other half
    lies opposite. Mean and covariance are exactly 0 and 1.
    """
    root = 1.2207440846057596
    normal = NormalDist()
    half = [
        [normal.inv_cdf((0.5 + number / root**power) % 1.0) for power in (1, 2, 3)]
        for number in range(1, count // 2 + 1)
    ]
    points = np.concatenate([np.array(half), -np.array(half)])
    # So few points have another covariance; with this, it is exact.
    factor = np.linalg.cholesky(points.T @ points / len(points))
    return np.asarray(np.linalg.solve(factor, points.T).T)


ERROR_POINTS: Final = _normal_points(ERRORS)
"""The errors, in standard deviations along three axes."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where the needle may come, and what it has done by then.

    Attributes:
        tip: The pose of the tip there.
        since_roll_mm: How far the last roll is behind.
        way_rolls: The way has at most so many rolls; None: as many as the scene allows.
        spin: The spin of the push that led there, which counts until the next roll; None: any may
            come.
    """

    tip: Pose
    since_roll_mm: float = math.inf
    way_rolls: int | None = None
    spin: float | None = None


@dataclass(frozen=True, slots=True)
class Judged:
    """What is ahead of a place.

    Attributes:
        prospect: From 0 to 1.
        way: The way that passes nearest to the middle of the target, of those that touch nothing;
            None if none passes through the target.
    """

    prospect: float
    way: Plan | None


@dataclass(frozen=True, slots=True)
class _Arcs:
    """Arcs as rows: their starts, how long they may be, and where they branch off from which.

    Each belongs to the place that has its number, and has the roll before it, which is 0 where the
    spin alone changes, and its own spin.
    """

    place: _Rows
    start: Poses
    length_mm: _Array
    radius_mm: _Array
    parent: _Rows
    branch_mm: _Array
    roll_rad: _Array
    spin: _Array

    def nearest(self, rows: _Rows, places: _Array) -> tuple[_Array, _Array]:
        """The least distance of arcs to places, and where; see `Arc.nearest_to`."""
        start, radius_mm = self.start.at(rows), self.radius_mm[rows, None]
        center, sine, cosine = self._in_plane(start, radius_mm, places)
        at_mm = np.arctan2(sine, cosine) * radius_mm
        at_mm = np.where(at_mm < 0.0, at_mm + 2.0 * math.pi * radius_mm, at_mm)
        in_plane = np.hypot(sine, cosine)
        across = np.maximum(0.0, _squares(center, places) - in_plane**2)
        away = np.sqrt(across + (in_plane - radius_mm) ** 2)
        length_mm = self.length_mm[rows]
        # Where the circle comes nearest beyond the arc, one of its ends is the nearest place.
        beyond = np.flatnonzero((at_mm >= length_mm[:, None]).any(axis=1))
        if len(beyond):
            missing = start.at(beyond)
            end = missing.places(radius_mm[beyond, 0], length_mm[beyond])
            first = np.sqrt(np.maximum(0.0, _squares(missing.position, places)))
            last = np.sqrt(np.maximum(0.0, _squares(end, places)))
            is_beyond = at_mm[beyond] >= length_mm[beyond, None]
            is_last = last < first
            away[beyond] = np.where(is_beyond, np.where(is_last, last, first), away[beyond])
            ends_mm = np.where(is_last, length_mm[beyond, None], 0.0)
            at_mm[beyond] = np.where(is_beyond, ends_mm, at_mm[beyond])
        return away, at_mm

    @staticmethod
    def _in_plane(start: Poses, radius_mm: _Array, places: _Array) -> tuple[_Array, _Array, _Array]:
        """The centres of circles, and the places along the heading and the bevel from there."""
        heading, bevel = start.heading, start.bevel
        center = start.position - radius_mm * bevel
        # As products of matrices: there may be a hundred thousand pairs.
        sine = heading @ places.T - np.einsum("ni,ni->n", heading, center)[:, None]
        cosine = bevel @ places.T - np.einsum("ni,ni->n", bevel, center)[:, None]
        return center, sine, cosine

    def least(self, rows: _Rows, ends: _Array, firsts: _Rows) -> _Array:
        """The least distances of groups of arcs to ends; each group begins at one of `firsts`.

        They are those of `nearest`, without where: no angle is computed, and few roots.
        """
        start, radius_mm = self.start.at(rows), self.radius_mm[rows, None]
        center, sine, cosine = self._in_plane(start, radius_mm, ends)
        in_plane2 = sine**2 + cosine**2
        # The square of the distance to the circle; rounding may make the first part negative.
        away2 = _squares(center, ends) - in_plane2 + (np.sqrt(in_plane2) - radius_mm) ** 2
        turn = self.length_mm[rows, None] / radius_mm
        after_start, before_end = sine >= 0.0, np.sin(turn) * cosine >= np.cos(turn) * sine
        on_arc = np.where(turn <= math.pi, after_start & before_end, after_start | before_end)
        last = start.places(radius_mm[:, 0], self.length_mm[rows])
        outer2 = np.minimum(_squares(start.position, ends), _squares(last, ends))
        least2 = np.where(on_arc | (turn >= 2.0 * math.pi), away2, outer2)
        return np.asarray(np.sqrt(np.maximum(0.0, np.minimum.reduceat(least2, firsts))))


def _squares(points: _Array, places: _Array) -> _Array:
    """The squares of the distances of all points to all places."""
    squares = np.einsum("ni,ni->n", points, points)[:, None] - 2.0 * points @ places.T
    return np.asarray(squares + np.einsum("ki,ki->k", places, places))


def _pieces(length_mm: _Array, most_mm: float) -> tuple[_Rows, _Array, _Array]:
    """Equal pieces, at most so long: of which length each is one, its middle and its half."""
    counts = np.maximum(1, np.ceil(length_mm / most_mm)).astype(np.intp)
    owners = np.repeat(np.arange(len(counts)), counts)
    half_mm = (0.5 * length_mm / counts)[owners]
    number = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
    return owners, (2 * number + 1) * half_mm, half_mm


def _groups(owners: _Rows) -> tuple[_Rows, _Rows, _Rows]:
    """The owners of rows that are in their order; where the rows of each begin, and how many."""
    return np.unique(owners, return_index=True, return_counts=True)


class Prospects:
    """Judges places in a scene.

    Args:
        scene: The scene; `suits` says of which ones places can be judged.
        depth_mm: How deep in the target a way must end.
    """

    def __init__(self, scene: Scene, depth_mm: float) -> None:
        self._scene = scene
        self._radius_mm = scene.needle.radius_mm
        limits = scene.limits
        self._spins = (0.0, max(limits.spins)) if limits.spins else (0.0,)
        # After a roll by 0 another spin comes, and only then.
        angles = (*limits.roll_angles_rad, 0.0) if limits.spins else limits.roll_angles_rad
        choices = [(angle, spin) for angle in angles for spin in self._spins]
        self._rolls_rad, self._spins_after = np.array(choices).T
        target = scene.targets[-1]
        self._middle = np.array(target.center_mm)
        self._centers = np.array([one.center_mm for one in scene.avoided]).reshape(-1, 3)
        self._reaches_mm = np.array([one.shape.reach_mm() for one in scene.avoided])
        self._reach_mm = target.shape.reach_mm()
        self._inside_mm = max(_LEAST_MM, target.shape.depth_mm - depth_mm)
        # What is farther away than this does not count.
        self._counted_mm = self._inside_mm + 0.5 * SOFT_MM

    @staticmethod
    def suits(scene: Scene) -> bool:
        """Whether places can be judged: nothing moves, and one target is left."""
        return scene.breath is None and len(scene.targets) == 1

    def judge(
        self, places: Sequence[Place], left_mm: float, covariance_mm2: _Array
    ) -> list[Judged]:
        """What is ahead of each place.

        Args:
            places: The places.
            left_mm: How far the needle may still be inserted from them.
            covariance_mm2: That of the error of the end, along x, y and z.
        """
        variances, axes = np.linalg.eigh(covariance_mm2)
        spread = axes * np.sqrt(np.maximum(variances, 0.0))
        ends = self._middle - ERROR_POINTS @ spread.T
        # What is farther from the middle than this is of no use for any end.
        useful_mm = self._counted_mm + float(lengths(ends - self._middle).max())
        best_mm = np.full((len(places), len(ends)), math.inf)
        nearest_mm, ways = [self._inside_mm] * len(places), [(-1, 0, 0.0)] * len(places)
        levels = self._levels(places, left_mm, useful_mm)
        clear: _Flags = np.ones(len(levels[0].length_mm), dtype=bool)
        for index, arcs in enumerate(levels):
            rows = np.flatnonzero(clear)
            near = arcs.nearest(rows, self._middle[None])
            useful = near[0][:, 0] <= useful_mm
            rows, away_mm, foot_mm = rows[useful], near[0][useful, 0], near[1][useful, 0]
            free = foot_mm < self._touched_at(arcs, rows, foot_mm)
            # Those of each place follow each other, the nearest one first.
            order = np.flatnonzero(free)
            order = order[np.lexsort((away_mm[order], arcs.place[rows[order]]))]
            rows, away_mm, foot_mm = rows[order], away_mm[order], foot_mm[order]
            owners, firsts, counts = _groups(arcs.place[rows])
            numbers = np.arange(len(rows)) - np.repeat(firsts, counts)
            self._look(arcs, rows, numbers, away_mm, ends, best_mm)
            for owner, first in zip(owners.tolist(), firsts.tolist(), strict=True):
                most = places[owner].way_rolls
                if away_mm[first] < nearest_mm[owner] and (most is None or index <= most):
                    nearest_mm[owner] = float(away_mm[first])
                    ways[owner] = (index, int(rows[first]), float(foot_mm[first]))
            if index + 1 < len(levels):
                branches = levels[index + 1]
                touched_mm = np.zeros(len(clear))
                all_rows = np.flatnonzero(clear)
                touched_mm[all_rows] = self._touched_at(arcs, all_rows, arcs.length_mm[all_rows])
                clear = branches.branch_mm < touched_mm[branches.parent]
        counted = np.clip((self._inside_mm - best_mm) / SOFT_MM + 0.5, 0.0, 1.0).mean(axis=1)
        return [
            Judged(prospect, None if way[0] < 0 else self._plan(levels, *way))
            for prospect, way in zip(counted.tolist(), ways, strict=True)
        ]

    def _look(
        self,
        arcs: _Arcs,
        rows: _Rows,
        numbers: _Rows,
        away_mm: _Array,
        ends: _Array,
        best_mm: _Array,
    ) -> None:
        """Makes the least distances of places to ends smaller where these arcs pass nearer.

        What counts in full already is not looked at again, and the first rows reach most.

        Args:
            arcs: The arcs of a level.
            rows: Those that count, those of each place together, the nearest to the middle first.
            numbers: The number of each among those of its place.
            away_mm: The distance of each to the middle.
            ends: Where the middle of the target may be.
            best_mm: The least distances: a row for each place, a column for each end.
        """
        moved_mm = lengths(ends - self._middle)
        for first in range(0, int(numbers.max(initial=-1)) + 1, _ROWS):
            is_open = best_mm > self._inside_mm - 0.5 * SOFT_MM
            chosen = (numbers >= first) & (numbers < first + _ROWS)
            chosen &= np.asarray(is_open.any(axis=1))[arcs.place[rows]]
            # An arc is at least as far from an end as from the middle, less what is between them.
            least_mm = away_mm[chosen].min(initial=math.inf)
            columns = is_open.any(axis=0) & (moved_mm > least_mm - self._counted_mm)
            if not columns.any():
                return
            owners, firsts, _ = _groups(arcs.place[rows[chosen]])
            found_mm = arcs.least(rows[chosen], ends[columns], firsts)
            cells = np.ix_(owners, columns)
            best_mm[cells] = np.minimum(best_mm[cells], found_mm)

    def _levels(self, places: Sequence[Place], most_mm: float, useful_mm: float) -> list[_Arcs]:
        """All arcs: straight from the places, then those after one roll, two rolls and so on.

        Those that come no nearer to the target than `useful_mm`, however they bend, are left out.
        """
        limits = self._scene.limits
        tip = Poses.of(one.tip for one in places)
        straight_mm = lengths(self._middle - tip.position)
        left_mm = np.minimum(most_mm, _LONGEST_RATIO * straight_mm + self._reach_mm)
        levels = [self._straight(places, tip, left_mm)]
        apart_mm = limits.min_roll_distance_mm
        roll_places = ROLL_PLACES if len(self._spins) == 1 else SPUN_PLACES
        first_mm = np.array([max(0.0, apart_mm - one.since_roll_mm) for one in places])
        for number in range(limits.max_rolls):
            before = levels[-1]
            count = roll_places[min(number, len(roll_places) - 1)]
            spacing_mm = left_mm[before.place] / count
            along_mm = first_mm[before.place, None] + spacing_mm[:, None] * np.arange(count)
            rows, columns = np.nonzero(along_mm < before.length_mm[:, None] - _TINY_MM)
            if not len(rows):
                break
            at_mm = along_mm[rows, columns]
            start = before.start.at(rows).pushed(before.radius_mm[rows], at_mm)
            rest_mm = before.length_mm[rows] - at_mm
            kept = np.flatnonzero(self._can_reach(start, rest_mm, useful_mm))
            if not len(kept):
                break
            # All branches of the first choice come first, then those of the next one.
            each = np.tile(kept, len(self._rolls_rad))
            roll_rad = np.repeat(self._rolls_rad, len(kept))
            spun = np.repeat(self._spins_after, len(kept))
            if len(self._spins) > 1:
                changes = (roll_rad != 0.0) | (spun != before.spin[rows[each]])
                each, roll_rad, spun = each[changes], roll_rad[changes], spun[changes]
            parent, rolled = rows[each], start.at(each).rolled(roll_rad)
            radii_mm = self._radius_mm / (1.0 - spun)
            levels.append(
                _Arcs(
                    before.place[parent],
                    rolled,
                    rest_mm[each],
                    radii_mm,
                    parent,
                    at_mm[each],
                    roll_rad,
                    spun,
                )
            )
            first_mm = np.full(len(places), max(apart_mm, _LEAST_APART_MM))
        return levels

    def _straight(self, places: Sequence[Place], tip: Poses, left_mm: _Array) -> _Arcs:
        """The arcs that go on from the places without a roll, one for each spin that may come."""
        first = [
            (number, spin)
            for number, one in enumerate(places)
            if left_mm[number] > 0.0
            for spin in (self._spins if one.spin is None else (one.spin,))
        ]
        owner = np.array([number for number, _ in first], np.intp)
        spun = np.array([spin for _, spin in first])
        none, radii_mm = np.zeros(len(owner)), self._radius_mm / (1.0 - spun)
        return _Arcs(owner, tip.at(owner), left_mm[owner], radii_mm, owner, none, none, spun)

    def _can_reach(self, start: Poses, rest_mm: _Array, useful_mm: float) -> _Flags:
        """Whether the greatest bend from places leads near the middle of the target.

        What is farther ahead than the radius, or than a right angle of the bend, is not told.
        """
        ahead = self._middle - start.position
        along_mm = np.einsum("ni,ni->n", ahead, start.heading)
        aside_mm = lengths(ahead - along_mm[:, None] * start.heading)
        radius_mm = self._radius_mm
        chord_mm2 = np.maximum(0.0, radius_mm**2 - np.maximum(0.0, along_mm) ** 2)
        is_far = (along_mm >= radius_mm) | (rest_mm > 0.5 * math.pi * radius_mm)
        bend_mm = np.where(is_far, math.inf, radius_mm - np.sqrt(chord_mm2))
        return np.asarray((along_mm > -useful_mm) & (aside_mm <= bend_mm + useful_mm))

    def _touched_at(self, arcs: _Arcs, rows: _Rows, length_mm: _Array) -> _Array:
        """Where arcs touch something first, if they are not longer than this; else infinite."""
        touched_mm = np.full(len(rows), math.inf)
        if not self._scene.avoided or not len(rows):
            return touched_mm
        # Most pieces are nowhere near the ball around a region.
        pieces, middle_mm, half_mm = _pieces(length_mm, _PIECE_MM)
        middles = arcs.start.at(rows[pieces]).places(arcs.radius_mm[rows[pieces]], middle_mm)
        squares = _squares(middles, self._centers)
        near = squares <= (self._reaches_mm + half_mm[:, None] + _TINY_MM) ** 2
        for number, region in enumerate(self._scene.avoided):
            chosen = np.flatnonzero(near[:, number])
            if not len(chosen):
                continue
            parts, along_mm, apart_mm = _pieces(2.0 * half_mm[chosen], _SAMPLE_MM)
            # Each part is looked at where it ends.
            at_mm = (middle_mm - half_mm)[chosen][parts] + along_mm + apart_mm
            owners = pieces[chosen][parts]
            points = arcs.start.at(rows[owners]).places(arcs.radius_mm[rows[owners]], at_mm)
            touches = region.shape.distance_mm(points) <= 0.0
            np.minimum.at(touched_mm, owners[touches], at_mm[touches])
        return touched_mm

    def _plan(self, levels: list[_Arcs], index: int, row: int, foot_mm: float) -> Plan:
        """The way that ends on this arc of a level."""
        actions: list[Action] = []
        length_mm = foot_mm
        while True:
            arcs = levels[index]
            actions.insert(0, Push(length_mm, float(arcs.spin[row])))
            if index == 0:
                return Plan.of(actions)
            if arcs.roll_rad[row]:
                actions.insert(0, Roll(float(arcs.roll_rad[row])))
            length_mm, index, row = float(arcs.branch_mm[row]), index - 1, int(arcs.parent[row])


def first_part(plan: Plan, length_mm: float) -> Plan:
    """What a plan does until the needle was pushed this far."""
    actions: list[Action] = []
    left_mm = length_mm
    for action in plan.actions:
        if left_mm <= _TINY_MM:
            break
        if isinstance(action, Push):
            actions.append(Push(min(left_mm, action.length_mm), action.spin))
            left_mm -= action.length_mm
        else:
            actions.append(action)
    return Plan.of(actions)
