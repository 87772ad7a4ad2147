"""The pictures of `ntagen plot` that show models: traces, zones, state spaces, random runs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.checker.picture.page import kind_of
from ntagen.cli.guard import current, doing
from ntagen.cli.loading import load_model, pointing_to_explanations
from ntagen.cli.models import plot_learned
from ntagen.cli.models.options import RUNS
from ntagen.cli.models.queries import Asked, queries_of
from ntagen.cli.progress import progress_of, say_interrupted, shown_progress
from ntagen.cli.settings import Setting
from ntagen.cli.terminal import echo, say_idle
from ntagen.errors import InputError, LimitError, ModelError
from ntagen.files import require_apart
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model
    from ntagen.checker.picture.page import Svg
    from ntagen.checker.runs import Run
    from ntagen.checker.strategy import Strategy

MODELS: Final = (".xml", ".xta", ".ta")
"""The endings of UPPAAL models."""

KINDS: Final = {
    "runs": "what the random runs of Pr, E or simulate say",
    "gantt": "the trace of a query as a chart, where each process is when",
    "sequence": "the trace, and what passes between the processes",
    "zones": "what the strategy of a game does over two clocks, in one state",
    "templates": "the templates, as UPPAAL's editor shows them",
    "states": "the state space of a small model as a graph",
    "discrete": "the same without clocks",
    **plot_learned.KINDS,
}
"""The pictures of a model, each with what it shows."""

GRAPHS: Final = ("states", "discrete")
"""Those that may be written for Graphviz, too."""

_FOR: Final = {
    "at": ("zones", "decisions", "tree"),
    "clocks": ("zones",),
    "features": ("decisions",),
    "limit": (*GRAPHS, "tree"),
}
"""What counts for some pictures only, and for which."""

OF_SOME: Final = {
    "at": "--at",
    "clocks": "--set 'clocks …'",
    "features": "--set 'features …'",
    "limit": "--set 'limit …'",
}
"""How each of them is given."""

RUN_SETTINGS: Final = (
    *RUNS,
    Setting(
        "buckets N",
        click.IntRange(min=1),
        "The number of buckets of the histogram.  [default: the square root of the number of "
        "values, at most 120]",
    ),
    Setting("bucket width WIDTH", click.FLOAT, "How wide a bucket is, instead."),
)
"""The settings that count for random runs only."""

OF_RUNS: Final = {one.field: f"--set '{one.words} …'" for one in RUN_SETTINGS}
"""How each of them is given."""

MOST_DRAWN: Final = 100
"""If no number is given, the picture of a graph has at most this number of states."""

MOST_SEARCHED: Final = 10_000
"""If no greater number is given, at most this number of symbolic states is searched for."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What is to be drawn of a model."""

    kind: str | None
    """One of `KINDS`; ``None`` leaves it to the query."""

    asked: str | None
    """The text or name of a query."""

    at: str | None
    """The state of zones, where it differs from the initial one; or values of features."""

    settings: dict[str, Any]
    """``clocks`` for zones, ``features`` for decisions, ``limit`` for graphs and trees, and those
    of random runs and of learning, as far as given."""

    memory_bytes: int | None

    def limits(self) -> dict[str, Any]:
        """What is left for a search, as fields of `ntagen.checker.Options`."""
        return {"timeout_s": current().left_s(), "memory_bytes": self.memory_bytes}


def plot_model(
    source: Path, path: Path | None, wish: Wish, include: Sequence[Path]
) -> tuple[Path, int]:
    """Writes a picture of a model; returns which file it is, and the exit code.

    Raises:
        InputError: The model, the query or the name of the picture is wrong, or there is nothing
            to draw.
        LimitError: The search reached a limit.
    """
    with pointing_to_explanations(True):
        with doing("loading the model"):
            model = load_model(source, include).model
        path = path or Path(f"{source.stem}.svg")
        require_apart({"-o": path}, {"source": source})
        kind = wish.kind or _kind(model, wish)
        wish = replace(wish, kind=kind)
        _say_idle(kind)
        if kind == "runs":
            asked = _asked_of_runs(model, wish)
            return path, _plot_runs(model, asked, path, wish.settings, wish.limits())
        if kind in plot_learned.KINDS:
            kind_of(path)
            drawn = model, _query(model, wish), path, kind, wish.at
            return path, plot_learned.plot_learned(*drawn, wish.settings, wish.limits())
        _plot_exactly(model, path, wish)
        return path, 0


def _kind(model: Model, wish: Wish) -> str:
    """The picture that shows most of what the query asks for."""
    if wish.asked is None and len(model.queries) != 1:
        return "gantt"
    query = _query(model, wish)
    if query.form is not None and query.form.is_statistical:
        return "runs"
    return "decisions" if plot_learned.has_learned(query) else "gantt"


