"""What is shown while something takes long, and what is said when the user interrupts it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from ntagen.cli.terminal import echo, safe

if TYPE_CHECKING:
    from ntagen.checker import QueryForm


@contextmanager
def status(first: str, *, quiet: bool) -> Iterator[Callable[[str], None]]:
    """Gives what shows a line on standard error in place of the one before, on a terminal only.

    Args:
        first: The first line.
        quiet: Whether nothing is shown.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    with Console(stderr=True, markup=False).status(first) as line:
        yield lambda text: line.update(safe(text))


def rate(count: int, seconds: float) -> str:
    """How many there were in a second."""
    return f"{count / seconds if seconds > 0 else 0:,.0f}/s"


@contextmanager
def shown_progress(query: str, quiet: bool) -> Iterator[Callable[[int, int, int, int], None]]:
    """Gives the function to which the engine reports its counters.

    A terminal shows them in one line that is overwritten. If the user interrupts, the last counters
    are printed to standard error.

    Args:
        query: The query that is being answered.
        quiet: Whether nothing is shown before an interruption.
    """
    start = time.monotonic()
    last = "nothing is counted yet"
    try:
        with status("searching …", quiet=quiet) as show:

            def report(explored: int, stored: int, waiting: int, size_bytes: int) -> None:
                nonlocal last
                last = (
                    f"{explored:,} states explored ({rate(explored, time.monotonic() - start)}), "
                    f"{stored:,} stored, {waiting:,} waiting, {size_bytes / 2**20:.0f} MiB"
                )
                show(last)

            yield report
    except KeyboardInterrupt:
        echo(f"{query}\n  {last}", err=True)
        raise


def so_far(
    runs: int, estimate: float | None, lower: float | None, upper: float | None, seconds: float
) -> str:
    """What runs say until now, on one line."""
    said = [f"{runs:,} runs ({rate(runs, seconds)})"]
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
    if form is None or not form.is_statistical:
        with shown_progress(query, quiet) as report:
            yield {"progress": report}
        return
    from ntagen.checker import Interrupted

    start = time.monotonic()
    try:
        with status("making random runs …", quiet=quiet) as show:

            def report_runs(
                runs: int, estimate: float | None, lower: float | None, upper: float | None
            ) -> None:
                show(so_far(runs, estimate, lower, upper, time.monotonic() - start))

            yield {"run_progress": report_runs}
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
