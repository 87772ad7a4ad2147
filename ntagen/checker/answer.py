"""Answers of the engine to queries."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from itertools import accumulate, count
from typing import TYPE_CHECKING, Any, Final, Literal

import ntagen._checker as _checker
from ntagen.checker.edges import EdgeTable, EngineEdge, EnginePlan, EngineStep, step_of
from ntagen.checker.errors import rejecting
from ntagen.checker.queries import form_of
from ntagen.errors import InputError
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker.distribution import Distribution
    from ntagen.checker.learned import LearnedStrategy
    from ntagen.checker.machine import Machine
    from ntagen.checker.options import Options
    from ntagen.checker.picture.page import Svg
    from ntagen.checker.runs import Run
    from ntagen.checker.strategy import Strategy
    from ntagen.checker.trajectories import OverTime, Trajectory

Verdict = Literal["satisfied", "not satisfied", "maybe", "unknown", "error"]

Matrix = list[list[tuple[int, bool] | None]]
"""A zone as a closed difference bound matrix; `SymbolicState.dbm` says what an entry is."""

Extreme = int | Literal["inf"] | None
"""A least or greatest value: ``"inf"`` if there is no greatest, ``None`` if no state counts."""

Value = Extreme | float | list[Extreme] | list[list[Extreme] | None]
"""The value of ``sup`` or ``inf`` is an `Extreme`, that of ``bounds`` the pair of the least and the
greatest. Several items have a list of these. The value of a statistical query is its estimate."""

PAGE_PLANS: Final = 4096
"""So many plans are taken from the engine together."""

JSON_PAGE_PLANS: Final = 64
"""So many plans are written as text together: each may take tens of thousands of characters."""


@dataclass(frozen=True)
class Place:
    """An expression of a model.

    Attributes:
        place: ``file:line:column``, from 1; for an XML file also the text that has the line.
        text: The expression.
    """

    place: str
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


@dataclass(frozen=True, slots=True)
class Estimate:
    """What random runs say of a probability or of a mean.

    Attributes:
        value: The share of the runs that are satisfied, or the mean of their values.
        lower: The lower end of the interval; ``None`` if too few runs give none.
        upper: The upper end of the interval; ``None`` if too few runs give none.
        confidence: The confidence of the interval; the method says what it means.
        method: What made the interval: ``Clopper-Pearson``, ``confidence sequence``,
            ``Student (asymptotic)``, ``empirical Bernstein``,
            ``empirical Bernstein confidence sequence``, ``Dvoretzky-Kiefer-Wolfowitz``,
            ``importance splitting, Student (asymptotic)`` or, of a best strategy whose value was
            computed without runs, ``value iteration``.
        runs: The number of runs; with importance splitting, of parts of runs.
        satisfied_runs: How many of them are satisfied; ``None`` for means and with splitting.
        compared: What runs say of the second probability of a comparison,
            ``Pr[…](…) >= Pr[…](…)``; ``None`` for other queries.
    """

    value: float
    lower: float | None
    upper: float | None
    confidence: float
    method: str
    runs: int
    satisfied_runs: int | None
    compared: Estimate | None = None

    @property
    def is_computed(self) -> bool:
        """Whether the value lies between the ends for certain, since no runs were needed."""
        return self.method == "value iteration"

    @classmethod
    def from_object(cls, given: dict[str, Any]) -> Estimate:
        """The estimate that an object of the engine describes."""
        compared = given["compared"]
        return cls(**given | {"compared": compared and cls.from_object(compared)})


@dataclass(frozen=True, slots=True)
class Iteration:
    """What an iteration of learning came to.

    Attributes:
        runs: How many runs were made until its end, those that judged it among them.
        resets: How often all had been forgotten before.
        value: The value of its strategy.
        error: The standard error of the value.
        judging_runs: How many runs judged the strategy; they are the same for all iterations.
    """

    runs: int
    resets: int
    value: float
    error: float
    judging_runs: int


@dataclass(frozen=True, slots=True)
class Shielded:
    """What is known of a shield.

    Attributes:
        cells: How many cells its grid has.
        safe_cells: How many of them are safe.
        choice_cells: In how many cells some sample has a choice.
        unseen_pairs: How many pairs of a cell and a move no sample has shown; cells count whose
            samples have what must be kept.
        stuck_runs: How many runs were stuck where time cannot pass; they count as unsafe.
        moves: How many moves the controller has.
        trial: How likely it is that a fresh run under the shield, of 100 choices, breaks what must
            be kept; ``None`` without a shield, or if a limit came before.
    """

    cells: int
    safe_cells: int
    choice_cells: int
    unseen_pairs: int
    stuck_runs: int
    moves: int
    trial: Estimate | None

    @property
    def safe_share(self) -> float:
        """The share of cells that are safe."""
        return self.safe_cells / self.cells


@dataclass(frozen=True, slots=True)
class Optimised:
    """How the best strategy was found.

    Attributes:
        runs: From how many runs it was learned, those that judged it among them.
        iterations: How many iterations there were.
        iterations_in_last_reset: How many of them came after the last reset.
        resets: How often all was forgotten.
        judged: Its value by the runs that chose it among others; it is too good by a little.
            `Answer.value` comes from runs that learning has not seen.
        uniform: What runs are worth in which all is chosen uniformly; ``None`` if a limit came
            before.
        comparison: Whether the strategy is ``better`` or ``worse`` than that, or ``alike`` as far
            as the runs can tell; ``None`` if a limit came before.
        history: What the iterations came to, in their order.
        is_complete: Whether learning came to its end.
        leaves: How many leaves the trees of the strategy have.
    """

    runs: int
    iterations: int
    iterations_in_last_reset: int
    resets: int
    judged: float
    uniform: Estimate | None
    comparison: Literal["better", "worse", "alike"] | None
    history: tuple[Iteration, ...]
    is_complete: bool
    leaves: int


class Answer:
    """The answer to a query.

    An answer is neither true nor false: `satisfied` says whether the query is.

    Attributes:
        query: The query as given.
        verdict: ``satisfied``, ``not satisfied``, ``maybe`` (an over-approximation could not
            decide), ``unknown`` (a limit came first: see `stop`) or ``error`` (the model failed:
            see `message`).
        value: The value of ``sup``, ``inf`` or ``bounds``, or the estimate of a statistical query;
            ``None`` for other queries, and if no state counts. `message` says whether a clock
            reaches the value.
        estimate: What the random runs of a statistical query say; ``None`` for other queries.
        message: A remark for the user, or what went wrong in the model.
        wrapped: The first place, in the order of the model, where a result of integer arithmetic
            did not fit into 32 bits and wrapped round. `Model.overflow` can make it an error.
        warnings: The warnings about the query, one text each.
        stop: ``states``, ``memory``, ``disk``, ``time`` or ``clocks`` if a limit stopped the
            search; ``interrupted`` if the user ended random runs, and this is the answer of those
            until then.
        explored: The number of states whose successors were computed.
        stored: The number of states that are stored at the end; a state that was replaced by one
            with a larger zone does not count.
        seconds: The seconds of the search alone.
        load_seconds: The seconds of loading the model and compiling its code.
        peak_bytes: The greatest number of bytes that states and tables took.
        plan_count: How many plans were found; ``None`` if none were asked for, or if the
            environment has choices, so that a strategy is not a list of plans.
        has_more_plans: Whether there are more plans, or may be.
        plans_stop: ``states``, ``memory`` or ``time`` if a limit ended the list of plans.
        stopped: What was asked for beside the verdict and is missing (``strategy``, ``check`` or
            ``certificate``), each with the limit that came before.
        verified: Whether the strategy and the exact runs of the traces passed their independent
            checks; ``None`` if there was no check, or one did not finish.
        verification: What these checks covered, or what is wrong, line by line.
    """

    def __init__(
        self,
        raw: _checker.Answer,
        query: str,
        edges: EdgeTable,
        options: Options,
    ) -> None:
        self._raw = raw
        self._options = options
        self._edges = edges
        self.query = query
        self.verdict: Verdict = raw.verdict
        value = raw.value_json()
        self.value: Value = None if value is None else json.loads(value)
        estimate = raw.estimate_json()
        self.estimate = (
            None
            if estimate is None
            else Estimate.from_object({"value": json.loads(value or "0")} | json.loads(estimate))
        )
        self.message = raw.message
        self.wrapped = None if raw.wrapped is None else Place(*raw.wrapped)
        self.warnings = tuple(raw.warnings)
        self.stop: str | None = raw.stop
        self.explored = raw.explored
        self.stored = raw.stored
        self.seconds = raw.seconds
        self.load_seconds = raw.load_seconds
        self.peak_bytes = raw.peak_bytes
        self.plan_count = raw.plan_count
        self.has_more_plans = raw.has_more_plans
        self.plans_stop = raw.plans_stop
        self.stopped = tuple(raw.stopped)
        self.verified = raw.verified
        self.verification = tuple(raw.verification())

    def __repr__(self) -> str:
        states = "1 state" if self.explored == 1 else f"{self.explored} states"
        facts = [f"{self.query.strip()} is {self.verdict}"]
        if self.value is not None:
            facts.append(f"value {json.dumps(self.value)}")
        if self.stop is not None:
            facts.append(f"stopped by the {self.limit_text}")
        if self.message:
            facts.append(self.message.partition("\n")[0])
        if self.trajectories:
            states = f"{len(self.trajectories)} runs shown"
            return f"<Answer: {', '.join(facts)}; {states}, {1000 * self.seconds:.1f} ms>"
        if self.estimate is not None and not self.estimate.is_computed:
            states = f"{self.estimate.runs} runs"
            return f"<Answer: {', '.join(facts)}; {states} in {1000 * self.seconds:.1f} ms>"
        return f"<Answer: {', '.join(facts)}; {states} explored in {1000 * self.seconds:.1f} ms>"

    def __bool__(self) -> bool:
        raise ValueError(
            f"an answer is neither true nor false; this one is {self.verdict!r}\n"
            "hint: ask for answer.satisfied, or compare answer.verdict"
        )

    @property
    def satisfied(self) -> bool | None:
        """Whether the query is satisfied; ``None`` without a verdict: see `verdict`."""
        return {"satisfied": True, "not satisfied": False}.get(self.verdict)

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """The runs that ``simulate`` shows; empty for other queries."""
        from ntagen.checker.trajectories import Trajectory

        items, count = self._raw.shown_runs() or ([], 0)
        # One by one, so that limits and Ctrl-C hold in between.
        runs = (self._raw.shown_run(index) for index in range(count))
        return tuple(
            Trajectory(run[0], self.query, dict(zip(items, run[1], strict=True)))
            for run in runs
            if run is not None
        )

    @property
    def distribution(self) -> Distribution | None:
        """How the values of random runs are distributed; ``None`` for other queries than these.

        For ``Pr`` they say when runs reach what is asked, for ``E`` what is asked of each.
        """
        from ntagen.checker.distribution import Distribution

        known = self._raw.distribution_json()
        if known is None:
            return None
        return Distribution(json.loads(known), self._raw.distribution_points, self.query)

    def frequency_over_time(
        self,
        times: Any = None,  # noqa: ANN401  any array will do
        quantiles: tuple[float, float] = (0.05, 0.95),
    ) -> OverTime:
        """What the runs that ``simulate`` shows say of each moment: mean and quantiles over runs.

        For an expression that is 0 or 1 the mean is the share of runs in which it holds then.

        Args:
            times: The moments; by default 201 from 0 to the end of the longest run.
            quantiles: Which quantiles over runs are given beside the mean.

        Raises:
            InputError: No run is shown, or the quantiles do not lie between 0 and 1.
        """
        from ntagen.checker.trajectories import over_time

        return over_time(self.trajectories, times, quantiles, self.query)

    def to_frame(self) -> Any:  # noqa: ANN401  it depends on what is installed
        """What random runs say, as a frame of pandas, or of polars if there is no pandas.

        It has a row for each point of the runs of ``simulate``, and for ``Pr`` and ``E`` a row for
        each value of `distribution`.

        Raises:
            InputError: Neither library is installed, or the query is not statistical.
        """
        from ntagen.checker.trajectories import frame_of_trajectories

        if (distribution := self.distribution) is not None:
            return distribution.to_frame()
        if self._raw.shown_runs() is None:
            raise InputError(
                f"{self.query.strip()} has no random runs to make a frame of\n"
                "hint: ask for Pr[…](…), E[…](…) or simulate[…]{…}"
            )
        return frame_of_trajectories(self.trajectories)

    def chart(self, buckets: int | None = None, width: float | None = None) -> Svg | None:
        """What random runs say, as a picture; ``None`` if there is nothing to draw.

        Of a strategy that was learned, it is the value of each iteration.

        Args:
            buckets: The number of buckets of a histogram; see `Distribution.histogram`.
            width: How wide they are, instead.

        Raises:
            InputError: The buckets cannot be made.
        """
        from ntagen.checker.trajectories import runs_chart

        if (optimised := self.optimised) is not None:
            return self._learning_chart(optimised)
        distribution, estimate = self.distribution, self.estimate
        if distribution is not None and distribution.count > 0:
            is_mean = distribution.of == "value" and estimate is not None
            ends = (estimate.lower, estimate.upper) if is_mean and estimate else (None, None)
            return distribution.chart(buckets, width, ends)
        runs = self.trajectories
        return runs_chart(runs, self.query) if runs else None

    def _learning_chart(self, found: Optimised) -> Svg:
        from ntagen.checker.picture.learning import Level, Point, learning_picture

        def level(one: Estimate | None) -> Level | None:
            return None if one is None else Level(one.value, one.lower, one.upper)

        form = form_of(self.query)
        return learning_picture(
            [Point(one.runs, one.resets, one.value, one.error) for one in found.history],
            level(self.estimate),
            level(found.uniform),
            maximises=form is not None and form.kind.startswith("max"),
            heading=self.query,
        )

    def _repr_svg_(self) -> str | None:
        chart = self.chart()
        return None if chart is None else chart.text

    @property
    def limit_text(self) -> str:
        """What stopped the search, in words, for example ``state limit``; or ``user``."""
        if self.stop == "interrupted":
            return "user"
        if self.stop == "disk":
            return "disk, which cannot be written: it may be full"
        return f"{(self.stop or 'unknown').removesuffix('s')} limit"

    @property
    def plans(self) -> tuple[EnginePlan, ...]:
        """The plans; empty if none were asked for or found."""
        chains = self.plan_chains()
        return tuple(
            EnginePlan(tuple(step for chain in plan for step in chains[chain]))
            for page in self.plan_pages()
            for plan in page
        )

    def plan_chains(self) -> tuple[tuple[EngineStep, ...], ...]:
        """The distinct sequences of transitions that plans consist of; see `plan_pages`."""
        raw = self._raw.plans()
        if raw is None:
            return ()
        entries, chains = raw.chains()
        steps = [step_of(self._edges, entry) for entry in entries]
        return tuple(tuple(steps[index] for index in chain) for chain in chains)

    def plan_pages(self, size: int = PAGE_PLANS) -> Iterator[list[tuple[int, ...]]]:
        """The plans in pages of at most `size`; no more than one page is in memory.

        Yields:
            Of each plan, the indices of its sequences of transitions in `plan_chains`.
        """
        raw = self._raw.plans()
        while raw is not None:
            lengths, chains = (memoryview(data).cast("I") for data in raw.page(size))
            if not lengths:
                return
            ends = list(accumulate(lengths))
            yield [tuple(chains[s:e]) for s, e in zip([0, *ends], ends, strict=False)]

    def plans_json_pieces(self) -> Iterator[str]:
        """The plans as JSON text with every edge in full, in pieces; none without plans."""
        around = self._raw.around_plans()
        if around is None:
            return
        yield around[0]
        for number, line in enumerate(self.plan_lines()):
            yield f",{line}" if number else line
        yield around[1]

    def plan_lines(self) -> Iterator[str]:
        """Each plan as JSON text on one line."""
        raw = self._raw.plans()
        while raw is not None and (page := raw.page_json(JSON_PAGE_PLANS)):
            yield from page

    @property
    def runs(self) -> tuple[Run, ...]:
        """The runs with exact times of the traces: one run, or one for each value.

        Empty without a trace, with ``trace=False``, and if no exact times were found (the end of
        `trace_text` says why).
        """
        from ntagen.checker.runs import runs_of

        traces = self.trace_json()
        return () if traces is None else runs_of(json.loads(traces))

    @property
    def trace(self) -> Run | None:
        """The first of `runs`; ``None`` if there is none."""
        return next(iter(self.runs), None)

    def trace_lines(self, most: int | None = None) -> list[str]:
        """The trace for people, line by line: each step with its time, and only what it changes.

        Empty without a trace.

        Args:
            most: Only so many of the last steps are told; ``None`` is all.
        """
        from ntagen.checker.story import told

        traces = self.trace_json()
        if traces is None:
            return []
        text = (self.trace_text() or "").splitlines()
        missing = next((line for line in text if line.startswith("No exact times: ")), "")
        return told(json.loads(traces), missing, most)

    def trace_text(self) -> str | None:
        """The witness, counterexample or trace to the failure as UPPAAL prints it, if any.

        After it comes the run with exact times: each state with its clock values, the delay in it,
        and the edges that are taken then.
        """
        return self._raw.trace_text()

    def trace_json(self) -> str | None:
        """The same as JSON text."""
        return self._raw.trace_json()

    def trace_zones(self) -> list[list[Matrix]]:
        """Of each trace in `trace_json`, the zones of its symbolic states."""
        return self._raw.trace_zones()

    @property
    def certificate_states(self) -> int | None:
        """How many states the certificate has; ``None`` if none was asked for or found."""
        return self._raw.certificate_states

    def certificate_pieces(self) -> Iterator[str]:
        """The text of the file of the certificate, in pieces; none without a certificate."""
        return _until_none(self._raw.certificate_piece)

    def certificate_text(self) -> str | None:
        """The certificate as the text of a file; ``None`` if none was asked for or found."""
        return None if self.certificate_states is None else "".join(self.certificate_pieces())

    @property
    def strategy(self) -> Strategy | LearnedStrategy | None:
        """The strategy of the player who wins, or the one that was learned.

        ``None`` if none was asked for or found.
        """
        from ntagen.checker.learned import LearnedStrategy
        from ntagen.checker.strategy import Strategy

        learned = _checker.LearnedStrategy.of_answer(self._raw)
        if learned is not None:
            return LearnedStrategy(learned)
        raw = _checker.Strategy.of_answer(self._raw)
        return (
            None if raw is None else Strategy(raw, self._options.forced, self._options.priorities)
        )

    @property
    def optimised(self) -> Optimised | None:
        """How the best strategy was found; ``None`` for other queries than ``minE`` and its kin."""
        text = self._raw.optimised_json()
        if text is None:
            return None
        given = json.loads(text)
        uniform = given["uniform"] and Estimate.from_object(given["uniform"])
        history = tuple(Iteration(**one) for one in given["history"])
        return Optimised(**given | {"uniform": uniform, "history": history})

    @property
    def shielded(self) -> Shielded | None:
        """What is known of the shield; ``None`` for other queries than ``acontrol``."""
        text = self._raw.shielded_json()
        if text is None:
            return None
        given = json.loads(text)
        trial = given["trial"] and Estimate.from_object(given["trial"])
        return Shielded(**given | {"trial": trial})

    @property
    def machine(self) -> Machine | None:
        """The controller's strategy in a game with observations.

        ``None`` if no strategy was asked for or found.
        """
        from ntagen.checker.machine import Machine

        if self._raw.is_shield or self.strategy is not None:
            return None
        text = self.strategy_json()
        return None if text is None else Machine.from_json(text)

    def strategy_json(self) -> str | None:
        """The strategy, the shield, or the machine of a game with observations, as JSON text.

        A learned strategy has UPPAAL's form.

        ``None`` if none was asked for or found.
        """
        text = self._raw.strategy_json()
        return None if text is None else str(text)

    @property
    def is_shield(self) -> bool:
        """Whether there is a shield: one that was made or loaded."""
        return self._raw.is_shield

    def shield_code(self, language: Literal["c", "python"], name: str = "shield") -> str:
        """The shield as a function that depends on nothing; the file says how to call it.

        Args:
            language: The language: C99, or Python.
            name: What the names in C begin with.

        Raises:
            ValueError: There is no shield, or this is no name in C.
        """
        code = self._raw.shield_code(language, name) if name.isidentifier() else None
        if code is None or not name.isascii():
            raise ValueError(f"there is no shield, or {name!r} is no name in C")
        return code

    def decisions_of(
        self, process: str, variables: Sequence[str]
    ) -> Iterator[tuple[tuple[tuple[int, ...], ...], EngineEdge]]:
        """What a process does where the strategy lets it move: the first such move of each state.

        That is a small part of a large strategy; to which clock values it applies is left out.

        Args:
            process: The process.
            variables: Global integer variables, or arrays of integers.

        Yields:
            The values of each variable where it is decided (one, or all elements of an array), and
            the edge that the process takes.

        Raises:
            ValueError: There is no strategy, or no such process or variable.
        """
        decisions = self._raw.decisions_of(process, list(variables))
        if decisions is None:
            raise ValueError(f"there is no strategy with {process} and {', '.join(variables)}")
        for values, move in decisions:
            edges = step_of(self._edges, move).edges
            edge = next(one for one in edges if one.process == process)
            yield tuple(tuple(one) for one in values), edge

    def strategy_text(self) -> str | None:
        """The strategy as text in the form of TIGA; ``None`` if none was asked for or found."""
        text = self._raw.strategy_text()
        return None if text is None else str(text)

    def strategy_pieces(self, form: Literal["json", "text"]) -> Iterator[str]:
        """The text of `strategy_json` or `strategy_text` in pieces; none without a strategy.

        A large strategy is in memory once then, and not three times.
        """
        raw = self._raw
        text = raw.strategy_json() if form == "json" else raw.strategy_text()
        return iter(()) if text is None else _until_none(text.piece)

    def trajectories_json(self) -> Iterator[str]:
        """The runs of `trajectories` as JSON objects with ``run`` and ``points``."""
        return _until_none(self._raw.shown_run_json)

    def controller_c(self) -> str | None:
        """The strategy as a controller in C99; ``None`` if none was asked for or found.

        The file needs only two standard headers; the comment at its start says how to call it.

        Raises:
            RejectedError: The model has stopwatches.
        """
        with rejecting():
            return self._raw.controller_c()


def _until_none(part: Callable[[int], str | None]) -> Iterator[str]:
    """The parts with the numbers 0, 1 and so on, as long as there are some."""
    for number in count():
        text = part(number)
        if text is None:
            return
        yield text


class Interrupted(KeyboardInterrupt):
    """The user interrupted random runs; `answer` is that of the runs until then.

    Its verdict is ``unknown``, and `Answer.stop` is ``interrupted``. Whoever does not catch it sees
    what every interruption is, a `KeyboardInterrupt`::

        try:
            answer = model.check("Pr[<=1000](<> p)", epsilon=0.0001)
        except checker.Interrupted as interrupted:
            answer = interrupted.answer
    """

    def __init__(self, answer: Answer) -> None:
        super().__init__(f"{answer!r}")
        self.answer = answer
