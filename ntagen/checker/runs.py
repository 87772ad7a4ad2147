"""Runs with exact times: those in the traces of answers, and simulated runs.

Times are fractions of the model's unit of time. A run is a list of states. Between two states it
waits for a delay and takes edges. It may end in a loop, or wait for ever.
"""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol

from ntagen.errors import InputError

if TYPE_CHECKING:
    from ntagen.checker.picture.gantt import Stay
    from ntagen.checker.picture.page import Svg

__all__ = [
    "Choice",
    "Choose",
    "Edge",
    "Run",
    "State",
    "Step",
    "edges_of",
    "runs_of",
    "simulated",
    "state_of",
]

MOST_STEPS: Final = 500
"""A sequence chart of a longer run cannot be read."""

MOST_CHANGES: Final = 20_000
"""A Gantt chart with more steps would take a browser minutes."""

End = Literal["after", "loop", "waits", "stuck"]


@dataclass(frozen=True, slots=True)
class Edge:
    """An edge that is taken.

    Attributes:
        process: The process, for example ``Train(1)``.
        source: The location that it leaves.
        target: The location that it enters.
        sync: The synchronisation as written, for example ``go!``; empty for an internal edge.
        guard: The guard as written.
        update: The update as written.
        select: The values of the select bindings.
    """

    process: str
    source: str
    target: str
    sync: str
    guard: str
    update: str
    select: dict[str, int]

    def __str__(self) -> str:
        label = f" [{self.sync}]" if self.sync else ""
        return f"{self.process}.{self.source} -> {self.process}.{self.target}{label}"


@dataclass(frozen=True, slots=True)
class State:
    """A state with exact clock values.

    Attributes:
        locations: The location of each process.
        variables: The value of each variable; parts of arrays and structs by names such as
            ``a[2].x``.
        clocks: The value of each clock.
    """

    locations: dict[str, str]
    variables: dict[str, int | float]
    clocks: dict[str, Fraction]

    def __str__(self) -> str:
        places = " ".join(f"{process}.{place}" for process, place in self.locations.items())
        values = {**self.variables, **self.clocks}.items()
        return " ".join([f"( {places} )", *(f"{name}={value}" for name, value in values)])


@dataclass(frozen=True, slots=True)
class Step:
    """A step of a run: it waits for `delay`, then takes the edges, the sender's first."""

    delay: Fraction
    edges: tuple[Edge, ...]

    def __str__(self) -> str:
        return f"wait {self.delay}, then {', '.join(map(str, self.edges))}"


@dataclass(frozen=True, slots=True)
class Choice:
    """What can happen next in a simulation.

    Attributes:
        edges: The edges, the sender's first.
        windows: When it can happen: pairs of the least and the greatest delay, in ascending order;
            the greatest is ``None`` if there is no limit.
    """

    edges: tuple[Edge, ...]
    windows: tuple[tuple[Fraction, Fraction | None], ...]


Choose = Callable[[State, tuple[Choice, ...]], "int | tuple[int, Fraction] | None"]
"""Gets a state and its choices; returns an index, or an index and a delay; ``None`` stops."""


