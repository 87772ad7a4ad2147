"""The pictures of `ntagen plot` that show what random runs of a model say."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.asked import Asked
from ntagen.cli.options import PICTURED
from ntagen.cli.rules import Decorator
from ntagen.cli.run_progress import progress_of, say_interrupted
from ntagen.cli.terminal import echo
from ntagen.errors import InputError, LimitError, ModelError
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model
    from ntagen.checker.picture.chart import Chart

NAMES: Final = {"runs": "--runs", "buckets": "--buckets", "width": "--bucket-width"} | {
    name: f"--{name}" for name in ("seed", "alpha", "epsilon", "threads")
}
"""The options that count for random runs only."""

_OPTIONS: Final[dict[str, Decorator]] = {
    "buckets": click.option(
        "--buckets",
        metavar="N",
        type=click.IntRange(min=1),
        help="Of random runs: the number of buckets of the histogram.  [default: the square root "
        "of the number of values, at most 120]",
    ),
    "width": click.option(
        "--bucket-width",
        "width",
        metavar="WIDTH",
        type=float,
        help="Of random runs: how wide a bucket is, instead.",
    ),
}


@dataclass(frozen=True, slots=True)
class RunWish:
    """How random runs are made and drawn.

    Attributes:
        given: Options of `ntagen.checker.Options`.
        buckets: The number of buckets of a histogram.
        width: How wide they are.
    """

    given: dict[str, Any]
    buckets: int | None
    width: float | None


def run_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Adds the options of random runs; the command gets them as `run_wish`."""

    @functools.wraps(command)
    def with_wish(**values: Any) -> int | None:  # noqa: ANN401  click's values
        buckets, width = values.pop("buckets"), values.pop("width")
        given = {name: values.pop(name) for name in PICTURED}
        return command(run_wish=RunWish(given, buckets, width), **values)

    decorated: Callable[..., int | None] = with_wish
    for option in reversed([*PICTURED.values(), *_OPTIONS.values()]):
        decorated = option(decorated)
    return decorated


def plot_runs(model: Model, query: Asked, path: Path, wish: RunWish, limits: dict[str, Any]) -> int:
    """Draws what random runs say; returns the exit code.

    Raises:
        InputError: The query or the name of the picture is wrong, or there is nothing to draw.
        LimitError: A limit came before there was anything to draw.
    """
    from ntagen.checker import Interrupted
    from ntagen.checker.picture.chart import svg
    from ntagen.checker.picture.page import kind_of

    kind_of(path)
    code = 0
    try:
        with progress_of(query.text, query.form, quiet=False) as reports:
            answer = model.check(query.text, **wish.given, **limits, **reports)
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
    svg(_chart(answer, wish)).save(path)
    return code


def _chart(answer: Answer, wish: RunWish) -> Chart:
    distribution = answer.distribution
    if distribution is not None and distribution.count == 0:
        what = "breaks" if distribution.broken else "reaches"
        raise InputError(
            f"none of {distribution.runs:,} runs {what} what {answer.query.strip()} asks, so there "
            "is nothing to draw\nhint: make more of them (--runs, --epsilon), or longer ones"
        )
    chart = answer.chart(wish.buckets, wish.width)
    if chart is None:
        raise InputError(
            f"{answer.query.strip()} shows no run, so there is nothing to draw\n"
            "hint: make more runs, or longer ones"
        )
    return chart