def _say_idle(kind: str) -> None:
    """Says which options have no effect on a picture."""
    for name, option in OF_SOME.items():
        *others, last = kinds = _FOR[name]
        if kind not in kinds:
            either = f"{', '.join(others)} or {last}" if others else last
            say_idle({name: option}, f"without --as {either}")
    if kind != "runs":
        used = {one.field for one in RUNS} if kind in plot_learned.KINDS else set()
        idle = {name: option for name, option in OF_RUNS.items() if name not in used}
        say_idle(idle, "here: no random runs are drawn")
    if kind not in plot_learned.KINDS:
        say_idle(plot_learned.OF_LEARNING, "here: no learned strategy is drawn")


def _asked_of_runs(model: Model, wish: Wish) -> Asked:
    """The query, which is to be answered by random runs.

    Raises:
        InputError: Random runs do not answer it.
    """
    query = _query(model, wish)
    if query.form is None or not query.form.is_statistical:
        raise InputError(
            f"{query.text} is not answered by random runs\n"
            "hint: ask for Pr[…](…), E[…](…) or simulate[…]{…}"
        )
    return query


def _plot_exactly(model: Model, path: Path, wish: Wish) -> None:
    """Writes a picture of a model that does not show random runs."""
    is_graph = wish.kind in GRAPHS
    kind_of(path, ("dot",) if is_graph else ())
    if is_graph or wish.kind == "templates":
        drawn = "templates" if wish.kind == "templates" else "states"
        say_idle({"asked": "--query"}, f"with --as {wish.kind}: all {drawn} are drawn")
    if is_graph:
        _plot_graph(model, path, wish)
        return
    with doing("drawing the templates" if wish.kind == "templates" else "drawing the picture"):
        _drawn(model, wish).save(path)


def _plot_graph(model: Model, path: Path, wish: Wish) -> None:
    """Writes the graph of a state space.

    Raises:
        InputError: It has more states than the picture may have.
        LimitError: More states would have to be searched for.
    """
    given = wish.settings.get("limit")
    searched = max(MOST_SEARCHED, given or 0)
    try:
        with doing("the search for the states"):
            space = model.state_space(searched, **wish.limits())
    except LimitError as error:
        said = str(error).partition("\n")[0]
        if str(searched) not in said:
            raise
        raise LimitError(
            f"{said}\nhint: search for more (--set 'limit …'), or make constants of the model "
            "smaller"
        ) from None
    clocks = wish.kind == "states"
    with doing("drawing the graph"):
        space.save(path, clocks=clocks, limit=MOST_DRAWN if given is None else given)


def _drawn(model: Model, wish: Wish) -> Svg:
    if wish.kind == "templates":
        from ntagen.checker.picture.svg import draw_all

        return draw_all(model.templates)
    query = _query(model, wish)
    if wish.kind == "zones":
        return _zones(model, query, wish)
    run = _trace(model, query, wish)
    return run.gantt() if wish.kind == "gantt" else run.sequence()


def _query(model: Model, wish: Wish) -> Asked:
    """The query that was asked for, or the only one of the model that can be drawn."""
    if wish.asked is None and not model.queries:
        raise InputError("the model has no queries\nhint: give one with --query")
    queries = queries_of(model, () if wish.asked is None else (wish.asked,), None)
    if wish.kind == "zones" and wish.asked is None:
        queries = [query for query in queries if query.form and query.form.is_game]
        if not queries:
            raise InputError(
                "no query of the model is a game, so there is no strategy to draw\n"
                "hint: give one with --query: control: A<> p, control: A[] p, …"
            )
    if wish.kind in plot_learned.KINDS and wish.asked is None:
        queries = [query for query in queries if plot_learned.has_learned(query)]
        if not queries:
            raise InputError(
                "no query of the model asks for the best strategy, so there is none to draw\n"
                "hint: give one with --query: strategy S = minE(cost)[<=9]: <> p, …"
            )
    if len(queries) > 1:
        names = "\n".join(f"  {query.name or query.text}" for query in queries[:10])
        raise InputError(
            f"the model has {len(queries)} queries\nhint: choose one with --query:\n{names}"
        )
    return queries[0]


def _zones(model: Model, query: Asked, wish: Wish) -> Svg:
    """The zones of the strategy of a game."""
    with doing("the search for the answer"), shown_progress(query.text, quiet=False) as report:
        strategy = model.synthesize(query.text, progress=report, **wish.limits())
    axes = _axes(wish.settings.get("clocks"))
    return strategy.zones(_state(strategy, wish.at), x=axes[0], y=axes[1])


