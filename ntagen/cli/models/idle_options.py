"""Which options of `ntagen check` have no effect, and which outputs were not written."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.cli.models.options import OPTIONS, STATISTICAL

if TYPE_CHECKING:
    from ntagen.checker import QueryForm

_SYMBOLIC_ONLY: Final = {
    "search": "--search has no effect here: games are explored in an order of their own",
    "wanted_trace": "--set 'trace …' has no effect here: it chooses among the runs of symbolic "
    "queries",
}
"""For each parameter, the note if all queries are games."""

_GAMES_ONLY: Final = {
    "guide": "--set 'guide …' has no effect here: it guides games, and no query is a game",
    "forced": "--forced has no effect here: it is a rule of games, and no query is a game",
    "priorities": "--set 'priorities …' has no effect here: only games and queries under a "
    "strategy may ignore priorities; in other queries they always count",
}
"""For each parameter, the note if no query is a game or under a strategy."""

_NOTHING_WRITTEN: Final = {
    "--trace": "no answer has a trace",
    "--certificate": "only an E<> that is not satisfied and an A[] that is satisfied have a "
    "certificate",
    "--strategy": "no answer has a strategy; only control queries can have one",
    "--plans": "plans are listed for control: A<> and A[ U ] without `under`, if the environment "
    "has no choices",
}
"""For each option, why there may be nothing to write."""


def idle_options(
    given: Collection[str],
    values: Mapping[str, object],
    queries: Sequence[QueryForm],
    *,
    ranks: bool,
) -> list[str]:
    """A note for each option on the command line that has no effect.

    Args:
        given: The names of the parameters that stand on the command line.
        values: All parameters by name.
        queries: What the queries ask for that are answered; those that are wrong are left out.
        ranks: Whether plans are ranked, as those of environments are.
    """
    if not queries:
        return []
    notes = []
    if all(query.kind in ("control", "control_t*") for query in queries):
        notes += [note for name, note in _SYMBOLIC_ONLY.items() if name in given]
    elif "wanted_trace" in given and not (values["trace"] or values["verify"]):
        notes.append("--set 'trace …' has no effect without --trace")
    if not any(query.is_game or query.uses for query in queries):
        notes += [note for name, note in _GAMES_ONLY.items() if name in given]
    if "threads" in given and not any(_takes_threads(query, values) for query in queries):
        notes.append(
            "--threads has no effect here: games under partial observation use one thread, and so "
            "do E[], A<> and -->, and searches that are not breadth first"
        )
    keeps_values = any(values[name] for name in ("strategy", "plans", "verify"))
    if "reductions" in given and keeps_values and all(query.is_game for query in queries):
        notes.append(
            "--reductions has no effect here: of the reductions games make live-variables only, "
            "and strategies and plans are about states with all their values"
        )
    notes += _of_statistics(given, values, queries)
    if "allow_write" in given and not any(query.kind == "saveStrategy" for query in queries):
        notes.append("--allow-write has no effect here: no query saves a strategy")
    for name in ("max_plans", "ranking"):
        if name in given and not values["plans"]:
            notes.append(f"{_spelled(name)} has no effect without --plans")
    if "ranking" in given and values["plans"] and not ranks:
        notes.append("--set 'ranking …' has no effect here: only plans of environments are ranked")
    return notes


def _of_statistics(
    given: Collection[str], values: Mapping[str, object], queries: Sequence[QueryForm]
) -> list[str]:
    """A note for each option of statistical queries, if no query takes it."""
    if any(query.is_statistical for query in queries):
        notes = [
            f"{_spelled(name)} has no effect without --set 'levels …'"
            for name in ("effort", "repetitions")
            if name in given and "levels" not in given
        ]
    else:
        notes = [
            f"{_spelled(name)} has no effect here: no query is a statistical one"
            for name in STATISTICAL
            if name in given
        ]
        if "seed" in given and values["search"] != "random":
            notes.append("--seed has no effect without --search random or a statistical query")
    if "under_choice" in given and not any(one.is_statistical and one.uses for one in queries):
        notes.append(
            "--set 'under choice …' has no effect here: no statistical query is under a strategy"
        )
    return notes


def _takes_threads(query: QueryForm, values: Mapping[str, object]) -> bool:
    """Whether more than one thread can share the work of a query."""
    if query.is_game:
        return not query.is_observed
    if query.is_statistical:
        return True
    return values["search"] == "bfs" and query.kind not in ("E[]", "A<>", "-->")


def _spelled(name: str) -> str:
    """An option or a setting of this name, as it stands on the command line."""
    return f"--{name}" if name in OPTIONS else f"--set '{name.replace('_', ' ')} …'"


def unwritten(wanted: Mapping[str, str | Path | None], written: Collection[str]) -> list[str]:
    """A note for each output that was asked for but that no answer gave.

    Args:
        wanted: Where the output of each option should be written.
        written: The options whose output was written.
    """
    notes = []
    for option, target in wanted.items():
        if target is None or option in written:
            continue
        old = "" if str(target) == "-" or not Path(target).exists() else f", {target} is unchanged"
        notes.append(f"{option}: nothing was written{old}: {_NOTHING_WRITTEN[option]}")
    return notes
