"""What `ntagen experiment` and `ntagen sweep` share: options, progress, the table, the end.

`ntagen policies` has the same workers.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.options import gathered
from ntagen.cli.terminal import aligned, echo, safe
from ntagen.errors import InputError

if TYPE_CHECKING:
    from ntagen.experiment.campaign import Progress
    from ntagen.experiment.description import Experiment
    from ntagen.experiment.results import Campaign

_LOST: Final = 1
"""The exit code if some runs could not be made."""

FORMER: Final = {"--quiet": "progress goes to standard error"}

EPILOG: Final = """\
Exit codes: 0 all runs were made, 1 some could not be made or the driver broke in them, 2 the input
is wrong or a result cannot be written, 70 internal error, 130 interrupted, 143 ended by SIGTERM."""


@dataclass(frozen=True, slots=True)
class How:
    """How the runs of a campaign are made; see the help of the options.

    Attributes:
        workers: So many processes; None for one on each core.
        dask: The address of a Dask scheduler, or None.
        resume: Whether finished runs are kept.
        no_logs: Whether runs have no logs.
    """

    workers: int | None
    dask: str | None
    resume: bool
    no_logs: bool


workers_option = click.option(
    "--workers",
    metavar="N",
    type=click.IntRange(1, 1024),
    help="Use this many processes of this machine.  [default: one for each core]",
)

dask_option = click.option(
    "--dask",
    metavar="ADDRESS",
    help="Use the workers of the Dask scheduler at this address, as tcp://host:8786. They must "
    "have the same ntagen, and see the same files.",
)

campaign_options = gathered(
    "how",
    {
        "workers": workers_option,
        "dask": dask_option,
        "resume": click.option(
            "--resume",
            is_flag=True,
            help="Go on with an experiment that was interrupted. Finished runs are kept.",
        ),
        "no_logs": click.option("--no-logs", is_flag=True, help="Write no log of each run."),
    },
    How,
)
"""Adds the options; the command gets their values as `how`."""


def made(experiment: Experiment, folder: Path, how: How) -> Campaign:
    """Makes a campaign, with its progress, and prints its table.

    Raises:
        InputError: The folder cannot be used, or somebody cannot work.
    """
    from ntagen.experiment.campaign import carry_out
    from ntagen.experiment.scripting import crew_of

    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is no folder\nhint: choose another one with -o")
    try:
        with _progress() as notify:
            campaign = carry_out(
                experiment,
                folder,
                crew_of(how.workers, how.dask),
                resume=how.resume,
                logs=not how.no_logs,
                notify=notify,
            )
    except KeyboardInterrupt:
        echo(f"finished runs are kept in {folder}; go on with --resume", err=True)
        raise
    _show(campaign.document)
    _conclude(campaign.document)
    return campaign


def ended(campaign: Campaign, folder: Path, *more: Path) -> int:
    """Says what was written and what could not be made; returns the exit code."""
    from ntagen.experiment.results import FILES

    document = campaign.document
    echo(f"wrote {folder / FILES[0]}, {', '.join([*FILES[1:], *map(str, more)])}")
    broken = sum(row["outcomes"].get("failed", 0) for row in document["rows"])
    for lost in document["lost"]:
        echo(f"not made: seed {lost['seed']} of {lost['row']}: {lost['reason']}", err=True)
    if broken:
        echo(f"the driver broke in {broken} runs: see `reason` in table.json", err=True)
    return _LOST if document["lost"] or broken else 0


def _conclude(document: Mapping[str, Any]) -> None:
    """Prints what the sweeps show, each kind of rows with its name if there are several."""
    from ntagen.experiment.sweeps import conclusions_of

    names = [sweep["name"] for sweep in document["sweeps"]]
    for number, sweep in enumerate(document["sweeps"]):
        if len(set(names)) > 1 and names[number] not in names[max(0, number - 1) : number]:
            echo(f"{names[number]}:")
        for line in conclusions_of(document, sweep):
            echo(line)


@contextlib.contextmanager
def _progress() -> Iterator[Callable[[Progress], None]]:
    """Gives what shows the progress: a bar on a terminal, else a line for each tenth."""
    if sys.stderr.isatty():
        with _bar() as show:
            yield show
        return
    shown = -1

    def show_line(progress: Progress) -> None:
        nonlocal shown
        if progress.note:
            echo(f"note: {progress.note}", err=True)
        tenth = 10 * progress.done // max(1, progress.of)
        if tenth > shown:
            shown = tenth
            echo(f"{progress.done} of {progress.of} runs{_counts(progress)}", err=True)

    yield show_line


def _counts(progress: Progress) -> str:
    return f", {progress.reached} reached, {progress.hits} hits"


@contextlib.contextmanager
def _bar() -> Iterator[Callable[[Progress], None]]:
    """A bar with the rate and the time left."""
    from rich import progress as columns
    from rich.console import Console

    console = Console(stderr=True)
    shown = (
        columns.SpinnerColumn(),
        columns.MofNCompleteColumn(),
        columns.BarColumn(),
        columns.TextColumn("{task.fields[rate]}"),
        columns.TimeRemainingColumn(),
        columns.TextColumn("{task.fields[counts]}"),
    )
    with columns.Progress(*shown, console=console, transient=True) as bar:

        def show(progress: Progress) -> None:
            if progress.note:
                console.print(safe(f"note: {progress.note}"), markup=False, highlight=False)
            if not bar.tasks:
                bar.add_task("runs", total=progress.of, rate="", counts="")
            speed = bar.tasks[0].speed
            bar.update(
                bar.tasks[0].id,
                completed=progress.done,
                rate="" if speed is None else f"{speed:.1f} runs/s",
                counts=_counts(progress).removeprefix(", "),
            )

        yield show


def _show(document: Mapping[str, Any]) -> None:
    """Prints the table in short."""
    rows = [("row", "runs", "reached", "95 %", "hits", "adjustments", "synthesis", "overall")]
    for row in document["rows"]:
        reach, adjusted = row["reach_rate"], row["adjustments"]
        synthesis, overall = row["synthesis_s"], row["overall_s"]
        rows.append(
            (
                row["id"],
                str(row["runs"]),
                "" if reach is None else f"{reach:.1%}",
                f"{row['reach_low']:.1%} to {row['reach_high']:.1%}",
                str(row["hits"]),
                "" if adjusted is None else f"{adjusted['avg']:.2f}",
                "" if synthesis is None else f"{synthesis['avg']:.3f} s",
                "" if overall is None else f"{overall['avg']:.1f} s",
            )
        )
    for line in aligned(rows, right=range(1, 8)):
        echo(line)
