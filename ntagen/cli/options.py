"""The options of `ntagen check` that go to the engine as they are: a row for each."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

import click

from ntagen.cli.limits import LIMITS
from ntagen.cli.rules import Decorator, forced_rule, priority_rule
from ntagen.cli.statistical_options import STATISTICAL


class _Threads(click.ParamType[int]):
    """A number of threads; ``all`` is 0, one for each core."""

    name = "threads"
    most = 2048

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> int:
        text = str(value).strip().lower()
        if text == "all":
            return 0
        if not re.fullmatch(r"[0-9]{1,6}", text) or int(text) > self.most:
            self.fail(
                f"{value!r} is not a number of threads; write 1 to {self.most}, or all", param, ctx
            )
        return int(text)


class _Heuristics(click.ParamType[tuple[str, ...]]):
    """Names of heuristics, separated by commas."""

    name = "heuristics"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, ...]:
        from ntagen import checker

        names = tuple(name.strip() for name in str(value).split(",") if name.strip())
        for name in names:
            if name not in checker.HEURISTICS:
                known = "".join(f"\n  {one}: {does}" for one, does in checker.HEURISTICS.items())
                self.fail(f"{name!r} is not a heuristic. The heuristics are:{known}", param, ctx)
        return names


class _Reductions(click.ParamType[str]):
    """Which reductions a search may make: ``all``, ``none``, or names with commas between them."""

    name = "reductions"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        from ntagen.checker import REDUCTIONS

        names = [name.strip() for name in str(value).split(",")]
        for name in names if names not in (["all"], ["none"]) else ():
            if name not in REDUCTIONS:
                known = f"{', '.join(REDUCTIONS[:-1])} and {REDUCTIONS[-1]}"
                self.fail(
                    f"{name!r} is not a reduction. Write all, none, or some of {known} with commas "
                    "between them",
                    param,
                    ctx,
                )
        return ",".join(names)


_OPTIONS: Final[dict[str, Decorator]] = {
    "verify": click.option(
        "--verify",
        is_flag=True,
        help="Check each strategy against every move of the opponent, and replay each trace with "
        "its exact times. The check does not use the solver's code.",
    ),
    "max_plans": click.option(
        "--max-plans",
        metavar="N",
        type=click.IntRange(min=1),
        default=1_000_000,
        show_default=True,
        help="Write at most N plans. With 1, the search stops at the first plan. With --plans "
        "FILE.jsonl, all are written unless you give this option.",
    ),
    "search": click.option(
        "--search",
        type=click.Choice(["bfs", "dfs", "random"]),
        default="bfs",
        help="The order of the search: breadth first, depth first or random. Verdicts do not "
        "depend on it.  [default: bfs]",
    ),
    "guide": click.option(
        "--guide",
        metavar="EXPR",
        help="An integer expression of the model, for example a function that says how far a state "
        "is from the goal: games explore first where it is least. Verdicts do not depend on it.",
    ),
    "threads": click.option(
        "--threads",
        metavar="N",
        type=_Threads(),
        default="1",
        help="The number of threads, or `all` for one per core. Threads share the breadth-first "
        "search of E<>, A[], sup, inf and bounds, the computation with zones in games, and the "
        "random runs of Pr and E. Liveness, partial observation, --shortest, --fastest and "
        "--certificate use one thread.  "
        "[default: 1]",
    ),
    "seed": click.option(
        "--seed",
        type=click.IntRange(min=0),
        default=0,
        help="For --search random and statistical queries: the same seed gives the same search and "
        "the same runs.  [default: 0]",
    ),
    **STATISTICAL,
    "under_choice": click.option(
        "--under-choice",
        type=click.Choice(["race", "eager", "lazy"]),
        default="race",
        help="For Pr, E and simulate under a strategy that lets the controller choose: its "
        "processes draw delays as without the strategy and may then wait on, until it demands a "
        "move (race), or the controller moves as soon as it may (eager), or only when it must "
        "(lazy).  [default: race]",
    ),
    "reductions": click.option(
        "--reductions",
        metavar="all|none|LIST",
        type=_Reductions(),
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
    "without": click.option(
        "--without",
        metavar="NAME[,NAME…]",
        type=_Heuristics(),
        default="",
        help="For experiments: switch these heuristics of the engine off. Verdicts do not depend "
        "on them; time and counts do. A wrong name lists all names.",
    ),
    "forced": forced_rule(),
    "priorities": priority_rule(
        "Whether priorities of channels and processes count in games and in queries under a "
        "strategy. In all other queries they count.  [default: ignore, as TIGA does]"
    ),
    "engine": click.option(
        "--engine",
        type=click.Choice(["jit", "interpreter"]),
        default="jit",
        help="How the code of the model runs: compiled to machine code (jit), or interpreted, "
        "which is slower. Answers do not depend on it.  [default: jit]",
    ),
    **LIMITS,
    "allow_write": click.option(
        "--allow-write",
        metavar="DIR",
        multiple=True,
        type=click.Path(path_type=Path),
        help="Allow saveStrategy in queries to write below this folder too, not only below the "
        "current one. You can give this option several times. saveStrategy replaces no files but "
        "strategies.",
    ),
}
"""The options on the command line, by their fields of `ntagen.checker.Options`."""

PICTURED: Final[dict[str, Decorator]] = {
    name: _OPTIONS[name] for name in ("runs", "alpha", "epsilon", "seed", "threads")
}
"""Those of random runs that a picture depends on, or that make it faster."""


def engine_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Adds these options; the command gets their values as `given`, by the names of the fields."""

    @functools.wraps(command)
    def with_given(**values: object) -> int | None:
        given = {name: values.pop(name) for name in _OPTIONS}
        return command(given=given, **values)

    decorated: Callable[..., int | None] = with_given
    for option in reversed(_OPTIONS.values()):
        decorated = option(decorated)
    return decorated
