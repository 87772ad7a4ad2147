"""Makes plans from the engine's runs: the only module that knows the generated model's actions.

It also asks the model whether it can make a plan that was not found by the engine.

In the model, the User's edge with ``do_push!`` is a push of one model step. Where the needle may
spin, the edge selects the index of the spin. Its edge with ``do_rotate!`` is a roll by the angle
whose index the edge selects, or a change of the spin alone with the index behind them. That with
``do_wait!`` is a wait, which only models with moving regions have. All other edges (checks, the
tissue's answers) are not actions of the needle.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, groupby
from typing import TYPE_CHECKING, Final

from ntagen.errors import NtagenError
from ntagen.plan.actions import Action, Plan, Push, Roll, Wait
from ntagen.scene import Scene

if TYPE_CHECKING:
    from ntagen.checker import Answer, EngineEdge, EnginePlan, EngineStep, Simulation

_PUSH: Final = "do_push!"
_ROLL: Final = "do_rotate!"
_WAIT: Final = "do_wait!"
_ANGLE_INDEX: Final = "angle_index"
_SPIN_INDEX: Final = "spin_index"
_CHECKER: Final = "Checker"
_REACHED: Final = "Final_TR_Reached"


def extract(runs: Iterable[EnginePlan], scene: Scene) -> tuple[Plan, ...]:
    """The different plans of the runs, in the order of the runs.

    Raises:
        NtagenError: A run selects an angle or a spin that the scene does not have, so the model is
            not that of the scene.
    """
    return tuple(dict.fromkeys(_plan(run, scene) for run in runs))


def pages_of(listed: Answer, scene: Scene) -> Iterator[list[Plan]]:
    """The plans of an answer, some at a time, in its order: only one page is in memory.

    In the model of a scene the User alone has a choice, and each choice is an action. So no plan
    comes twice.

    Raises:
        NtagenError: As for `extract`.
    """
    actions = _Actions(scene)
    chains = [actions.runs_in(steps) for steps in listed.plan_chains()]
    for page in listed.plan_pages():
        yield [actions.plan_of(chains[index] for index in plan) for plan in page]


class _Actions:
    """Makes plans of equal actions that follow each other, and keeps their sums.

    Equal plans have equal sums, because they are added up in the same way as in `Plan.of`.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._sums: dict[tuple[Action, int], Action] = {}

    def runs_in(self, steps: Iterable[EngineStep]) -> tuple[tuple[Action, int], ...]:
        """Each action of some moves, and how often it follows itself."""
        edges = (edge for step in steps for edge in step.edges)
        found = [action for edge in edges if (action := _action(edge, self._scene)) is not None]
        return tuple((action, len(list(same))) for action, same in groupby(found))

    def plan_of(self, chains: Iterable[tuple[tuple[Action, int], ...]]) -> Plan:
        """The plan of such actions."""
        runs: list[tuple[Action, int]] = []
        for run in chain.from_iterable(chains):
            if runs and runs[-1][0] == run[0]:
                runs[-1] = (run[0], runs[-1][1] + run[1])
            else:
                runs.append(run)
        actions: list[Action] = []
        for run in runs:
            if isinstance(run[0], Roll):
                actions += [run[0]] * run[1]
                continue
            whole = self._sums.get(run)
            if whole is None:
                (whole,) = Plan.of([run[0]] * run[1]).actions
                self._sums[run] = whole
            actions.append(whole)
        return Plan(tuple(actions))


def leads_to_target(walk: Simulation, plan: Plan, scene: Scene) -> bool:
    """Whether the model of the scene can make a plan, and reaches its last target.

    The model ends with the first step that ends in the last target. The plan may push deeper into
    it, as those plans do that the engine found for a smaller target.

    Args:
        walk: A walk through the model, at its beginning. It ends where the model does, or where it
            does not follow the plan.
        plan: Pushes of whole steps, and rolls that the scene allows.
        scene: The scene.
    """
    wanted = _moves_of(plan, scene)
    while steps := walk.moves():
        decisions = [_decision(step) for step in steps]
        if not any(decisions):
            # Checks, and the tissue's answer, which is determined.
            if len(steps) > 1:
                return False
            walk.take(0)
            continue
        if not wanted or wanted[-1] not in decisions:
            return False
        walk.take(decisions.index(wanted.pop()))
    is_left_for_pushes = all(sent == _PUSH for sent, _ in wanted)
    return is_left_for_pushes and walk.locations[_CHECKER] == _REACHED


def _moves_of(plan: Plan, scene: Scene) -> list[tuple[str, int]]:
    """The User's edges, last first: what they send, and the index of the angle or spin, or -1."""
    limits = scene.limits
    moves: list[tuple[str, int]] = []
    for action in plan.actions:
        if isinstance(action, Push):
            if moves and moves[-1][0] == _PUSH:
                moves.append((_ROLL, len(limits.roll_angles_rad)))
            spin = limits.spun_fractions.index(action.spin) if limits.spins else -1
            moves += [(_PUSH, spin)] * round(action.length_mm / step_length_mm(scene))
        elif isinstance(action, Wait):
            moves += [(_WAIT, -1)] * round(action.seconds / _wait_s(scene))
        else:
            moves.append((_ROLL, limits.roll_angles_rad.index(action.angle_rad)))
    return moves[::-1]


def _decision(step: EngineStep) -> tuple[str, int] | None:
    """What the User's edge of a move sends, with the index of the angle or spin, or -1."""
    for edge in step.edges:
        if edge.sync == _PUSH:
            return _PUSH, edge.select.get(_SPIN_INDEX, -1)
        if edge.sync == _WAIT:
            return _WAIT, -1
        if edge.sync == _ROLL:
            return _ROLL, edge.select.get(_ANGLE_INDEX, -1)
    return None


def step_length_mm(scene: Scene) -> float:
    """The length of one push of the model, before it is rounded to integers."""
    return scene.needle.speed_mm_per_s * scene.limits.step_s


def _wait_s(scene: Scene) -> float:
    """The length of one wait of the model."""
    if scene.breath is None:
        raise NtagenError("the model waits, but in the scene nothing moves")
    return scene.breath.wait_s


def _plan(run: EnginePlan, scene: Scene) -> Plan:
    edges = (edge for step in run.steps for edge in step.edges)
    return Plan.of(action for edge in edges if (action := _action(edge, scene)) is not None)


def _action(edge: EngineEdge, scene: Scene) -> Action | None:
    limits = scene.limits
    if edge.sync == _PUSH:
        spin = edge.select.get(_SPIN_INDEX, 0)
        if not 0 <= spin < len(limits.spun_fractions):
            raise NtagenError(f"the model has the spin with index {spin}, which the scene lacks")
        return Push(step_length_mm(scene), limits.spun_fractions[spin])
    if edge.sync == _WAIT:
        return Wait(_wait_s(scene))
    if edge.sync != _ROLL:
        return None
    index = edge.select.get(_ANGLE_INDEX, -1)
    if limits.spins and index == len(limits.roll_angles_rad):
        return None  # The pushes have the spins.
    if not 0 <= index < len(limits.roll_angles_rad):
        raise NtagenError(f"the model rolls by the angle with index {index}, which the scene lacks")
    return Roll(limits.roll_angles_rad[index])
