"""The options and settings of `ntagen check` that go to the engine as they are: a row for each."""

from __future__ import annotations

import math
import re
from typing import Final

import click

from ntagen.cli.options import LIMITS, Decorator, forced_rule, gathered, path_option
from ntagen.cli.quantities import number, pair
from ntagen.cli.settings import Setting

_MOST_THREADS: Final = 2048


def _threads(value: object) -> int:
    """A number of threads; ``all`` is 0, one for each core."""
    text = str(value).strip().lower()
    if text == "all":
        return 0
    if not re.fullmatch(r"[0-9]{1,6}", text) or int(text) > _MOST_THREADS:
        raise click.BadParameter(
            f"{value!r} is not a number of threads; write 1 to {_MOST_THREADS}, or all"
        )
    return int(text)


def _heuristics(value: object) -> tuple[str, ...]:
    """Names of heuristics, separated by commas."""
    from ntagen.checker import HEURISTICS

    names = tuple(name.strip() for name in str(value).split(",") if name.strip())
    for name in names:
        if name not in HEURISTICS:
            known = "".join(f"\n  {one}: {does}" for one, does in HEURISTICS.items())
            raise click.BadParameter(f"{name!r} is not a heuristic. The heuristics are:{known}")
    return names


def _reductions(value: object) -> str:
    """Which reductions a search may make: ``all``, ``none``, or names with commas between them."""
    from ntagen.checker import REDUCTIONS

    names = [name.strip() for name in str(value).split(",")]
    for name in names if names not in (["all"], ["none"]) else ():
        if name not in REDUCTIONS:
            known = f"{', '.join(REDUCTIONS[:-1])} and {REDUCTIONS[-1]}"
            raise click.BadParameter(
                f"{name!r} is not a reduction. Write all, none, or some of {known} with commas "
                "between them"
            )
    return ",".join(names)


LEARNING_METHODS: Final = {"q": "q", "4": "q", "m": "m", "5": "m", "auto": "auto"}
"""The methods of learning by their names and by UPPAAL's numbers."""


def _learning_method(value: object) -> str:
    """A method of learning, by its name or UPPAAL's number."""
    method = LEARNING_METHODS.get(str(value).strip().lower())
    if method is None:
        raise click.BadParameter(f"{value!r} is not a method of learning; write q (4) or m (5)")
    return method


OUT_OF_BOUNDS: Final = ("error", "safe", "unsafe", "sample")
"""What may count outside the grid of a shield, in the order of UPPAAL's numbers."""


def _out_of_bounds(value: object) -> str:
    """What counts outside the grid of a shield, by its name or UPPAAL's number."""
    text = str(value).strip().lower()
    names = dict(zip("0123", OUT_OF_BOUNDS, strict=True)) | {one: one for one in OUT_OF_BOUNDS}
    if text not in names:
        raise click.BadParameter(f"{value!r} is none of error, safe, unsafe and sample")
    return names[text]


_SHARE: Final = number(0, 1)

RUNS: Final = (
    Setting(
        "runs N",
        click.IntRange(min=1),
        "For Pr and E: make N random runs.  [default: as many as the query says, or as epsilon "
        "needs]",
    ),
    Setting(
        "alpha RISK",
        _SHARE,
        "For Pr and E: the risk that the interval misses, or that Pr >= p is rejected wrongly.  "
        "[default: 0.05]",
    ),
    Setting(
        "epsilon WIDTH",
        _SHARE,
        "For Pr: make runs until both ends of the interval are so near to the estimate. E without "
        "a number of runs makes as many as a probability of 1/2 takes then.  "
        "[default: 0.05]",
    ),
    Setting(
        "seed N",
        click.IntRange(min=0),
        "For a random search and for statistical queries: the same seed gives the same search and "
        "the same runs.  [default: 0]",
    ),
    Setting(
        "threads N",
        _threads,
        "The number of threads, or `all` for one per core. Threads share the breadth-first search "
        "of E<>, A[], sup, inf and bounds, the computation with zones in games, and the random "
        "runs of Pr and E. Liveness, partial observation, shortest and fastest traces and "
        "certificates use one thread.  [default: 1]",
    ),
)
"""What random runs depend on, or what makes them faster: options here, settings of pictures."""

_DISCRETISATION: Final = Setting(
    "discretisation STEP",
    number(0, math.inf),
    "Solve equations of clocks in steps of this length.  [default: as their errors need]",
)

