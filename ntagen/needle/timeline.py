"""A needle over time: where its tip is, where its shaft lies, and how near moving shapes come.

Distances are found by subdivision, as those of still shapes (`ntagen.needle.nearest`), but in time
too: what a moving shape is away from the tip changes by no more than both move. So a stretch of
time comes no nearer than its middle, less half of its length at the sum of the two speeds.

The shaft lies where the tip went: of a shape that must not touch it, every place of the path counts
from the moment at which the tip was there, and what lies behind the start counts from the start.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.motion import Motion
from ntagen.needle.kinematics import Arc, Nearest
from ntagen.needle.nearest import TOLERANCE_MM, first_within, places_on
from ntagen.scene import SHAFT_SPACING_MM, Pose, Vector
from ntagen.shapes import Shape
from ntagen.values import dataclass

_RATIO: Final = 0.01
"""A distance of a shaft may also be too small by this part of it."""

_FIRST_MM: Final = 4.0
_BOUND_PIECE_MM: Final = 0.01
"""Half of the shortest stretch that is looked at where distances are bounds, as for fields."""

_Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Stage:
    """A push or a rest: its arc, of length 0 in a rest, and when and how deep it begins."""

    arc: Arc
    start_s: float
    end_s: float
    start_mm: float

    @property
    def speed_mm_per_s(self) -> float:
        """The speed of the tip."""
        return self.arc.length_mm / (self.end_s - self.start_s) if self.arc.length_mm else 0.0


class Timeline:
    """Pushes and rests one after the other, on the clock of the breath.

    Args:
        tip: The pose at the start.
        radius_mm: The radius of the motion circle.
        speed_mm_per_s: The speed of pushes.
        clock_s: When it begins.
        shaft_mm: Places of the shaft behind the tip, at most `SHAFT_SPACING_MM` apart.
    """

    def __init__(
        self,
        tip: Pose,
        radius_mm: float,
        speed_mm_per_s: float,
        clock_s: float,
        shaft_mm: Sequence[Vector] = (),
    ) -> None:
        self._shaft = np.array(shaft_mm, dtype=np.float64).reshape(-1, 3)
        self._radius_mm = radius_mm
        self._speed_mm_per_s = speed_mm_per_s
        self._stages = [Stage(Arc(tip, radius_mm, 0.0), clock_s, clock_s, 0.0)]

    @property
    def end_s(self) -> float:
        """When it ends."""
        return self._stages[-1].end_s

    @property
    def end(self) -> Pose:
        """The pose of the tip at the end, without rolls after the last push."""
        return self._stages[-1].arc.end

    @property
    def end_mm(self) -> Vector:
        """Where the tip is at the end."""
        return self.end.position_mm

    @property
    def arcs(self) -> tuple[Arc, ...]:
        """The arcs of all pushes and rests."""
        return tuple(stage.arc for stage in self._stages)

    def push(self, start: Pose, length_mm: float, radius_mm: float | None = None) -> None:
        """Adds a push from a pose, perhaps on another circle."""
        arc = Arc(start, radius_mm or self._radius_mm, length_mm)
        self._add(arc, length_mm / self._speed_mm_per_s)

    def rest(self, seconds: float) -> None:
        """Adds a rest where the tip is."""
        self._add(Arc(self.end, self._radius_mm, 0.0), seconds)

    def _add(self, arc: Arc, seconds: float) -> None:
        last = self._stages[-1]
        begun_mm = last.start_mm + last.arc.length_mm
        self._stages.append(Stage(arc, last.end_s, last.end_s + seconds, begun_mm))

    def depth_mm(self, time_s: float) -> float:
        """How deep the tip is at a time, from the start."""
        starts = [stage.start_s for stage in self._stages]
        stage = self._stages[max(0, bisect_right(starts, time_s) - 1)]
        return stage.start_mm + min(
            stage.arc.length_mm, stage.speed_mm_per_s * (time_s - stage.start_s)
        )

    def tip_nearest(self, shape: Shape, motion: Motion) -> Nearest:
        """The least distance of the tip to a moving shape, and how deep the tip is then.

        It is never too great, and at most `TOLERANCE_MM` too small.
        """
        best_mm, best_s = math.inf, self._stages[0].start_s
        middles, halves, owners = self._stretches(motion)
        speeds = self._tip_speeds + motion.speed_mm_per_s
        while len(middles):
            distances = self._tip_distances(shape, motion, middles, owners)
            least = int(np.argmin(distances))
            if distances[least] < best_mm:
                best_mm, best_s = float(distances[least]), float(middles[least])
            is_open = distances - halves * speeds[owners] < best_mm - TOLERANCE_MM
            middles, halves, owners = middles[is_open], 0.5 * halves[is_open], owners[is_open]
            middles = np.concatenate([middles - halves, middles + halves])
            halves, owners = np.tile(halves, 2), np.tile(owners, 2)
        return Nearest(best_mm - TOLERANCE_MM - shape.excess_mm, self.depth_mm(best_s))

    def tip_enters(self, shape: Shape, motion: Motion, since_s: float) -> float | None:
        """When the tip is first in a moving shape, not before a time; None if it never is.

        A touch that is shorter than `TOLERANCE_MM` may be left out.
        """
        speeds = self._tip_speeds + motion.speed_mm_per_s
        for number, stage in enumerate(self._stages):
            start_s = max(since_s, stage.start_s)
            if start_s > stage.end_s:
                continue
            found_s = self._enters(shape, motion, (start_s, stage.end_s), number, speeds[number])
            if found_s is not None:
                return found_s
        return None

    def _enters(
        self,
        shape: Shape,
        motion: Motion,
        stretch: tuple[float, float],
        number: int,
        speed_mm_per_s: float,
    ) -> float | None:
        """When the tip is first in the shape, within a stretch of a stage."""

        def away_mm(time_s: float) -> float:
            times, owners = np.array([time_s]), np.array([number])
            return float(self._tip_distances(shape, motion, times, owners)[0])

        # A distance that is a bound may change faster than the place, by its error.
        is_bound = shape.error_mm > TOLERANCE_MM
        slack_mm = shape.error_mm if is_bound else 0.0
        least_mm = _BOUND_PIECE_MM if is_bound else 0.5 * TOLERANCE_MM
        return first_within(away_mm, *stretch, speed_mm_per_s, slack_mm, least_mm)

    def shaft_nearest(self, shape: Shape, motion: Motion) -> Nearest:
        """The least distance of tip and shaft to a moving shape, and at which depth that is.

        Never too great; too small by `TOLERANCE_MM` or a hundredth of it, whichever is more. A
        place behind the start counts as the start, and its distance may be too small by half of
        `SHAFT_SPACING_MM`.
        """
        ahead, behind_mm = self._path_nearest(shape, motion), self._behind_nearest_mm(shape, motion)
        return ahead if ahead.distance_mm <= behind_mm else Nearest(behind_mm, 0.0)

    def _behind_nearest_mm(self, shape: Shape, motion: Motion) -> float:
        """A bound for the distance of the shaft behind the start; infinite without one."""
        if not len(self._shaft):
            return math.inf
        start_s = self._stages[0].start_s
        # After a period, everything comes again.
        seconds = min(self.end_s - start_s, motion.period_s)
        count = max(1, math.ceil(seconds * motion.speed_mm_per_s / _FIRST_MM))
        half_s = 0.5 * seconds / count
        times = np.tile(start_s + (2 * np.arange(count) + 1) * half_s, len(self._shaft))
        places = np.repeat(np.arange(len(self._shaft)), count)
        best_mm = math.inf
        while len(times):
            distances = shape.distance_mm(self._shaft[places] - motion.many_mm(times))
            best_mm = min(best_mm, float(np.min(distances)))
            is_open = distances - half_s * motion.speed_mm_per_s < best_mm - TOLERANCE_MM
            times, places = times[is_open], places[is_open]
            half_s *= 0.5
            times = np.concatenate([times - half_s, times + half_s])
            places = np.tile(places, 2)
        return best_mm - TOLERANCE_MM - shape.excess_mm - 0.5 * SHAFT_SPACING_MM

    def _path_nearest(self, shape: Shape, motion: Motion) -> Nearest:
        """The least distance of tip and shaft from the start on."""
        arcs = [stage.arc for stage in self._stages]
        fields = self._boxes(motion)
        speed_mm_per_s = motion.speed_mm_per_s
        best_mm, best_at_mm = math.inf, 0.0
        slacks = np.array(
            [1.0 / s if (s := stage.speed_mm_per_s) else 0.0 for stage in self._stages]
        )
        starts = np.array([stage.start_s for stage in self._stages])
        depths = np.array([stage.start_mm for stage in self._stages])
        lengths = np.array([stage.arc.length_mm for stage in self._stages])
        while len(fields):
            along, half_mm, times, half_s = fields[:, 0], fields[:, 1], fields[:, 2], fields[:, 3]
            owners = fields[:, 4].astype(np.intp)
            # Nothing lies at a place before the tip came there.
            came_s = starts[owners] + along * slacks[owners]
            seen_s = np.minimum(np.maximum(times, came_s), self.end_s)
            points = places_on(arcs, owners, np.minimum(along, lengths[owners]))
            distances = shape.distance_mm(points - motion.many_mm(seen_s))
            least = int(np.argmin(distances))
            if distances[least] < best_mm:
                best_mm = float(distances[least])
                best_at_mm = float(depths[owners[least]] + along[least])
            radii = half_mm + speed_mm_per_s * (half_s + np.abs(seen_s - times))
            tolerance_mm = max(TOLERANCE_MM, _RATIO * best_mm)
            # A box of which no moment has come yet has nothing in it.
            has_come = times + half_s >= came_s - half_mm * slacks[owners]
            fields = fields[(distances - radii < best_mm - tolerance_mm) & has_come]
            # What is too small to matter is taken as its middle: that is within the tolerance.
            sizes = fields[:, 1] + speed_mm_per_s * fields[:, 3]
            fields = _halved(fields[sizes > 0.5 * TOLERANCE_MM], speed_mm_per_s)
        tolerance_mm = max(TOLERANCE_MM, _RATIO * best_mm)
        return Nearest(best_mm - tolerance_mm - shape.excess_mm, best_at_mm)

    @property
    def _tip_speeds(self) -> _Array:
        return np.array([stage.speed_mm_per_s for stage in self._stages])

    def _tip_distances(
        self, shape: Shape, motion: Motion, times: _Array, owners: NDArray[np.intp]
    ) -> _Array:
        starts = np.array([stage.start_s for stage in self._stages])[owners]
        along = (times - starts) * self._tip_speeds[owners]
        points = places_on([stage.arc for stage in self._stages], owners, along)
        return np.asarray(shape.distance_mm(points - motion.many_mm(times)))

    def _stretches(self, motion: Motion) -> tuple[_Array, _Array, NDArray[np.intp]]:
        """Stretches of time: their middles, half of their lengths, and their stages.

        A rest of more than a period has nothing new after it.
        """
        middles, halves, owners = [], [], []
        for number, stage in enumerate(self._stages):
            seconds = stage.end_s - stage.start_s
            if not stage.arc.length_mm:
                seconds = min(seconds, motion.period_s)
            way_mm = seconds * (stage.speed_mm_per_s + motion.speed_mm_per_s)
            count = max(1, math.ceil(way_mm / _FIRST_MM))
            half_s = 0.5 * seconds / count
            middles += [stage.start_s + (2 * i + 1) * half_s for i in range(count)]
            halves += [half_s] * count
            owners += [number] * count
        return np.array(middles), np.array(halves), np.array(owners, dtype=np.intp)

    def _boxes(self, motion: Motion) -> _Array:
        """Boxes of place and time: where and how long, when and how long, and the stage."""
        return np.array(
            [
                box
                for number, stage in enumerate(self._stages)
                for box in self._of(number, stage, motion)
            ]
        )

    def _of(self, number: int, stage: Stage, motion: Motion) -> Iterator[Sequence[float]]:
        length_mm = stage.arc.length_mm
        pieces = max(1, math.ceil(length_mm / _FIRST_MM))
        half_mm = 0.5 * length_mm / pieces
        for piece in range(pieces):
            along_mm = (2 * piece + 1) * half_mm
            share = 1.0 / pieces
            first_s = stage.start_s + piece * share * (stage.end_s - stage.start_s)
            gone_s = (stage.end_s - stage.start_s) * share if length_mm else 0.0
            # After a period, everything comes again.
            last_s = min(self.end_s, first_s + gone_s + motion.period_s)
            count = max(1, math.ceil((last_s - first_s) * motion.speed_mm_per_s / _FIRST_MM))
            half_s = 0.5 * (last_s - first_s) / count
            for part in range(count):
                yield along_mm, half_mm, first_s + (2 * part + 1) * half_s, half_s, number


def _halved(fields: _Array, speed_mm_per_s: float) -> _Array:
    """Boxes cut in two, across their longer side."""
    if not len(fields):
        return fields
    by_place = fields[:, 1] >= speed_mm_per_s * fields[:, 3]
    column = np.where(by_place, 0, 2)
    rows = np.arange(len(fields))
    halves = fields.copy()
    halves[rows, column + 1] *= 0.5
    before, after = halves.copy(), halves.copy()
    before[rows, column] -= halves[rows, column + 1]
    after[rows, column] += halves[rows, column + 1]
    return np.concatenate([before, after])
