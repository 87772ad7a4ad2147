"""Follows a strategy against a tissue that answers: which branch of it the needle is on.

A strategy is a tree of decisions (`ntagen.plan.closed_loop`). In each segment the tissue has picked
how the needle bends and how the roll before went; each pick has a branch, which says where the next
decision is, and what it is. The driver sees positions only, and looks at them after each push: of
all ways through the tree on which the commands so far were the same, that one is followed whose
path explains the last positions best. So what short segments do not show is seen later.

What is guaranteed. On every branch, whatever must not be touched is at least the tip error of the
task away, and the end lies as deep in the target (`certify_all`). So while the tip is no farther
than that from the path of a branch, nothing is touched, and at the end of one the target is
reached, whatever the tissue did. The measured distance decides, in the mean of so many readings
that noise alone passes the tip error as seldom as `Settings.false_alarm` says. If it is greater,
the guarantee has ended. That the tip will stay on a branch follows only if the tissue picks corners
or the middle of its bounds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ntagen.drive.deviation import window
from ntagen.drive.pieces import pieces
from ntagen.drive.settings import Settings
from ntagen.needle.kinematics import Arc, orthonormal, roll
from ntagen.needle.measurement import squared_length_bound
from ntagen.needle.path import Path
from ntagen.needle.poses import Poses
from ntagen.plan.actions import Action, Push, Roll
from ntagen.plan.branches import arc_of
from ntagen.plan.closed_loop import Branch, Segment
from ntagen.scene import Pose, Scene, Vector
from ntagen.units import deg_from_rad

_Array = NDArray[np.float64]

AHEAD_MM: Final = 20.0
"""A direction that is off by 1 rad counts as much as a position that is off by this; ours."""

_RECENT_MM: Final = 10.0
"""Readings of so much of a segment tell which branch the needle is on; ours."""

_LONGEST_MM: Final = 10.0
"""Readings of at most so much insertion are averaged; ours."""

_SMALL_MM: Final = 1e-6
"""Lengths differ less than this by rounding."""


@dataclass(frozen=True, slots=True)
class Course:
    """How a run goes in a tissue that answers.

    Attributes:
        tree: The strategy that is followed; None if there is none.
        only_guaranteed: Whether the run ends where the strategy says nothing more. Otherwise it
            goes on with plans, as in another tissue.
        lack: Why there is no strategy, in words.
    """

    tree: Segment | None
    only_guaranteed: bool = False
    lack: str = ""


@dataclass(frozen=True, slots=True)
class Seen:
    """What the driver has seen at the end of a branch, and what it does then.

    Attributes:
        way: The numbers of the branches from the root to this one.
        branch: The branch.
        off_mm: How far the tip is from its path, in the mean of the last readings.
        decision: What comes then, in words.
    """

    way: tuple[int, ...]
    branch: Branch
    off_mm: float
    decision: str


@dataclass(frozen=True, slots=True)
class _Node:
    """A segment on one way through the tree, and the path that leads to it."""

    way: tuple[int, ...]
    segment: Segment
    path: Path


class _Candidates:
    """The branches that the needle may be on in a segment, and how far from each it was seen."""

    def __init__(self, nodes: Sequence[_Node], radius_mm: float) -> None:
        self.ways: list[tuple[int, ...]] = []
        self.branches: list[Branch] = []
        self.arcs: list[Arc] = []
        self._paths: list[Path] = []
        for node in nodes:
            pose = orthonormal(node.path.tip)
            for number, branch in enumerate(node.segment.branches):
                self.ways.append((*node.way, number))
                self.branches.append(branch)
                self.arcs.append(arc_of(pose, node.segment, branch, radius_mm))
                self._paths.append(node.path)
        self._starts = Poses.of(arc.start for arc in self.arcs)
        self._radii_mm = np.array([arc.radius_mm for arc in self.arcs])
        self.lengths_mm = np.array([branch.length_mm for branch in self.branches])
        # With nothing seen, the needle does what is expected.
        self._surprise = np.array(
            [abs(one.factor - 1.0) + abs(one.roll_error_rad) for one in self.branches]
        )
        self._offsets_mm: list[float] = []
        self._differences: list[_Array] = []

    def note(self, offset_mm: float, position_mm: Vector) -> None:
        """Takes a reading after so much of the segment."""
        expected_mm = self._starts.places(self._radii_mm, offset_mm)
        self._offsets_mm.append(offset_mm)
        self._differences.append(np.array(position_mm) - expected_mm)

    def best(self, offset_mm: float) -> int:
        """The one that explains the readings best; one that has ended before cannot."""
        is_open = self.lengths_mm >= offset_mm - _SMALL_MM
        misfit_mm = np.where(is_open, self._misfits_mm(), math.inf)
        least = misfit_mm <= misfit_mm.min() + _SMALL_MM**2
        return int(np.argmin(np.where(least, self._surprise, math.inf)))

    def _misfits_mm(self) -> _Array:
        """How far position and direction are off at the last reading, by a line through them."""
        if not self._offsets_mm:
            return np.zeros(len(self.branches))
        since_mm = self._offsets_mm[-1] - _RECENT_MM - _SMALL_MM
        first = next(i for i, one in enumerate(self._offsets_mm) if one >= since_mm)
        given = np.array(self._differences[first:])
        away = np.array(self._offsets_mm[first:])
        away = away - away.mean()
        mean = given.mean(axis=0)
        spread = float(away @ away)
        if spread <= _SMALL_MM**2:
            return np.asarray(np.linalg.norm(mean, axis=1))
        slope = np.tensordot(away, given, axes=1) / spread
        now = mean + float(away[-1]) * slope
        return np.asarray(np.linalg.norm(now, axis=1) + AHEAD_MM * np.linalg.norm(slope, axis=1))

    def differences(self, number: int, count: int) -> list[_Array]:
        """The last differences between readings and the path of one, at most so many."""
        return [one[number] for one in self._differences[-count:]]

    def before(self, number: int) -> Path:
        """The path that leads to the segment, on the way of one."""
        return self._paths[number]

    def path(self, number: int, roll_rad: float, length_mm: float) -> Path:
        """The path of one after so much of the segment; the roll before it was this."""
        turned_rad = roll_rad + self.branches[number].roll_error_rad
        turned = self._paths[number].roll(turned_rad) if turned_rad else self._paths[number]
        return turned.push(self.arcs[number].radius_mm, length_mm)

    def after(self, chosen: int, roll_rad: float) -> list[_Node]:
        """The segments that begin where a branch ends, after the same commands."""
        branch = self.branches[chosen]
        if branch.then is None:
            return []
        same = [
            number
            for number, one in enumerate(self.branches)
            if one.then is not None
            and one.then.roll_rad == branch.then.roll_rad
            and abs(one.length_mm - branch.length_mm) <= _SMALL_MM
        ]
        return [
            _Node(self.ways[i], then, self.path(i, roll_rad, self.branches[i].length_mm))
            for i in same
            if (then := self.branches[i].then) is not None
        ]


class Following:
    """A strategy that is followed.

    Args:
        tree: The strategy.
        scene: The scene for which it was made.
        settings: How pushes are divided, and the noise of the tracker.
        depth_mm: The insertion depth at which the strategy begins.

    Attributes:
        readings: How many readings are averaged, at most.
        most_off_mm: The greatest distance from the path so far.
        held_until_mm: The depth up to which the tip was near enough.
    """

    def __init__(
        self, tree: Segment, scene: Scene, settings: Settings, depth_mm: float = 0.0
    ) -> None:
        self._spacing_mm = settings.spacing_mm
        self._radius_mm = scene.needle.radius_mm
        self._tip_mm = max(scene.tissue.tip_mm, _SMALL_MM)
        tolerant = replace(settings, deviation_mm=self._tip_mm)
        most = max(settings.deviation_count, round(_LONGEST_MM / settings.spacing_mm))
        self.readings = min(window(tolerant, scene.needle.length_mm), most)
        readings = max(1.0, scene.needle.length_mm / settings.spacing_mm)
        bound = squared_length_bound(settings.false_alarm / readings)
        self._noise_mm = settings.priors.noise_mm * math.sqrt(bound)
        self.most_off_mm = 0.0
        self.held_until_mm = depth_mm
        # Differences from the branches that were followed in earlier segments.
        self._before: list[_Array] = []
        self._enter([_Node((), tree, Path(orthonormal(scene.needle.tip)))], depth_mm)

    def _enter(self, nodes: Sequence[_Node], depth_mm: float) -> None:
        """A segment begins; the roll before it is the same on all ways."""
        self._roll_rad = nodes[0].segment.roll_rad
        self._has_rolled = self._roll_rad == 0.0
        self._depth_mm = depth_mm
        self._offset_mm = 0.0
        self._candidates = _Candidates(nodes, self._radius_mm)
        self._chosen = self._candidates.best(0.0)

    @property
    def allowed_mm(self) -> float:
        """How far the tip may be from the path, in the mean of the readings so far."""
        return max(self._tip_mm, self._noise_mm / math.sqrt(max(1, len(self._last()))))

    @property
    def _branch(self) -> Branch:
        return self._candidates.branches[self._chosen]

    def _pose_at(self, offset_mm: float) -> Pose:
        return self._candidates.arcs[self._chosen].pose_at(offset_mm)

    def expected(self) -> Pose:
        """The pose of the tip on the branch that is followed."""
        pose = self._pose_at(self._offset_mm)
        # The roll may still have to be made.
        return pose if self._has_rolled else roll(pose, -self._roll_rad)

    def path(self) -> Path:
        """The path of the needle up to now, on the branch that is followed."""
        if not self._has_rolled:
            return self._candidates.before(self._chosen)
        return self._candidates.path(self._chosen, self._roll_rad, self._offset_mm)

    def _after(self) -> list[_Node]:
        return self._candidates.after(self._chosen, self._roll_rad)

    def next(self) -> tuple[Action, Pose] | None:
        """The next move and the pose that is expected after it; None at the end in the target."""
        if self._is_due():
            nodes, length_mm = self._after(), self._branch.length_mm
            if not nodes:
                return None
            self._before = self._last()
            self._enter(nodes, self._depth_mm + length_mm)
        if not self._has_rolled:
            self._has_rolled = True
            return Roll(self._roll_rad), self._pose_at(0.0)
        ahead_mm = self._candidates.lengths_mm - self._offset_mm
        stop_mm = float(ahead_mm[ahead_mm > _SMALL_MM].min())
        piece_mm = pieces(stop_mm, self._spacing_mm)[0]
        return Push(piece_mm), self._pose_at(self._offset_mm + piece_mm)

    def note(self, depth_mm: float, position_mm: Vector) -> None:
        """Takes a reading at a depth, and chooses the branch that explains the readings best."""
        self._offset_mm = max(0.0, depth_mm - self._depth_mm)
        self._candidates.note(self._offset_mm, position_mm)
        self._chosen = self._candidates.best(self._offset_mm)
        if self.is_near():
            self.most_off_mm = max(self.most_off_mm, self.off_mm())
            self.held_until_mm = depth_mm

    def is_near(self) -> bool:
        """Whether the tip is near enough to the path of the branch that is followed."""
        return self.off_mm() <= self.allowed_mm

    def off_mm(self) -> float:
        """How far the tip is from that path, in the mean of the last readings."""
        last = self._last()
        return float(np.linalg.norm(np.mean(last, axis=0))) if last else 0.0

    def seen(self) -> Seen | None:
        """What was seen at the end of the branch; None before."""
        if not self._is_due():
            return None
        then = self._branch.then
        decision = "stop in the target"
        if then is not None:
            decision = f"roll {deg_from_rad(then.roll_rad):g} deg"
        way = self._candidates.ways[self._chosen]
        return Seen(way, self._branch, self.off_mm(), decision)

    def _is_due(self) -> bool:
        """Whether the branch that is followed ends here."""
        return self._has_rolled and self._branch.length_mm - self._offset_mm <= _SMALL_MM

    def _last(self) -> list[_Array]:
        """The last differences between readings and the path, at most those that are averaged."""
        own = self._candidates.differences(self._chosen, self.readings)
        return [*self._before, *own][-self.readings :]
