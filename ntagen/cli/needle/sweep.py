"""`ntagen sweep`: how much of an error a task stands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.loading import load_task
from ntagen.cli.needle.campaigns import EPILOG, FORMER, How, campaign_options, ended, made
from ntagen.cli.needle.steering import known_option, settings_options
from ntagen.cli.options import output_option, path_argument
from ntagen.parameters import SEED

if TYPE_CHECKING:
    from ntagen.parameters import Given


@click.command(
    "sweep",
    cls=Renamed,
    former={
        **FORMER,
        "--timeout": "write --set 'time limit {}'",
        "--figure": "the folder has sweep.png and sweep.svg",
    },
    epilog=EPILOG,
)
@path_argument("environment", metavar="ENV.nsl")
@click.option(
    "--over",
    metavar="SETTING",
    required=True,
    help="What is swept: noise, radius-error, roll-lag, delay, or any other setting that is a "
    "quantity.",
)
@click.option(
    "--values",
    metavar="A,B,…",
    required=True,
    help="Its values, at least two. Numbers without a unit have that of the last one.",
)
@click.option(
    "--runs",
    metavar="N",
    type=click.IntRange(1, 1_000_000),
    default=20,
    show_default=True,
    help="Make this many runs for each value, with the same seeds.",
)
@click.option(
    "--needle",
    default="phantom",
    show_default=True,
    help="The simulated needle: phantom drifts, lags and is measured as real needles are; virtual "
    "bends exactly as planned; grbl+sim is a phantom behind an emulated stepper controller.",
)
@known_option
@output_option(
    "DIR",
    "The folder for all results.  [default: the names of the task and the setting]",
    "folder",
)
@campaign_options
@settings_options(without=(SEED,))
def command(
    environment: Path,
    over: str,
    values: str,
    runs: int,
    needle: str,
    known: str,
    folder: Path | None,
    how: How,
    given: tuple[Given, ...],
) -> int:
    """Show how much of an error a task stands.

    Drives a simulated needle many times with each value of one setting, and draws over it how often
    the target is reached and a critical region hit, with 95 % intervals, and how near the needle
    comes to what is critical. All values have the same seeds. The folder gets what `ntagen
    experiment` writes; the other settings are those of the task and of --set.

    \b
      noise         of each measured coordinate; the driver is calibrated to it
      radius-error  by how much the true motion circle is greater than that of the task
      roll-lag      of the phantom's tip, 100 mm deep; rolls make up for `lag compensation`
                    only, which is 45 deg by itself
      delay         of position and force, as a phantom needle's tracker measures them

    \b
    Examples:
      ntagen sweep examples/paper.nsl --over noise --values 0,0.5,1,2,4mm
      ntagen sweep examples/paper.nsl --over radius-error --values -20,-10,0,10,20% --runs 50
      ntagen sweep examples/paper.nsl --over roll-lag --values 0,30,60,90deg \\
        --set 'lag compensation 0'
      ntagen sweep examples/paper.nsl --over delay --values 0,100,200,400ms --known none

    docs/experiments.md says how to read the picture, and how to sweep several tasks at once.
    """  # noqa: D301  click wants the control character
    from ntagen.experiment.one_sweep import quantity_of, sweep_of_task
    from ntagen.experiment.pictures import sensitivity
    from ntagen.plot.save import save

    parameter = quantity_of(over)
    load_task(environment)
    experiment = sweep_of_task(
        environment,
        parameter,
        values,
        known=known,
        needle=needle,
        runs=runs,
        settings={one.parameter.words: one.parameter.written(one.value) for one in given},
    )
    folder = folder or Path(f"{environment.stem}-{parameter.words.replace(' ', '-')}")
    campaign = made(experiment, folder, how)
    (sweep,) = campaign.document["sweeps"]
    figures = [folder / "sweep.png", folder / "sweep.svg"]
    for figure in figures:
        save(sensitivity(campaign.document, sweep), figure)
    return ended(campaign, folder, *figures)
