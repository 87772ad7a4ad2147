"""The pictures of `ntagen plot` that show learned strategies, and how they were learned."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ntagen.cli.guard import current, doing
from ntagen.cli.models.options import LEARNING_SETTINGS, RUNS
from ntagen.cli.models.queries import Asked, with_strategies
from ntagen.cli.progress import progress_of, say_interrupted
from ntagen.cli.terminal import echo
from ntagen.errors import InputError, LimitError, ModelError

if TYPE_CHECKING:
    from ntagen.checker import Answer, LearnedStrategy, Model
    from ntagen.checker.picture.page import Svg

KINDS: Final = {
    "decisions": "what a learned strategy decides, over two features or over one",
    "tree": "the same as a tree of questions",
    "learning": "what its value was after each iteration",
}
"""The pictures of a learned strategy, each with what it shows."""

DRAWING_S: Final = 3.0
DRAWING_BYTES: Final = 200 << 20
"""Enough to load matplotlib and to draw, on a slow machine too."""

MOST_LEAVES: Final = 60
"""If no number is given, the picture of trees has at most this number of leaves."""

OF_LEARNING: Final = {one.field: f"--set '{one.words} …'" for one in LEARNING_SETTINGS}
"""How the settings of learning are given."""


def has_learned(query: Asked) -> bool:
    """Whether the answer to a query may have a learned strategy."""
    form = query.form
    return form is not None and (form.is_learned or form.kind == "loadStrategy")


def plot_learned(
    model: Model,
    query: Asked,
    path: Path,
    kind: str,
    at: str | None,
    settings: dict[str, Any],
    limits: dict[str, Any],
) -> int:
    """Writes a picture of a learned strategy; returns the exit code.

    Args:
        model: The model.
        query: The query that learns or loads the strategy.
        path: The picture.
        kind: One of `KINDS`.
        at: Values of features.
        settings: What ``--set`` gives, by names.
        limits: Those of `ntagen.checker.Options`.

    Raises:
        InputError: The query has no learned strategy, or this cannot be drawn of it.
        LimitError: A limit came before there was a strategy.
        ModelError: The model fails.
    """
    if query.form is not None and not has_learned(query):
        raise InputError(
            f"{query.text} has no learned strategy to draw\n"
            "hint: ask for minE, maxE, minPr or maxPr, or load one: strategy S = "
            'loadStrategy("S.json"); the strategy of a game is drawn with --as zones'
        )
    with doing("the search for the best strategy"):
        answer = _answer(model, query, settings, limits)
    is_cut_off = answer.optimised is not None and not answer.optimised.is_complete
    if is_cut_off:
        current().allow(DRAWING_S, DRAWING_BYTES)
    strategy = _strategy(answer, query)
    with doing("drawing the picture"):
        _picture(answer, strategy, query, kind, at, settings).save(path)
    if not is_cut_off:
        return 0
    echo("note: learning was stopped by a limit: the strategy is the best until then", err=True)
    return LimitError.exit_code


def _answer(model: Model, query: Asked, settings: dict[str, Any], limits: dict[str, Any]) -> Answer:
    """The answer to a query, after those that define the strategies which it names."""
    from ntagen.checker import Interrupted
    from ntagen.verifyta.options import of_model

    given = {one.field for one in (*RUNS, *LEARNING_SETTINGS) if one.field in settings}

    def answered(one: Asked) -> Answer:
        options = of_model(one.options, given) | {name: settings[name] for name in given}
        try:
            with progress_of(one.text, one.form, quiet=False) as reports:
                return model.check(
                    one.text, folder=one.folder, strategy=True, **options, **limits, **reports
                )
        except Interrupted as interrupted:
            say_interrupted(one.text, 0)
            return interrupted.answer

    *before, last = with_strategies(model, [query])
    for one in before:
        answered(one)
    return answered(last)


def _strategy(answer: Answer, query: Asked) -> LearnedStrategy:
    """The learned strategy of an answer."""
    from ntagen.checker import LearnedStrategy

    strategy = answer.strategy
    if isinstance(strategy, LearnedStrategy):
        return strategy
    if strategy is not None:
        raise InputError(
            f"{query.text} has the strategy of a game, which is not learned\n"
            "hint: in Python, strategy.zones(…) draws it; of a control query, --as zones does"
        )
    if answer.verdict == "error":
        raise ModelError(answer.message or "the model has a run-time error")
    if answer.stop is None:
        raise InputError(
            f"{query.text} is {answer.verdict}, and has no strategy to draw\n"
            "hint: what minE, maxE, minPr and maxPr find can be drawn like this"
        )
    raise LimitError(
        f"{query.text} was stopped by the {answer.limit_text} before there was a strategy to draw"
    )


def _picture(
    answer: Answer,
    strategy: LearnedStrategy,
    query: Asked,
    kind: str,
    at: str | None,
    settings: dict[str, Any],
) -> Svg:
    if kind == "decisions":
        names = _names(settings.get("features"))
        x, y, *more = [*names, None, None]
        if more[:-2]:
            raise InputError(
                f"{len(names)} features are given, and a picture has two axes\n"
                "hint: choose two of them, and give the others a value (--at)"
            )
        return strategy.decisions(x, y, at=_values(strategy, at))
    if kind == "tree":
        return strategy.tree(at=_values(strategy, at), limit=settings.get("limit", MOST_LEAVES))
    chart = answer.chart() if answer.optimised is not None else None
    if chart is None:
        how = "was loaded: its file does not say how it was learned"
        if answer.estimate is not None and answer.estimate.is_computed:
            how = "was computed exactly, without learning"
        raise InputError(
            f"the strategy of {query.text} {how}\n"
            "hint: draw what it decides: --as decisions, or --as tree"
        )
    return chart


def _names(features: str | None) -> list[str]:
    """The features of the axes: a comma in brackets is part of a name, as in ``f(a,b)``."""
    names = [] if features is None else re.split(r",(?![^(\[]*[)\]])", features)
    names = [name.strip() for name in names]
    if not all(names):
        raise InputError(f"{features!r} is not one feature or two\nhint: write for example x,y")
    return names


def _values(strategy: LearnedStrategy, given: str | None) -> dict[str, float | str]:
    """The values of ``--at``."""
    text = given or ""
    for feature in strategy.discrete + strategy.continuous:
        # Words end at blanks, so a feature must have none.
        text = text.replace(feature, "".join(feature.split()))
    values: dict[str, float | str] = {}
    for word in text.split():
        # A feature may compare: n==1=1.
        name, equals, value = word.rpartition("=")
        process, dot, location = word.rpartition(".")
        if equals:
            values[name] = value
        elif dot:
            values[process] = location
        else:
            raise InputError(
                f"--at: {word!r} is neither a location nor a value\n"
                "hint: write Process.Location or name=value"
            )
    return values
