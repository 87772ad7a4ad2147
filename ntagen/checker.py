"""The typed face of the engine: verdicts, traces, strategies and plans of UPPAAL models.

The engine is the Rust crate in ``checker/``; this module only gives its answers Python types.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from ntagen import _checker
from ntagen.errors import InputError, LimitError, ModelError, NtagenError
from ntagen.machine import Machine
from ntagen.model.facts import (
    Channel,
    Clock,
    Facts,
    Process,
    Query,
    ScalarSet,
    StateSize,
    Template,
    Variable,
    queries_from,
)
from ntagen.runs import Choose, Run, runs_of, simulated
from ntagen.strategy import ForcedRule, PriorityRule, Strategy, Verification

Verdict = Literal["satisfied", "not satisfied", "maybe", "unknown", "error"]
SearchOrder = Literal["bfs", "dfs", "random"]
CodeEngine = Literal["jit", "interpreter"]
PlansWanted = Literal["none", "first", "all"]
TraceWanted = Literal["any", "shortest", "fastest"]

Extreme = int | Literal["inf"] | None
"""A least or greatest value: ``"inf"`` if there is no greatest, ``None`` if no state counts."""

Value = Extreme | list[Extreme] | list[list[Extreme] | None]
"""What ``sup`` and ``inf`` found: of one item an `Extreme`, for ``bounds`` the pair of the least
and the greatest; of several items a list of these."""

Progress = Callable[[int, int, int, int], object]
"""Is shown explored, stored and waiting states, and bytes."""

_ReachedEntry = tuple[
    str,
    list[str],
    list[list[tuple[int, bool] | None]],
    tuple[int, list[tuple[int, int, int, list[int]]]] | None,
]
"""A state as the engine gives it."""

MAX_PLANS = 1_000_000
"""Plans that are listed at most, unless the caller says otherwise."""

_GAME = re.compile(r"\s*(strategy\s+\w+\s*=\s*)?(\{[^{}]*\}\s*)?(E\s*<>\s*)?control(_t\*|\b)")
"""How a query begins that asks for a strategy."""

_PROCESSES_SHOWN = 5
"""Processes that the short text of a model names."""


class RejectedError(InputError):
    """The engine does not accept a model or a query; `diagnostics` say what is wrong and where."""

    def __init__(self, diagnostics: list[str]) -> None:
        super().__init__("\n".join(text.rstrip() for text in diagnostics))
        self.diagnostics = tuple(diagnostics)


@dataclass(frozen=True, slots=True)
class EngineEdge:
    """An edge as it is taken in a plan.

    Attributes:
        process: The process, for example ``User``.
        source: The location that it leaves.
        target: The location that it enters.
        sync: The synchronisation as written, for example ``do_push!``; empty for an internal edge.
        select: The values of the select bindings.
    """

    process: str
    source: str
    target: str
    sync: str
    select: dict[str, int] = field(hash=False)


@dataclass(frozen=True, slots=True)
class EngineStep:
    """A transition of a plan: the edges that are taken together, the sender's first."""

    edges: tuple[EngineEdge, ...]


@dataclass(frozen=True, slots=True)
class EnginePlan:
    """A winning sequence: the transitions that leave a state without committed locations."""

    steps: tuple[EngineStep, ...]


@dataclass(frozen=True, slots=True)
class _EdgeEntry:
    process: str
    source: str
    targets: list[str]
    selects: list[str]
    sync: str

    def taken(self, branch: int, values: list[int]) -> EngineEdge:
        select = dict(zip(self.selects, values, strict=True))
        return EngineEdge(self.process, self.source, self.targets[branch], self.sync, select)


