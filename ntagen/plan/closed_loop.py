"""Strategies against a tissue that answers: a tree of decisions, and what holds for it.

Against an adversarial tissue a plan is no sequence. After the entry and after each roll the tissue
picks how the needle bends and how the roll went; the strategy sees the pose and decides how far to
push, and by which angle to roll then. `decisions_of` reads that tree off the engine's strategy; it
is the second module that knows the generated model, besides `ntagen.plan.extract`.

The picks are corners and the middle: curvature times 1 - x, 1 or 1 + x, and roll errors of -y, 0
or y. `certify_all` follows every branch in exact kinematics.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from ntagen import rules
from ntagen.errors import NtagenError
from ntagen.needle.kinematics import Arc, orthonormal, roll
from ntagen.needle.nearest import nearest_to, places_on
from ntagen.rounding import units_per_mm
from ntagen.scene import Pose, Scene

if TYPE_CHECKING:
    from ntagen.checker import Answer

_SPACING_MM: Final = 0.1
"""Distances are computed at points so far apart on a path."""

Key = tuple[tuple[int, ...], int, int]
"""Where the strategy decides: the picks, the number of segments before, the insertion."""


@dataclass(frozen=True, slots=True)
class Branch:
    """What the strategy does after a pick of the tissue.

    Attributes:
        factor: What the tissue picked: the curvature, relative to the needle's.
        roll_error_rad: And by how much the roll before went too far.
        length_mm: The insertion until the next decision.
        then: What comes then; None in the target.
    """

    factor: float
    roll_error_rad: float
    length_mm: float
    then: Segment | None


@dataclass(frozen=True, slots=True)
class Segment:
    """A decision, and the answers to it.

    Attributes:
        roll_rad: The roll that is made first; 0 for none.
        branches: One for each pick of the tissue.
    """

    roll_rad: float
    branches: tuple[Branch, ...]

    @property
    def leaves(self) -> int:
        """The number of ways on which the target is reached."""
        return sum(1 if one.then is None else one.then.leaves for one in self.branches)

    @property
    def longest_mm(self) -> float:
        """The length of the longest way through this segment and all after it."""
        return max(
            one.length_mm + (0.0 if one.then is None else one.then.longest_mm)
            for one in self.branches
        )

    def to_json(self) -> dict[str, Any]:
        """The tree as JSON; angles in rad, lengths in mm."""
        return {
            "roll_rad": self.roll_rad,
            "branches": [
                {
                    "factor": one.factor,
                    "roll_error_rad": one.roll_error_rad,
                    "length_mm": one.length_mm,
                    "then": None if one.then is None else one.then.to_json(),
                }
                for one in self.branches
            ],
        }

    @staticmethod
    def from_json(document: Mapping[str, Any]) -> Segment:
        """The tree of such a document."""
        return Segment(
            document["roll_rad"],
            tuple(
                Branch(
                    one["factor"],
                    one["roll_error_rad"],
                    one["length_mm"],
                    None if one["then"] is None else Segment.from_json(one["then"]),
                )
                for one in document["branches"]
            ),
        )


@dataclass(frozen=True, slots=True)
class Reach:
    """What holds on all branches of a tree, in exact kinematics.

    Attributes:
        leaves: The number of branches.
        clearance_mm: The least distance to a region that must not be touched; infinite without one.
        depth_mm: The least depth in the target at the end.
        longest_mm: The length of the longest branch.
        most_rolls: The most rolls on a branch.
    """

    leaves: int
    clearance_mm: float
    depth_mm: float
    longest_mm: float
    most_rolls: int

    def holds(self, tip_mm: float) -> bool:
        """Whether nothing is touched and the target is reached if the tip is off by this much."""
        is_free = self.clearance_mm >= tip_mm and self.clearance_mm > 0.0
        return is_free and self.depth_mm >= tip_mm

    def missing_mm(self, tip_mm: float) -> float:
        """How much is missing on the worst branch so that it holds; 0 if nothing is."""
        return max(0.0, tip_mm - min(self.clearance_mm, self.depth_mm))


def decisions_of(answer: Answer, scene: Scene) -> Segment:
    """The tree of decisions of an answer's strategy for the scene's model.

    Raises:
        NtagenError: It is no such strategy.
    """
    return _Reader(dict(_decisions(answer)), scene, units_per_mm(scene)).segment((), 0, 0)


def _decisions(answer: Answer) -> Iterator[tuple[Key, int]]:
    """What is decided where: the index of the angle of a roll, or -1 for a push.

    A strategy has a state for each of the many steps between two decisions, so only those are asked
    for in which the User decides.
    """
    decided = answer.decisions_of("User", ("picks", "segment", "needle_progress"))
    for (picks, (segment,), (progress,)), edge in decided:
        # Elsewhere the User does what it must.
        if edge.source == "Idle":
            key = (picks[: segment + 1], segment, progress)
            yield key, edge.select.get("angle_index", -1)


@dataclass(frozen=True, slots=True)
class _Reader:
    """Follows the decisions of a strategy through the picks of the tissue."""

    decided: Mapping[Key, int]
    scene: Scene
    per_mm: int

    def segment(self, picks: tuple[int, ...], number: int, progress: int) -> Segment:
        """The decision before the first push of a segment, and what follows."""
        angle = self._decision((*picks, 0), number, progress) if number == 0 else -1
        if angle >= 0:
            return self._rolled(angle, (*picks, 0), 1, progress)
        return self._pushed(0.0, picks, number, progress)

    def _rolled(self, angle: int, picks: tuple[int, ...], number: int, progress: int) -> Segment:
        roll_rad = self.scene.limits.roll_angles_rad[angle]
        return self._pushed(roll_rad, picks, number, progress)

    def _pushed(
        self, roll_rad: float, picks: tuple[int, ...], number: int, progress: int
    ) -> Segment:
        tissue = self.scene.tissue
        factors, errors = tissue.factors, tissue.roll_errors_rad
        is_first = number == 0 or (self.scene.limits.free_bevel and number == 1 and progress == 0)
        branches = []
        # The model lists radii, the smallest first: the strongest bend.
        for bend, factor in enumerate(reversed(factors)):
            for twist, error in enumerate(errors):
                if is_first and error != 0.0:
                    continue
                pick = 1 + bend * len(errors) + twist
                branches.append(self._branch(factor, error, (*picks, pick), number, progress))
        return Segment(roll_rad, tuple(branches))

    def _branch(
        self, factor: float, error: float, picks: tuple[int, ...], number: int, progress: int
    ) -> Branch:
        """Follows pushes up to the next roll, or to the end."""
        needle = self.scene.needle
        push = needle.speed_mm_per_s * self.scene.limits.step_s
        dt, velocity_mm, _ = rules.time_units(self.scene.limits.step_s, needle.speed_mm_per_s)
        units = dt * rules.units_of(velocity_mm, self.per_mm)
        now, count = progress + units, 1
        while (angle := self.decided.get((picks, number, now), None)) == -1:
            now, count = now + units, count + 1
        then = None if angle is None else self._rolled(angle, picks, number + 1, now)
        return Branch(factor, error, count * push, then)

    def _decision(self, picks: tuple[int, ...], number: int, progress: int) -> int:
        decision = self.decided.get((picks, number, progress))
        if decision is None:
            raise NtagenError("the strategy does not decide in the model's initial state")
        return decision


def certify_all(tree: Segment, scene: Scene) -> Reach:
    """Follows all branches of a tree from the needle's pose, in exact kinematics."""
    found = _Found(scene)
    found.follow(tree, orthonormal(scene.needle.tip), 0.0, 0)
    return Reach(
        tree.leaves,
        found.clearance_mm,
        found.depth_mm,
        found.longest_mm,
        found.most_rolls,
    )


