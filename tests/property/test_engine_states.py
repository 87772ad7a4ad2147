"""The engine's states of the generated model are those of the oracle, bit for bit."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ntagen import checker
from ntagen.render import render
from ntagen.scene import Scene
from tests.oracles.declaration import End, Instance, Needle
from tests.scenes import PAPER, choices, scenes

SEQUENCES_OF_THE_PAPER = 1000
"""With each engine; every run of the tests draws others."""
SCENES = 15
SEQUENCES_A_SCENE = 20

ENDS = {
    "Path_Invalid": End.PATH_INVALID,
    "Final_TR_Reached": End.FINAL_TR_REACHED,
    "TR_Unreachable": End.TR_UNREACHABLE,
    "UR_Reached": End.UR_REACHED,
}
"""The Checker's last locations, and what the oracle calls them."""


def flattened(name: str, value: object) -> Iterator[tuple[str, int]]:
    """A variable of the oracle under the engine's names: ``tip_pos[0]``."""
    if isinstance(value, list):
        for index, part in enumerate(value):
            yield from flattened(f"{name}[{index}]", part)
    else:
        yield name, int(value)  # type: ignore[call-overload]


class Walker:
    """The engine's model, moved by decisions."""

    def __init__(self, scene: Scene, engine: checker.CodeEngine) -> None:
        self._model = checker.load(render(scene))
        self._engine = engine

    def start(self) -> None:
        """To the first decision or end."""
        self._simulation = self._model.walk(self._engine)
        self._simulation.settle()

    def decisions(self) -> list[int]:
        """What may be chosen: -1 is a push, others are the index of an angle."""
        steps = self._simulation.moves()
        edges = [step.edges[0] for step in steps]
        assert all(edge.process == "User" for edge in edges)
        return [edge.select.get("angle_index", -1) for edge in edges]

    def decide(self, decision: int) -> None:
        """Carries out a decision, up to the next one or the end."""
        self._simulation.take(self.decisions().index(decision))
        self._simulation.settle()
        if decision == -1:
            self._simulation.take(0)  # The push ends after its time.
            self._simulation.settle()

    def end(self) -> End | None:
        """The end that was reached, if any."""
        return ENDS.get(self._simulation.locations["Checker"])

    def variables(self) -> dict[str, int | float]:
        """All variables of the model."""
        return self._simulation.variables


def check_sequence(walker: Walker, needle: Needle, picks: list[int]) -> None:
    """Both make the same decisions; before each and at the end all variables are the same."""
    walker.start()
    for pick in picks:
        end = needle.check()
        expected = dict(part for item in needle.variables().items() for part in flattened(*item))
        found = walker.variables()
        assert {name: found[name] for name in expected} == expected
        assert walker.end() == end
        if end is not None:
            return
        allowed = [-1, *range(len(needle.instance.angles) * needle.may_roll())]
        assert sorted(walker.decisions()) == allowed
        decision = allowed[pick % len(allowed)]
        if decision == -1:
            needle.push()
        else:
            needle.roll(needle.instance.angles[decision])
        walker.decide(decision)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["jit", "interpreter"])
def test_a_thousand_sequences_of_the_paper_scene(engine: checker.CodeEngine) -> None:
    walker = Walker(PAPER, engine)

    @settings(max_examples=SEQUENCES_OF_THE_PAPER, deadline=None, database=None)
    @given(choices())
    def walk(picks: list[int]) -> None:
        check_sequence(walker, Needle.start(Instance()), picks)

    walk()


@settings(max_examples=SCENES, deadline=None, suppress_health_check=list(HealthCheck))
@given(scenes(), st.lists(choices(), min_size=1, max_size=SEQUENCES_A_SCENE))
def test_sequences_of_any_scene(scene: Scene, sequences: list[list[int]]) -> None:
    walker = Walker(scene, "jit")
    for picks in sequences:
        check_sequence(walker, Needle.start(Instance.of_scene(scene)), picks)