@dataclass(frozen=True, slots=True)
class SymbolicState:
    """A reachable symbolic state: discrete values, and a convex set of clock values.

    Attributes:
        index: Its place among the states, from 0.
        locations: The location of each process.
        variables: The value of each variable; parts of arrays and structs by names such as
            ``a[2].x``.
        zone: The fewest constraints on the clocks, such as ``x-y == 2`` and ``x <= 3``, in units
            of the model's time; the equalities first. That clocks are not negative is left out.
        predecessor: The index of the state that was left for it; ``None`` for the initial one.
        step: The transition that was taken there; ``None`` for the initial one.
    """

    index: int
    locations: dict[str, str] = field(hash=False)
    variables: dict[str, int | float] = field(hash=False)
    zone: tuple[str, ...]
    predecessor: int | None
    step: EngineStep | None
    _bounds: tuple[tuple[tuple[int, bool] | None, ...], ...] = field(repr=False)

    def dbm(self) -> tuple[tuple[tuple[int, bool] | None, ...], ...]:
        """The zone as a closed difference bound matrix.

        Returns:
            Rows; the entry in row i and column j is ``(bound, strict)``: clock i minus clock j is
            at most `bound`, or less if `strict`; ``None`` without a bound. Bounds are in units
            of the model's time. Clock 0 is the number 0, clock i is ``model.clocks[i - 1]``.
        """
        return self._bounds


class Answer:
    """The answer to a query.

    Attributes:
        query: The query as given.
        verdict: ``satisfied``, ``not satisfied``, ``maybe`` (an over-approximation could not
            decide), ``unknown`` (a limit came first: see `stop`) or ``error`` (the model failed:
            see `message`).
        value: What a query with ``sup``, ``inf`` or ``bounds`` found; ``None`` for other queries,
            and if no state counts. Whether a clock reaches the value is in `message`.
        message: A remark for the user, or what went wrong in the model.
        warnings: What the user should know about the query, one text a warning.
        stop: ``states``, ``memory`` or ``time`` if a limit stopped the search.
        explored: States whose successors were computed.
        stored: States that are stored at the end; one that a larger zone took the place of does
            not count.
        seconds: Seconds of the search alone.
        load_seconds: Seconds of loading the model and compiling its code.
        peak_bytes: The greatest number of bytes that states and tables took.
        plan_count: How many plans were found; ``None`` if none were asked for, or if the
            environment has choices, so that a strategy is no list of plans.
        verified: Whether the strategy and the exact runs of the traces passed their independent
            checks; ``None`` if there was none, or one came to no end.
        verification: What these checks covered, or what is wrong, line by line.
    """

    def __init__(
        self,
        raw: _checker.Answer,
        query: str,
        edges: list[list[_EdgeEntry]],
        rules: tuple[ForcedRule, PriorityRule],
    ) -> None:
        self._raw = raw
        self._rules = rules
        self._edges = edges
        self.query = query
        self.verdict: Verdict = raw.verdict
        value = raw.value_json()
        self.value: Value = None if value is None else json.loads(value)
        self.message = raw.message
        self.warnings = tuple(raw.warnings)
        self.stop = raw.stop
        self.explored = raw.explored
        self.stored = raw.stored
        self.seconds = raw.seconds
        self.load_seconds = raw.load_seconds
        self.peak_bytes = raw.peak_bytes
        self.plan_count = raw.plan_count
        self.has_more_plans = raw.has_more_plans
        self.verified = raw.verified
        self.verification = tuple(raw.verification())

    @property
    def plans(self) -> tuple[EnginePlan, ...]:
        """The plans; empty if none were asked for or found."""
        return tuple(self._plans())

    def _plans(self) -> Iterator[EnginePlan]:
        for plan in self._raw.plans():
            yield EnginePlan(tuple(_step(self._edges, step) for step in plan))

    def plans_json(self) -> str | None:
        """The plans as JSON text with every edge in full; ``None`` without plans."""
        return self._raw.plans_json()

    @property
    def runs(self) -> tuple[Run, ...]:
        """The runs with exact times that the traces show: one, or for values one a value.

        Empty without a trace, with ``trace=False``, and where no exact times were found (the end
        of `trace_text` says why).
        """
        traces = self.trace_json()
        return () if traces is None else runs_of(json.loads(traces))

    @property
    def trace(self) -> Run | None:
        """The first of `runs`; ``None`` if there is none."""
        return next(iter(self.runs), None)

    def trace_text(self) -> str | None:
        """The witness, counterexample or way to the failure as UPPAAL prints it, if any.

        Below it stands the run with exact times: each state with its clock values, how long it is
        waited there, and the edges that are taken then.
        """
        return self._raw.trace_text()

    def trace_json(self) -> str | None:
        """The same as JSON text."""
        return self._raw.trace_json()

    def certificate_text(self) -> str | None:
        """The certificate as text of its file; ``None`` if none was asked for or there is none."""
        return self._raw.certificate_text()

    @property
    def strategy(self) -> Strategy | None:
        """The strategy of the player who wins; ``None`` if none was asked for or found."""
        raw = _checker.Strategy.of_answer(self._raw)
        return None if raw is None else Strategy(raw, *self._rules)

    @property
    def machine(self) -> Machine | None:
        """How the controller wins a game with observations.

        ``None`` if no strategy was asked for or found.
        """
        text = self._raw.strategy_json()
        return None if text is None or self.strategy is not None else Machine.from_json(text)

    def strategy_json(self) -> str | None:
        """The strategy, or the machine of a game with observations, as JSON text.

        ``None`` if none was asked for or found.
        """
        return self._raw.strategy_json()

    def strategy_text(self) -> str | None:
        """The strategy as text in the form of TIGA; ``None`` if none was asked for or found."""
        return self._raw.strategy_text()

    def controller_c(self) -> str | None:
        """The strategy as a controller in C99; ``None`` if none was asked for or found.

        The file depends on nothing but two standard headers; the comment at its start says how to
        call it.

        Raises:
            RejectedError: The model has stopwatches.
        """
        try:
            return self._raw.controller_c()
        except _checker.RejectedError as error:
            raise RejectedError(error.args[0]) from None


