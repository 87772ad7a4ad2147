"""Makes plans from the engine's runs: the only module that knows the generated model's actions.

In the model, the User's edge with ``do_push!`` is a push of one model step. Its edge with
``do_rotate!`` is a roll by the angle whose index the edge selects. All other edges (checks, the
tissue's answers) are not actions of the needle.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, Protocol

from ntagen.errors import NtagenError
from ntagen.plan.actions import Action, Plan, Push, Roll
from ntagen.scene import Scene

_PUSH: Final = "do_push!"
_ROLL: Final = "do_rotate!"
_ANGLE_INDEX: Final = "angle_index"


class Edge(Protocol):
    """An edge as the engine lists it."""

    @property
    def sync(self) -> str | None:
        """The synchronisation, such as ``do_push!``."""

    @property
    def select(self) -> dict[str, int]:
        """The values of the edge's selections."""


class Step(Protocol):
    """A move of one or more edges."""

    @property
    def edges(self) -> Sequence[Edge]:
        """The edges that are taken together."""


class Run(Protocol):
    """A winning run of the model."""

    @property
    def steps(self) -> Sequence[Step]:
        """The moves in order."""


def extract(runs: Iterable[Run], scene: Scene) -> tuple[Plan, ...]:
    """The different plans of the runs, in the order of the runs.

    Raises:
        NtagenError: A run selects an angle that the scene does not have, so the model is not that
            of the scene.
    """
    return tuple(dict.fromkeys(_plan(run, scene) for run in runs))


def step_length_mm(scene: Scene) -> float:
    """The length of one push of the model, before it is rounded to integers."""
    return scene.needle.speed_mm_per_s * scene.limits.step_s


def _plan(run: Run, scene: Scene) -> Plan:
    edges = (edge for step in run.steps for edge in step.edges)
    return Plan.of(action for edge in edges if (action := _action(edge, scene)) is not None)


def _action(edge: Edge, scene: Scene) -> Action | None:
    if edge.sync == _PUSH:
        return Push(step_length_mm(scene))
    if edge.sync != _ROLL:
        return None
    index = edge.select.get(_ANGLE_INDEX, -1)
    if not 0 <= index < len(scene.limits.roll_angles_rad):
        raise NtagenError(f"the model rolls by the angle with index {index}, which the scene lacks")
    return Roll(scene.limits.roll_angles_rad[index])