def _axes(clocks: str | None) -> tuple[str | None, str | None]:
    """The clocks of both axes, as far as they are given."""
    # A name may have commas of its own, in the brackets of its process: Train(1,2).x.
    names = [] if clocks is None else re.split(r",(?![^(\[]*[)\]])", clocks)
    names = [name.strip() for name in names]
    if len(names) > 2 or not all(names):
        raise InputError(f"{clocks!r} is not one clock or two\nhint: write for example x,y")
    return names[0] if names else None, names[1] if len(names) > 1 else None


def _state(strategy: Strategy, given: str | None) -> dict[str, dict[str, Any]]:
    """The state of `--at`: the initial one, but for what is given."""
    first = strategy.play().state
    places, variables = dict(first.locations), dict(first.variables)
    clocks: dict[str, str] = {}
    for word in (given or "").split():
        name, equals, value = word.partition("=")
        process, dot, location = word.rpartition(".")
        if equals and name in first.clocks:
            clocks[name] = value
        elif equals and name in variables:
            variables[name] = _number(word, value)
        elif not equals and dot and process in places:
            places[process] = location
        else:
            known = ", ".join([*places, *variables, *first.clocks])
            raise InputError(
                f"--at: {word!r} is neither a location nor a value\n"
                f"hint: write Process.Location or name=value; the names are {known}"
            )
    return {"locations": places, "variables": variables, "clocks": clocks}


def _number(word: str, value: str) -> int | float:
    try:
        return float(value) if "." in value else int(value)
    except ValueError:
        raise InputError(f"--at: {word!r} gives no number\nhint: write for example n=1") from None


def _trace(model: Model, query: Asked, wish: Wish) -> Run:
    """The trace of a query, with exact times."""
    with doing("the search for the answer"), shown_progress(query.text, quiet=False) as report:
        answer = model.check(query.text, trace=True, progress=report, **wish.limits())
    if answer.verdict == "error":
        raise ModelError(answer.message or "the model has a run-time error")
    if answer.verdict == "unknown":
        raise LimitError(f"the search was stopped by the {answer.limit_text}")
    run = answer.trace
    if run is not None:
        return run
    if answer.trace_json():
        why = (answer.trace_text() or "").rpartition("No exact times: ")[2].strip()
        raise InputError(f"the trace of {query.text} has no exact times: {why}")
    raise InputError(
        f"{query.text} is {answer.verdict}, and has no trace\n"
        "hint: E<> p that is satisfied and A[] p that is not have one"
    )


def _plot_runs(
    model: Model, query: Asked, path: Path, settings: dict[str, Any], limits: dict[str, Any]
) -> int:
    """Draws what random runs say; returns the exit code.

    Args:
        model: The model.
        query: The query that is answered by random runs.
        path: The picture.
        settings: Those of `RUN_SETTINGS` that are given, by their names.
        limits: Those of `ntagen.checker.Options`.

    Raises:
        InputError: The query or the name of the picture is wrong, or there is nothing to draw.
        LimitError: A limit came before there was anything to draw.
    """
    from ntagen.checker import Interrupted

    kind_of(path)
    options = {one.field: settings[one.field] for one in RUNS if one.field in settings}
    code = 0
    try:
        with progress_of(query.text, query.form, quiet=False) as reports:
            answer = model.check(query.text, **options, **limits, **reports)
    except Interrupted as interrupted:
        answer = interrupted.answer
        say_interrupted(query.text, 0)
    if answer.verdict == "error":
        raise ModelError(answer.message or "the model has a run-time error")
    if answer.verdict == "unknown":
        code = LimitError.exit_code
        said = f"stopped by the {answer.limit_text}"
        if answer.estimate is None and not answer.trajectories:
            raise LimitError(f"{query.text} was {said} before there was anything to draw")
        echo(f"note: {said}: the picture shows the runs until then", err=True)
        current().allow(plot_learned.DRAWING_S, plot_learned.DRAWING_BYTES)
    _chart_of(answer, settings).save(path)
    return code


def _chart_of(answer: Answer, settings: dict[str, Any]) -> Svg:
    distribution = answer.distribution
    if distribution is not None and distribution.count == 0:
        what = "breaks" if distribution.broken else "reaches"
        raise InputError(
            f"none of {distribution.runs:,} runs {what} what {answer.query.strip()} asks, so there "
            "is nothing to draw\nhint: make more of them (--set 'runs …'), or longer ones"
        )
    chart = answer.chart(settings.get("buckets"), settings.get("bucket_width"))
    if chart is None:
        raise InputError(
            f"{answer.query.strip()} shows no run, so there is nothing to draw\n"
            "hint: make more runs, or longer ones"
        )
    return chart
