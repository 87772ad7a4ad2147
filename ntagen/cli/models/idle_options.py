"""Which options of `ntagen check` have no effect, and which outputs were not written."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.cli.models.options import LEARNING, OPTIONS, SETTINGS, SHIELD, STATISTICAL

if TYPE_CHECKING:
    from ntagen.checker import QueryForm

_NOTHING_WRITTEN: Final = {
    "--trace": "no answer has a trace",
    "--certificate": "only an E<> that is not satisfied and an A[] that is satisfied have a "
    "certificate",
    "--strategy": "no answer has a strategy; only control queries, minE, maxE, minPr and maxPr, "
    "and acontrol can have one",
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
    notes: list[str] = []

    def idle(name: str, is_idle: bool, why: str) -> None:
        if is_idle and name in given:
            notes.append(f"{_spelled(name)} has no effect {why}")

    is_symbolic = not all(query.kind in ("control", "control_t*") for query in queries)
    has_rules = any(query.is_game or query.uses for query in queries)
    keeps_values = any(values[name] for name in ("strategy", "plans", "verify"))
    idle("search", not is_symbolic, "here: games are explored in an order of their own")
    idle("wanted_trace", not is_symbolic, "here: it chooses among the runs of symbolic queries")
    has_trace = values["trace"] or values["verify"]
    idle("wanted_trace", is_symbolic and not has_trace, "without --trace")
    idle("guide", not has_rules, "here: it guides games, and no query is a game")
    idle("forced", not has_rules, "here: it is a rule of games, and no query is a game")
    idle(
        "priorities",
        not has_rules,
        "here: only games and queries under a strategy may ignore priorities; in other queries "
        "they always count",
    )
    idle(
        "threads",
        not any(_takes_threads(query, values) for query in queries),
        "here: games under partial observation use one thread, and so do E[], A<> and -->, and "
        "searches that are not breadth first",
    )
    idle(
        "reductions",
        keeps_values and all(query.is_game for query in queries),
        "here: of the reductions games make live-variables only, and strategies and plans are "
        "about states with all their values",
    )
    spills = any(_is_plain_search(query) for query in queries)
    idle("spill", not spills, "here: games and random runs keep everything in memory")
    _find_idle_statistics(idle, given, values, queries)
    saves = any(query.kind == "saveStrategy" for query in queries)
    idle("allow_write", not saves, "here: no query saves a strategy")
    idle("max_plans", not values["plans"], "without --plans")
    idle("ranking", not values["plans"], "without --plans")
    is_ranked = ranks or not values["plans"]
    idle("ranking", not is_ranked, "here: only plans of environments are ranked")
    return notes


def _find_idle_statistics(
    idle: Callable[[str, bool, str], None],
    given: Collection[str],
    values: Mapping[str, object],
    queries: Sequence[QueryForm],
) -> None:
    """Tells the options of statistical queries that no query takes."""
    is_learned = any(query.is_learned for query in queries)
    for name in LEARNING:
        idle(name, not is_learned, "here: no query is for the best strategy")
    idle(
        "qlearning_alpha",
        is_learned and values["learning_method"] != "q",
        "without --learning-method q",
    )
    has_runs = is_learned or any(query.is_statistical for query in queries)
    for name in ("effort", "repetitions"):
        idle(name, has_runs and "levels" not in given, "without --set 'levels …'")
    is_shielded = any(query.is_shield for query in queries)
    for name in SHIELD:
        idle(name, not is_shielded, "here: no query is for a shield")
    for name in STATISTICAL:
        is_taken = has_runs or (is_shielded and name in ("alpha", "discretisation"))
        idle(name, not is_taken, "here: no query is a statistical one")
    has_runs |= is_shielded
    is_fixed = not has_runs and values["search"] != "random"
    idle("seed", is_fixed, "without --search random or a statistical query")
    is_under = any(one.is_statistical and one.uses for one in queries)
    idle("under_choice", not is_under, "here: no statistical query is under a strategy")


def _is_plain_search(query: QueryForm) -> bool:
    """Whether a query is answered by a search of symbolic states."""
    return not (query.is_game or query.is_statistical or query.is_learned or query.is_shield)


def _takes_threads(query: QueryForm, values: Mapping[str, object]) -> bool:
    """Whether more than one thread can share the work of a query."""
    if query.is_game:
        return not query.is_observed
    if query.is_statistical or query.is_learned or query.is_shield:
        return True
    return values["search"] == "bfs" and query.kind not in ("E[]", "A<>", "-->")


def _spelled(name: str) -> str:
    """An option or a setting of this name, as it stands on the command line."""
    if name in OPTIONS:
        return f"--{name.replace('_', '-')}"
    return f"--set '{next(one.words for one in SETTINGS if one.field == name)} …'"


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
