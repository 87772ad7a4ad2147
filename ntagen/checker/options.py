"""The options of a query: every option with its meaning and its default, in one table.

`Model.check` takes them as keywords, `Model.answer` as one value. To add an option, add a field
here, a field to ``Options`` in ``checker/src/engine/options.rs``, and a row to
``checker/src/python/options.rs``; for the command line, a row to ``ntagen/cli/models/options.py``.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Concatenate, Literal, ParamSpec, TypeVar

from ntagen.checker.queries import Query
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker.strategy import ForcedRule, PriorityRule

SearchOrder = Literal["bfs", "dfs", "random"]
CodeEngine = Literal["jit", "interpreter"]
PlansWanted = Literal["none", "all"]
StrategyWanted = Literal["winner", "controller"]
TraceWanted = Literal["any", "shortest", "fastest"]
UnderChoice = Literal["race", "eager", "lazy"]
LearningMethod = Literal["auto", "q", "m"]
OutOfBounds = Literal["error", "safe", "unsafe", "sample"]
MeanInterval = Literal["auto", "student", "bernstein", "dkw"]

Progress = Callable[[int, int, int, int], object]
"""Is called with the numbers of explored, stored and waiting states, and of bytes."""

RunProgress = Callable[[int, float | None, float | None, float | None], object]
"""Is called with the number of random runs, their estimate, and the ends of its interval."""

RunSource = Callable[[int, int | None], bytes]
"""Is called with the number of a run, and how many runs are needed at most."""

MAX_PLANS = 1_000_000
"""The default maximum of plans that are listed."""

MAX_EFFORT = 1_000_000
MAX_SAMPLES = 1_000
"""The greatest effort of importance splitting: each part may keep a state."""

MAX_REPETITIONS = 1_000_000
"""The greatest number of repetitions of importance splitting."""

REDUCTIONS = ("symmetry", "partial-order", "live-variables")
"""The reductions that a search may make."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How a query is to be answered.

    Raises:
        ValueError: A number has no meaning: `threads` is negative, `max_plans` or `runs` less than
            1, a risk or a width not between 0 and 1, or a pair is in the wrong order.
    """

    search: SearchOrder = "bfs"
    """The order of the search; verdicts do not depend on it."""

    threads: int | Literal["all"] = 1
    """The number of threads; ``"all"`` (or 0) is one for each core.

    They share the breadth-first search for a reachable state (``E<>``, ``A[]``) or for values, the
    computation of winning states in games, and random runs, whose results do not depend on the
    number; other searches use one thread. The same number gives
    the same counts and traces. The verdict can depend on the number only if the model has a
    run-time error, because the search may or may not meet it before its goal. In games nothing
    depends on the number.
    """

    seed: int = 0
    """For ``search="random"`` and for statistical queries: the same seed gives the same search and
    the same runs. It is at least 0."""

    runs: int | None = None
    """How many random runs a statistical query makes, instead of the number that it says itself or
    that `epsilon` needs."""

    alpha: float = 0.05
    """The risk that the interval of a statistical query misses, or that ``Pr[…](…) >= p`` is
    rejected wrongly."""

    beta: float = 0.05
    """The risk that ``Pr[…](…) >= p`` is accepted wrongly."""

    epsilon: float = 0.05
    """A probability is estimated until both ends of its interval are so near to the estimate. ``E``
    without a number of runs makes as many runs as that takes for a probability of 1/2."""

    anytime: bool = False
    """Whether the intervals of ``Pr`` and ``E`` hold all together, after every run: then you may
    look at them whenever you want, and stop when you like what you see. They are wider."""

    relative: float | None = None
    """Runs are made until both ends of the interval are within this part of the estimate, instead
    of `epsilon`; for ``E`` at most as many runs as the query says. The interval is one that holds
    at any moment (see `anytime`). For a probability of 0 this never ends: `runs` or `timeout_s`
    must end it."""

    value_bounds: tuple[float, float] | None = None
    """Between which numbers the value of ``E`` lies in every run. With them the interval of a mean
    is right for any number of runs; a run with a value outside is an error. Without them the engine
    looks for bounds in the declared ranges of integers."""

    mean_interval: MeanInterval = "auto"
    """What makes the interval of ``E``. ``student`` is right in the limit of many runs only. The
    others need bounds of the value: ``bernstein`` is narrow where values vary little, ``dkw``
    (Dvoretzky, Kiefer and Wolfowitz) where there are few runs. ``auto`` is ``bernstein`` where
    bounds are known, and ``student`` where they are not."""

    levels: str | None = None
    """For ``Pr`` of a rare event, an expression that says how near a state is to it: the estimate
    is made by importance splitting. The greater the value, the more likely the event should be;
    what it says besides decides only how wide the interval is."""

    effort: int = 1000
    """How many parts of runs each stage between two levels has."""

    repetitions: int = 40
    """How many times the splitting is repeated; the interval comes from what differs. It is right
    in the limit of many."""

    delta: float | tuple[float, float] = 0.01
    """So near to ``p`` the test of ``Pr[…](…) >= p`` promises nothing: a number for both sides, or
    one for below and one for above."""

    odds_ratios: tuple[float, float] = (0.9, 1.1)
    """``Pr[…](…) >= Pr[…](…)`` promises nothing if the ratio of the odds lies between these."""

    discretisation: float | None = None
    """The step with which equations of clocks are solved, in units of the model, instead of steps
    that their errors choose."""

    under_choice: UnderChoice = "race"
    """When the controller moves in random runs under a strategy that lets it choose: its processes
    ``race`` for what the strategy allows, with waiting as one more choice where it allows that too,
    until it demands a move; or it moves as soon as it may (``eager``), or only when it must
    (``lazy``)."""

    learning_method: LearningMethod = "auto"
    """How ``minE``, ``maxE``, ``minPr`` and ``maxPr`` learn what actions are worth: by Q-learning
    (``q``), or from the finite process that all samples make (``m``); ``auto`` is ``m``. The
    options of learning have the names that UPPAAL gives them; ``None`` leaves a number to the
    engine."""

    good_runs: int | None = None
    """From how many random runs an iteration learns."""

    eval_runs: int | None = None
    """How many random runs judge the strategy of an iteration."""

    max_iterations: int | None = None
    """How many iterations there are at most, in total."""

    reset_no_better: int | None = None
    """After so many iterations without a better strategy, learning ends or begins anew; without a
    number after 5, but not before the 10th one in all."""

    max_reset_learning: int | None = None
    """How often learning begins anew, with all forgotten but the best strategy."""

    discount: float | None = None
    """What a cost counts a decision earlier, as a part of itself: more than 0, at most 1."""

    qlearning_alpha: float | None = None
    """In Q-learning, the n-th sample counts for 1 / min(`qlearning_alpha`, n + 1)."""

    out_of_bounds: OutOfBounds = "error"
    """What counts where a run leaves the grid of ``acontrol``: it is an ``error``, all is ``safe``
    there or ``unsafe``, or a ``sample`` outside decides."""

    shield_samples: int = 3
    """How many samples of a cell of ``acontrol`` there are along each axis of intervals."""

    shield_repeats: int = 1
    """How many random runs begin with each move in each sample."""

    guide: str | None = None
    """An integer expression: games explore first where its value is least."""

    forced: ForcedRule = "tiga"
    """When the environment must move at a moment at which time cannot pass: if the process that
    stops time has no controllable move (``tiga``), if no process has one (``product``), or always
    (``neutral``)."""

    priorities: PriorityRule = "ignore"
    """Whether priorities of channels and processes count in games and under strategies; in all
    other queries they do."""

    engine: CodeEngine = "jit"
    """How the code of the model runs; answers do not depend on it."""

    states: int | None = None
    """The search stops after this many stored states."""

    memory_bytes: int | None = None
    """The search stops when its states take this many bytes."""

    spill: Path | None = None
    """A folder on a disk: states that have no room in memory go there, in ``E<>``, ``A[]``,
    ``E[]``, ``A<>``, ``-->``, ``sup``, ``inf`` and ``bounds``, and the folder is as it was when the
    search ends. They stay in `memory_bytes` of memory or, without it, in half of what is free. The
    tables by which states are found stay in memory, too. What a process that was killed has left
    in the folder is removed."""

    timeout_s: float | None = None
    """The search stops after this time, in seconds."""

    plans: PlansWanted = "none"
    """Which winning sequences to list."""

    max_plans: int = MAX_PLANS
    """At most this many plans are listed; with 1 the search stops at the first."""

    strategy: bool = False
    """Whether to make the strategy of the player who wins."""

    wanted_strategy: StrategyWanted = "winner"
    """Whose strategy is made: with ``"controller"`` none is made where it loses, which takes less
    time and memory. With `verify` it is the winner's in any case."""

    verify: bool = False
    """Whether to check the strategy against every move of the opponent."""

    trace: bool = True
    """Whether witnesses and counterexamples get exact times, which an independent replay checks.

    For ``sup``, ``inf`` and ``bounds`` this takes a second search.
    """

    wanted_trace: TraceWanted = "any"
    """``shortest``: traces have the fewest transitions; if a run never ends, its loop counts once.
    ``fastest``: traces take the least time; not for ``E[]``, ``A<>`` and ``-->``, whose runs do not
    end. Both take a second search."""

    certificate: bool = False
    """Whether to keep the set of reached states if ``E<>`` is not satisfied or ``A[]`` is.

    This takes a second search, in which states are different if they differ only in ``meta``
    variables.
    """

    reductions: str = "all"
    """Which reductions the search may make: ``all``, ``none``, or some of `REDUCTIONS` with commas
    between them. Verdicts, values and traces do not depend on them; counts do.

    ``symmetry``: ``E<>``, ``A[]``, ``sup``, ``inf`` and ``bounds`` treat states as one if they
    differ only by exchanged members of scalar sets. ``partial-order``: ``E<>`` and ``A[]`` take
    independent moves in one order only while time cannot pass. ``live-variables``: ``E<>``,
    ``A[]``, ``sup``, ``inf`` and ``bounds``, and games if neither a strategy nor plans are asked
    for, treat states as one if they differ only in variables that are written before they are read
    again.
    """

    without: Sequence[str] = ()
    """Heuristics of `HEURISTICS` that are not used; verdicts and values do not depend on them, time
    and counts do."""

    folder: Path | None = None
    """The folder of the files of ``saveStrategy`` and ``loadStrategy``; by default the folder of
    the model."""

    allow_write: Sequence[str | Path] = ()
    """Folders below which ``saveStrategy`` may write, besides the current one. It replaces no files
    but strategies."""

    progress: Progress | None = None
    """Is called about twenty times per second with the numbers of explored, stored and waiting
    states and of bytes."""

    run_progress: RunProgress | None = None
    """Is called about ten times per second while a statistical query makes random runs, with their
    number, the estimate so far and the ends of its interval; each is ``None`` as long as it is not
    known. The interval is that of as many runs, and was not chosen to be looked at before. What it
    raises ends the runs as Ctrl-C does."""

    run_source: RunSource | None = None
    """Gives the results of the random runs of ``Pr`` and ``E``, which are then made elsewhere.

    It is called with the number of the next run and, if that is known, how many are needed at most;
    it returns what `Model.block_of_runs` gives for some runs from this one on, or ``b""`` if
    nothing is there yet. `ntagen.cluster.runs.DaskRuns` makes them by a cluster.
    """

    def __post_init__(self) -> None:
        if self.threads != "all" and self.threads < 0:
            raise ValueError(f"{self.threads} threads: there must be at least 1, or 'all'")
        if self.max_plans < 1:
            raise ValueError(f"max_plans is {self.max_plans}, but must be at least 1")
        self._require_statistics()

    def _require_statistics(self) -> None:
        """Raises an error if an option of statistical queries has no meaning."""
        if self.runs is not None and self.runs < 1:
            raise ValueError(f"{self.runs} runs: there must be at least 1")
        for name in ("alpha", "beta", "epsilon", "relative"):
            value = getattr(self, name)
            if value is not None and not 0 < value < 1:
                raise ValueError(f"{name} is {value}, but must lie between 0 and 1")
        deltas = self.delta if isinstance(self.delta, tuple) else (self.delta,)
        if not all(0 < delta < 1 for delta in deltas):
            raise ValueError(f"delta is {self.delta}, but must lie between 0 and 1")
        low, high = self.odds_ratios
        if not 0 < low < 1 < high < math.inf:
            raise ValueError(f"odds_ratios are {low} and {high}, but 1 must lie between them")
        if not 0 < self.effort <= MAX_EFFORT:
            raise ValueError(f"effort is {self.effort}, but must be 1 to {MAX_EFFORT}")
        if not 2 <= self.repetitions <= MAX_REPETITIONS:
            raise ValueError(
                f"repetitions is {self.repetitions}, but must be 2 to {MAX_REPETITIONS}"
            )
        if self.value_bounds is not None:
            least, greatest = self.value_bounds
            if not -math.inf < least < greatest < math.inf:
                raise ValueError(f"value_bounds are {least} and {greatest}: the first must be less")
        self._require_learning()
        if self.discretisation is not None and not 0 < self.discretisation < math.inf:
            raise ValueError(f"discretisation is {self.discretisation}, but must be positive")

    def _require_learning(self) -> None:
        """Raises an error if an option of learning or of shields has no meaning."""
        least = {"good_runs": 1, "eval_runs": 1, "max_iterations": 1, "reset_no_better": 1}
        for name in ("shield_samples", "shield_repeats"):
            if not 0 < (number := getattr(self, name)) <= MAX_SAMPLES:
                raise ValueError(f"{name} is {number}, but must be 1 to {MAX_SAMPLES:,}")
        for name, number in (least | {"max_reset_learning": 0}).items():
            value = getattr(self, name)
            if value is not None and value < number:
                raise ValueError(f"{name} is {value}, but must be at least {number}")
        if self.discount is not None and not 0 < self.discount <= 1:
            raise ValueError(f"discount is {self.discount}, but must lie between 0 and 1")
        if self.qlearning_alpha is not None and not 1 <= self.qlearning_alpha < math.inf:
            raise ValueError(f"qlearning_alpha is {self.qlearning_alpha}, but must be at least 1")


Keywords = ParamSpec("Keywords")
Asked = TypeVar("Asked")
Result = TypeVar("Result")


def by_keywords(
    options: Callable[Keywords, Options],
) -> Callable[
    [Callable[[Asked, str, Options], Result]],
    Callable[Concatenate[Asked, str | Query, Keywords], Result],
]:
    """Lets a method about a query take the fields of its options as keywords.

    The query may also be one of a file.

    Args:
        options: `Options`, whose fields become the keywords.
    """

    def decorate(
        method: Callable[[Asked, str, Options], Result],
    ) -> Callable[Concatenate[Asked, str | Query, Keywords], Result]:
        @functools.wraps(method)
        def with_keywords(
            asked: Asked, query: str | Query, /, *args: Keywords.args, **keywords: Keywords.kwargs
        ) -> Result:
            return method(asked, str(query), options(*args, **keywords))

        first = list(inspect.signature(method).parameters.values())[:2]
        fields = inspect.signature(options).parameters.values()
        shown = inspect.Signature([*first, *fields])
        # What `help` shows.
        with_keywords.__dict__["__signature__"] = shown
        return with_keywords

    return decorate
