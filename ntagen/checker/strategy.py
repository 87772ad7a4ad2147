"""Strategies of timed games: what to do in a state, a list of all decisions, and files.

The owner of a strategy is the player who wins: the controller, or the environment, whose strategy
shows why the controller cannot win. Clock values and waits are exact fractions of the model's unit
of time.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

import ntagen._checker as _checker
from ntagen.checker.decisions import Decision, StrategyState, state_of
from ntagen.checker.errors import failing, rejecting
from ntagen.checker.play import Play, played
from ntagen.checker.runs import Edge, Run, State, edges_of, runs_of
from ntagen.errors import InputError, UndecidedError
from ntagen.files import write_files

if TYPE_CHECKING:
    from ntagen.checker.picture.page import Svg

__all__ = ["Advice", "Decision", "Discrete", "Strategy", "StrategyState", "Verification"]

Owner = Literal["controller", "environment"]

ForcedRule = Literal["tiga", "product", "neutral"]

PriorityRule = Literal["ignore", "keep"]

ExactNumber = int | Fraction | Decimal | str
"""A clock value; a text looks like ``"3/2"`` or ``"1.5"``."""

_TIME = "#time"
"""The clock of strategies with a time limit: the time since the start."""

_DECISIONS_SHOWN = 5
"""A message lists at most this many decisions."""


class Discrete(Protocol):
    """Anything with locations and variables: a state of a run, a symbolic state, a walk."""

    @property
    def locations(self) -> dict[str, str]:
        """The location of each process."""

    @property
    def variables(self) -> dict[str, int | float]:
        """The value of each variable."""


StateLike = State | Mapping[str, Any]
"""A state of a run; or names with values, such as ``{"Gate": "Open", "n": 2, "x": "3/2"}``."""


@dataclass(frozen=True, slots=True)
class Advice:
    """What a strategy does, or allows, in a state with exact clock values.

    Attributes:
        kind: ``act``: it takes `edges` now. ``wait``: it waits; the opponent may move. ``done``:
            play has ended here, won.
        edges: The edges that are taken together, the sender's first; empty unless it acts.
        delay: If it waits, the time until it acts, unless the opponent moves before. If acting has
            no first moment (``x > 1``), a moment soon after is chosen. ``None`` if it waits as
            long as time passes.
        then: The edges that it takes after `delay`; a permissive strategy takes the first move
            that it allows.
        rank: It never grows during a play. It is 0 at the goal, and everywhere in a strategy that
            only avoids something.
    """

    kind: Literal["act", "wait", "done"]
    edges: tuple[Edge, ...] = ()
    delay: Fraction | None = None
    then: tuple[Edge, ...] = ()
    rank: int = 0

    def __str__(self) -> str:
        if self.kind != "wait":
            return ", ".join(map(str, self.edges)) or "done"
        if self.delay is None:
            return "wait"
        after = f", then {', '.join(map(str, self.then))}" if self.then else ""
        return f"wait {self.delay}{after}"


@dataclass(frozen=True, slots=True)
class Verification:
    """The result of an independent check.

    Attributes:
        holds: Whether the evidence is right; ``None`` if the check does not cover the model or the
            query.
        lines: What was checked, or what is wrong.
    """

    holds: bool | None
    lines: tuple[str, ...]


class Strategy:
    """A strategy of the player who wins a game. Iterating gives its states.

    Attributes:
        query: The query that it answers.
        owner: ``controller``, or ``environment`` if the strategy shows that the controller loses.
        winning: Whether the controller wins, so that this is the controller's strategy.
        is_permissive: Whether every decision that applies is allowed, and not only the first. Such
            a strategy keeps a condition, and allows as much as possible.
        time_limit: For ``control_t*``: the time within which the controller reaches the goal, or
            during which the environment prevents it. The strategy then reads the clock ``#time``,
            the time since the start. ``None`` without a limit.
        forced: The rule for forced moves of the game.
        priorities: Whether priorities count in the game.
    """

    def __init__(
        self, raw: _checker.Strategy, forced: ForcedRule, priorities: PriorityRule
    ) -> None:
        self._raw = raw
        processes, clocks = raw.names()
        self._processes = frozenset(processes)
        self._clocks = frozenset(clocks)
        self._clock_order = tuple(clocks)
        self.forced: ForcedRule = forced
        self.priorities: PriorityRule = priorities
        self.query = raw.query
        self.owner: Owner = raw.owner
        self.winning = raw.owner == "controller"
        self.is_permissive = raw.is_permissive
        self.time_limit = raw.time_limit

    def __repr__(self) -> str:
        states = "1 state" if len(self) == 1 else f"{len(self)} states"
        return f"<Strategy of the {self.owner}, {states}: {self.query}>"

    def __len__(self) -> int:
        return len(self._raw)

    def __iter__(self) -> Iterator[StrategyState]:
        return map(state_of, json.loads(self.json())["states"])

    @property
    def under(self) -> Strategy | None:
        """The strategy that the game is ``under``; ``None`` if it is under none.

        The controller makes only moves that this strategy allows, and waits only where it allows
        waiting.
        """
        raw = self._raw.under()
        return None if raw is None else Strategy(raw, self.forced, self.priorities)

    @property
    def start(self) -> Literal["initial", "anywhere"] | Run:
        """Where play by the strategy begins: usually ``initial``, the initial state.

        For ``E<> control:`` play begins after a run of both players together, if the controller
        wins; if the environment wins, it begins ``anywhere`` that is reachable.

        Raises:
            InputError: The run is not possible in the model.
            ModelError: The model has a run-time error.
        """
        with rejecting(), failing():
            start: Literal["initial", "anywhere"] | dict[str, Any] | None
            start = json.loads(self._raw.start_json(self.priorities))
        if start is None:
            raise InputError("the run to the start of the strategy is not possible in the model")
        return runs_of(start)[0] if isinstance(start, dict) else start

    def at(self, state: StateLike | Discrete) -> StrategyState:
        """The decisions for the locations and variables of a state; its clocks are ignored.

        Raises:
            UndecidedError: The strategy does not have this state.
            InputError: The model does not have this state.
        """
        return state_of(json.loads(self._at(self._given(state))))

    def action(self, state: StateLike, *, time: ExactNumber | None = None) -> Advice:
        """What the strategy does in a state.

        A permissive strategy waits as long as it may, and then takes the first move that it allows.

        Args:
            state: The state.
            time: The time since the start, for a strategy with a `time_limit`, unless the state
                has it as ``#time``.

        Raises:
            UndecidedError: It says nothing of the state.
            InputError: It is no state of the model.
            ModelError: The model fails in it.
        """
        allowed = self.allowed(state, time=time)
        return next((one for one in allowed if one.kind == "wait"), allowed[0])

    def allowed(self, state: StateLike, *, time: ExactNumber | None = None) -> tuple[Advice, ...]:
        """All that the strategy allows in a state: one action, unless it is permissive.

        Args:
            state: The state.
            time: As in `action`.

        Raises:
            UndecidedError: It says nothing of the state.
            InputError: It is no state of the model.
            ModelError: The model fails in it.
        """
        if not isinstance(state, State | Mapping):
            raise InputError(
                "a symbolic state has no clock values\n"
                "hint: use `at`, which gives the decisions with their zones, or give clock values"
            )
        given = self._given(state)
        if time is not None:
            given["clocks"][_TIME] = _pair(_TIME, time)
        if self.time_limit is not None and _TIME not in given["clocks"]:
            raise InputError(
                "the strategy has a time limit, and the state does not say how late it is\n"
                f"hint: give the time since the start: time=…, or {_TIME} among the clocks"
            )
        with failing(), self._refusing(given):
            raw = json.loads(self._raw.advice_json(json.dumps(given)))
        if raw["over"]:
            return (Advice("done"),)
        return tuple(_advice(decision, raw["waiting"]) for decision in raw["now"])

    def zones(
        self,
        state: StateLike | Discrete | None = None,
        *,
        x: str | None = None,
        y: str | None = None,
    ) -> Svg:
        """What it does in a state as a picture: the zones of two clocks, coloured by decisions.

        A clock that is not drawn has its value of the state; if the state is one without clock
        values, or names with values among which it is not, the picture shows what is done for some
        value of it.

        Args:
            state: The state; by default the locations and variables of the initial one.
            x: The clock to the right; by default the first one on which decisions depend.
            y: The clock upwards; by default the second one. A model with one clock needs none.

        Raises:
            UndecidedError: The strategy does not have this state.
            InputError: The model does not have this state or clock, or has no clocks.
        """
        # Imported here: few commands draw, and the XML libraries take time to load.
        from ntagen.checker.winning import zones_chart

        if state is None:
            first = self.play().state
            state = {"locations": first.locations, "variables": first.variables}
        given = self._given(state)
        return zones_chart(
            state_of(json.loads(self._at(given))),
            self._clock_order,
            (x, y),
            {name: Fraction(*value) for name, value in given["clocks"].items()},
            owner=self.owner,
            is_permissive=self.is_permissive,
        )

    def json(self) -> str:
        """The strategy as JSON text, as ``ntagen check --strategy FILE`` writes it."""
        return self._raw.json()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the strategy to a file, which `ntagen.load_strategy` and ``loadStrategy`` read.

        The file is written completely or not at all; a missing folder is made.

        Raises:
            InputError: The file cannot be written.
        """
        write_files({Path(path): self.json() + "\n"})

    def keep(self, name: str) -> None:
        """Makes the strategy available to later queries of the model: ``A<> Gate.Open under S``.

        Args:
            name: The name of the strategy in such queries.
        """
        self._raw.keep(name)

    def verify(self, states: int | None = None) -> Verification:
        """Checks that the owner wins, in closed loop, against every move of the opponent.

        The check shares no code with the solver.

        Args:
            states: The check gives up after this many zones; by default two million.

        Returns:
            Whether the owner wins; if not, the lines have the run that shows why.

        Raises:
            InputError: The strategy's query does not fit the model.
        """
        with rejecting(), failing():
            holds, lines = self._raw.verify(self.forced, self.priorities, states)
        return Verification(holds, tuple(lines))

    def play(self) -> Play:
        """Begins a play against the strategy; the caller chooses the opponent's moves.

        Raises:
            InputError: The strategy's query does not fit the model.
            ModelError: The initial state cannot be computed.
        """
        with rejecting(), failing():
            return Play(self._raw.play(self.query, self.forced, self.priorities))

    def simulate(self, steps: int = 100, seed: int = 0) -> Run:
        """Makes a run that follows the strategy; its opponent moves at random.

        A permissive strategy also makes random moves of those that it allows.

        Args:
            steps: The run ends after this many steps, or when play is decided.
            seed: The same seed gives the same run.

        Raises:
            InputError: The strategy's query does not fit the model, or the delays have no common
                unit.
            ModelError: The model has a run-time error.
        """
        return played(self.play(), steps, seed)

    def fits(self, model: _checker.Model) -> bool:
        """Whether a model has the processes and clocks that the strategy speaks of."""
        facts = json.loads(model.facts_json(with_stored=False))
        names = (frozenset(one["name"] for one in facts[kind]) for kind in ("processes", "clocks"))
        return tuple(names) == (self._processes, self._clocks - {_TIME})

    def _given(self, state: StateLike | Discrete) -> dict[str, Any]:
        """The state as the engine reads it."""
        clocks: Mapping[str, Any] = {}
        if isinstance(state, Mapping):
            if isinstance(state.get("locations"), Mapping):
                locations, variables = state["locations"], state.get("variables", {})
                clocks = state.get("clocks", {})
            else:
                locations = {name: state[name] for name in state if name in self._processes}
                clocks = {name: state[name] for name in state if name in self._clocks}
                rest = state.keys() - locations.keys() - clocks.keys()
                variables = {name: state[name] for name in state if name in rest}
        else:
            locations, variables = state.locations, state.variables
            clocks = getattr(state, "clocks", {})
        return {
            "locations": dict(locations),
            "variables": {name: self._number(name, value) for name, value in variables.items()},
            "clocks": {name: _pair(name, value) for name, value in clocks.items()},
        }

    def _number(self, name: str, value: object) -> int | float:
        if isinstance(value, int | float):
            # Truth values are 0 and 1.
            return float(value) if isinstance(value, float) else int(value)
        # Most likely the user meant a clock, but wrote its name wrong.
        clocks = ", ".join(sorted(self._clocks)) or "none"
        raise InputError(
            f"the value {value!r} of {name} is not a number\n{_STATE_HINT}; the clocks are {clocks}"
        )

    def _at(self, given: dict[str, Any]) -> str:
        with self._refusing(given):
            return self._raw.state_json(json.dumps(given))

    @contextlib.contextmanager
    def _refusing(self, given: dict[str, Any]) -> Iterator[None]:
        """Turns the engine's errors about a state into ours."""
        try:
            yield
        except LookupError as error:
            raise self._undecided(given, error) from None
        except ValueError as error:
            raise InputError(f"{error}\n{self._way_out(error, given)}") from None

    def _way_out(self, error: ValueError, given: dict[str, Any]) -> str:
        """The hint for a state that does not fit the model."""
        for name in (*given["variables"], *given["clocks"]):
            full = sorted(clock for clock in self._clocks if clock.endswith(f".{name}"))
            if full and str(error).endswith((f"no variable {name}", f"no clock {name}")):
                shown = " or ".join(full)
                return f"hint: a clock of a process is named together with it: {shown}"
        return _STATE_HINT

    def _undecided(self, given: dict[str, Any], error: LookupError) -> UndecidedError:
        places = " ".join(f"{process}.{place}" for process, place in given["locations"].items())
        values = "".join(f" {name}={value}" for name, value in given["variables"].items())
        what = f"( {places} ){values}"
        if error.args[0] == "state":
            return UndecidedError(
                f"the {self.owner}'s strategy has no state {what}\n"
                "hint: play under it does not get there, or it does not win from there"
            )
        clocks = " ".join(f"{name}={Fraction(*value)}" for name, value in given["clocks"].items())
        decisions = state_of(json.loads(self._at(given))).decisions
        lines = [f"  {decision}" for decision in decisions[:_DECISIONS_SHOWN]] or ["  none"]
        if len(decisions) > _DECISIONS_SHOWN:
            lines.append(f"  … and {len(decisions) - _DECISIONS_SHOWN} more")
        return UndecidedError(
            "\n".join(
                [
                    f"the {self.owner}'s strategy has no decision for {clocks} in {what}; it has",
                    *lines,
                ]
            )
        )


_STATE_HINT = (
    "hint: give a state of a run of this model, or the location of each process and the value of "
    "each variable and clock by their names"
)


def _pair(name: str, value: object) -> tuple[int, int]:
    """A clock value as numerator and denominator."""
    if isinstance(value, int | Fraction | Decimal | str):
        try:
            exact = Fraction(value)
        except (ValueError, ZeroDivisionError, OverflowError):
            pass
        else:
            return exact.numerator, exact.denominator
    hint = "write an integer, a Fraction, or a text such as '3/2' or '1.5'"
    raise InputError(f"the value {value!r} of clock {name} is not an exact number\nhint: {hint}")


def _advice(decision: dict[str, Any], waiting: dict[str, Any] | None) -> Advice:
    if decision["edges"] is not None or waiting is None:
        return Advice("act", edges=edges_of(decision["edges"]), rank=decision["rank"])
    ticks, unit = waiting["ticks"], waiting["ticks_per_unit"]
    return Advice(
        "wait",
        delay=None if ticks is None else Fraction(ticks, unit),
        then=edges_of(waiting["then"][0]["edges"]) if waiting["then"] else (),
        rank=decision["rank"],
    )
