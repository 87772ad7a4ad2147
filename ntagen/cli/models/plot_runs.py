"""The pictures of `ntagen plot` that show what random runs of a model say."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.guard import current
from ntagen.cli.models.options import RUNS
from ntagen.cli.models.queries import Asked
from ntagen.cli.progress import progress_of, say_interrupted
from ntagen.cli.settings import Setting
from ntagen.cli.terminal import echo
from ntagen.errors import InputError, LimitError, ModelError

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model
    from ntagen.checker.picture.page import Svg

SETTINGS: Final = (
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

NAMES: Final = {one.field: f"--set '{one.words} …'" for one in SETTINGS}
"""How each of them is given."""

_DRAWING_S: Final = 3.0
_DRAWING_BYTES: Final = 200 << 20
"""Enough to load matplotlib and to draw, on a slow machine too."""


def plot_runs(
    model: Model, query: Asked, path: Path, settings: dict[str, Any], limits: dict[str, Any]
) -> int:
    """Draws what random runs say; returns the exit code.

    Args:
        model: The model.
        query: The query that is answered by random runs.
        path: The picture.
        settings: Those of `SETTINGS` that are given, by their names.
        limits: Those of `ntagen.checker.Options`.

    Raises:
        InputError: The query or the name of the picture is wrong, or there is nothing to draw.
        LimitError: A limit came before there was anything to draw.
    """
    from ntagen.checker import Interrupted
    from ntagen.checker.picture.page import kind_of

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
        current().allow(_DRAWING_S, _DRAWING_BYTES)
    _chart(answer, settings).save(path)
    return code


def _chart(answer: Answer, settings: dict[str, Any]) -> Svg:
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
