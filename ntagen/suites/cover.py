"""Finds a small set of traces that cover the goals of a model."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ntagen.errors import ModelError, NtagenError
from ntagen.suites.goals import (
    Covered,
    Goal,
    Kind,
    Question,
    covered_by,
    goals_of,
    is_traceable,
    key_of,
    question_for,
)
from ntagen.suites.layout import Layout, layout_of
from ntagen.suites.suite import Case, Suite

if TYPE_CHECKING:
    from ntagen.checker import Answer
    from ntagen.checker import Model as LoadedModel


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of each search; ``None`` is no limit."""

    states: int | None = None
    timeout_s: float | None = None
    memory_bytes: int | None = None


def cover(
    model: LoadedModel,
    kinds: Sequence[Kind],
    *,
    name: str = "",
    each_process: bool = False,
    limits: Limits | None = None,
    constants: Mapping[str, str] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Suite:
    """A test suite of a model.

    For each goal that no trace covers yet, the engine looks for a trace with the fewest steps. Of
    all these traces, a greedy choice keeps those that are needed: always the one that covers most
    of what is left (Chvátal, 1979: at most 1 + ln n times as many as the smallest set has).

    Args:
        model: The model, with its constants set.
        kinds: What is to be covered.
        name: The name of the model's file.
        each_process: Whether every process must cover the locations and edges of its template.
        limits: The limits of each search.
        constants: The values of constants that the model was loaded with.
        progress: Is called with the number of goals that are decided, and of all goals.

    Raises:
        InputError: There is nothing to cover, or the model is not XML.
        ModelError: The model has a run-time error on the way to a goal.
    """
    search = _Search(model, layout_of(model), limits or Limits(), constants or {})
    goals = goals_of(search.layout, kinds, each_process=each_process)
    decided: dict[Goal, Covered] = {}
    traces: list[tuple[Goal, dict[str, Any], set[Goal]]] = []
    for number, goal in enumerate(goals):
        if progress is not None:
            progress(number, len(goals))
        if goal in decided:
            continue
        found = search.trace_to(goal)
        if isinstance(found, Covered):
            decided[goal] = found
            continue
        keys = covered_by(found, search.layout, kinds)
        reached = {one for one in goals if key_of(one) in keys} | {goal}
        traces.append((goal, found, reached))
        decided |= {one: Covered(one, "covered") for one in reached}
    chosen = _needed([reached for *_, reached in traces])
    kept = [traces[index] for index in chosen]
    tests = [
        Case(f"test_{number}", goal.name, search.layout.templates, trace)
        for number, (goal, trace, _) in enumerate(kept)
    ]
    return Suite(name, tuple(tests), tuple(_with_tests(decided[goal], kept) for goal in goals))


def _with_tests(one: Covered, kept: Sequence[tuple[Goal, dict[str, Any], set[Goal]]]) -> Covered:
    if one.verdict != "covered":
        return one
    tests = tuple(i for i, (*_, reached) in enumerate(kept) if one.goal in reached)
    return Covered(one.goal, "covered", tests)


def _needed(sets: Sequence[set[Goal]]) -> list[int]:
    """The indices of a few sets that have all members, in ascending order."""
    left = set().union(*sets)
    chosen: list[int] = []
    while left:
        best = max(range(len(sets)), key=lambda index: (len(sets[index] & left), -index))
        chosen.append(best)
        left -= sets[best]
    return sorted(chosen)


class _Search:
    """Asks the engine for traces to goals."""

    def __init__(
        self,
        model: LoadedModel,
        layout: Layout,
        limits: Limits,
        constants: Mapping[str, str],
    ) -> None:
        self.layout = layout
        self._model = model
        self._limits = limits
        self._constants = constants

    def trace_to(self, goal: Goal) -> dict[str, Any] | Covered:
        """A trace of the model that covers the goal, or why there is none."""
        question = question_for(goal, self.layout)
        if question is None:
            return Covered(goal, "unreachable", reason=f"no process runs {goal.template}")
        if goal.kind == "queries" and not is_traceable(question.query):
            return Covered(goal, "no trace", reason="queries of this kind have no trace")
        found = self._asked(goal, question)
        if isinstance(found, Covered) or goal.kind == "queries":
            return found
        places = found["run"]["states"][-1]["locations"].items()
        committed = self.layout.committed
        if any(f"{process}.{place}" in committed for process, place in places):
            resting = question_for(goal, self.layout, at_rest=True)
            longer = found if resting is None else self._asked(goal, resting)
            return found if isinstance(longer, Covered) else longer
        return found

    def _asked(self, goal: Goal, question: Question) -> dict[str, Any] | Covered:
        asked = self._model
        if question.model is not None:
            asked = question.model.load()
            if self._constants:
                asked = asked.with_constants(self._constants)
            asked.overflow = self._model.overflow
        answer = asked.check(
            question.query,
            wanted_trace="shortest",
            states=self._limits.states,
            timeout_s=self._limits.timeout_s,
            memory_bytes=self._limits.memory_bytes,
        )
        # A run-time error of the model has a trace too, but not to the goal.
        text = None if answer.satisfied is None else answer.trace_json()
        if text is None or "run" not in (trace := json.loads(text)):
            return self._without_trace(goal, answer)
        trace = question.clean(trace) | {"query": question.stated}
        checked = self._model.verify(json.dumps(trace), "the trace")
        if checked.holds is False:
            raise NtagenError("\n".join([f"the trace to {goal.name} is wrong", *checked.lines]))
        return trace

    def _without_trace(self, goal: Goal, answer: Answer) -> Covered:
        if answer.verdict == "error":
            raise ModelError(f"{goal.name}: {answer.message or 'the model has a run-time error'}")
        if answer.verdict == "unknown":
            return Covered(goal, "unknown", reason=f"stopped by the {answer.limit_text}")
        if answer.verdict == "maybe":
            return Covered(goal, "unknown", reason="the engine cannot decide it: clocks stop")
        if goal.kind == "queries":
            return Covered(goal, "no trace", reason=f"{answer.verdict}, which no run shows")
        if answer.verdict == "satisfied":
            return Covered(goal, "unknown", reason="its trace has no exact times")
        return Covered(goal, "unreachable", reason=f"all {answer.explored} states were searched")
