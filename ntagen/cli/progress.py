"""The counters that are shown while a query takes long, and when the user interrupts it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ntagen.cli.terminal import echo
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Counters:
    """The counters of a search until now."""

    explored: int
    stored: int
    waiting: int
    size_bytes: int
    seconds: float

    def __str__(self) -> str:
        rate = self.explored / self.seconds if self.seconds > 0 else 0
        return (
            f"{self.explored:,} states explored ({rate:,.0f}/s), {self.stored:,} stored, "
            f"{self.waiting:,} waiting, {self.size_bytes / 2**20:.0f} MiB"
        )


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
    last: Counters | None = None
    show: Callable[[str], None] | None = None

    def report(explored: int, stored: int, waiting: int, size_bytes: int) -> None:
        nonlocal last
        last = Counters(explored, stored, waiting, size_bytes, time.monotonic() - start)
        if show is not None:
            show(str(last))

    try:
        if quiet or not sys.stderr.isatty():
            yield report
            return
        from rich.console import Console

        with Console(stderr=True).status("searching …") as status:
            show = status.update
            yield report
    except KeyboardInterrupt:
        done = "nothing is counted yet" if last is None else str(last)
        echo(f"{query}\n  {done}", err=True)
        raise
