"""What the pictures of a run show: the stays in locations, and the steps with their changes.

Runs show their own pictures (`ntagen.checker.runs.Run.gantt`), so runs know this module, and it
knows of them only what it reads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import accumulate, pairwise
from typing import Final, Protocol

from ntagen.checker.picture.gantt import Stay, gantt
from ntagen.checker.picture.page import Svg
from ntagen.checker.picture.sequence import Event, sequence
from ntagen.errors import InputError

MOST_STEPS: Final = 500
"""A sequence chart of a longer run cannot be read."""

MOST_CHANGES: Final = 20_000
"""A Gantt chart with more steps would take a browser minutes."""


class Edge(Protocol):
    """An edge that is taken: `ntagen.checker.runs.Edge`."""

    @property
    def process(self) -> str:
        """The process."""

    @property
    def sync(self) -> str:
        """As written."""

    @property
    def select(self) -> Mapping[str, int]:
        """The values of the select bindings."""


class State(Protocol):
    """A state: `ntagen.checker.runs.State`."""

    @property
    def locations(self) -> Mapping[str, str]:
        """The location of each process."""

    @property
    def variables(self) -> Mapping[str, int | float]:
        """The value of each variable."""


class Step(Protocol):
    """A delay and edges: `ntagen.checker.runs.Step`."""

    @property
    def delay(self) -> Fraction:
        """The delay before the edges."""

    @property
    def edges(self) -> Sequence[Edge]:
        """The edges, the sender's first."""


class Run(Protocol):
    """A run: `ntagen.checker.runs.Run`."""

    @property
    def states(self) -> Sequence[State]:
        """The states, the initial one first."""

    @property
    def steps(self) -> Sequence[Step]:
        """The steps between them."""

    @property
    def end(self) -> str:
        """How it ends."""

    @property
    def loop(self) -> int | None:
        """To which state it leads back."""

    @property
    def delay(self) -> Fraction:
        """How long it waits in the last state."""

    @property
    def title(self) -> str | None:
        """What it shows."""

    @property
    def duration(self) -> Fraction:
        """The time from the beginning to the end."""


def gantt_chart(run: Run) -> Svg:
    """See `ntagen.checker.runs.Run.gantt`."""
    if len(run.steps) > MOST_CHANGES:
        raise InputError(
            f"the run has {len(run.steps)} steps, and a Gantt chart shows at most {MOST_CHANGES}"
            "\nhint: ask for a shorter run"
        )
    is_timed = run.duration > 0
    moments = moments_of(run)
    if is_timed:
        last = run.duration
        heading, unit = f"Run of {_steps(run)} in time {number(last)}", "time in the model's unit"
    else:
        moments = [Fraction(index) for index in range(len(run.states))]
        last = Fraction(len(run.states))
        heading, unit = f"Run of {_steps(run)}, which takes no time", "state"
    marks = []
    if run.end == "loop" and run.loop is not None:
        marks = [(moments[run.loop], "loop"), (last, "back")]
    elif run.end != "after":
        marks = [(last, {"waits": "waits for ever", "stuck": "stuck"}[run.end])]
    title = f"{run.title}: {heading}" if run.title else heading
    return gantt(stays_of(run, [*moments, last]), title, unit, marks)


def moments_of(run: Run) -> list[Fraction]:
    """When each state of a run is entered."""
    return list(accumulate((step.delay for step in run.steps), initial=Fraction(0)))


def stays_of(run: Run, moments: list[Fraction]) -> list[Stay]:
    """How long each process stays where, by process; `moments` are of the states, and the end.

    A process that takes an edge back to the same location stays there again.
    """
    stays = []
    for process in run.states[0].locations:
        entered = [0] + [
            index
            for index, step in enumerate(run.steps, start=1)
            if any(edge.process == process for edge in step.edges)
        ]
        for index, following in pairwise([*entered, len(moments) - 1]):
            place = run.states[index].locations[process]
            stays.append(Stay(process, place, moments[index], moments[following]))
    return stays


def number(value: Fraction) -> str:
    """A number as people write it: decimal if it has few places, else as a fraction."""
    return f"{float(value):g}" if 10_000 % value.denominator == 0 else str(value)


def sequence_chart(run: Run) -> Svg:
    """See `ntagen.checker.runs.Run.sequence`."""
    if len(run.steps) > MOST_STEPS:
        raise InputError(
            f"the run has {len(run.steps)} steps, and a sequence chart shows at most {MOST_STEPS}"
            "\nhint: draw it as a Gantt chart, or ask for a shorter run"
        )
    events = []
    moments = moments_of(run)[1:]
    for step, moment, (before, after) in zip(run.steps, moments, pairwise(run.states), strict=True):
        changes = ", ".join(
            f"{name} = {value}"
            for name, value in after.variables.items()
            if value != before.variables[name]
        )
        moves = {edge.process: after.locations[edge.process] for edge in step.edges}
        events.append(Event(f"at {number(moment)}", moves, _label(step.edges), changes))
    ends = {
        "after": f"then it waits {number(run.delay)}" if run.delay else "",
        "loop": f"from here on as after step {run.loop}, for ever",
        "waits": "then time passes for ever",
        "stuck": "nothing is possible any more",
    }
    heading = f"Run of {_steps(run)} in time {number(run.duration)}"
    title = f"{run.title}: {heading}" if run.title else heading
    return sequence(run.states[0].locations, events, title, ends[run.end])


def _label(edges: Sequence[Edge]) -> str:
    """What the edges of a step do: the sender's synchronisation with its choices."""
    if not edges:
        return ""
    first = edges[0]
    select = ", ".join(f"{name}={value}" for name, value in first.select.items())
    return " ".join(part for part in (first.sync, f"[{select}]" if select else "") if part)


def _steps(run: Run) -> str:
    return "1 step" if len(run.steps) == 1 else f"{len(run.steps)} steps"
