"""`ntagen experiment`: drives many runs and makes a table of them."""

from __future__ import annotations

from pathlib import Path

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.needle.campaigns import EPILOG, FORMER, How, campaign_options, ended, made
from ntagen.cli.options import output_option, path_argument


@click.command("experiment", cls=Renamed, former=FORMER, epilog=EPILOG)
@path_argument("file", metavar="FILE.toml")
@click.option(
    "--runs",
    metavar="N",
    type=click.IntRange(1, 1_000_000),
    help="Make this many runs of each row; the number in the file does not count then.",
)
@output_option(
    "DIR",
    "The folder for all results.  [default: the name of the file without .toml]",
    "folder",
)
@campaign_options
def command(file: Path, runs: int | None, folder: Path | None, how: How) -> int:
    """Drive simulated needles many times, and make a table.

    The file says what to combine: scenarios, what the driver knows, needles, their errors, and
    seeds. The folder gets the table (table.json, .csv, .md, .tex), a report with pictures
    (report.html), and the log of each run (runs/).

    The same file gives the same table on any number of workers, except for times, and for needles
    in a lab, whose controller and tracker take real time. Ctrl-C ends the experiment; --resume goes
    on with it.

    \b
    Examples:
      ntagen experiment examples/experiments/virtual.toml --runs 5
      ntagen experiment examples/experiments/real.toml --runs 1
      ntagen experiment examples/experiments/virtual.toml -o virtual --workers 8
      ntagen experiment examples/experiments/virtual.toml -o virtual --resume
      ntagen experiment examples/experiments/virtual.toml -o virtual --dask tcp://head:8786

    docs/experiments.md explains the file and the table.
    """  # noqa: D301  click wants the control character
    from ntagen.experiment.reading import read_experiment

    experiment = read_experiment(file, runs)
    folder = folder or Path(file.stem)
    return ended(made(experiment, folder, how), folder)
