"""A policy in a run: it is asked at each measurement, and its move is made if that is safe.

Whoever follows a plan asks the policy after each push of the model (`ntagen.plan.policy`). If the
plan goes on with the same move, nothing changes. If not, the rolls that the policy has still to
make give plans that begin with its move; the best of those that hold for the newest estimate
replaces the plan. They must pass what every plan of the driver must pass: its certificate, its
tube, and the time that is left. Where the policy says nothing, or none of its plans holds, the plan
stays, which syntheses have found and go on to check.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Final

from ntagen.drive.records import Advised, Journal
from ntagen.drive.steering import Steering
from ntagen.plan.actions import Action, Plan, Push, Roll
from ntagen.plan.policy import Move, Policy, push_mm
from ntagen.plan.rank import Candidate
from ntagen.scene import Scene

POLICY: Final = "policy"
SYNTHESIS: Final = "re-synthesis"
AS_PLANNED: Final = "as planned"

_ROLL_RAD: Final = 0.1
"""What turns the shaft by less is no roll of a plan: the least one is by 5 deg or more."""

_WHOLE: Final = 1e-6
"""Depths are whole pushes, and pushes whole steps, up to this."""


class Advice:
    """The policy of a run.

    Args:
        policy: The policy; None or a silent one to follow plans alone.
        scene: The a-priori scene.
        needle: The needle.
        journal: Records who decides.
    """

    def __init__(
        self, policy: Policy | None, scene: Scene, needle: Steering, journal: Journal
    ) -> None:
        self._policy = None if policy is None or policy.is_silent else policy
        self._scene = scene
        self._needle = needle
        self._journal = journal
        self._asked: tuple[int, int] | None = None

    def is_due(self) -> bool:
        """Whether the policy is to be asked: once after each push of the model, and each roll.

        After the last roll it has nothing to decide.
        """
        if self._policy is None:
            return False
        pushes, rolls = self._needle.depth_mm / push_mm(self._scene), self._rolls()
        if rolls >= len(self._policy.around.rolls) or abs(pushes - round(pushes)) > _WHOLE:
            return False
        return self._asked != (round(pushes), rolls)

    def instead_of(
        self,
        rest: Plan,
        scene: Scene,
        vouched: Callable[[Scene, Iterable[Plan]], tuple[Candidate, ...]],
    ) -> Plan | None:
        """The plan of the policy if it goes on with another move, and if one holds.

        Args:
            rest: The rest of the plan that is followed.
            scene: The known scene for the newest estimate.
            vouched: The plans that may be followed in a scene, best first.
        """
        policy, step_mm, rolls = self._policy, push_mm(self._scene), self._rolls()
        if policy is None:
            raise AssertionError("there is no policy to ask")
        pushes = round(self._needle.depth_mm / step_mm)
        self._asked = pushes, rolls
        move = policy.decide(self._scene, scene.needle.tip, self._needle.depth_mm, rolls)
        if move is None:
            self._note("", SYNTHESIS, "the policy has not seen this")
            return None
        if move == _begins(rest, step_mm, policy, rolls):
            self._note(move, POLICY, AS_PLANNED)
            return None
        found = vouched(scene, plans_of(policy, move, rolls, pushes, step_mm))
        if not found:
            self._note(move, SYNTHESIS, "no plan that begins so is safe")
            return None
        self._note(move, POLICY, str(found[0].plan))
        return found[0].plan

    def _rolls(self) -> int:
        """The rolls in the channel, and those at its end."""
        path = self._needle.path
        turns = (*(one.roll_before_rad for one in path.stretches), path.pending_roll_rad)
        return sum(abs(turn) > _ROLL_RAD for turn in turns)

    def _note(self, move: str, by: str, reason: str) -> None:
        needle = self._needle
        self._journal.record(Advised(needle.now_s(), needle.depth_mm, move, by, reason))


def plans_of(policy: Policy, move: Move, rolls: int, pushes: int, step_mm: float) -> Iterator[Plan]:
    """The plans with the rolls that are left, of which the first action is a move of the policy.

    The next roll and the end lie anywhere in their windows; rolls behind the next one are as far
    from the plan's place as that.
    """
    around = policy.around
    places = [place for place, _ in around.rolls]
    if move == "roll":
        shifts: Iterable[int] = (pushes - places[rolls],)
    else:
        shifts = range(max(pushes + 1, around.first[rolls]) - places[rolls], around.window + 1)
    for shift in shifts:
        for most in range(around.pushes - around.window, around.most_pushes + 1):
            actions: list[Action] = []
            at = pushes
            for number in range(rolls, len(places)):
                place = max(at, places[number] + shift)
                actions += [Push((place - at) * step_mm), Roll(policy.angle_rad(number))]
                at = place
            if most > at:
                yield Plan.of([*actions, Push((most - at) * step_mm)])


def _begins(rest: Plan, step_mm: float, policy: Policy, rolls: int) -> Move | None:
    """The move with which a plan goes on; None if it is none that the policy could make."""
    actions = rest.actions
    first = actions[0] if actions else None
    if isinstance(first, Push) and not first.spin:
        is_whole = first.length_mm > step_mm - _WHOLE or len(actions) == 1
        return "push" if is_whole else None
    if isinstance(first, Roll):
        turn_rad = Roll(first.angle_rad - policy.angle_rad(rolls)).turn_rad
        return "roll" if abs(turn_rad) < _ROLL_RAD else None
    return None