STATISTICAL_SETTINGS: Final = (
    Setting(
        "beta RISK",
        _SHARE,
        "For Pr >= p: the risk that it is accepted wrongly.  [default: 0.05]",
    ),
    Setting(
        "anytime on|off",
        click.BOOL,
        "For Pr and E: intervals that hold after every run, all together, so that you may look and "
        "stop when you want. They are wider. For E, bounds of the value must be known.  "
        "[default: off]",
    ),
    Setting(
        "relative PART",
        _SHARE,
        "For Pr and E: make runs until both ends of the interval are within this part of the "
        "estimate. The interval is an anytime one. It never ends for a probability of 0: bound it "
        "by --runs or --timeout.",
    ),
    Setting(
        "value bounds LOW,HIGH",
        pair(-math.inf, math.inf),
        "For E: in every run the value lies between these; then the interval is right for any "
        "number of runs.  [default: what the ranges of integers in the query say]",
    ),
    Setting(
        "mean interval student|bernstein|dkw",
        click.Choice(["auto", "student", "bernstein", "dkw"]),
        "What makes the interval of E: Student's distribution, which is right in the limit of many "
        "runs only; empirical Bernstein intervals, or the band of Dvoretzky, Kiefer and Wolfowitz, "
        "for values between known bounds.  [default: bernstein if bounds are known, else student]",
    ),
    Setting(
        "levels EXPR",
        click.STRING,
        "For Pr of a rare event: an expression that says how near a state is to it, such as the "
        "length of a queue that must not overflow. The estimate is made by importance splitting: "
        "runs are started again where others came nearer.",
    ),
    Setting(
        "effort N",
        click.IntRange(min=1, max=1_000_000),
        "With levels: make N parts of runs between two levels.  [default: 1000]",
    ),
    Setting(
        "repetitions N",
        click.IntRange(min=2, max=1_000_000),
        "With levels: make the interval of N independent repetitions.  [default: 40]",
    ),
    Setting(
        "delta WIDTH[,WIDTH]",
        pair(0, 1, one_is_enough=True),
        "For Pr >= p: so near to p nothing is promised; one number for both sides, or one for "
        "below and one for above.  [default: 0.01]",
    ),
    Setting(
        "odds ratios LOW,HIGH",
        pair(0, math.inf),
        "For Pr >= Pr: if the ratio of the odds lies between these, nothing is promised.  "
        "[default: 0.9,1.1]",
    ),
    Setting(
        "joint on|off",
        click.BOOL,
        "Answer all Pr and E queries so that all their intervals hold together, with the risk of "
        "--alpha for all of them. Queries with the same bound share their runs.  [default: off]",
    ),
    Setting(
        "dask ADDRESS",
        click.STRING,
        "For Pr and E: use the workers of the Dask scheduler at this address, as tcp://host:8786. "
        "They must have the same ntagen. Answers are the same as without them. Joint runs, those "
        "with levels, those of simulate, those to learn from and those under a learned strategy, "
        "a shield or a policy are made by this machine.",
    ),
)

LEARNING_SETTINGS: Final = (
    Setting(
        "good-runs N",
        click.IntRange(min=1),
        "For minE and its kin: an iteration learns from N random runs.  "
        "[default: as the length of runs needs]",
        "good_runs",
    ),
    Setting(
        "eval-runs N",
        click.IntRange(min=1),
        "For minE and its kin: N random runs judge the strategy of an iteration.  "
        "[default: as the length of runs needs]",
        "eval_runs",
    ),
    Setting(
        "max-iterations N",
        click.IntRange(min=1),
        "For minE and its kin: the most iterations, in total.  [default: 30]",
        "max_iterations",
    ),
    Setting(
        "reset-no-better N",
        click.IntRange(min=1),
        "For minE and its kin: after N iterations without a better strategy, learning ends or "
        "begins anew.  [default: 5, but at least 10 in all]",
        "reset_no_better",
    ),
    Setting(
        "max-reset-learning N",
        click.IntRange(min=0),
        "For minE and its kin: how often learning begins anew.  [default: 0]",
        "max_reset_learning",
    ),
    Setting(
        "discount PART",
        click.FloatRange(0, 1, min_open=True),
        "For minE and its kin: what a cost counts a decision earlier.  [default: 1]",
    ),
    Setting(
        "qlearning-alpha N",
        click.FloatRange(1, 1e18),
        "For --learning-method q: the n-th sample counts for 1 / min(N, n + 1).  [default: 1000]",
        "qlearning_alpha",
    ),
)
"""What ``--set`` takes for queries for the best strategy; the names are those of UPPAAL."""

SHIELD_SETTINGS: Final = (
    Setting(
        "shield samples N",
        click.IntRange(1, 1_000),
        "For acontrol: a cell has N samples along each axis of intervals.  [default: 3]",
    ),
    Setting(
        "shield repeats N",
        click.IntRange(1, 1_000),
        "For acontrol: N random runs begin with each move in each sample; one is enough where "
        "nothing is drawn at random.  [default: 1]",
    ),
)
"""What ``--set`` takes for queries for shields."""

SHIELD: Final = ("out_of_bounds", *(one.field for one in SHIELD_SETTINGS))
"""The names of options and settings that count for queries for shields only."""

LEARNING: Final = ("learning_method", *(one.field for one in LEARNING_SETTINGS))
"""The names of options and settings that count for queries for the best strategy only."""

STATISTICAL: Final = (
    *(one.field for one in STATISTICAL_SETTINGS),
    *("runs", "alpha", "epsilon", "discretisation"),
)
"""The names of options and settings that count for statistical queries only."""

