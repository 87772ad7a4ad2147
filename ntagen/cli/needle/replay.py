"""`ntagen replay`: tells a logged run, and repeats its decisions."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ntagen.cli.options import path_argument
from ntagen.cli.terminal import echo

if TYPE_CHECKING:
    from ntagen.drive.reading import RunLog
    from ntagen.drive.records import Record
    from ntagen.drive.replay import Comparison


@click.command(
    "replay",
    epilog="Exit codes: 0 the same decisions, 1 a different one, 2 the log cannot be read, "
    "3 the engine reached a limit.",
)
@path_argument("log", metavar="RUN.mcap")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, nothing else.")
def command(log: Path, as_json: bool) -> int:
    """Repeat the decisions of a logged run and compare them.

    Prints what happened in the run. Then the driver decides again from the logged measurements, and
    every decision is compared: states, commands, estimates, syntheses, learned regions. A log that
    was cut off by a crash is read up to that place.

    \b
    Example:
      ntagen replay run.mcap
    """  # noqa: D301  click wants the control character
    from ntagen.drive.reading import read_log
    from ntagen.drive.replay import replay
    from ntagen.drive.simulate import synthesiser_for

    run = read_log(log)
    synthesise = synthesiser_for(run.settings)
    if not as_json:
        _tell(run, log)
    comparison = replay(run, synthesise)
    if as_json:
        echo(json.dumps(_summary(run, comparison)))
    else:
        _report(comparison)
    return 0 if comparison.is_same else 1


def _tell(run: RunLog, log: Path) -> None:
    from ntagen.drive.story import tell

    known = ("program", "environment", "seed", "known", "noise_mm", "roll_error_rad")
    echo(", ".join(f"{name} {run.metadata[name]}" for name in known if name in run.metadata))
    for record in run.records:
        line = tell(record)
        if line is not None:
            echo(line)
    if run.torn_at_byte is not None:
        last_s = run.records[-1].time_s if run.records else 0.0
        echo(
            f"{log} is cut off: it can be read up to byte {run.torn_at_byte}, "
            f"{len(run.records)} records, {last_s:.2f} s"
        )


def _report(comparison: Comparison) -> None:
    if comparison.is_same:
        extent = "all" if comparison.complete else "all logged"
        echo(f"the same decisions again: {extent} {comparison.compared} are equal")
        return
    echo(f"a different decision, after {comparison.compared} equal ones")
    echo(f"  logged: {_shown(comparison.logged)}")
    echo(f"  now:    {_shown(comparison.decided)}")


def _shown(record: Record | None) -> str:
    return "nothing" if record is None else str(record)


def _summary(run: RunLog, comparison: Comparison) -> dict[str, Any]:
    from ntagen.drive.records import Ended

    ends = [record for record in run.records if isinstance(record, Ended)]
    return {
        "outcome": ends[-1].outcome if ends else None,
        "records": len(run.records),
        "torn_at_byte": run.torn_at_byte,
        "same": comparison.is_same,
        "complete": comparison.complete,
        "compared": comparison.compared,
        "logged": _document(comparison.logged),
        "decided": _document(comparison.decided),
    }


def _document(record: Record | None) -> dict[str, Any] | None:
    return None if record is None else {"kind": type(record).__name__.lower(), **asdict(record)}