class _Found:
    """The worst on all branches so far."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.clearance_mm = math.inf
        self.depth_mm = math.inf
        self.longest_mm = 0.0
        self.most_rolls = 0

    def follow(self, segment: Segment, pose: Pose, length_mm: float, rolls: int) -> None:
        """Follows a segment and all after it."""
        is_free = self._scene.limits.free_bevel and length_mm == 0.0
        rolls += segment.roll_rad != 0.0 and not is_free
        for branch in segment.branches:
            start = roll(pose, segment.roll_rad + branch.roll_error_rad)
            radius_mm = self._scene.needle.radius_mm / branch.factor
            arc = Arc(start, radius_mm, branch.length_mm)
            self._pass(arc)
            inserted_mm = length_mm + branch.length_mm
            if branch.then is not None:
                self.follow(branch.then, orthonormal(arc.end), inserted_mm, rolls)
                continue
            target = self._scene.targets[-1]
            self.depth_mm = min(self.depth_mm, -target.distance_mm(arc.end.position_mm))
            self.longest_mm = max(self.longest_mm, inserted_mm)
            self.most_rolls = max(self.most_rolls, rolls)

    def _pass(self, arc: Arc) -> None:
        points = _points(arc)
        for region in self._scene.avoided:
            # No point of the path is farther than half the spacing from one of these.
            near_mm = float(region.shape.distance_mm(points).min()) - 0.5 * _SPACING_MM
            if near_mm < self.clearance_mm:
                nearest = nearest_to((arc,), arc.start.position_mm, region.shape)
                self.clearance_mm = min(self.clearance_mm, nearest.distance_mm)


def _points(arc: Arc) -> NDArray[np.float64]:
    """Points on an arc, at most `_SPACING_MM` apart, with both ends, of shape (n, 3)."""
    count = max(1, math.ceil(arc.length_mm / _SPACING_MM))
    along_mm = np.linspace(0.0, arc.length_mm, count + 1)
    return places_on([arc], np.zeros(count + 1, dtype=np.intp), along_mm)
