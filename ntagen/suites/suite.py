"""Suites and their tests as values."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ntagen.checker.runs import Edge, Run, State, runs_of
from ntagen.suites.goals import Covered


@dataclass(frozen=True, slots=True)
class CaseEdge:
    """An edge that a step takes.

    Attributes:
        process: The process, for example ``Light``.
        template: Its template.
        source: The location that it leaves.
        target: The location that it enters.
        sync: The synchronisation as written, such as ``press?``; empty for an internal edge.
        select: The values of the select bindings.
        guard: As written.
        update: As written.
        controllable: Whether the controller owns it.
        codes: The test code of the model for it, with values: that of leaving the source, of the
            edge, and of entering the target.
    """

    process: str
    template: str
    source: str
    target: str
    sync: str
    select: dict[str, int]
    guard: str
    update: str
    controllable: bool
    codes: tuple[str, ...] = ()

    @property
    def action(self) -> str:
        """The channel of the synchronisation; empty for an internal edge."""
        return self.sync.rstrip("!? \t\n")

    @property
    def direction(self) -> str:
        """``send``, ``receive`` or ``internal``."""
        return {"!": "send", "?": "receive"}.get(self.sync.strip()[-1:], "internal")


@dataclass(frozen=True, slots=True)
class CaseStep:
    """A step of a test: after `delay` it takes the edges together.

    Attributes:
        delay: The time since the step before.
        time: The time since the beginning.
        edges: The edges, the sender's first.
        before: The state when the delay begins.
        after: The state after the edges.
    """

    delay: Fraction
    time: Fraction
    edges: tuple[CaseEdge, ...]
    before: State
    after: State


@dataclass(frozen=True, slots=True)
class Case:
    """A test: a trace of the model.

    Attributes:
        name: Its name, such as ``test_3``.
        goal: The name of the goal that it was made for.
        templates: The template of each process.
        trace: The trace, as ``ntagen check --trace`` writes it.
    """

    name: str
    goal: str
    templates: dict[str, str]
    trace: dict[str, Any]

    @property
    def run(self) -> Run:
        """The run with exact times."""
        return runs_of(self.trace)[0]

    @property
    def initial(self) -> State:
        """The state in which the test begins."""
        return self.run.states[0]

    @property
    def wait(self) -> Fraction:
        """How long the test waits after its last step."""
        return self.run.delay

    @property
    def duration(self) -> Fraction:
        """The time from the beginning to the end."""
        return self.run.duration

    @property
    def steps(self) -> tuple[CaseStep, ...]:
        """The steps, without test code."""
        run, raw = self.run, self.trace["run"]["steps"]
        found: list[CaseStep] = []
        time = Fraction(0)
        for index, step in enumerate(run.steps):
            time += step.delay
            edges = tuple(
                self._edge(edge, one["controllable"])
                for edge, one in zip(step.edges, raw[index]["edges"], strict=True)
            )
            states = run.states[index], run.states[index + 1]
            found.append(CaseStep(step.delay, time, edges, *states))
        return tuple(found)

    def _edge(self, edge: Edge, controllable: bool) -> CaseEdge:
        return CaseEdge(
            edge.process,
            self.templates[edge.process],
            edge.source,
            edge.target,
            edge.sync,
            edge.select,
            edge.guard,
            edge.update,
            controllable,
        )


@dataclass(frozen=True, slots=True)
class Suite:
    """A test suite.

    Attributes:
        model: The name of the model's file.
        tests: The tests.
        goals: What became of each goal.
    """

    model: str
    tests: tuple[Case, ...]
    goals: tuple[Covered, ...]

    def count(self, verdict: str) -> int:
        """How many goals have this verdict."""
        return sum(one.verdict == verdict for one in self.goals)