class Model:
    """A model that the engine has accepted.

    What is in it are its attributes; `check` answers queries, `synthesize` solves games, `simulate`
    makes random runs, `states` lists the reachable symbolic states, and `walk` goes through them by
    hand.
    """

    def __init__(self, raw: _checker.Model) -> None:
        self._raw = raw
        self._edges: list[list[_EdgeEntry]] | None = None
        self._facts: Facts | None = None

    def __repr__(self) -> str:
        names = ", ".join(process.name for process in self.processes[:_PROCESSES_SHOWN])
        more = ", …" if len(self.processes) > _PROCESSES_SHOWN else ""
        return f"<Model of {len(self.processes)} processes: {names}{more}>"

    def facts_json(self) -> str:
        """All that is in the model as one JSON object, as ``ntagen info --json`` prints it."""
        return self._raw.facts_json()

    @property
    def facts(self) -> Facts:
        """All that is in the model as one value."""
        if self._facts is None:
            self._facts = Facts.from_object(json.loads(self.facts_json()))
        return self._facts

    @property
    def templates(self) -> tuple[Template, ...]:
        """The templates as written, in order; a notebook shows each as a picture."""
        return self.facts.templates

    def template(self, name: str) -> Template:
        """The template with this name.

        Raises:
            KeyError: There is none.
        """
        for template in self.templates:
            if template.name == name:
                return template
        known = ", ".join(template.name for template in self.templates)
        raise KeyError(f"there is no template {name}; the model has {known}")

    @property
    def processes(self) -> tuple[Process, ...]:
        """The processes, in the order of the system line."""
        return self.facts.processes

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The variables, in the order of their words; constants are none."""
        return self.facts.variables

    @property
    def clocks(self) -> tuple[Clock, ...]:
        """The clocks; arrays part by part."""
        return self.facts.clocks

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels; arrays part by part."""
        return self.facts.channels

    @property
    def features(self) -> tuple[str, ...]:
        """Names of what the model uses beyond plain timed automata, such as ``urgent-channels``."""
        return self.facts.features

    @property
    def scalar_sets(self) -> tuple[ScalarSet, ...]:
        """The scalar sets, and whether symmetry reduction applies to them."""
        return self.facts.scalar_sets

    @property
    def state(self) -> StateSize:
        """How large the discrete part of a state is."""
        return self.facts.state

    @property
    def state_words(self) -> int:
        """How many 32-bit words the discrete part of a state takes."""
        return self.state.words

    @property
    def queries(self) -> tuple[Query, ...]:
        """The queries of the file, in order."""
        # Not by `facts`: of a large model these take a while to put together.
        return queries_from(json.loads(self._raw.queries_json()))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know about the model and files of queries, one text a warning."""
        return tuple(self._raw.warnings)

    @property
    def load_seconds(self) -> float:
        """Seconds of loading, and of compiling the code once a query was checked."""
        return self._raw.load_seconds

    def read_queries(self, path: Path) -> tuple[Query, ...]:
        """Reads a ``.q`` file.

        Raises:
            RejectedError: The file is no list of queries.
            OSError: The file cannot be read.
        """
        try:
            entries = self._raw.read_queries_json(str(path), path.read_bytes())
        except _checker.RejectedError as error:
            raise RejectedError(error.args[0]) from None
        return queries_from(json.loads(entries))

    def check(
        self,
        query: str,
        *,
        search: SearchOrder = "bfs",
        threads: int | Literal["all"] = 1,
        seed: int = 0,
        forced: ForcedRule = "tiga",
        priorities: PriorityRule = "ignore",
        engine: CodeEngine = "jit",
        states: int | None = None,
        memory_bytes: int | None = None,
        timeout_s: float | None = None,
        plans: PlansWanted = "none",
        max_plans: int = MAX_PLANS,
        strategy: bool = False,
        verify: bool = False,
        trace: bool = True,
        wanted_trace: TraceWanted = "any",
        certificate: bool = False,
        symmetry: bool = True,
        partial_order: bool = True,
        folder: Path | None = None,
        progress: Progress | None = None,
    ) -> Answer:
        """Answers a query.

        The strategy of ``strategy S = control: …`` is kept under its name: later queries of the
        same model may be asked ``under S``.

        Args:
            query: The query in UPPAAL's language.
            search: The order of the search; verdicts do not depend on it.
            threads: How many threads share the search for a reachable state (``E<>``, ``A[]``) or
                for values, breadth first; ``"all"`` (or 0) is one for each core. Other searches
                take one. With the same number everything is the same again, counts and traces
                included; verdicts do not depend on the number, unless the model has a run-time
                error, which may be met before or after what is looked for.
            seed: For ``search="random"``.
            forced: What happens where time cannot pass and only the environment can move.
            priorities: Whether priorities of channels and processes count in games and under
                strategies; in all other queries they do.
            engine: What runs the code of the model; answers do not depend on it.
            states: The search stops after this many stored states.
            memory_bytes: The search stops when its states take this much.
            timeout_s: The search stops after this time.
            plans: Which winning sequences to list.
            max_plans: At most this many plans are listed; 1 is the quick search of
                ``plans="first"``.
            strategy: Whether the strategy of the player who wins is wanted.
            verify: Whether the strategy is to be checked against every move of the opponent.
            trace: Whether witnesses and counterexamples get exact times, which an independent
                replay checks. For ``sup``, ``inf`` and ``bounds`` this takes a second search.
            wanted_trace: For ``E<>`` and ``A[]``: whether the trace is to have the fewest
                transitions (``shortest``) or to take the least time (``fastest``); either takes
                a second search.
            certificate: Whether the reached set is wanted if ``E<>`` is not satisfied or ``A[]``
                is; it takes a second search.
            symmetry: Whether ``E<>``, ``A[]``, ``sup``, ``inf`` and ``bounds`` may take states
                that differ only by exchanged members of scalar sets for one; verdicts, values
                and traces do not depend on it, counts do.
            partial_order: Whether ``E<>`` and ``A[]`` may leave out orders of independent moves
                while time stands still; verdicts do not depend on it, counts do.
            folder: Where the files of ``saveStrategy`` and ``loadStrategy`` lie; by default the
                folder of the model.
            progress: Is called some twenty times a second with the numbers of explored,
                stored and waiting states and of bytes.

        Returns:
            The answer; a limit that was reached is an answer too.

        Raises:
            ValueError: `max_plans` is less than 1.
            RejectedError: The query is wrong or of a kind that is not supported.
            ValueError: There are to be more than 2048 threads, or fewer than none.
            KeyboardInterrupt: The user interrupted.
        """
        if threads != "all" and threads < 0:
            raise ValueError(f"{threads} threads: there must be at least one, or all")
        if max_plans < 1:
            raise ValueError("max_plans is the number of plans to list, at least 1")
        wanted = {"none": None, "first": 1, "all": max_plans}[plans]
        try:
            raw = self._raw.check(
                query,
                search=search,
                threads=0 if threads == "all" else threads,
                seed=seed,
                forced=forced,
                priorities=priorities,
                engine=engine,
                states=states,
                memory_bytes=memory_bytes,
                timeout_s=timeout_s,
                max_plans=wanted,
                strategy=strategy,
                verify=verify,
                trace=trace,
                wanted_trace=wanted_trace,
                certificate=certificate,
                symmetry=symmetry,
                partial_order=partial_order,
                folder=None if folder is None else str(folder),
                progress=progress,
            )
        except _checker.RejectedError as error:
            raise RejectedError(error.args[0]) from None
        return Answer(raw, query, self._edge_table(), (forced, priorities))

    def synthesize(
        self,
        query: str,
        *,
        search: SearchOrder = "bfs",
        seed: int = 0,
        forced: ForcedRule = "tiga",
        priorities: PriorityRule = "ignore",
        engine: CodeEngine = "jit",
        states: int | None = None,
        memory_bytes: int | None = None,
        timeout_s: float | None = None,
        verify: bool = False,
        progress: Progress | None = None,
    ) -> Strategy:
        """Solves a game and gives the strategy of the player who wins.

        If the controller cannot win, that is the environment's: `Strategy.winning` says which.

        Args:
            query: A control query, such as ``control: A<> Gate.Open``.
            search: As in `check`, like all that follow.
            seed: For ``search="random"``.
            forced: What happens where time cannot pass and only the environment can move.
            priorities: Whether priorities of channels and processes count.
            engine: What runs the code of the model.
            states: The search stops after this many stored states.
            memory_bytes: The search stops when its states take this much.
            timeout_s: The search stops after this time.
            verify: Whether the strategy is to be checked against every move of the opponent.
            progress: Is called now and then.

        Raises:
            RejectedError: The query is wrong or of a kind that is not supported.
            InputError: It is no game, or of a kind that has no strategy.
            LimitError: A limit was reached before there was an answer, or there is none because
                stopped clocks allow only an approximation.
            ModelError: The model fails.
            KeyboardInterrupt: The user interrupted.
        """
        if not _GAME.match(query):
            raise InputError(
                f"{query.strip()} asks for no strategy\n"
                "hint: begin the query with control: — control: A<> p, control: A[] p, …"
            )
        answer = self.check(
            query,
            search=search,
            seed=seed,
            forced=forced,
            priorities=priorities,
            engine=engine,
            states=states,
            memory_bytes=memory_bytes,
            timeout_s=timeout_s,
            strategy=True,
            verify=verify,
            progress=progress,
        )
        if answer.verified is False:
            raise NtagenError("\n".join(answer.verification))
        if answer.verdict == "error":
            raise ModelError(answer.message or "the model fails")
        if answer.verdict == "unknown":
            raise LimitError(f"the synthesis was stopped by the limit of {answer.stop}")
        if answer.verdict == "maybe":
            raise LimitError("the engine could not decide who wins, since the model stops clocks")
        strategy = answer.strategy
        if strategy is None:
            if answer.strategy_json() is not None:
                raise InputError(
                    f"{answer.query.strip()} gives a machine that goes by observations, and no "
                    "strategy over states\nhint: check(query, strategy=True).machine is it; "
                    "on the command line, check --strategy FILE writes it"
                )
            remark = f": {answer.message}" if answer.message else ""
            raise InputError(
                f"{answer.query.strip()} is {answer.verdict}, but this kind of query gives no "
                f"strategy then{remark}"
            )
        return strategy

    def load_strategy(
        self,
        path: str | os.PathLike[str],
        forced: ForcedRule = "tiga",
        priorities: PriorityRule = "ignore",
    ) -> Strategy:
        """Reads a strategy that was saved for this model.

        Whether it wins is not checked: `Strategy.verify` does that.

        Args:
            path: A file as `Strategy.save` and ``ntagen check --strategy`` write it.
            forced: The rule for forced moves that the strategy was made by.
            priorities: Whether priorities counted when it was made.

        Raises:
            RejectedError: It is no strategy, or does not fit the model.
            OSError: The file cannot be read.
        """
        data = Path(path).read_bytes()
        try:
            raw = _checker.Strategy.read(self._raw, os.fspath(path), data)
        except _checker.RejectedError as error:
            raise RejectedError(error.args[0]) from None
        return Strategy(raw, forced, priorities)

    def verify(
        self,
        text: str,
        path: str = "",
        *,
        forced: ForcedRule = "tiga",
        priorities: PriorityRule = "ignore",
    ) -> Verification:
        """Checks a trace, certificate or strategy, independently of the search that found it.

        Args:
            text: The file, as `Answer.trace_json`, `Answer.certificate_text` and
                `Answer.strategy_json` give it.
            path: What to call it in messages.
            forced: For strategies: what happens where time cannot pass and only the environment
                can move.
            priorities: For strategies: whether priorities of channels and processes count.

        Raises:
            RejectedError: It is none of them, or does not belong to this model.
        """
        try:
            holds, lines = self._raw.verify(path or "evidence", text, forced, priorities)
        except _checker.RejectedError as error:
            raise RejectedError(error.args[0]) from None
        return Verification(holds, tuple(lines))

    def simulate(self, steps: int = 100, seed: int = 0, choose: Choose | None = None) -> Run:
        """Makes a run with exact times from the initial state.

        Without `choose`, each transition that is possible now or later is as likely as any other,
        and so is each moment at which it is possible (of those without a last one, the first few
        units).

        Args:
            steps: The run ends after so many transitions, or where none is possible any more.
            seed: The same seed gives the same run.
            choose: Is given each state and what can happen; says which choice is taken, with the
                delay or without (then a random one), or ``None`` to end the run.

        Raises:
            ValueError: `choose` gives a delay that is too fine a fraction of the unit.
            IndexError: `choose` gives what is not possible.
            ModelError: The model fails on the way.
        """
        with _failing():
            return simulated(self._raw.walk_exactly(), steps, seed, choose)

    def states(
        self,
        limit: int | None = None,
        *,
        timeout_s: float | None = None,
        memory_bytes: int | None = None,
        engine: CodeEngine = "jit",
    ) -> Iterator[SymbolicState]:
        """The reachable symbolic states, those with the fewest transitions first.

        They are all computed before the first is given. One that an earlier one contains is left
        out. Zones are extrapolated by the constants of the model, so that they are finitely many:
        beyond these constants, and where stopwatches stand, a zone may contain clock values that
        are not reachable.

        Args:
            limit: At most so many; there may be more.
            timeout_s: The search gives up after this time.
            memory_bytes: The search gives up when its states take this much.
            engine: What runs the code of the model; states do not depend on it.

        Raises:
            ValueError: A limit is negative.
            LimitError: Time or memory ran out.
            ModelError: The model fails in a state.
            KeyboardInterrupt: The user interrupted.
        """
        if any(one is not None and one < 0 for one in (limit, timeout_s, memory_bytes)):
            raise ValueError("a limit cannot be negative")
        with _failing():
            found, stop = self._raw.states(
                engine, states=limit, memory_bytes=memory_bytes, timeout_s=timeout_s
            )
        if stop in ("memory", "time"):
            raise LimitError(
                f"the search was stopped by the limit of {stop}; "
                "raise it, or ask for fewer states with `limit`"
            )
        return self._symbolic_states(found)

    def _symbolic_states(self, found: list[_ReachedEntry]) -> Iterator[SymbolicState]:
        edges = self._edge_table()
        for index, (discrete, zone, bounds, origin) in enumerate(found):
            raw = json.loads(discrete)
            yield SymbolicState(
                index=index,
                locations=raw["locations"],
                variables=raw["variables"],
                zone=tuple(zone),
                predecessor=None if origin is None else origin[0],
                step=None if origin is None else _step(edges, origin[1]),
                _bounds=tuple(map(tuple, bounds)),
            )

    def walk(self, engine: CodeEngine = "jit") -> Simulation:
        """Starts a symbolic walk through the model from its initial state.

        Args:
            engine: What runs the code of the model; states do not depend on it.

        Raises:
            ModelError: The initial state cannot be computed.
        """
        with _failing():
            return Simulation(self._raw.simulate(engine), self._edge_table())

    def _edge_table(self) -> list[list[_EdgeEntry]]:
        if self._edges is None:
            processes = self._raw.edges()
            self._edges = [[_EdgeEntry(*entry[:5]) for entry in process] for process in processes]
        return self._edges


class Simulation:
    """A walk through a model: a state, its moves, and the state after one of them.

    States are symbolic: `zone` holds all clock values that the moves so far allow.
    """

    def __init__(self, raw: _checker.Simulation, edges: list[list[_EdgeEntry]]) -> None:
        self._raw = raw
        self._edges = edges

    @property
    def locations(self) -> dict[str, str]:
        """The location of each process."""
        return dict(self._raw.locations())

    @property
    def variables(self) -> dict[str, int | float]:
        """The value of each variable; parts of arrays and structs by names such as ``a[2].x``."""
        return dict(self._raw.variables())

    @property
    def zone(self) -> tuple[str, ...]:
        """The constraints on the clocks, such as ``x <= 3``."""
        return tuple(self._raw.zone())

    def moves(self) -> tuple[EngineStep, ...]:
        """The moves of the state, in a fixed order.

        Raises:
            ModelError: The model fails in computing one.
        """
        with _failing():
            return tuple(_step(self._edges, step) for step in self._raw.moves())

    def take(self, index: int) -> None:
        """Takes the move with this index.

        Raises:
            IndexError: There is no such move.
            ModelError: The model fails in computing one.
        """
        with _failing():
            self._raw.take(index)

    def settle(self) -> None:
        """Follows moves as long as time cannot pass and there is exactly one.

        Raises:
            ModelError: The model fails on the way.
        """
        with _failing():
            self._raw.settle()


def _step(edges: list[list[_EdgeEntry]], step: list[tuple[int, int, int, list[int]]]) -> EngineStep:
    taken = (edges[process][edge].taken(branch, values) for process, edge, branch, values in step)
    return EngineStep(tuple(taken))


@contextlib.contextmanager
def _failing() -> Iterator[None]:
    """Turns the engine's error about a failing model into ours."""
    try:
        yield
    except _checker.FailedError as error:
        raise ModelError(error.args[0]) from None


def load(text: str, path: str = "") -> Model:
    """Loads a model from its text (UPPAAL XML or XTA).

    Args:
        text: The whole file.
        path: What to call it in diagnostics.

    Raises:
        RejectedError: The engine does not accept it.
    """
    return _load(path, text.encode())


def load_file(path: Path) -> Model:
    """Loads a model from a file (UPPAAL XML or XTA).

    Raises:
        RejectedError: The engine does not accept it.
        OSError: The file cannot be read.
    """
    return _load(str(path), path.read_bytes())


def diagnostic_pages() -> list[tuple[str, str, str, str]]:
    """Of every diagnostic of models and queries: code, name, severity, and its page in Markdown."""
    return _checker.explanations()


def _load(path: str, data: bytes) -> Model:
    try:
        return Model(_checker.load(path, data))
    except _checker.RejectedError as error:
        raise RejectedError(error.args[0]) from None
