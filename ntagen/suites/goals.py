"""What the traces of a suite should cover, and how the engine is asked for a trace to each."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from ntagen import build
from ntagen.checker import form_of
from ntagen.errors import InputError
from ntagen.suites.layout import Layout

Kind = Literal["locations", "edges", "queries"]
KINDS: Final[tuple[Kind, ...]] = ("locations", "edges", "queries")
"""What can be covered."""

Verdict = Literal["covered", "unreachable", "unknown", "no trace"]

_WITH_TRACES: Final = ("E<>", "A[]", "E[]", "A<>", "-->")
"""The kinds of queries that a run of the model can show or refute."""

Cleaning = Callable[[dict[str, Any]], dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Goal:
    """Something to be covered.

    Attributes:
        kind: ``locations``, ``edges`` or ``queries``.
        name: How it is shown: ``Light.Dim``, ``Light: Off -> Dim [press?]``, or the query.
        template: The template of a location or edge; empty for a query.
        index: Its number among the locations or edges of the template, or among the queries.
        process: The process in which it must be covered; ``None`` if any process will do.
    """

    kind: Kind
    name: str
    template: str
    index: int
    process: str | None = None


@dataclass(frozen=True, slots=True)
class Covered:
    """What became of a goal.

    Attributes:
        goal: The goal.
        verdict: ``covered``; ``unreachable``: the engine has searched all states; ``unknown``: a
            limit came first; ``no trace``: the verdict of the query has no run that shows it.
        tests: The numbers of the tests that cover it, from 0.
        reason: Why it is not covered.
    """

    goal: Goal
    verdict: Verdict
    tests: tuple[int, ...] = ()
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Question:
    """How to ask for a trace.

    Attributes:
        query: The query.
        model: The changed copy of the model that is asked; ``None`` for the model itself.
        clean: Makes of a trace of the copy one of the model.
        stated: The query that this trace shows in the model.
    """

    query: str
    model: build.Model | None
    clean: Cleaning
    stated: str


def goals_of(layout: Layout, kinds: Sequence[Kind], *, each_process: bool) -> list[Goal]:
    """The goals of a model.

    Args:
        layout: The model.
        kinds: What is to be covered.
        each_process: Whether every process of a template must cover its locations and edges, and
            not just one of them.

    Raises:
        InputError: There is nothing to cover.
    """
    found: list[Goal] = []
    for kind in KINDS:
        if kind not in kinds:
            continue
        if kind == "queries":
            texts = [query.formula for query in layout.written.queries]
            found += [Goal(kind, " ".join(t.split()), "", i) for i, t in enumerate(texts) if t]
            continue
        for template in layout.written.templates:
            names = _location_names(template) if kind == "locations" else _edge_names(template)
            running: list[str | None] = [None]
            if each_process:
                running = [*layout.processes(template.name)] or running
            for index, name in names.items():
                found += [
                    Goal(kind, f"{name} of {one}" if one else name, template.name, index, one)
                    for one in running
                ]
    if not found:
        raise InputError(
            f"the model has no {' or '.join(kinds)}, so there is nothing to cover\n"
            "hint: ask for something else with --cover"
        )
    return found


def _location_names(template: build.Template) -> dict[int, str]:
    return {i: f"{template.name}.{one.shown_name}" for i, one in enumerate(template.locations)}


def _edge_names(template: build.Template) -> dict[int, str]:
    """The names of the edges that can be goals: what leads into a branch point is part of legs."""
    names: dict[int, str] = {}
    for index, edge in enumerate(template.edges):
        if isinstance(edge.target, build.BranchPoint):
            continue
        sync = f" [{' '.join(edge.sync.split())}]" if edge.sync.strip() else ""
        name = f"{template.name}: {edge.source.shown_name} -> {edge.target.shown_name}{sync}"
        names[index] = f"{name} (edge {index})" if name in names.values() else name
    return names


def question_for(goal: Goal, layout: Layout, *, at_rest: bool = False) -> Question | None:
    """How to ask for a trace to a goal; ``None`` if no process runs its template.

    Edges are found by a variable that they set in a copy of the model, a location without a name by
    a name that it gets there. Search and trace are else those of the model: the variable is false
    until the edge is taken.

    Args:
        goal: The goal.
        layout: The model.
        at_rest: Whether the trace must go on until no process is in a committed location with a
            name: where it ends then, an implementation can be looked at.
    """
    if goal.kind == "queries":
        query = layout.written.queries[goal.index].formula
        return Question(query, None, dict, query)
    processes = [goal.process] if goal.process else layout.processes(goal.template)
    if not processes:
        return None
    if goal.kind == "edges" or at_rest:
        return _marked(goal, layout, processes, at_rest=at_rest)
    own = layout.written[goal.template].locations[goal.index]
    if own.name:
        query = f"E<> {_in_any(processes, own.name)}"
        return Question(query, None, dict, query)
    name = _fresh_name(layout.written)
    changed = _copy(layout)
    changed[goal.template].locations[goal.index].name = name
    running = layout.processes(goal.template)
    clean = _renaming(running, name, layout.places[goal.template][goal.index])
    return Question(f"E<> {_in_any(processes, name)}", changed, clean, "E<> true")


def _marked(goal: Goal, layout: Layout, processes: Sequence[str], *, at_rest: bool) -> Question:
    """The question for an edge, or for any of the edges into a location."""
    name = _fresh_name(layout.written)
    mark = f"{name} = true"
    changed = _copy(layout)
    template = changed[goal.template]
    marked = [template.edges[goal.index]] if goal.kind == "edges" else []
    started = False
    if goal.kind == "locations":
        location = template.locations[goal.index]
        marked = [edge for edge in template.edges if edge.target is location]
        started = template.initial is location
    template.declarations += f"\nbool {name} = {'true' if started else 'false'};"
    for edge in marked:
        edge.update = f"{mark}, {edge.update}" if _has_code(edge.update) else mark
    query = f"E<> ({_in_any(processes, name)})"
    if at_rest:
        query += "".join(f" && not {one}" for one in layout.committed)
    clean = _unmarking(layout.processes(goal.template), name, mark)
    return Question(query, changed, clean, "E<> true")


def _copy(layout: Layout) -> build.Model:
    changed = copy.deepcopy(layout.written)
    changed.queries = []
    return changed


def is_traceable(query: str) -> bool:
    """Whether the verdict of a query may have a run that shows it."""
    form = form_of(query)
    return form is not None and form.kind in _WITH_TRACES and form.uses is None


def covered_by(trace: dict[str, Any], layout: Layout, kinds: Sequence[Kind]) -> set[Any]:
    """What a trace covers: tuples of kind, template, index and process."""
    run = trace["run"]
    found: set[Any] = set()
    if "locations" in kinds:
        for state in run["states"]:
            for process, place in state["locations"].items():
                found.add(("locations", *layout.location_index(process, place), process))
    if "edges" in kinds:
        for step in run["steps"]:
            for taken in step["edges"]:
                found.add(("edges", *layout.edge_index(taken), taken["process"]))
    return found | {(*one[:3], None) for one in found}


def key_of(goal: Goal) -> tuple[Any, ...]:
    """The goal as `covered_by` names it."""
    return (goal.kind, goal.template, goal.index, goal.process)


def _in_any(processes: Sequence[str], name: str) -> str:
    return " || ".join(f"{process}.{name}" for process in processes)


def _fresh_name(model: build.Model) -> str:
    """A name that occurs nowhere in the model."""
    text = model.xml()
    name = "ntagen_goal"
    while name in text:
        name += "_"
    return name


def _has_code(update: str) -> bool:
    return bool(re.sub(r"/\*.*?\*/|//[^\n]*", "", update, flags=re.DOTALL).strip())


def _unmarking(processes: Sequence[str], name: str, mark: str) -> Cleaning:
    """Takes the variable of a goal out of a trace."""

    def clean(trace: dict[str, Any]) -> dict[str, Any]:
        for state in _states(trace):
            for process in processes:
                state["variables"].pop(f"{process}.{name}", None)
        for edge in _edges(trace):
            edge["update"] = edge["update"].removeprefix(f"{mark}, ").removeprefix(mark)
        return trace

    return clean


def _renaming(processes: Sequence[str], name: str, before: str) -> Cleaning:
    """Gives a location in a trace the name back that it has in the model."""

    def clean(trace: dict[str, Any]) -> dict[str, Any]:
        for state in _states(trace):
            places = state["locations"]
            for process in processes:
                if places[process] == name:
                    places[process] = before
        for edge in _edges(trace):
            for end in ("source", "target"):
                if edge[end] == name:
                    edge[end] = before
        return trace

    return clean


def _states(trace: dict[str, Any]) -> list[dict[str, Any]]:
    return [*trace["states"], *trace["run"]["states"]]


def _edges(trace: dict[str, Any]) -> list[dict[str, Any]]:
    steps = [*trace["transitions"], *(step["edges"] for step in trace["run"]["steps"])]
    return [edge for step in steps for edge in step]
