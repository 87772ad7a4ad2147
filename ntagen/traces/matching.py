"""The match of a trace: the pushes and rolls, and the start, that explain it best.

1. The search ranks sequences of 0, 1, … rolls (`ntagen.traces.search`).
2. The best ones of each number are fitted exactly (`ntagen.traces.refine`), and their rolls are
   moved by single steps as long as that helps.
3. More rolls always explain more, so a further roll is taken only if it lowers the root mean
   square of the distances by 40 % (`ROLL_GAIN`).

The deviations are then computed once more from the plan alone, with the exact kinematics of the
other rooms (`ntagen.needle.path`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from ntagen.errors import InputError
from ntagen.needle.circle import CurvaturePrior, fit_circle
from ntagen.needle.path import nearest_on_all
from ntagen.plan.actions import Action, Plan, Push, Roll
from ntagen.plan.extract import step_length_mm
from ntagen.scene import Needle, Pose, Scene
from ntagen.shapes import vector_of
from ntagen.traces.chain import LEAST_CURVATURE_PER_MM
from ntagen.traces.refine import (
    CURVATURE_STD_RATIO,
    ERROR_MM,
    Fitted,
    Freedom,
    fit_chain,
    oriented_on_grid,
    pose_from_depths,
    turned_from_depths,
)
from ntagen.traces.search import Space, Start, Steps, best_sequences
from ntagen.traces.trace import Trace
from ntagen.units import deg_from_rad

StartWay = Literal["free", "fit", "model"]
RadiusWay = Literal["scene", "fit"]

ROLL_GAIN: Final = 1.7
"""A further roll is taken only if the root mean square falls by this factor."""

FLOOR_MM: Final = 0.05
"""Distances below the noise of good trackers are no reason for a roll."""

FIRST_MM: Final = 20.0
"""The length of the first part to which a circle is fitted for the start."""

_REFINED: Final = 5
"""So many sequences of each number of rolls are fitted exactly."""

_HOPELESS: Final = 1.4
"""Moves of rolls by single pushes do not lower the deviation by more than this factor."""

_WINDOW_MM: Final = 20.0
_SAME_CURVATURE: Final = 0.03


@dataclass(frozen=True, slots=True)
class Options:
    """How a trace is matched.

    Attributes:
        start: What is known of the start: nothing (``free``), its pose from a circle fit of the
            first part (``fit``), or its position alone, with the orientation that the model gives
            on a grid (``model``).
        radius: The radius of all arcs: the scene's, or fitted with the scene's as a prior.
        rolls: The number of rolls; None for as many as `ROLL_GAIN` asks for, at most the scene's.
        most_rolls: The greatest number of rolls; None for the scene's.
        first_mm: The length of the first part.
    """

    start: StartWay = "free"
    radius: RadiusWay = "scene"
    rolls: int | None = None
    most_rolls: int | None = None
    first_mm: float = FIRST_MM


@dataclass(frozen=True, slots=True)
class Match:
    """What explains a trace best.

    Attributes:
        trace: The trace.
        needle: The needle at the start, with the radius.
        plan: Its pushes and rolls.
        distances_mm: The distance of each point of the trace from the plan's path.
        at_mm: The depth of the nearest place of the path.
        rms_by_rolls_mm: By the number of rolls, the root mean square of the best sequence; if it
            could not be taken, of the best one that was looked at.
    """

    trace: Trace
    needle: Needle
    plan: Plan
    distances_mm: tuple[float, ...]
    at_mm: tuple[float, ...]
    rms_by_rolls_mm: tuple[float, ...]

    @property
    def min_mm(self) -> float:
        """The least deviation."""
        return min(self.distances_mm)

    @property
    def avg_mm(self) -> float:
        """The mean deviation."""
        return sum(self.distances_mm) / len(self.distances_mm)

    @property
    def max_mm(self) -> float:
        """The greatest deviation."""
        return max(self.distances_mm)

    @property
    def rms_mm(self) -> float:
        """The root mean square of the deviations."""
        return math.sqrt(sum(d * d for d in self.distances_mm) / len(self.distances_mm))

    @property
    def rolls(self) -> tuple[tuple[float, float], ...]:
        """The depth in mm and the angle in rad of each roll."""
        found, depth_mm = [], 0.0
        for action in self.plan.actions:
            if isinstance(action, Push):
                depth_mm += action.length_mm
            elif isinstance(action, Roll):
                found.append((depth_mm, action.angle_rad))
        return tuple(found)

    @property
    def rolls_in_words(self) -> str:
        """The rolls for a reader; empty without any."""
        return ", ".join(f"{deg_from_rad(a):.4g} deg at {depth:g} mm" for depth, a in self.rolls)


def match_trace(scene: Scene, trace: Trace, options: Options | None = None) -> Match:
    """The match of a trace with the needle and the controller of a scene.

    Where the scene's targets and regions lie does not matter: the start is free.

    Raises:
        InputError: The trace is longer than the needle, so many rolls are not possible, or the
            needle may spin.
    """
    return _Matcher(scene, trace, options or Options()).best()


@dataclass(frozen=True, slots=True)
class _Found:
    """A sequence of rolls, and the chain with them that fits best."""

    steps: Steps
    fitted: Fitted


class _Matcher:
    """One match."""

    def __init__(self, scene: Scene, trace: Trace, options: Options) -> None:
        self._needle, self._trace, self._options = scene.needle, trace, options
        limits = scene.limits
        if limits.spins:
            raise InputError(
                "a trace is explained by pushes and rolls, and the needle of the scene may spin\n"
                "hint: leave `spin` out of the task"
            )
        self._step_mm = step_length_mm(scene)
        self._angles_rad = limits.roll_angles_rad
        self._apart = max(1, math.ceil(limits.min_roll_distance_mm / self._step_mm - 1e-9))
        self._counts = self._roll_counts(limits.max_rolls)
        if trace.length_mm > scene.needle.length_mm:
            raise InputError(
                f"{trace.samples.name}: the trace has {trace.length_mm:.1f} mm, but the needle of "
                f"the scene {scene.needle.length_mm:g} mm\n"
                "hint: write a greater length for the needle, or check the unit of the trace"
            )
        steps = max(1, math.ceil(trace.length_mm / self._step_mm))
        self._length_mm = steps * self._step_mm
        self._expected_per_mm = 1.0 / scene.needle.radius_mm
        self._start = self._known_start()

    def _roll_counts(self, most: int) -> range:
        wanted = self._options.rolls
        most = most if self._angles_rad else 0
        if wanted is None:
            upto = self._options.most_rolls
            return range((most if upto is None else min(most, upto)) + 1)
        if wanted > most:
            raise InputError(
                f"{wanted} rolls are asked for, but the scene allows {most}\n"
                "hint: write `at most N times` after the angles of its rolls"
            )
        return range(wanted, wanted + 1)

    def best(self) -> Match:
        """The match."""
        found: list[_Found] = []
        costs: list[float] = []
        for count in self._counts:
            if costs and FLOOR_MM * ROLL_GAIN**count >= min(costs):
                break  # Even without any distance, so many rolls would not be taken.
            # A start that is known leaves more to be gained by moves of rolls.
            is_free = self._options.start == "free"
            one = self._with_rolls(count, min(costs) if costs and is_free else math.inf)
            if one is not None:
                found.append(one)
                costs.append(self._weighed(one))
        if not found:
            raise InputError(
                f"{self._trace.samples.name}: the trace is too short for {self._options.rolls} "
                "rolls\nhint: ask for fewer"
            )
        best = found[int(np.argmin(costs))]
        return self._match(best, tuple(self._rms_mm(one.fitted) for one in found))

    def _weighed(self, found: _Found) -> float:
        """What is least for the number of rolls that is taken."""
        return math.hypot(self._rms_mm(found.fitted), FLOOR_MM) * ROLL_GAIN ** len(found.steps)

    def _rms_mm(self, fitted: Fitted) -> float:
        return math.sqrt(fitted.squares_mm2 / len(self._trace.points_mm))

    # Parts.

    def _known_start(self) -> Start:
        """What the options say of the start."""
        if self._options.start == "free":
            return Start()
        trace = self._trace
        first = trace.depths_mm <= self._options.first_mm
        if np.sum(first) < 3:
            raise InputError(
                f"{trace.samples.name}: there are fewer than 3 points on the first "
                f"{self._options.first_mm:g} mm\nhint: give a greater length, "
                f"as in --start {self._options.start}:40mm"
            )
        prior = CurvaturePrior(self._expected_per_mm, CURVATURE_STD_RATIO * self._expected_per_mm)
        circle = fit_circle(trace.points_mm[first], ERROR_MM, prior)
        x, y, z = trace.points_mm[0].tolist()
        pose = circle.pose_at((x, y, z))
        heading, bevel = np.array(pose.heading), np.array(pose.bevel)
        frame = np.column_stack([heading, bevel, np.cross(heading, bevel)])
        return Start(np.array(pose.position_mm), frame)

    def _freedom(self) -> Freedom:
        free = self._options.start == "free"
        return Freedom(free, free, self._options.radius == "fit", self._expected_per_mm)

    def _with_rolls(self, count: int, bar: float) -> _Found | None:
        """The best sequence with so many rolls; None if the trace is too short for them.

        It is not improved further if it is far from what fewer rolls reach, the bar.
        """
        curvature = self._expected_per_mm
        if self._options.radius == "fit":
            curvature = bend_of(self._trace)
        best: _Found | None = None
        for _ in range(2):
            space = self._space(curvature)
            sequences = best_sequences(space, count, _REFINED)
            if not sequences:
                return None
            found = [_Found(steps, self._fitted(space, steps)) for steps in sequences]
            best = min(found if best is None else [*found, best], key=_cost_mm2)
            if self._weighed(best) > _HOPELESS * bar:
                break
            best = self._moved(space, best)
            change = best.fitted.curvature_per_mm / curvature - 1.0
            if count == 0 or abs(change) < _SAME_CURVATURE:
                break
            curvature = best.fitted.curvature_per_mm
        return best

    def _space(self, curvature_per_mm: float) -> Space:
        start = self._start
        if self._options.start == "model":
            start = Start(start.position_mm)
        return Space(
            self._trace.points_mm,
            self._trace.depths_mm,
            curvature_per_mm,
            self._step_mm,
            self._angles_rad,
            self._apart,
            start,
        )

    def _fitted(self, space: Space, steps: Steps) -> Fitted:
        """The exact fit of a sequence."""
        points, depths = self._trace.points_mm, self._trace.depths_mm
        rolls, curvature = space.rolls([steps]), space.curvature_per_mm
        position, frame = self._start.position_mm, self._start.frame
        if position is None or frame is None:
            position, frame = pose_from_depths(points, depths, rolls, curvature)
        begin = Fitted(curvature, position, frame)
        if self._options.start == "model":
            frame = turned_from_depths(points, depths, rolls, curvature, position)
            freedom = replace(self._freedom(), orientation=True)
            free = fit_chain(points, rolls, self._length_mm, replace(begin, frame=frame), freedom)
            begin = replace(
                free, frame=oriented_on_grid(points, rolls, self._length_mm, free, begin.frame)
            )
        return fit_chain(points, rolls, self._length_mm, begin, self._freedom())

    def _moved(self, space: Space, found: _Found) -> _Found:
        """The sequence after moves by one step, of single rolls or all, as long as they help."""
        tried = {found.steps}
        while True:
            near = {moved for moved in _neighbours(found.steps) if space.contains(moved)} - tried
            tried |= near
            tries = [_Found(one, self._fitted(space, one)) for one in sorted(near)]
            best = min([*tries, found], key=_cost_mm2)
            if best is found:
                return found
            found = best

    def _match(self, found: _Found, rms_mm: tuple[float, ...]) -> Match:
        fitted = found.fitted
        heading, bevel, _ = (vector_of(column) for column in fitted.frame.T)
        pose = Pose(vector_of(fitted.position_mm), heading, bevel)
        needle = replace(self._needle, tip=pose, radius_mm=1.0 / fitted.curvature_per_mm)
        plan = self._plan(found.steps)
        near = nearest_on_all(
            plan.arcs(needle), pose.position_mm, [vector_of(p) for p in self._trace.points_mm]
        )
        return Match(
            trace=self._trace,
            needle=needle,
            plan=plan,
            distances_mm=tuple(one.distance_mm for one in near),
            at_mm=tuple(one.at_mm for one in near),
            rms_by_rolls_mm=rms_mm,
        )

    def _plan(self, steps: Steps) -> Plan:
        actions: list[Action] = []
        done_mm = 0.0
        for place, angle in steps:
            actions += [Push(place * self._step_mm - done_mm), Roll(self._angles_rad[angle])]
            done_mm = place * self._step_mm
        return Plan.of([*actions, Push(self._length_mm - done_mm)])


def bend_of(trace: Trace) -> float:
    """A first guess of the curvature: the median of those of windows of 20 mm.

    Each is that of the parabola through the window's points over their depth.
    """
    points, depths_mm = trace.points_mm, trace.depths_mm
    found: list[float] = []
    for begin in range(len(points)):
        inside = (depths_mm >= depths_mm[begin]) & (depths_mm <= depths_mm[begin] + _WINDOW_MM)
        is_last = depths_mm[-1] - depths_mm[begin] < 0.9 * _WINDOW_MM
        if np.sum(inside) < 4 or (is_last and found):
            continue
        along = depths_mm[inside] - depths_mm[inside].mean()
        design = np.column_stack([np.ones_like(along), along, 0.5 * along**2])
        bend = np.linalg.lstsq(design, points[inside], rcond=None)[0][2]
        found.append(float(np.linalg.norm(bend)))
    return max(float(np.median(found)), LEAST_CURVATURE_PER_MM) if found else 1e-3


def _neighbours(steps: Steps) -> Iterator[Steps]:
    """The sequences in which one roll, or all of them, come one step earlier or later."""
    for by in (-1, 1):
        yield tuple((place + by, angle) for place, angle in steps)
        for index, (place, angle) in enumerate(steps):
            yield (*steps[:index], (place + by, angle), *steps[index + 1 :])


def _cost_mm2(found: _Found) -> float:
    return found.fitted.cost_mm2
