"""Models that the engine has loaded: what is in them, queries, runs and states."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import ntagen._checker as _checker
from ntagen.checker.answer import Answer, Interrupted
from ntagen.checker.constants import Value, written
from ntagen.checker.edges import EdgeTable
from ntagen.checker.errors import RejectedError, failing, rejecting
from ntagen.checker.options import CodeEngine, Options, by_keywords
from ntagen.checker.queries import Query, form_of, queries_from
from ntagen.errors import InputError, LimitError, ModelError, NtagenError
from ntagen.files import EVIDENCE_BYTES, MODEL_BYTES, read_file, read_pieces

if TYPE_CHECKING:
    from ntagen.checker.facts import (
        Channel,
        Clock,
        Facts,
        Process,
        ScalarSet,
        StateSize,
        StoredState,
        Template,
        Variable,
    )
    from ntagen.checker.policy import Follower, Policy
    from ntagen.checker.runs import Choose, Run, Walk
    from ntagen.checker.state_space import StateSpace
    from ntagen.checker.states import Simulation, SymbolicState
    from ntagen.checker.stepwise import StepwiseRuns
    from ntagen.checker.strategy import ForcedRule, PriorityRule, Strategy, Verification

OverflowRule = Literal["wrap", "error"]

HEURISTICS: dict[str, str] = dict(_checker.PARTS)
"""The heuristics that can be switched off, each with what it does."""

_PIECE_CHARACTERS = 2**20
_PROCESSES_SHOWN = 5
"""The short text of a model names at most this many processes."""


class Model:
    """A model that the engine has accepted.

    The attributes describe the model. `check` answers queries, `synthesize` solves games,
    `simulate` makes random runs, `states` lists the reachable symbolic states, and `walk` goes
    through them step by step.
    """

    def __init__(self, raw: _checker.Model) -> None:
        self._raw = raw
        self._edges = EdgeTable(raw.edges)
        self._facts: Facts | None = None
        self._followers: dict[str, Follower] = {}

    @property
    def overflow(self) -> OverflowRule:
        """What happens if a result of integer arithmetic does not fit into 32 bits.

        You can set it. ``wrap``: the result wraps round, as in UPPAAL, and `Answer.wrapped` says
        where it did; ``error``: it is a run-time error.
        """
        return self._raw.overflow

    @overflow.setter
    def overflow(self, rule: OverflowRule) -> None:
        self._raw.set_overflow(rule)

    def __repr__(self) -> str:
        names = ", ".join(process.name for process in self.processes[:_PROCESSES_SHOWN])
        more = ", …" if len(self.processes) > _PROCESSES_SHOWN else ""
        return f"<Model of {len(self.processes)} processes: {names}{more}>"

    def facts_json(self, *, with_stored: bool = False) -> str:
        """The description of the model as one JSON object, as ``ntagen info --json`` prints it.

        Args:
            with_stored: Whether it says what is stored of a state, as with ``--state``.
        """
        return self._raw.facts_json(with_stored=with_stored)

    def network_json(self) -> str:
        """The processes, clocks and variables by number as one JSON object.

        Locations and edges have the numbers of traces and strategies; ``network_json.rs`` of the
        engine describes the object.
        """
        return self._raw.network_json()

    @property
    def facts(self) -> Facts:
        """The description of the model as one value."""
        if self._facts is None:
            from ntagen.checker.facts import Facts

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
        """The variables without constants, in the order of their words."""
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

    def stored_state(self) -> StoredState:
        """What a search stores of a state: how many bits each part takes, and what is left out.

        It is found out anew with each call, which takes long for a large model.
        """
        from ntagen.checker.facts import stored_state_from

        return stored_state_from(self._raw.stored_state_json())

    @property
    def state_words(self) -> int:
        """How many 32-bit words the discrete part of a state takes."""
        return self.state.words

    @property
    def queries(self) -> tuple[Query, ...]:
        """The queries of the file, in order."""
        # This does not use `facts`: for a large model they take a while to collect.
        return queries_from(json.loads(self._raw.queries_json()))

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings about the model and files of queries, one text each."""
        return tuple(self._raw.warnings)

    @property
    def load_seconds(self) -> float:
        """The seconds that loading took, and compiling the code once a query was checked."""
        return self._raw.load_seconds

    @property
    def text(self) -> str:
        """The text that was loaded: UPPAAL XML or XTA."""
        return self._raw.text

    def with_constants(self, values: Mapping[str, Value] | None = None, /, **named: Value) -> Model:
        """The same model with other values of some of its constants, loaded again.

        Sizes, ranges and instances that depend on them follow. This model stays as it is. A sweep::

            for n in range(2, 8):
                print(n, model.with_constants(N=n).check("A[] not deadlock"))

        Args:
            values: By name. That of a constant in a template is ``"Train.LENGTH"``.
            named: The same, for names without a dot. A value is a number, the text of an
                expression, or lists (of arrays) and mappings (of structs) of them.

        Raises:
            RejectedError: There is no such constant, or the model is wrong with these values.
            TypeError, ValueError: A value is none that a constant can have.
        """
        wanted = {**(values or {}), **named}
        with rejecting():
            raw = self._raw.with_constants([(name, written(one)) for name, one in wanted.items()])
        return Model(raw)

    def read_queries(self, path: Path) -> tuple[Query, ...]:
        """Reads a ``.q`` file.

        Raises:
            RejectedError: The file is not a list of queries.
            OSError: The file cannot be read.
        """
        with rejecting():
            entries = self._raw.read_queries_json(str(path), read_file(path, MODEL_BYTES))
        return queries_from(json.loads(entries))

    @by_keywords(Options)
    def check(self, query: str, options: Options) -> Answer:
        """Answers a query; the keywords are the fields of `Options`.

        The strategy of ``strategy S = control: …`` is kept under its name: later queries of the
        same model may be asked ``under S``. Unless it is wanted with the answer, it is made when it
        is first used, within the limits of that query.

        Args:
            query: The query in UPPAAL's language, or one of `queries`.
            options: How it is to be answered, given as keywords.

        Returns:
            The answer. If a limit was reached, the answer says so.

        Raises:
            ValueError: A keyword has a value that it cannot have.
            RejectedError: The query is wrong or of a kind that is not supported.
            KeyboardInterrupt: The user interrupted. If random runs were made until then, it is an
                `Interrupted` with their answer.
        """
        return self.answer(query, options)

    def answer(self, query: str, options: Options) -> Answer:
        """Answers a query as `check` does, with all options as one value."""
        if any(one.is_asked for one in self._followers.values()):
            # The model answers a query until the policy has decided.
            raise InputError("a policy must not ask the model that is asked under it")
        try:
            with rejecting():
                raw = _checker.check(self._raw, query, options)
        except _checker.InterruptedError as interrupted:
            answer = Answer(interrupted.args[0], query, self._edges, options)
            raise Interrupted(answer) from None
        except RejectedError as error:
            form = form_of(query) if self._followers else None
            follower = self._followers.get(form.uses or "") if form else None
            raised = follower.taken() if follower else None
            if raised is None:
                raise
            if not isinstance(raised, Exception):
                # The user has interrupted the policy.
                raise raised from None
            raise error from raised
        return Answer(raw, query, self._edges, options)

    def stepwise(
        self, query: str, *, strategies: Sequence[str] = (), wait: float | None = None
    ) -> StepwiseRuns:
        """Random runs in which the caller decides for the controller.

        `ntagen.gymnasium.Environment`, which is made of them, explains the arguments.

        Raises:
            RejectedError: A query is wrong, or nothing is there to be decided.
            InputError: `wait` is no positive number.
        """
        from ntagen.checker.policy import checked_wait
        from ntagen.checker.stepwise import StepwiseRuns

        checked_wait(wait)
        with rejecting():
            return StepwiseRuns(_checker.Environment(self._raw, query, list(strategies), wait))

    def follow(
        self, name: str, policy: Policy, features: str | None = None, *, wait: float | None = None
    ) -> tuple[str, ...]:
        """Makes a policy available to later queries: ``Pr[<=9](<> p) under Agent``.

        In their runs the policy decides for the controller, as an agent does in
        `ntagen.gymnasium.Environment` with the same features: it gets an observation, and returns
        the number of an action. ``Pr``, ``E`` and ``simulate`` can be asked under it, and all other
        queries are refused. Runs take one thread, and come in the order of their numbers. The
        policy must not ask this model anything.

        Args:
            name: The name of the policy in queries, such as ``"Agent"``.
            policy: An object with ``predict(observation, deterministic=True)``, which returns the
                action and something else, as the policies and algorithms of stable-baselines3; or
                a function of the observation and the mask of actions, which returns the action.
            features: What it sees: ``"{exact} -> {intervals}"``. An agent that was trained in
                `ntagen.gymnasium.Environment` knows this, its `wait` and its actions by itself.
            wait: After how many units of time it is asked again at the latest, if a clock is among
                the features; then it must be given.

        Returns:
            The texts of the actions, by their numbers; the last one is ``WAIT``.

        Raises:
            RejectedError: The features are wrong, `wait` is missing, there is nothing to decide, or
                the policy was trained for other actions.
            InputError: The name is no name, `wait` is no positive number, this is no policy, or
                nobody says what it sees.
        """
        from ntagen.checker.policy import Follower, checked_wait, trained_in

        if not (name.isascii() and name.isidentifier()):
            raise InputError(f"{name!r} is no name: use letters, digits and underscores")
        checked_wait(wait)
        follower = Follower(policy)
        known: list[str] | None = None
        if features is None:
            training = trained_in(policy)
            if training is None:
                raise InputError(
                    f"it is not known what the policy '{name}' sees: it was not trained in an "
                    "environment of ntagen, or what it sees was changed on the way\n"
                    'hint: train it in ntagen.gymnasium.Environment, or call model.follow("'
                    f'{name}", policy, "{{exact}} -> {{intervals}}") in Python'
                )
            features, known = training["features"], training["actions"]
            wait = training["wait"] if wait is None else wait
        with rejecting():
            actions = _checker.follow(self._raw, name, features, follower, wait=wait, actions=known)
        self._followers[name] = follower
        return tuple(actions)

    def block_of_runs(self, query: str, first: int, count: int, options: Options) -> bytes:
        """Makes random runs of ``Pr`` or ``E``, for whoever answers the query elsewhere.

        Args:
            query: The query.
            first: The number of the first run.
            count: How many runs; for a comparison of probabilities, how many pairs of runs.
            options: How the query is answered.

        Returns:
            The results for `Options.run_source`: bytes that this version of ntagen reads.

        Raises:
            RejectedError: The query is wrong, or of another kind.
            KeyboardInterrupt: The user interrupted.
        """
        with rejecting():
            return _checker.block_of_runs(self._raw, query, options, first, count)

    def check_jointly(self, queries: Iterable[str | Query], **keywords: Any) -> list[Answer]:  # noqa: ANN401
        """Answers statistical queries so that all their intervals hold together.

        Queries with the same bound share their runs: each run is made once, and watched for all of
        them. Each of k intervals has the risk ``alpha / k`` (Bonferroni's correction), so all hold
        together but for a risk of `alpha`, whatever the queries have to do with each other.

        Args:
            queries: Queries ``Pr[…](…)``, also compared with a number, and ``E[…](…)``.
            keywords: The fields of `Options`.

        Returns:
            The answers, in the order of the queries.

        Raises:
            RejectedError: A query is wrong, or of another kind.
        """
        options = Options(**keywords)
        return self.answer_jointly([(str(query), options) for query in queries])

    def answer_jointly(self, queries: Sequence[tuple[str, Options]]) -> list[Answer]:
        """Answers queries as `check_jointly` does, each with its own options.

        Queries share their runs if they have the same bound, seed and step of equations. Each
        interval has its own risk divided by the number of queries: all hold together but for the
        mean of the risks. Limits are those of the first query.
        """
        texts = [text for text, _ in queries]
        with rejecting():
            answers = _checker.check_jointly(self._raw, texts, [options for _, options in queries])
        return [
            Answer(raw, text, self._edges, options)
            for raw, (text, options) in zip(answers, queries, strict=True)
        ]

    @by_keywords(Options)
    def synthesize(self, query: str, options: Options) -> Strategy:
        """Solves a game and gives the strategy of the player who wins.

        If the controller cannot win, it is the environment's strategy; `Strategy.winning` tells.

        Args:
            query: A control query, such as ``control: A<> Gate.Open``, or one of `queries`.
            options: How it is to be answered, given as keywords: the fields of `Options`.

        Raises:
            RejectedError: The query is wrong or of a kind that is not supported.
            InputError: The query is not a game, or its kind has no strategy.
            LimitError: A limit was reached before there was an answer, or there is no answer
                because stopped clocks allow only an approximation.
            ModelError: The model fails.
            KeyboardInterrupt: The user interrupted.
        """
        from ntagen.checker.strategy import Strategy

        form = form_of(query)
        if form is None or not form.is_game:
            raise InputError(
                f"{query.strip()} is not a control query, so it has no strategy\n"
                "hint: begin the query with control: — control: A<> p, control: A[] p, …"
            )
        answer = self.answer(query, replace(options, strategy=True))
        if answer.verified is False:
            raise NtagenError("\n".join(answer.verification))
        if answer.verdict == "error":
            raise ModelError(answer.message or "the model has a run-time error")
        if answer.verdict == "unknown":
            raise LimitError(f"the synthesis was stopped by the {answer.limit_text}")
        if answer.verdict == "maybe":
            raise LimitError("the engine could not decide who wins, because the model stops clocks")
        strategy = answer.strategy
        if not isinstance(strategy, Strategy):
            if answer.strategy_json() is not None:
                raise InputError(
                    f"{answer.query.strip()} has a machine over observations, not a strategy "
                    "over states\nhint: check(query, strategy=True).machine gives it; on the "
                    "command line, check --strategy FILE writes it"
                )
            remark = f": {answer.message}" if answer.message else ""
            raise InputError(
                f"{answer.query.strip()} is {answer.verdict}, and this kind of query has no "
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

        This does not check whether the strategy wins; `Strategy.verify` does.

        Args:
            path: A file as `Strategy.save` and ``ntagen check --strategy`` write it.
            forced: The rule for forced moves with which the strategy was made.
            priorities: Whether priorities counted when it was made.

        Raises:
            RejectedError: The file is not a strategy, or does not fit the model.
            OSError: The file cannot be read.
        """
        data = read_file(os.fspath(path), EVIDENCE_BYTES)
        return self.read_strategy(data, os.fspath(path), forced, priorities)

    def read_strategy(
        self,
        data: bytes,
        path: str = "",
        forced: ForcedRule = "tiga",
        priorities: PriorityRule = "ignore",
    ) -> Strategy:
        """Reads a strategy from the bytes of a file; all else is as in `load_strategy`.

        Args:
            data: What `Strategy.json` gives, in UTF-8.
            path: The name of the file, for messages.
            forced: The rule for forced moves with which the strategy was made.
            priorities: Whether priorities counted when it was made.

        Raises:
            RejectedError: The file is not a strategy, or does not fit the model.
        """
        from ntagen.checker.strategy import Strategy

        with rejecting():
            raw = _checker.Strategy.read(self._raw, path, data)
        return Strategy(raw, forced, priorities)

    def strategy_under(self, query: str, options: Options) -> Strategy | None:
        """The strategy that a query is asked under, made now if only its winner is known so far.

        Args:
            query: The query, as ``Pr[<=100](<> Gate.Open) under S``.
            options: How the query is answered; its limits hold for making the strategy.

        Returns:
            The strategy; ``None`` if the query names none, or one that no query has defined.

        Raises:
            RejectedError: The query that defined the strategy gave none.
        """
        from ntagen.checker.strategy import Strategy

        form = form_of(query)
        if form is None or form.uses is None:
            return None
        with rejecting():
            raw = _checker.Strategy.named(self._raw, form.uses, query, options)
        return None if raw is None else Strategy(raw, options.forced, options.priorities)

    def has_strategy_of_game(self, name: str) -> bool | None:
        """Whether the strategy with this name is one of a game.

        Args:
            name: The name that a query has given it.

        Returns:
            False for a learned strategy, a shield and a policy; ``None`` if the name is not known.
        """
        return _checker.Strategy.is_of_game(self._raw, name)

    def verify(
        self,
        text: str | bytes,
        path: str = "",
        *,
        forced: ForcedRule = "tiga",
        priorities: PriorityRule = "ignore",
    ) -> Verification:
        """Checks a trace, certificate or strategy, independently of the search that found it.

        Args:
            text: The file, as `Answer.trace_json`, `Answer.certificate_text` and
                `Answer.strategy_json` give it; a large one is in memory once as bytes.
            path: The name of the file in messages.
            forced: For strategies: when the environment must move because time cannot pass.
            priorities: For strategies: whether priorities of channels and processes count.

        Raises:
            RejectedError: The text is none of these, or does not belong to this model.
        """
        from ntagen.checker.strategy import Verification

        name = path or "evidence"
        data = text.encode() if isinstance(text, str) else text
        try:
            with rejecting():
                holds, lines = self._raw.verify(name, data, forced, priorities)
        except RejectedError as error:
            if name in str(error):
                raise
            # What is wrong with the query in the file is said by its place in the query.
            where = f"error: {name}: the query in this file cannot be asked of the model"
            raise RejectedError([where, *error.diagnostics]) from None
        return Verification(holds, tuple(lines))

    def simulate(
        self,
        steps: int = 100,
        seed: int = 0,
        choose: Choose | None = None,
        *,
        strategy: Strategy | None = None,
    ) -> Run:
        """Makes a run with exact times from the initial state.

        Without `choose`, each transition that is possible now or later is equally likely, and so is
        each moment at which it is possible. If there is no last moment, the first few units count.

        Args:
            steps: The run ends after this many transitions, or earlier if none is possible.
            seed: The same seed gives the same run.
            choose: Gets each state and its choices. Returns the index of a choice, with a delay or
                without (then the delay is random), or ``None`` to end the run.
            strategy: A strategy of this model, which the run follows; its opponent moves at random.
                The run also ends when play is decided.

        Raises:
            ValueError: `choose` returns a delay that is too fine a fraction of the unit, or is
                given together with `strategy`.
            IndexError: `choose` returns a choice that is not possible.
            ModelError: The model has a run-time error.
            InputError: The strategy does not belong to a model like this one.
        """
        from ntagen.checker.runs import simulated

        if strategy is not None:
            if choose is not None:
                raise ValueError("give either choose or strategy: both say what happens next")
            if not strategy.fits(self._raw):
                raise InputError("the strategy does not belong to this model")
            return strategy.simulate(steps, seed)
        with failing():
            return simulated(self.walk_exactly(), steps, seed, choose)

    def states(
        self,
        limit: int | None = None,
        *,
        timeout_s: float | None = None,
        memory_bytes: int | None = None,
        engine: CodeEngine = "jit",
    ) -> Iterator[SymbolicState]:
        """The reachable symbolic states, those with the fewest transitions first.

        All states are computed before the first one is returned. A state that an earlier one
        contains is left out. Zones are extrapolated by the constants of the model, so that their
        number is finite: beyond these constants, and where stopwatches stand, a zone may contain
        clock values that are not reachable.

        Args:
            limit: At most this many states are returned; there may be more.
            timeout_s: The search gives up after this time, in seconds.
            memory_bytes: The search gives up when its states take this many bytes.
            engine: What runs the code of the model; states do not depend on it.

        Raises:
            ValueError: A limit is negative.
            LimitError: Time or memory ran out.
            ModelError: The model fails in a state.
            KeyboardInterrupt: The user interrupted.
        """
        from ntagen.checker.states import symbolic_states

        if any(one is not None and one < 0 for one in (limit, timeout_s, memory_bytes)):
            raise ValueError("a limit cannot be negative")
        with failing():
            found, _, stop = self._raw.states(
                engine, states=limit, memory_bytes=memory_bytes, timeout_s=timeout_s, links=False
            )
        if stop in ("memory", "time"):
            raise LimitError(
                f"the search was stopped by the {stop} limit; "
                "raise that limit, or ask for fewer states with `limit`"
            )
        return symbolic_states(found, self._edges)

    def state_space(
        self,
        limit: int = 10_000,
        *,
        timeout_s: float | None = None,
        memory_bytes: int | None = None,
        engine: CodeEngine = "jit",
    ) -> StateSpace:
        """The reachable symbolic states with all moves between them, to be drawn or looked at.

        The states are those of `states`. A notebook shows the graph if it is small.

        Args:
            limit: At most this many states.
            timeout_s: The search gives up after this time, in seconds.
            memory_bytes: The search gives up when its states take this many bytes.
            engine: What runs the code of the model; states do not depend on it.

        Raises:
            ValueError: A limit is negative.
            LimitError: There are more states, or time or memory ran out.
            ModelError: The model fails in a state.
            KeyboardInterrupt: The user interrupted.
        """
        from ntagen.checker.state_space import state_space
        from ntagen.checker.states import symbolic_states

        if any(one is not None and one < 0 for one in (limit, timeout_s, memory_bytes)):
            raise ValueError("a limit cannot be negative")
        with failing():
            found, links, stop = self._raw.states(
                engine, states=limit, memory_bytes=memory_bytes, timeout_s=timeout_s, links=True
            )
        if stop == "states":
            raise LimitError(
                f"the model has more than {limit} symbolic states\n"
                "hint: make constants of the model smaller; in Python, state_space(limit=…) allows "
                "more"
            )
        if stop is not None:
            raise LimitError(f"the search was stopped by the {stop} limit\nhint: raise it")
        return state_space(symbolic_states(found, self._edges), links, self._edges)

    def walk(self, engine: CodeEngine = "jit") -> Simulation:
        """Starts a symbolic walk through the model from its initial state.

        Args:
            engine: What runs the code of the model; states do not depend on it.

        Raises:
            RejectedError: The model has a meaning in random runs only.
            ModelError: The initial state cannot be computed.
        """
        from ntagen.checker.states import Simulation

        with rejecting(), failing():
            return Simulation(_checker.simulate(self._raw, engine), self._edges)

    def walk_exactly(self) -> Walk:
        """Starts a walk with exact times through the model from its initial state.

        Raises:
            RejectedError: The model has a meaning in random runs only.
            ModelError: The initial state cannot be computed.
        """
        with rejecting(), failing():
            return _checker.walk_exactly(self._raw)


def load(text: str, path: str = "", *, allow_external: Sequence[str | Path] = ()) -> Model:
    """Loads a model from its text (UPPAAL XML or XTA).

    Args:
        text: The whole file.
        path: The name of the file in diagnostics.
        allow_external: The libraries that the model may import: their files, or folders that hold
            them. Their code runs in this process.

    Raises:
        RejectedError: The engine does not accept it.
    """
    return _load(path, _encoded(text), allow_external)


def load_file(path: Path, *, allow_external: Sequence[str | Path] = ()) -> Model:
    """Loads a model from a file (UPPAAL XML or XTA); `allow_external` as in `load`.

    Raises:
        RejectedError: The engine does not accept it.
        OSError: The file cannot be read.
    """
    return _load(str(path), read_pieces(path, MODEL_BYTES), allow_external)


def diagnostic_pages() -> list[tuple[str, str, str, str]]:
    """The diagnostics of models and queries: code, name, severity, and the page in Markdown."""
    return _checker.explanations()


def _load(path: str, pieces: Iterable[bytes], allow_external: Sequence[str | Path]) -> Model:
    with rejecting():
        return Model(_checker.load(path, pieces, [Path(one) for one in allow_external]))


def _encoded(text: str) -> Iterator[bytes]:
    """The bytes of a text, piece by piece: together they would take as much memory once more."""
    for start in range(0, len(text), _PIECE_CHARACTERS):
        yield text[start : start + _PIECE_CHARACTERS].encode()
