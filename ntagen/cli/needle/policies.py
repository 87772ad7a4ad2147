"""`ntagen policies`: what policies gain over plans, task by task."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.needle.campaigns import dask_option, workers_option
from ntagen.cli.needle.optimise import amount, signed, span
from ntagen.cli.options import output_option
from ntagen.cli.terminal import aligned, echo, say_idle
from ntagen.errors import InputError
from ntagen.plan.steering import Comparison, Mean

if TYPE_CHECKING:
    from ntagen.experiment.policies import PolicyCampaign, Row
    from ntagen.plan.policy import Aim

_LOST: Final = 1
_NO_PLAN: Final = {"none": "no plan", "unknown": "plan unknown"}


@click.command(
    "policies",
    epilog="Exit codes: 0 all tasks were done, 1 some were refused, 2 the input is wrong or a "
    "result cannot be written, 70 internal error, 130 interrupted, 143 ended by SIGTERM.",
)
@click.argument("files", metavar="[ENV.nsl]…", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--random",
    "random_tasks",
    metavar="N",
    default=0,
    type=click.IntRange(0, 10_000),
    help="Add this many random tasks: a needle, a target, one to three critical regions, and "
    "tissue with chance.",
)
@click.option(
    "--seed",
    metavar="N",
    default=1,
    show_default=True,
    type=click.IntRange(min=0),
    help="The seed of the first random task, and of what is learned for files. The same seed gives "
    "the same tasks and policies.",
)
@click.option(
    "--runs",
    metavar="N",
    default=20_000,
    show_default=True,
    type=click.IntRange(min=20),
    help="From this many runs each policy is learned. A tenth as many tissues compare it with the "
    "plan.",
)
@click.option(
    "--drives",
    metavar="N",
    default=0,
    show_default=True,
    type=click.IntRange(0, 10_000),
    help="Drive this many simulated needles in each of three ways: by the plan blindly, planning "
    "again as needed, and by the policy.",
)
@click.option(
    "--needle",
    default="phantom",
    show_default=True,
    type=click.Choice(["phantom", "virtual"]),
    help="Which needles are driven. A virtual one deviates as the task's tissue says.",
)
@click.option(
    "--optimise",
    "aim",
    default="probability",
    show_default=True,
    type=click.Choice(["probability", "miss", "cut"]),
    help="What plans and policies are to be the best for, as in `ntagen plan`.",
)
@workers_option
@dask_option
@output_option("DIR", "Keep rows, policies, random tasks and the table in this folder.", "folder")
@click.option(
    "--resume",
    is_flag=True,
    help="Go on with a campaign that was interrupted. Finished rows of the folder are kept.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, nothing else.")
def command(
    files: tuple[Path, ...],
    random_tasks: int,
    seed: int,
    runs: int,
    drives: int,
    needle: str,
    aim: Aim,
    workers: int | None,
    dask: str | None,
    folder: Path | None,
    resume: bool,
    as_json: bool,
) -> int:
    """Show what policies gain over plans, task by task.

    For each task the best plan is found, and a policy is learned around it (`ntagen plan
    --optimise`). Both meet the same tissues, which learning has not seen: a policy is better or
    worse if the 95 % interval of the difference says so, else alike. One that is silent never
    differs from its plan. Last come the counts, and the mean difference over tasks.

    Ctrl-C ends the campaign, and prints the rows that are done.

    \b
    Examples:
      ntagen policies examples/chance/chance.nsl --runs 100000
      ntagen policies --random 10 --drives 3 -o campaign
      ntagen policies --random 100 --drives 3 -o campaign --resume
      ntagen policies --random 100 --drives 3 -o campaign --dask tcp://head:8786

    \b
    The JSON object has wanted, tasks, confidence, rows (task, seed, verdict, reason, plan,
    is_silent, guard, compared, learning_runs, drives, seconds), and sum. docs/policy.md says what
    was measured.
    """  # noqa: D301  click wants the control character
    from ntagen.experiment.policies import Wanted, campaign_of, carry_out, document_of
    from ntagen.experiment.scripting import crew_of

    if folder is None:
        say_idle({"resume": "--resume"}, "without -o")
    elif folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is no folder\nhint: choose another one with -o")
    if not drives:
        say_idle({"needle": "--needle"}, "without --drives")
    campaign = campaign_of(files, random_tasks, seed, Wanted(aim, runs, drives, needle))
    told = _Progress(campaign)
    try:
        document = carry_out(campaign, crew_of(workers, dask), told.note, folder, resume=resume)
    except KeyboardInterrupt:
        _show(document_of(campaign, told.rows), as_json=as_json)
        kept = "" if folder is None else f", and kept in {folder}; go on with --resume"
        echo(f"interrupted: {len(told.rows)} of {told.of} tasks are done{kept}", err=True)
        raise
    _show(document, as_json=as_json)
    if folder is not None:
        echo(f"wrote {folder}", err=as_json)
    return _LOST if document["sum"]["refused"] else 0


@dataclass(slots=True)
class _Progress:
    """Prints a line for each task, and keeps its row."""

    campaign: PolicyCampaign
    rows: dict[str, Row] = field(default_factory=dict)

    @property
    def of(self) -> int:
        """The number of tasks."""
        return len(self.campaign.rows)

    def note(self, row: Row) -> None:
        """Notes a row."""
        self.rows[row.task] = row
        said = _NO_PLAN.get(row.verdict) or row.reason
        if row.compared is not None:
            aim = self.campaign.wanted.aim
            said = f"{_judged(row.compared.verdict, is_silent=row.is_silent)}, "
            said += span(signed(row.compared.difference, aim), aim, sign="+")
        echo(f"{len(self.rows)} of {self.of} tasks: {row.task}: {said}", err=True)


def _judged(verdict: str, *, is_silent: bool) -> str:
    return f"{verdict} (silent)" if is_silent else verdict


def _show(document: Mapping[str, Any], *, as_json: bool) -> None:
    """Prints the table and its sum."""
    if as_json:
        echo(json.dumps(document))
        return
    ways = list(document["sum"]["drives"])
    head = ("task", "plan", "policy", "difference (95 %)", "", *(f"driven: {way}" for way in ways))
    rows = [head, *(_cells(row, document) for row in document["rows"])]
    for line in aligned(rows, right=(1, 2, *range(5, len(head)))):
        echo(line)
    for line in _sum_lines(document):
        echo(line)


def _cells(row: Mapping[str, Any], document: Mapping[str, Any]) -> Sequence[str]:
    aim, drives = document["wanted"]["aim"], document["wanted"]["drives"]
    ways = list(document["sum"]["drives"])
    if row["compared"] is None:
        said = _NO_PLAN.get(row["verdict"]) or row["reason"]
        return (row["task"], "", "", said, "", *("" for _ in ways))
    compared = _comparison(row["compared"])
    return (
        row["task"],
        amount(compared.plan.value, aim),
        amount(compared.policy.value, aim),
        span(signed(compared.difference, aim), aim, sign="+"),
        _judged(compared.verdict, is_silent=row["is_silent"]),
        *(f"{row['drives'][way]['arrived']} of {drives}" for way in ways),
    )


def _comparison(document: Mapping[str, Any]) -> Comparison:
    means = {name: Mean(**document[name]) for name in ("plan", "policy", "difference")}
    return Comparison(**{**document, **means})


def _sum_lines(document: Mapping[str, Any]) -> Sequence[str]:
    """What all tasks together show."""
    total, wanted = document["sum"], document["wanted"]
    aim, found = wanted["aim"], total["found"]
    left = {"none": "without a plan", "unknown": "whose plan is unknown", "refused": "refused"}
    done = f"{len(document['rows'])} of {document['tasks']} tasks are done"
    others = [f"{total[word]} {said}" for word, said in left.items() if total[word]]
    lines = [
        ", ".join([done, *others]),
        f"of {found} with a policy it is better in {total['better']}, alike in {total['alike']} "
        f"(silent in {total['silent']}), worse in {total['worse']}",
    ]
    for name, whose in (("difference", f"{found} tasks"), ("kept_difference", "those not silent")):
        if total[name] is not None:
            mean = span(signed(Mean(**total[name]), aim), aim, sign="+")
            lines.append(f"mean difference of {whose}: {mean}")
    if total["drives"]:
        needles = found * wanted["drives"]
        counts = "; ".join(
            f"{way} {one['arrived']}, touched {one['hits']}" for way, one in total["drives"].items()
        )
        lines.append(f"of {needles} {wanted['needle']} needles arrived untouched: {counts}")
    return lines
