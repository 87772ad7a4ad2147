"""Writes lists of plans while they are made: one plan on a line, or one JSON document.

However many plans there are, no more than a page of them is in memory when they are written line by
line. Whatever ends the command, the file has whole lines: a page is written when it is whole, and
what was written in part is removed again.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import field
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.cli.terminal import echo
from ntagen.errors import InputError
from ntagen.files import GrowingFile, write_files
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Answer
    from ntagen.nsl import Task
    from ntagen.plan.rank import Candidate
    from ntagen.plan.synthesise import Margins
    from ntagen.scene import Scene

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


def write_lines(answer: Answer, path: Path, limits: ListLimits, task: Task | None) -> Written:
    """Writes one plan on each line, in the order of the model; of an environment, certified.

    Raises:
        InputError: The file cannot be written any further. It has whole lines, and the message
            says how many.
    """
    if task is None:
        pages = _lines(answer)
        count, _, stop = _write_pages(path, pages, limits)
        return Written((f"{count} plans written to {path}", *stopped(count, stop)), stop)
    from ntagen.drive.configure import configure
    from ntagen.plan.wording import counted, required

    margins = configure(task.given, task.scene).settings.margins
    pages = _certified_lines(answer, task.scene, margins)
    count, holding, stop = _write_pages(path, pages, limits)
    is_complete = stop is None and not answer.has_more_plans
    notes = (
        f"plans written to {path}, in the order of the model",
        counted(count, holding, is_complete=is_complete),
        *stopped(count, stop),
        required(margins),
    )
    return Written(notes, stop)


def write_document(answer: Answer, target: str, limits: ListLimits) -> Written:
    """Writes the plans of a UPPAAL model as one JSON document; ``-`` is standard output."""
    if target == "-":
        for piece in answer.plans_json_pieces():
            echo(piece, nl=False)
        echo("")
        return Written(())
    with _shown(limits.quiet) as show:
        write_files({Path(target): chain(_counted(answer.plans_json_pieces(), show), ["\n"])})
    return Written((f"{answer.plan_count} plans written to {target}",))


def certified_within(
    answer: Answer, scene: Scene, limits: ListLimits
) -> tuple[list[Candidate], str | None]:
    """The plans with their certificates, and which limit came before the last one, if any."""
    candidates: list[Candidate] = []
    with _shown(limits.quiet) as show:
        for page in _certified(answer, scene):
            if (stop := limits.stop(len(candidates) + len(page))) is not None:
                return candidates, stop
            candidates += page
            show(len(candidates))
    return candidates, None


def _certified(answer: Answer, scene: Scene) -> Iterator[list[Candidate]]:
    from ntagen.plan.extract import pages_of
    from ntagen.plan.rank import in_pages

    return in_pages(chain.from_iterable(pages_of(answer, scene)), scene)


def _certified_lines(
    answer: Answer, scene: Scene, margins: Margins
) -> Iterator[tuple[list[str], int]]:
    """Pages of lines, each with the number of plans in it that hold."""
    from ntagen.plan.document import plan_line

    for page in _certified(answer, scene):
        held = sum(margins.allow(candidate.certificate) for candidate in page)
        yield [plan_line(candidate, margins) for candidate in page], held


def _lines(answer: Answer) -> Iterator[tuple[list[str], int]]:
    rest = answer.plan_lines()
    while page := list(islice(rest, _PAGE_LINES)):
        yield page, 0


def _write_pages(
    path: Path, pages: Iterable[tuple[list[str], int]], limits: ListLimits
) -> tuple[int, int, str | None]:
    """Writes pages of lines; returns how many lines, and plans that hold, and which limit came."""
    count = holding = 0
    file = GrowingFile(path)
    try:
        with _shown(limits.quiet) as show:
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
def _shown(quiet: bool) -> Iterator[_Show]:
    """Gives the function that takes how many plans are listed; a terminal shows the number."""
    if quiet or not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    start_s = time.monotonic()
    with Console(stderr=True).status("listing plans …") as status:

        def show(count: int) -> None:
            seconds = time.monotonic() - start_s
            rate = count / seconds if seconds > 0 else 0
            status.update(f"{count:,} plans listed ({rate:,.0f}/s)")

        yield show
