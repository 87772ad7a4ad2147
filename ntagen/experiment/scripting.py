"""`ntagen.campaign`: an experiment from a script or a notebook."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ntagen import system
from ntagen.errors import InputError
from ntagen.experiment.campaign import Progress, carry_out
from ntagen.experiment.crew import Crew, Here
from ntagen.experiment.reading import read_experiment
from ntagen.experiment.results import Campaign


def campaign(
    file: str | Path,
    *,
    runs: int | None = None,
    workers: int | None = None,
    dask: str | None = None,
    resume: bool = False,
    folder: str | Path | None = None,
    logs: bool = True,
    notify: Callable[[Progress], None] = lambda _: None,
) -> Campaign:
    """Makes the runs of an experiment, and its table.

    A script calls it below ``if __name__ == "__main__":``, because each worker process imports the
    script; in a notebook, that does not matter.

    Args:
        file: The file, in TOML.
        runs: So many runs of each row, in place of those that the file says.
        workers: So many processes; by default one for each core. 0 makes all runs in this process.
        dask: The address of a Dask scheduler, whose workers are used instead.
        resume: Whether the folder may hold runs of this experiment, which are kept.
        folder: The folder for all results; by default the name of the file without ``.toml``.
        logs: Whether each run has a log.
        notify: Is told how far it is, after each block of runs.

    Returns:
        The campaign: `Campaign.table` has the rows, and `Campaign.to_frame` makes a frame of them.

    Raises:
        InputError: The file has mistakes, the folder cannot be used, or a number is wrong.
    """
    if runs is not None and runs < 1:
        raise InputError(f"runs is {runs}, and must be at least 1")
    if workers is not None and workers < 0:
        raise InputError(f"workers is {workers}, and must be at least 0")
    file = Path(file)
    crew = crew_of(workers, dask)
    return carry_out(
        read_experiment(file, runs),
        Path(file.stem) if folder is None else Path(folder),
        crew,
        resume=resume,
        logs=logs,
        notify=notify,
    )


def crew_of(workers: int | None, dask: str | None = None) -> Callable[[], Crew[Any]]:
    """Engages processes of this machine, or a cluster.

    Args:
        workers: How many; by default one for each core. 0 means this process itself.
        dask: The address of a Dask scheduler, whose workers are used instead.

    Raises:
        InputError: Both are given, or this process is a worker itself.
    """
    if dask is not None:
        if workers is not None:
            raise InputError(
                "a cluster has its own workers\nhint: leave out the number of workers, or Dask"
            )
        from ntagen.experiment.dask_crew import DaskCrew

        return lambda: DaskCrew(dask)
    if workers == 0:
        return Here
    from ntagen.experiment import local

    local.require_main_process()
    return lambda: local.LocalCrew(workers or system.core_count())
