"""`ntagen report`: makes a page of a logged run, as evidence for a lab notebook."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ntagen.cli.guard import doing
from ntagen.cli.options import bounded, output_option, path_argument
from ntagen.cli.terminal import echo
from ntagen.files import require_apart, write_files

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ntagen.report.checking import Check


@click.command(
    "report",
    epilog="Exit codes: 0 written, and with --verify all holds; 1 something does not hold "
    "(--verify), 2 the log cannot be read, 3 a check does not cover what it looks at (--verify), "
    "or a limit came first. The report is written with the exit codes 0 and 1, and with 3 unless "
    "--timeout or --memory ended the command.",
)
@path_argument("log", metavar="RUN.mcap")
@output_option(
    "FILE.html",
    "The report to write.  [default: the log's name with .html, in the current folder; with "
    "--json, the standard output]",
)
@click.option(
    "--verify",
    is_flag=True,
    help="Check the run again: repeat its decisions as ntagen replay does, play each strategy "
    "against every move of its opponent as ntagen verify does, and certify each plan.",
)
@click.option(
    "--json", "as_json", is_flag=True, help="Write the same facts as one JSON object, not a page."
)
@bounded
def command(log: Path, output: Path | None, verify: bool, as_json: bool) -> int:
    """Make a report of a logged run: one page that loads nothing and prints well.

    It has the task, settings and where they come from, how well things were measured, what was
    decided and why, how the run ended, its margins, pictures, and the SHA-256 of the log and of
    each file in it. The same log gives the same report.

    A log that was cut off by a crash is reported up to that place, and the report says so first.

    \b
    Examples:
      ntagen report run.mcap
      ntagen report run.mcap -o notebook/run.html --verify
      ntagen report run.mcap --json
    """  # noqa: D301  click wants the control character
    from ntagen.drive.reading import read_log
    from ntagen.report.facts import facts_of, verdict_of

    path = output
    if path is None and not as_json:
        path = Path(f"{log.stem or log.name}.html")
    require_apart({"-o": path}, {"log": log})
    with doing(f"reading {log}"):
        run = read_log(log)
    checks: list[Check] | None = None
    if verify:
        from ntagen.report.checking import checks_of

        with doing("checking the run"):
            checks = list(checks_of(run))
    with doing("making the report"):
        facts = facts_of(run, checks)
        if as_json:
            text = json.dumps(facts, allow_nan=False)
        else:
            from ntagen.report.page import page_of

            text = page_of(run, facts)
    if path is None:
        echo(text)
    else:
        write_files({path: text + "\n" if as_json else text})
        _tell(run.torn_at_byte, checks)
        echo(f"wrote {path}")
    return 0 if checks is None else {True: 0, False: 1, None: 3}[verdict_of(checks)]


def _tell(torn_at_byte: int | None, checks: Sequence[Check] | None) -> None:
    """Prints what a reader of the report must know first."""
    if torn_at_byte is not None:
        echo(f"the log is cut off: it can be read up to byte {torn_at_byte}")
    for check in checks or ():
        if check.result in ("does not hold", "not covered"):
            echo(f"{check.what}: {check.result}: {check.about}")
    if checks is not None:
        count = sum(check.result == "holds" for check in checks)
        asked = sum(check.result != "not in the log" for check in checks)
        echo(f"{count} of {asked} checks hold")
