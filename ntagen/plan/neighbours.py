"""Plans that differ little from a plan, and the best plan that small changes lead to.

The engine's plan for larger critical regions is one of many. The model's integers lose about 1 % of
an arc, so the plan can have up to 1 mm less clearance than was asked for, while a plan with a roll
one step earlier has it. To ask again for a little more costs a search through the whole game. To
certify all neighbours costs a millisecond or two.

A neighbour need not be a plan of the model: `Listing.has` asks it.

Cost: about 0.3 ms for a neighbour in a scene with ten regions; about 10 ms at most.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from ntagen.plan.actions import Action, Plan, Push, Roll
from ntagen.plan.certify import Certificate, certify
from ntagen.plan.extract import step_length_mm
from ntagen.plan.rank import Candidate, rank
from ntagen.scene import Scene

_MOST_DISTANCES: Final = 300
"""No further change is made after the distances of so many plans and regions were computed."""


@dataclass(frozen=True, slots=True)
class _Steps:
    """A plan in steps of the model.

    Attributes:
        pushes: The steps before the first roll, between two rolls, and after the last roll.
        angles: The angle of each roll, as an index.
    """

    pushes: tuple[int, ...]
    angles: tuple[int, ...]

    @staticmethod
    def of(plan: Plan, scene: Scene) -> _Steps:
        pushes, angles = [0], []
        for action in plan.actions:
            if isinstance(action, Push):
                pushes[-1] += round(action.length_mm / step_length_mm(scene))
            elif isinstance(action, Roll):
                pushes.append(0)
                angles.append(scene.limits.roll_angles_rad.index(action.angle_rad))
        return _Steps(tuple(pushes), tuple(angles))

    def plan(self, scene: Scene) -> Plan:
        step_mm = step_length_mm(scene)
        actions: list[Action] = [Push(step_mm) for _ in range(self.pushes[0])]
        for angle, pushes in zip(self.angles, self.pushes[1:], strict=True):
            actions.append(Roll(scene.limits.roll_angles_rad[angle]))
            # One by one, as the engine's plans are made: equal plans have equal sums.
            actions += [Push(step_mm) for _ in range(pushes)]
        return Plan.of(actions)

    def moved(self, *changes: tuple[int, int]) -> _Steps:
        """With more pushes (or fewer) at some places."""
        pushes = list(self.pushes)
        for place, more in changes:
            pushes[place] += more
        return _Steps(tuple(pushes), self.angles)

    def turned(self, roll: int, angle: int) -> _Steps:
        """With another angle of a roll."""
        angles = (*self.angles[:roll], angle, *self.angles[roll + 1 :])
        return _Steps(self.pushes, angles)

    def is_possible(self, scene: Scene) -> bool:
        """Whether the rolls are few and far enough apart, and the last move is a push."""
        is_free = scene.limits.free_bevel and self.pushes[0] == 0
        if len(self.angles) > scene.limits.max_rolls + is_free:
            return False
        apart = scene.limits.min_roll_distance_mm / step_length_mm(scene) - 1e-9
        first, *between = self.pushes[:-1] or (0,)
        return first >= 0 and all(steps >= apart for steps in between) and self.pushes[-1] > 0


def neighbours(plan: Plan, scene: Scene) -> Iterator[Plan]:
    """The plans with one small change.

    A roll comes one step earlier or later, or by the next smaller or larger angle; or the plan is
    one step shorter or longer. Where regions move there are none: they would meet other places.
    """
    if scene.breath is not None:
        return
    steps = _Steps.of(plan, scene)
    count = len(scene.limits.roll_angles_rad)
    changed: list[_Steps] = []
    for roll, (before, after) in enumerate(pairwise(range(len(steps.pushes)))):
        changed += [steps.moved((before, more), (after, -more)) for more in (-1, 1)]
        others = {(steps.angles[roll] + by) % count for by in (-1, 1)} - {steps.angles[roll]}
        changed += [steps.turned(roll, angle) for angle in sorted(others)]
    changed += [steps.moved((-1, more)) for more in (-1, 1)]
    yield from (one.plan(scene) for one in changed if one.is_possible(scene))


def improved(
    start: Candidate,
    scene: Scene,
    allow: Callable[[Certificate], bool],
    ranking: Sequence[str],
) -> Candidate:
    """The best plan that a chain of small changes leads to; each makes it better.

    Args:
        start: A plan of the scene that holds.
        scene: The scene.
        allow: Whether a plan with this certificate holds.
        ranking: What is better.
    """
    best = start
    tried = {start.plan}
    regions = len(scene.avoided) + len(scene.targets)
    while len(tried) * regions < _MOST_DISTANCES:
        new = [plan for plan in dict.fromkeys(neighbours(best.plan, scene)) if plan not in tried]
        tried.update(new)
        found = rank([best, *_holding(new, scene, allow)], ranking)[0]
        if found is best:
            break
        best = found
    return best


def _holding(
    plans: Iterable[Plan], scene: Scene, allow: Callable[[Certificate], bool]
) -> Iterator[Candidate]:
    for plan in plans:
        certificate = certify(plan, scene)
        if allow(certificate):
            yield Candidate(plan, certificate)
