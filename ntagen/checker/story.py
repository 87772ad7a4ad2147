"""Traces for people: each step with its time, its edges, and only what it changes.

A trace of the engine has symbolic states, and, if exact times were found, a run. The story is that
of the run; without one it is that of the symbolic states, and has no times.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ntagen.checker.runs import Edge, Run, Step, edges_of, runs_of

_WIDTH = 96
"""Lists of names are folded at about this many characters."""

_INDENT = " " * 14


@dataclass(frozen=True, slots=True)
class _Told:
    """A step: its time if it is known, its edges, and what changes."""

    time: Fraction | None
    edges: tuple[Edge, ...]
    changes: tuple[str, ...]


def told(traces: Mapping[str, Any], missing: str = "", most: int | None = None) -> list[str]:
    """The lines of a story.

    Args:
        traces: The trace, or several with a title each, as the engine writes them.
        missing: Why there are no exact times, as a line.
        most: Only so many of the last steps are told; ``None`` is all.
    """
    lines: list[str] = []
    for one in traces.get("traces", [traces]):
        lines += [f"{one['title']}:"] if one.get("title") else []
        run = next(iter(runs_of(one)), None)
        if run is None:
            lines += _symbolic(one, most)
            lines += [missing] if missing else []
        else:
            lines += _exact(run, most)
        if "failing" in one:
            lines += _failing(one["failing"], one["states"][-1])
    return lines


def _exact(run: Run, most: int | None) -> list[str]:
    steps, now = [], Fraction(0)
    for step, before, after in zip(run.steps, run.states, run.states[1:], strict=False):
        now += step.delay
        changes = _changes(before.variables, after.variables)
        clocks = [
            f"{name} = {value}"
            for name, value in after.clocks.items()
            if _is_set(name, value, before.clocks.get(name, Fraction(0)), step)
        ]
        steps.append(_Told(now, step.edges, (*changes, *clocks)))
    first = run.states[0]
    lines = [*_start(first.locations, first.variables), *_steps(steps, most)]
    if run.delay:
        lines.append(f"{_label('')}until {now + run.delay} nothing moves")
    return lines + _ending(run.end, run.loop)


def _is_set(clock: str, value: Fraction, before: Fraction, step: Step) -> bool:
    """Whether a step sets a clock, which otherwise goes on with time or stands still."""
    if value == before + step.delay:
        return False
    name = clock.rpartition(".")[2]
    return value != before or any(name in edge.update for edge in step.edges)


def _symbolic(trace: Mapping[str, Any], most: int | None) -> list[str]:
    states = trace.get("states", [])
    if not states:
        return []
    steps = [
        _Told(
            None,
            edges_of(edges),
            _changes(states[index]["variables"], states[index + 1]["variables"]),
        )
        for index, edges in enumerate(trace["transitions"])
    ]
    lines = [*_start(states[0]["locations"], states[0]["variables"]), *_steps(steps, most)]
    ending = trace.get("ending", {})
    return lines + _ending(ending.get("kind", "after"), ending.get("loop"))


def _ending(kind: str, loop: int | None) -> list[str]:
    """How a trace goes on for ever, or why it does not; nothing if it just ends."""
    said = {
        "loop": f"as after step {loop} from here on, for ever",
        "waits": "time passes for ever",
        "stuck": "nothing is possible any more",
    }
    return [] if kind == "after" else [_label("") + said[kind]]


def _failing(edges: list[dict[str, Any]], state: Mapping[str, Any]) -> Iterator[str]:
    """The step in which the model fails, and the state before it."""
    yield f"{_label('')}fails in the next step:"
    yield _INDENT + _move(edges_of(edges))
    values = [f"{name} = {value}" for name, value in state["variables"].items() if value]
    yield from _folded([*values, *state["zone"]])


def _start(locations: Mapping[str, str], variables: Mapping[str, object]) -> list[str]:
    """The initial state; variables that are 0 are left out."""
    places = [f"{process}.{location}" for process, location in locations.items()]
    values = [f"{name} = {value}" for name, value in variables.items() if value]
    lines = [*_folded(places), *_folded(values)]
    return [_label("start") + lines[0].strip(), *lines[1:]] if lines else []


def _steps(steps: list[_Told], most: int | None) -> Iterator[str]:
    first = 0 if most is None else max(0, len(steps) - most)
    if first:
        yield f"{_label('')}… {first} {'step' if first == 1 else 'steps'} before"
    for number, step in enumerate(steps[first:], start=first + 1):
        when = f"at {step.time}: " if step.time is not None else ""
        yield f"{_label(f'{number}.')}{when}{_move(step.edges)}"
        yield from _folded(list(step.changes))


def _changes(before: Mapping[str, object], after: Mapping[str, object]) -> tuple[str, ...]:
    return tuple(
        f"{name}: {before.get(name)} -> {value}"
        for name, value in after.items()
        if value != before.get(name)
    )


def _move(edges: tuple[Edge, ...]) -> str:
    return "  |  ".join(map(_edge, edges))


def _edge(edge: Edge) -> str:
    place = f"{edge.process}.{edge.source}"
    if edge.target != edge.source:
        place += f" -> {edge.target}"
    select = ", ".join(f"{name}={value}" for name, value in edge.select.items())
    return " ".join(part for part in (place, edge.sync, f"[{select}]" if select else "") if part)


def _label(text: str) -> str:
    return f"  {text:>8}  "


def _folded(items: list[str]) -> list[str]:
    """Items in as many indented lines as they need."""
    lines: list[str] = []
    for item in items:
        if lines and len(lines[-1]) + len(item) + 2 <= _WIDTH:
            lines[-1] += f"  {item}"
        else:
            lines.append(_INDENT + item)
    return lines