@dataclass(frozen=True, slots=True)
class Run:
    """A run with exact times.

    Attributes:
        states: The states at the moment of entry; the first is the initial one.
        steps: The steps between them, one fewer than states.
        end: How it ends: ``after`` the last delay; in a ``loop``; it ``waits`` for ever; or it is
            ``stuck``: nothing is possible any more.
        loop: The index of the state to which the last one leads back, if the run ends in a loop.
        delay: How long it waits in the last state; ``end`` is about the moment after that.
        title: What the run shows, if an answer has several runs.
    """

    states: tuple[State, ...]
    steps: tuple[Step, ...]
    end: End
    loop: int | None = None
    delay: Fraction = Fraction(0)
    title: str | None = None

    @property
    def duration(self) -> Fraction:
        """The time from the beginning to the end."""
        return sum((step.delay for step in self.steps), self.delay)

    def gantt(self) -> Svg:
        """The run as a Gantt chart: a row for each process, a bar for each stay in a location.

        Raises:
            InputError: The run has too many steps for a picture.
        """
        from ntagen.checker.picture.gantt import gantt

        count = len(self.steps)
        if count > MOST_CHANGES:
            raise InputError(
                f"the run has {count} steps, and a Gantt chart shows at most {MOST_CHANGES}\n"
                "hint: ask for a shorter run"
            )
        if last := self.duration:
            moments, unit = moments_of(self), "time in the model's unit"
        else:
            last, unit = Fraction(len(self.states)), "state"
            moments = [Fraction(index) for index in range(len(self.states))]
        marks = []
        if self.end == "loop" and self.loop is not None:
            marks = [(moments[self.loop], "loop"), (last, "back")]
        elif self.end != "after":
            marks = [(last, {"waits": "waits for ever", "stuck": "stuck"}[self.end])]
        heading = self._heading(", which takes no time")
        return gantt(stays_of(self, [*moments, last]), heading, unit, marks)

    def sequence(self) -> Svg:
        """The run as a sequence chart: a line for each process, and what passes between them.

        Raises:
            InputError: The run has too many steps for a picture.
        """
        from ntagen.checker.picture.sequence import Event, sequence

        count = len(self.steps)
        if count > MOST_STEPS:
            raise InputError(
                f"the run has {count} steps, and a sequence chart shows at most {MOST_STEPS}\n"
                "hint: draw it as a Gantt chart, or ask for a shorter run"
            )
        events = []
        moments = moments_of(self)
        for number, (before, after) in enumerate(pairwise(self.states)):
            changes = ", ".join(
                f"{name} = {value}"
                for name, value in after.variables.items()
                if value != before.variables[name]
            )
            edges, when = self.steps[number].edges, f"at {_number(moments[number + 1])}"
            moves = {edge.process: after.locations[edge.process] for edge in edges}
            events.append(Event(when, moves, _label(edges), changes))
        ends = {
            "after": f"then it waits {_number(self.delay)}" if self.delay else "",
            "loop": f"from here on as after step {self.loop}, for ever",
            "waits": "then time passes for ever",
            "stuck": "nothing is possible any more",
        }
        heading = self._heading(" in time 0")
        return sequence(self.states[0].locations, events, heading, ends[self.end])

    def _heading(self, timeless: str) -> str:
        """The heading of a picture; a run without time has its own words for that."""
        steps = "1 step" if len(self.steps) == 1 else f"{len(self.steps)} steps"
        time = f" in time {_number(self.duration)}" if self.duration else timeless
        return f"{f'{self.title}: ' if self.title else ''}Run of {steps}{time}"

    def __str__(self) -> str:
        lines = [f"{self.title}:"] if self.title else []
        for index, state in enumerate(self.states):
            lines.append(f"{index}: {state}")
            lines += [f"   {step}" for step in self.steps[index : index + 1]]
        if self.delay:
            lines.append(f"   wait {self.delay}")
        last = {
            "after": [],
            "loop": [f"   as state {self.loop} from here on, for ever"],
            "waits": ["   time passes for ever"],
            "stuck": ["   nothing is possible any more"],
        }
        return "\n".join([*lines, *last[self.end]])


def moments_of(run: Run) -> list[Fraction]:
    """When each state of a run is entered."""
    return list(accumulate((step.delay for step in run.steps), initial=Fraction(0)))


def stays_of(run: Run, moments: list[Fraction]) -> list[Stay]:
    """How long each process stays where, by process; `moments` are of the states, and the end.

    A process that takes an edge back to the same location stays there again.
    """
    from ntagen.checker.picture.gantt import Stay

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


def _number(value: Fraction) -> str:
    """A number as people write it: decimal if it has few places, else as a fraction."""
    return f"{float(value):g}" if 10_000 % value.denominator == 0 else str(value)


def _label(edges: Sequence[Edge]) -> str:
    """What the edges of a step do: the sender's synchronisation with its choices."""
    if not edges:
        return ""
    first = edges[0]
    select = ", ".join(f"{name}={value}" for name, value in first.select.items())
    return " ".join(part for part in (first.sync, f"[{select}]" if select else "") if part)


def runs_of(traces: dict[str, Any]) -> tuple[Run, ...]:
    """The runs with exact times in a trace as the engine writes it."""
    found = traces.get("traces", [traces])
    return tuple(_run(one["run"], one.get("title")) for one in found if "run" in one)


