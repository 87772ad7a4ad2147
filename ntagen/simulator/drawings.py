"""What a simulation draws beside the processes: zones of two clocks, charts, values over time."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Final

from ntagen.checker.constraints import axes_around, bounds_of, halves_of
from ntagen.checker.picture.halves import clipped
from ntagen.checker.runs import Edge, Run, Step
from ntagen.checker.runs import State as ExactState
from ntagen.errors import InputError
from ntagen.simulator.courses import State
from ntagen.simulator.history import Entry
from ntagen.simulator.network import Network

MOST_SERIES: Final = 12
"""At most so many variables are drawn over time."""


def zone(constraints: Sequence[str], clocks: Sequence[str], x: str, y: str) -> dict[str, Any]:
    """The shadow of a zone on two clocks: its corners, and which of its sides belong to it.

    Returns:
        ``corners`` are pairs of numbers in units of the model's time, in order round the zone, and
        ``open`` says of the side that begins at each whether it is left out. ``x_end`` and
        ``y_end`` are the ends of what is drawn.

    Raises:
        InputError: A clock is none of the model, or both are the same.
    """
    if x not in clocks or y not in clocks or x == y:
        raise InputError(f"{x} and {y} are not two clocks of the model")
    halves = halves_of(bounds_of(constraints, clocks), (x, y), {})
    axes = axes_around(halves, x, y)
    longest, zero = max(axes.x_end, axes.y_end), Fraction(0)
    named = {(abs(half.along_x), abs(half.along_y)) for half in halves if half.bound}
    # An axis without a constant is as long as the other one.
    ends = (
        axes.x_end if (1, 0) in named else longest,
        axes.y_end if (0, 1) in named else longest,
    )
    whole = [(zero, zero), (ends[0], zero), ends, (zero, ends[1])]
    corners = clipped(whole, halves)
    following = [*corners[1:], *corners[:1]]
    return {
        "x": x,
        "y": y,
        "x_end": float(ends[0]),
        "y_end": float(ends[1]),
        "corners": [[float(a), float(b)] for a, b in corners],
        "open": [
            any(half.strict and not half.excess(start) and not half.excess(end) for half in halves)
            for start, end in zip(corners, following, strict=True)
        ],
    }


def chart(kind: str, entries: Sequence[Entry], network: Network) -> str:
    """A history as an SVG document: a Gantt chart (``gantt``) or a sequence chart.

    Raises:
        InputError: It is too long for the picture.
    """
    states = tuple(
        ExactState(network.location_names(one.state["locations"]), one.state["variables"], {})
        for one in entries
    )
    names = ("process", "source", "target", "sync", "guard", "update", "select")
    steps = tuple(
        Step(
            one.done.delay or Fraction(0),
            tuple(
                Edge(*(edge[name] for name in names)) for edge in network.edges_json(one.done.parts)
            ),
        )
        for one in entries
        if one.done is not None
    )
    run = Run(states, steps, "after")
    return (run.gantt() if kind == "gantt" else run.sequence()).text


def series(names: Sequence[str], entries: Sequence[Entry], *, runs_on: bool) -> dict[str, Any]:
    """Values along a history: of each name its points, pairs of a moment and a value.

    Args:
        names: Variables, and clocks with exact values.
        entries: The history.
        runs_on: Whether clocks go on with time; they are drawn as far as they do.

    Raises:
        InputError: There are too many names, or a name is unknown.
    """
    if len(names) > MOST_SERIES:
        raise InputError(f"at most {MOST_SERIES} variables are drawn at a time")
    is_timed = any(one.time for one in entries)
    found: dict[str, Any] = {}
    for name in names:
        points: list[list[float]] = []
        for number, one in enumerate(entries):
            moment = float(one.time) if is_timed else float(number)
            if points:
                delay = one.done.delay if one.done is not None and is_timed else None
                gone = _is_clock(name, one.state) and runs_on and delay
                points.append([moment, points[-1][1] + float(gone or 0)])
            points.append([moment, _value(name, one.state)])
        found[name] = points
    return {"series": found, "timed": is_timed}


def _is_clock(name: str, state: State) -> bool:
    return name in state.get("clocks", {})


def _value(name: str, state: State) -> float:
    if name in state["variables"]:
        return float(state["variables"][name])
    if _is_clock(name, state):
        return float(Fraction(state["clocks"][name]))
    raise InputError(f"{name} is neither a variable nor a clock with a value here")