SETTINGS: Final = (
    *STATISTICAL_SETTINGS,
    *LEARNING_SETTINGS,
    *SHIELD_SETTINGS,
    Setting(
        "under choice race|eager|lazy",
        click.Choice(["race", "eager", "lazy"]),
        "For Pr, E and simulate under a strategy that lets the controller choose: its processes "
        "draw delays as without the strategy and may then wait on, until it demands a move (race), "
        "or the controller moves as soon as it may (eager), or only when it must (lazy).  "
        "[default: race]",
    ),
    Setting(
        "trace shortest|fastest",
        click.Choice(["any", "shortest", "fastest"]),
        "With --trace: write the trace with the fewest transitions (if a run never ends, its loop "
        "counts once), or the one that takes the least time (not for E[], A<> and -->, whose runs "
        "do not end).",
        "wanted_trace",
    ),
    Setting(
        "max plans N",
        click.IntRange(min=1),
        "With --plans: write at most N plans. With 1, the search stops at the first plan.  "
        "[default: 1000000; no limit for a FILE.jsonl]",
    ),
    Setting(
        "ranking CRITERION,…",
        click.STRING,
        "With --plans of an environment: how they are ranked, the most important criterion first: "
        "clearance, reserve, rolls, length, target.  "
        "[default: as drive { … } says, else clearance,rolls,length]",
    ),
    Setting(
        "guide EXPR",
        click.STRING,
        "An integer expression of the model, for example a function that says how far a state is "
        "from the goal: games explore first where it is least. Verdicts do not depend on it.",
    ),
    Setting(
        "priorities ignore|keep",
        click.Choice(["ignore", "keep"]),
        "Whether priorities of channels and processes count in games and in queries under a "
        "strategy. In all other queries they count.  [default: ignore, as TIGA does]",
    ),
    Setting(
        "without NAME,…",
        _heuristics,
        "For experiments: switch these heuristics of the engine off. Verdicts do not depend on "
        "them; time and counts do. A wrong name lists all names.",
    ),
)
"""What ``--set`` takes: fields of `ntagen.checker.Options`, and `joint`, `dask` and `ranking`."""

OPTIONS: Final[dict[str, Decorator]] = {
    "verify": click.option(
        "--verify",
        is_flag=True,
        help="Check each strategy against every move of the opponent, and replay each trace with "
        "its exact times. The check does not use the solver's code.",
    ),
    "search": click.option(
        "--search",
        type=click.Choice(["bfs", "dfs", "random"]),
        default="bfs",
        help="The order of the search: breadth first, depth first or random. Verdicts do not "
        "depend on it.  [default: bfs]",
    ),
    **{one.field: one.option() for one in RUNS},
    "discretisation": _DISCRETISATION.option(),
    "learning_method": click.option(
        "--learning-method",
        metavar="q|m",
        type=_learning_method,
        default="auto",
        help="How minE, maxE, minPr and maxPr learn what actions are worth: by Q-learning (q, or 4 "
        "as in UPPAAL), or from the finite process that all samples make (m, or 5).  [default: m]",
    ),
    "out_of_bounds": click.option(
        "--out-of-bounds",
        metavar="error|safe|unsafe|sample",
        type=_out_of_bounds,
        default="error",
        help="What counts where a run leaves the grid of acontrol: it is an error, all is safe "
        "there, nothing is, or samples outside decide (0, 1, 2, 3 as in UPPAAL).  "
        "[default: error]",
    ),
    "reductions": click.option(
        "--reductions",
        metavar="all|none|LIST",
        type=_reductions,
        default="all",
        help="Which reductions a search may make: all, none, or a LIST with commas between them. "
        "symmetry: treat states as one if they differ only by exchanged members of scalar sets, "
        "and the model cannot tell these apart (for E<>, A[], sup, inf and bounds). "
        "partial-order: while time cannot pass, take independent moves in one order only (for E<> "
        "and A[]). live-variables: treat states as one if they differ only in variables that are "
        "written before they are read again (for E<>, A[], sup, inf and bounds, and for games if "
        "neither a strategy nor plans are asked for). Verdicts do not depend on reductions.  "
        "[default: all]",
    ),
    "forced": forced_rule(),
    "engine": click.option(
        "--engine",
        type=click.Choice(["jit", "interpreter"]),
        default="jit",
        help="How the code of the model runs: compiled to machine code (jit), or interpreted, "
        "which is slower. Answers do not depend on it.  [default: jit]",
    ),
    **LIMITS,
    "spill": path_option(
        "--spill",
        metavar="DIR",
        help="Keep states that have no room in memory in files in this folder, which is made if it "
        "is missing: in as much memory as --memory says, else in half of what is free. For E<>, "
        "A[], E[], A<>, -->, sup, inf and bounds. The files go when the search ends; what a killed "
        "run has left there is removed.",
    ),
    "allow_write": path_option(
        "--allow-write",
        metavar="DIR",
        multiple=True,
        help="Allow saveStrategy in queries to write below this folder too, not only below the "
        "current one. You can give this option several times. saveStrategy replaces no files but "
        "strategies.",
    ),
}
"""The options on the command line, by their fields of `ntagen.checker.Options`."""


engine_options: Final = gathered("given", OPTIONS, dict)
"""Adds these options; the command gets their values as `given`, by the names of the fields."""
