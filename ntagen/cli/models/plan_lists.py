"""Writes lists of plans while they are made: one plan on a line, or one JSON document.

However many plans there are, no more than a page of them is in memory when they are written line by
line. Whatever ends the command, the file has whole lines: a page is written when it is whole, and
what was written in part is removed again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import field
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.cli.progress import rate, status
from ntagen.cli.terminal import echo
from ntagen.errors import InputError
from ntagen.files import GrowingFile, write_files
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Answer

_Show = Callable[[int], None]

LINES: Final = ".jsonl"
"""The ending of the names of files that have one plan on each line."""

_CANDIDATE_BYTES: Final = 4096
"""A plan with its certificate takes about so much while a list is ranked."""

_PAGE_LINES: Final = 64
"""So many plans of a UPPAAL model, each of them long, are written together."""


@dataclass(frozen=True, slots=True)
class ListLimits:
    """What ends a list of plans.

    Attributes:
        timeout_s: It ends when the query has taken this time.
        memory_bytes: It ends when the plans in memory take this much.
        quiet: Whether no progress is shown.
        start_s: When the query was asked; see `time.monotonic`.
    """

    timeout_s: float | None = None
    memory_bytes: int | None = None
    quiet: bool = True
    start_s: float = field(default_factory=time.monotonic)

    def stop(self, in_memory: int = 0) -> str | None:
        """The limit that is reached with this number of certified plans in memory, if any."""
        if self.timeout_s is not None and time.monotonic() - self.start_s >= self.timeout_s:
            return "time"
        size_bytes = in_memory * _CANDIDATE_BYTES
        is_full = self.memory_bytes is not None and size_bytes >= self.memory_bytes
        return "memory" if is_full else None


@dataclass(frozen=True, slots=True)
class Written:
    """What was written.

    Attributes:
        notes: Lines about it for the user.
        stop: ``time`` or ``memory``, if that limit came before the last plan.
    """

    notes: tuple[str, ...]
    stop: str | None = None


def stopped(count: int, stop: str | None) -> list[str]:
    """A note that says which limit ended a list, if one did."""
    if stop is None:
        return []
    hint = f"; a FILE{LINES} takes no memory for plans" if stop == "memory" else ""
    return [f"listed {count} plans until the {stop} limit{hint}"]


def write_lines(answer: Answer, path: Path, limits: ListLimits) -> Written:
    """Writes one plan on each line, in the order of the model.

    Raises:
        InputError: The file cannot be written any further. It has whole lines, and the message
            says how many.
    """
    count, _, stop = write_pages(path, _lines(answer), limits)
    return Written((f"{count} plans written to {path}", *stopped(count, stop)), stop)


def write_document(answer: Answer, target: str, limits: ListLimits) -> Written:
    """Writes the plans of a UPPAAL model as one JSON document; ``-`` is standard output."""
    if target == "-":
        for piece in answer.plans_json_pieces():
            echo(piece, nl=False)
        echo("")
        return Written(())
    with counting(limits.quiet) as show:
        write_files({Path(target): chain(_counted(answer.plans_json_pieces(), show), ["\n"])})
    return Written((f"{answer.plan_count} plans written to {target}",))


def _lines(answer: Answer) -> Iterator[tuple[list[str], int]]:
    rest = answer.plan_lines()
    while page := list(islice(rest, _PAGE_LINES)):
        yield page, 0


def write_pages(
    path: Path, pages: Iterable[tuple[list[str], int]], limits: ListLimits
) -> tuple[int, int, str | None]:
    """Writes pages of lines; returns how many lines, and plans that hold, and which limit came."""
    count = holding = 0
    file = GrowingFile(path)
    try:
        with counting(limits.quiet) as show:
            for lines, held in pages:
                file.write("".join(f"{line}\n" for line in lines).encode())
                file.acknowledge(to_disk=False)
                count, holding = count + len(lines), holding + held
                show(count)
                if (stop := limits.stop()) is not None and count != 0:
                    return count, holding, stop
        file.acknowledge(to_disk=True)
    except KeyboardInterrupt:
        echo(f"{path}: interrupted after {count} plans, all on whole lines", err=True)
        raise
    except InputError as error:
        first, _, hint = str(error).partition("\n")
        message = f"{first}; it has {count} plans, all on whole lines\n{hint}"
        raise InputError(message) from error
    finally:
        file.close()
    return count, holding, None


def _counted(pieces: Iterable[str], show: _Show) -> Iterator[str]:
    for number, piece in enumerate(pieces):
        yield piece
        show(number)


@contextmanager
def counting(quiet: bool) -> Iterator[_Show]:
    """Gives the function that takes how many plans are listed; a terminal shows the number."""
    start = time.monotonic()
    with status("listing plans …", quiet=quiet) as show:
        yield lambda n: show(f"{n:,} plans listed ({rate(n, time.monotonic() - start)})")
