"""A plan: the sequence of pushes and rolls that steers the needle, and of waits between them.

A plan is a value. Pushes that follow each other with the same spin are one push, and no push is
empty, so that two plans that move the needle in the same way are equal. So are waits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

from ntagen.needle.kinematics import Arc, push, roll
from ntagen.scene import Limits, Needle, Pose
from ntagen.units import deg_from_rad
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Push:
    """Insertion by a length along the motion circle.

    Attributes:
        length_mm: The length.
        spin: In this part of the length the needle spins about its shaft, in short cycles. The
            curvature is less by this part.
    """

    length_mm: float
    spin: float = 0.0

    def radius_mm(self, nominal_mm: float) -> float:
        """The radius of the motion circle of a needle that has this one without a spin."""
        return nominal_mm / (1.0 - self.spin)


@dataclass(frozen=True, slots=True)
class Roll:
    """Rotation about the shaft, right-handed about the heading."""

    angle_rad: float

    @property
    def turn_rad(self) -> float:
        """The shorter way to this angle: at most half a turn, to either side."""
        return math.remainder(self.angle_rad, 2.0 * math.pi)


@dataclass(frozen=True, slots=True)
class Wait:
    """The needle rests for a time, while regions move with the breath."""

    seconds: float


Action = Push | Roll | Wait


@dataclass(frozen=True, slots=True)
class Plan:
    """A sequence of actions; make it with `Plan.of`, which merges pushes.

    Attributes:
        actions: The actions in order.
    """

    actions: tuple[Action, ...]

    @staticmethod
    def of(actions: Iterable[Action]) -> Plan:
        """The plan of these actions with neighbouring pushes merged and empty ones left out.

        Waits too.

        Raises:
            ValueError: A push or a wait is negative, or a number is not finite.
        """
        merged: list[Action] = []
        for action in actions:
            _require_possible(action)
            last = merged[-1] if merged else None
            if isinstance(action, Push) and isinstance(last, Push) and action.spin == last.spin:
                merged[-1] = Push(last.length_mm + action.length_mm, last.spin)
            elif isinstance(action, Wait) and isinstance(last, Wait):
                merged[-1] = Wait(last.seconds + action.seconds)
            elif isinstance(action, Roll) or _amount(action) > 0.0:
                merged.append(action)
        return Plan(tuple(merged))

    @property
    def length_mm(self) -> float:
        """How far the plan inserts the needle."""
        return sum(action.length_mm for action in self.actions if isinstance(action, Push))

    @property
    def roll_count(self) -> int:
        """The number of rolls."""
        return sum(1 for action in self.actions if isinstance(action, Roll))

    @property
    def spin_changes(self) -> int:
        """How often the spin changes without a roll."""
        return sum(
            1
            for before, after in pairwise(self.actions)
            if isinstance(before, Push) and isinstance(after, Push)
        )

    @property
    def waits_s(self) -> float:
        """How long the needle rests, in all its waits."""
        return sum(action.seconds for action in self.actions if isinstance(action, Wait))

    def counted_rolls(self, limits: Limits) -> int:
        """The number of rolls, and of changes of the spin without one.

        One roll that chooses a free bevel before the entry does not count.
        """
        is_free = limits.free_bevel and self.actions[:1] and isinstance(self.actions[0], Roll)
        return self.roll_count + self.spin_changes - (1 if is_free else 0)

    def arcs(self, needle: Needle) -> tuple[Arc, ...]:
        """The arcs that the tip of this needle draws when it follows the plan exactly."""
        arcs: list[Arc] = []
        pose = needle.tip
        for action in self.actions:
            if isinstance(action, Roll):
                pose = roll(pose, action.angle_rad)
            elif isinstance(action, Push):
                arcs.append(Arc(pose, action.radius_mm(needle.radius_mm), action.length_mm))
                pose = arcs[-1].end
        return tuple(arcs)

    def end(self, needle: Needle) -> Pose:
        """The pose of this needle's tip after the plan."""
        pose = needle.tip
        for action in self.actions:
            if isinstance(action, Roll):
                pose = roll(pose, action.angle_rad)
            elif isinstance(action, Push):
                pose = push(pose, action.radius_mm(needle.radius_mm), action.length_mm)
        return pose

    def __str__(self) -> str:
        return ", ".join(_text(action) for action in self.actions) or "nothing to do"


def _amount(action: Action) -> float:
    """The number of an action: mm, rad or s."""
    match action:
        case Push():
            return action.length_mm
        case Roll():
            return action.angle_rad
        case Wait():
            return action.seconds


def _require_possible(action: Action) -> None:
    number = _amount(action)
    if not math.isfinite(number) or (not isinstance(action, Roll) and number < 0.0):
        raise ValueError(f"a needle cannot do {action}")
    if isinstance(action, Push) and not 0.0 <= action.spin < 1.0:
        raise ValueError(f"a needle cannot spin for {action.spin:g} of the way")


def _text(action: Action) -> str:
    match action:
        case Push():
            spinning = f" spinning {100.0 * action.spin:.4g} %" if action.spin else ""
            return f"push {action.length_mm:g} mm{spinning}"
        case Roll():
            return f"roll {deg_from_rad(action.angle_rad):.4g} deg"
        case Wait():
            return f"wait {action.seconds:.6g} s"
