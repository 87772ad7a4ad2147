"""Takes a test in a model that may be another one, such as a mutant."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from ntagen.checker.runs import Choice, Edge, Run, State
from ntagen.errors import ModelError
from ntagen.suites.suite import Case

if TYPE_CHECKING:
    from ntagen.checker import Model as LoadedModel


def replay(case: Case, model: LoadedModel) -> str | None:
    """Whether a model can do what a test does, with the same states at the same times.

    Args:
        case: The test.
        model: The model.

    Returns:
        ``None`` if it can; else what it does otherwise, and in which step.
    """
    follower = _Follower(case.run)
    try:
        done = model.simulate(len(follower.run.steps), choose=follower)
    except IndexError:
        delay = follower.run.steps[follower.number - 1].delay
        return f"step {follower.number}: it is not possible after a delay of {delay}"
    except ModelError as error:
        return f"step {follower.number}: {error}"
    if follower.missing:
        return f"step {follower.number + 1}: {follower.missing}"
    for number, (wanted, found) in enumerate(zip(follower.run.states, done.states, strict=False)):
        if difference := _difference(wanted, found):
            return f"after step {number}: {difference}"
    if len(done.steps) < len(follower.run.steps):
        return f"step {len(done.steps) + 1}: nothing is possible"
    return None


class _Follower:
    """Chooses what a run does."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self.number = 0
        self.missing = ""

    def __call__(self, _state: State, choices: tuple[Choice, ...]) -> tuple[int, Fraction] | None:
        step = self.run.steps[self.number]
        found = [
            (_likeness(choice.edges, step.edges), -index)
            for index, choice in enumerate(choices)
            if list(map(_key, choice.edges)) == list(map(_key, step.edges))
        ]
        if not found:
            self.missing = f"there is no {', '.join(map(str, step.edges))}"
            return None
        self.number += 1
        return -max(found)[1], step.delay


def _key(edge: Edge) -> tuple[object, ...]:
    return edge.process, edge.source, edge.target, edge.sync, edge.select


def _likeness(found: tuple[Edge, ...], wanted: tuple[Edge, ...]) -> int:
    """How many texts of the edges are the same, for edges between the same locations."""
    return sum(
        (one.guard == other.guard) + (one.update == other.update)
        for one, other in zip(found, wanted, strict=True)
    )


def _difference(wanted: State, found: State) -> str:
    for name in ("locations", "variables", "clocks"):
        values: dict[str, object] = getattr(found, name)
        for part, value in getattr(wanted, name).items():
            if part in values and values[part] != value:
                return f"{part} is {values[part]} and not {value}"
    return ""