def _run(raw: dict[str, Any], title: str | None) -> Run:
    unit = raw["ticks_per_unit"]
    steps = raw["steps"]
    end = raw["end"]
    return Run(
        states=tuple(state_of(state, unit) for state in raw["states"][: len(steps) + 1]),
        steps=tuple(Step(Fraction(step["wait"], unit), edges_of(step["edges"])) for step in steps),
        end=end["kind"],
        loop=end.get("state"),
        delay=Fraction(end.get("wait", 0), unit),
        title=title,
    )


def state_of(raw: dict[str, Any], unit: int) -> State:
    """A state from the engine's JSON; `unit` ticks make one unit of time."""
    clocks = {name: Fraction(ticks, unit) for name, ticks in raw["clocks"].items()}
    return State(raw["locations"], raw["variables"], clocks)


def edges_of(raw: Iterable[dict[str, Any]] | None) -> tuple[Edge, ...]:
    """Edges from the engine's JSON."""
    names = ("process", "source", "target", "sync", "guard", "update", "select")
    return tuple(Edge(*(one[name] for name in names)) for one in raw or ())


OPEN_WINDOW_UNITS = 5
"""In a window without end, a random delay is within this many units of its start."""


_FINEST = 2**30
"""The greatest denominator of a delay."""


class Walk(Protocol):
    """A run in the engine, at a state; times are whole numbers of ticks."""

    @property
    def ticks_per_unit(self) -> int:
        """How many ticks make one unit of the model's time."""

    def refine(self, denominator: int) -> bool:
        """Makes ticks fit this fraction of a unit; false if they would be too short."""

    def state_json(self) -> str:
        """The state."""

    def choices_json(self) -> tuple[str, int | None]:
        """The choices, and how long time can pass; ``None`` is for ever."""

    def take(self, index: int, wait: int) -> None:
        """Waits, and takes the choice with this index."""


def simulated(walk: Walk, steps: int, seed: int, choose: Choose | None) -> Run:
    """A run of at most `steps` steps; see `ntagen.checker.Model.simulate`."""
    chance = random.Random(seed)
    states = [state_of(json.loads(walk.state_json()), walk.ticks_per_unit)]
    taken: list[Step] = []
    while len(taken) < steps:
        text, longest = walk.choices_json()
        raw = json.loads(text)
        if not raw:
            end: End = "waits" if longest is None else "stuck"
            return Run(tuple(states), tuple(taken), end)
        choices = tuple(_choice(one, walk.ticks_per_unit) for one in raw)
        index, delay = _decision(states[-1], choices, choose, chance)
        if index is None:
            break
        if delay is None:
            ticks = _random_wait(raw[index]["windows"], walk.ticks_per_unit, chance)
            delay = Fraction(ticks, walk.ticks_per_unit)
        elif delay.denominator > _FINEST or not walk.refine(delay.denominator):
            raise ValueError(f"the delay {delay} is too fine a fraction of the unit")
        walk.take(index, int(delay * walk.ticks_per_unit))
        taken.append(Step(delay, choices[index].edges))
        states.append(state_of(json.loads(walk.state_json()), walk.ticks_per_unit))
    return Run(tuple(states), tuple(taken), "after")


def _choice(raw: dict[str, Any], unit: int) -> Choice:
    windows = tuple(
        (Fraction(first, unit), None if last is None else Fraction(last, unit))
        for first, last in raw["windows"]
    )
    return Choice(edges_of(raw["edges"]), windows)


def _decision(
    state: State,
    choices: tuple[Choice, ...],
    choose: Choose | None,
    chance: random.Random,
) -> tuple[int | None, Fraction | None]:
    """The choice that is taken, and its delay; ``None`` where that is not decided."""
    if choose is None:
        return chance.randrange(len(choices)), None
    chosen = choose(state, choices)
    index, delay = chosen if isinstance(chosen, tuple) else (chosen, None)
    if index is not None and not 0 <= index < len(choices):
        raise IndexError(f"there is no choice {index}; the state has {len(choices)}")
    return index, None if delay is None else Fraction(delay)


def _random_wait(windows: list[list[int | None]], unit: int, chance: random.Random) -> int:
    first, last = chance.choice(windows)
    low = first or 0
    return chance.randint(low, low + OPEN_WINDOW_UNITS * unit if last is None else last)
