"""What random runs say while a query makes them, and what Ctrl-C does then."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from ntagen.cli.progress import shown_progress
from ntagen.cli.terminal import echo, safe

if TYPE_CHECKING:
    from ntagen.checker import QueryForm

STATISTICAL: Final = ("Pr", "E", "simulate")
"""The kinds of queries that are answered by random runs."""


def so_far(
    runs: int, estimate: float | None, lower: float | None, upper: float | None, seconds: float
) -> str:
    """What runs say until now, on one line."""
    rate = runs / seconds if seconds > 0 else 0
    said = [f"{runs:,} runs ({rate:,.0f}/s)"]
    if estimate is not None:
        said.append(f"{estimate:.6g} so far")
    if lower is not None and upper is not None:
        said.append(f"in [{lower:.6g}, {upper:.6g}]")
    return ", ".join(said)


@contextmanager
def progress_of(query: str, form: QueryForm | None, quiet: bool) -> Iterator[dict[str, Any]]:
    """Gives the options of `ntagen.checker.Options` by which the engine reports its progress.

    A terminal shows it in one line that is overwritten. While there are random runs, Ctrl-C ends
    them, and what they say until then is the answer.

    Args:
        query: The query that is being answered.
        form: What it asks for.
        quiet: Whether nothing is shown before an interruption.
    """
    if form is None or form.kind not in STATISTICAL:
        with shown_progress(query, quiet) as report:
            yield {"progress": report}
        return
    start = time.monotonic()
    with _saying_if_nothing_is_done(query):
        if quiet or not sys.stderr.isatty():
            yield {}
            return
        from rich.console import Console

        with Console(stderr=True, markup=False).status("making random runs …") as status:

            def report_runs(
                runs: int, estimate: float | None, lower: float | None, upper: float | None
            ) -> None:
                line = so_far(runs, estimate, lower, upper, time.monotonic() - start)
                status.update(safe(line))

            yield {"run_progress": report_runs}


@contextmanager
def _saying_if_nothing_is_done(query: str) -> Iterator[None]:
    """Says what was interrupted before there was a result."""
    from ntagen.checker import Interrupted

    try:
        yield
    except Interrupted:
        raise
    except KeyboardInterrupt:
        echo(f"{query}\n  no random run has ended yet", err=True)
        raise


def say_interrupted(query: str, left: int) -> None:
    """Says that the user ended random runs, and how many queries are not asked any more."""
    rest = ""
    if left:
        rest = ", and 1 query is not asked" if left == 1 else f", and {left} queries are not asked"
    echo(f"interrupted: {query} is answered by the runs until now{rest}", err=True)
