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
from dataclasses import dataclass, replace
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
        angles: The angle of each roll, as an index; -1 where the spin alone changes.
        spins: The spin of the steps in each place, as an index.
    """

    pushes: tuple[int, ...]
    angles: tuple[int, ...]
    spins: tuple[int, ...]

    @staticmethod
    def of(plan: Plan, scene: Scene) -> _Steps:
        pushes, angles, spins = [0], [], [0]
        for action in plan.actions:
            if isinstance(action, Push):
                if pushes[-1] > 0:
                    pushes.append(0)
                    spins.append(0)
                    angles.append(-1)
                pushes[-1] = round(action.length_mm / step_length_mm(scene))
                spins[-1] = scene.limits.spun_fractions.index(action.spin)
            elif isinstance(action, Roll):
                pushes.append(0)
                spins.append(0)
                angles.append(scene.limits.roll_angles_rad.index(action.angle_rad))
        return _Steps(tuple(pushes), tuple(angles), tuple(spins))

    def plan(self, scene: Scene) -> Plan:
        limits, step_mm = scene.limits, step_length_mm(scene)
        actions: list[Action] = []
        for place, (pushes, spin) in enumerate(zip(self.pushes, self.spins, strict=True)):
            if place > 0 and self.angles[place - 1] >= 0:
                actions.append(Roll(limits.roll_angles_rad[self.angles[place - 1]]))
            # One by one, as the engine's plans are made: equal plans have equal sums.
            actions += [Push(step_mm, limits.spun_fractions[spin]) for _ in range(pushes)]
        return Plan.of(actions)

    def moved(self, *changes: tuple[int, int]) -> _Steps:
        """With more pushes (or fewer) at some places."""
        pushes = list(self.pushes)
        for place, more in changes:
            pushes[place] += more
        return replace(self, pushes=tuple(pushes))

    def turned(self, roll: int, angle: int) -> _Steps:
        """With another angle of a roll."""
        return replace(self, angles=(*self.angles[:roll], angle, *self.angles[roll + 1 :]))

    def spun(self, place: int, spin: int) -> _Steps:
        """With another spin in one place."""
        return replace(self, spins=(*self.spins[:place], spin, *self.spins[place + 1 :]))

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

    A roll comes one step earlier or later, or by the next smaller or larger angle; or the needle
    spins more or less between two rolls; or the plan is one step shorter or longer. Where regions
    move there are none: they would meet other places.
    """
    if scene.breath is not None:
        return
    steps = _Steps.of(plan, scene)
    count = len(scene.limits.roll_angles_rad)
    changed: list[_Steps] = []
    for roll, (before, after) in enumerate(pairwise(range(len(steps.pushes)))):
        changed += [steps.moved((before, more), (after, -more)) for more in (-1, 1)]
        if steps.angles[roll] >= 0:
            others = {(steps.angles[roll] + by) % count for by in (-1, 1)} - {steps.angles[roll]}
            changed += [steps.turned(roll, angle) for angle in sorted(others)]
    fractions = scene.limits.spun_fractions
    by_size = sorted(range(len(fractions)), key=fractions.__getitem__)
    for less, more in pairwise(by_size):
        for place, spin in enumerate(steps.spins):
            if spin in (less, more) and steps.pushes[place] > 0:
                changed.append(steps.spun(place, less + more - spin))
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
