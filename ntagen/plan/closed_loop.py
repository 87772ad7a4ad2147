"""Strategies against a tissue that answers: a tree of decisions, and what holds for it.

Against an adversarial tissue a plan is no sequence. After the entry and after each roll the tissue
picks how the needle bends and how the roll went; the strategy sees the pose and decides how far to
push, and by which angle to roll then. `decisions_of` reads that tree off the engine's strategy; it
is the second module that knows the generated model, besides `ntagen.plan.extract`.

The picks are corners and the middle: curvature times 1 - x, 1 or 1 + x, and roll errors of -y, 0
or y. `ntagen.plan.branches` follows every branch in exact kinematics.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from ntagen import rules
from ntagen.errors import NtagenError
from ntagen.rounding import units_per_mm
from ntagen.scene import Scene

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

    @property
    def most_rolls(self) -> int:
        """The most rolls on a way through this segment and all after it."""
        after = (one.then.most_rolls for one in self.branches if one.then is not None)
        return (self.roll_rad != 0.0) + max(after, default=0)


def decisions_of(answer: Answer, scene: Scene) -> Segment:
    """The tree of decisions of an answer's strategy for the scene's model.

    Raises:
        NtagenError: It is no such strategy.
    """
    return _Reader(dict(_decisions(answer)), scene, units_per_mm(scene)).first()


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

    def first(self) -> Segment:
        """The decision before the first push, and what follows."""
        angle = self.decided.get(((0,), 0, 0))
        if angle is None:
            raise NtagenError("the strategy does not decide in the model's initial state")
        return self._pushed(0.0, (), 0, 0) if angle < 0 else self._rolled(angle, (0,), 1, 0)

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
