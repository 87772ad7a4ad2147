"""A campaign of policies: for each task a policy is learned, compared with its plan, and driven.

A *row* is a task: its best plan, the policy, and how both compare in tissues that learning has not
seen. With drives, simulated needles follow the plan blindly, plan again and again, and ask the
policy; needles with the same seed are the same. Workers, and the folder from which a campaign goes
on, are those of other campaigns.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any, Final, Literal

from ntagen.cluster.identity import identity
from ntagen.cluster.workers import require_same_version
from ntagen.drive.best_policy import best_policy, sampling_of
from ntagen.drive.blind import drive_blindly
from ntagen.drive.configure import Configuration, configure
from ntagen.drive.json_values import value_from_json
from ntagen.drive.records import Journals
from ntagen.drive.scene_json import scene_to_json
from ntagen.drive.simulate import simulate, synthesiser_for
from ntagen.drive.states import State
from ntagen.errors import InputError, NtagenError
from ntagen.experiment.crew import Crew, Done, work_off
from ntagen.experiment.random_tasks import name_of, random_task
from ntagen.experiment.store import Results, lines_in, taken
from ntagen.experiment.table import CONFIDENCE
from ntagen.files import write_files
from ntagen.nsl import Task, load_task, loads_task
from ntagen.parameters import BY_FIELD, Given
from ntagen.plan.policy import Aim, Policy
from ntagen.plan.steering import Comparison, Mean

if TYPE_CHECKING:
    from ntagen.plan.steering import Steered

NEEDLES: Final = ("phantom", "virtual")
"""The simulated needles that can be driven."""

WAYS: Final = ("plan", "re-planning", "policy")
"""How needles are driven: by the plan blindly, as without a policy, and by the policy."""

TABLE: Final = "table.json"


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is done for each task.

    Attributes:
        aim: What plans and policies are to be the best for.
        runs: A policy is learned from this number of runs.
        drives: So many needles are driven in each way.
        needle: Which: one of `NEEDLES`.
    """

    aim: Aim
    runs: int
    drives: int
    needle: str = NEEDLES[0]


@dataclass(frozen=True, slots=True)
class Drives:
    """How needles fared that were driven in one way.

    Attributes:
        arrived: So many tips truly are in the target, and touched no critical region.
        hits: So many touched one.
    """

    arrived: int
    hits: int


@dataclass(frozen=True, slots=True)
class Row:
    """What a campaign says of a task.

    Attributes:
        task: Its name.
        seed: The seed of learning; that of the task, too, if it is a random one.
        verdict: ``found``; ``none`` if there is no plan, ``unknown`` if the search did not end, and
            ``refused`` if the task is none for a policy.
        reason: Why it is refused, or empty.
        plan: The plan, in words.
        is_silent: Whether the policy never differs from the plan.
        guard: What decided that.
        compared: How the policy compares with the plan in other tissues.
        learning_runs: From how many runs it was learned, with those that judged it.
        drives: By way (`WAYS`); empty without drives.
        seconds: The computer's time for all of it.
    """

    task: str
    seed: int
    verdict: Literal["found", "none", "unknown", "refused"]
    reason: str = ""
    plan: str = ""
    is_silent: bool = False
    guard: Comparison | None = None
    compared: Comparison | None = None
    learning_runs: int = 0
    drives: dict[str, Drives] = field(default_factory=dict)
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class TaskJob:
    """A task of a campaign.

    Attributes:
        id: Its name.
        path: Its file; None for a random task.
        seed: See `Row.seed`.
        wanted: What is done.
        digest: Tasks with the same digest give the same rows.
        version: The ntagen that must do it (`ntagen.cluster.identity`).
        folder: Where row and policy go; None to keep neither.
    """

    id: str
    path: Path | None
    seed: int
    wanted: Wanted
    digest: str = ""
    version: str = ""
    folder: Path | None = None

    @property
    def name(self) -> str:
        """Its name."""
        return self.id

    def load(self) -> Task:
        """The task.

        Raises:
            InputError: The file has mistakes.
        """
        return loads_task(random_task(self.seed)) if self.path is None else load_task(self.path)

    def make(self) -> list[Row]:
        """Learns, compares and drives; the row is on the disk at once if there is a folder.

        Raises:
            InputError: This is another version of ntagen, the task has changed, or nothing can be
                written.
        """
        kept = "" if self.folder is None else ", then go on with --resume"
        require_same_version(self.version, kept)
        since_s = time.perf_counter()
        task = self.load()
        if _digest_of(self, task) != self.digest:
            raise InputError(f"{self.path} has changed\nhint: restore it, and go on with --resume")
        row, policy = _made(self, task)
        row = replace(row, seconds=time.perf_counter() - since_s)
        if self.folder is not None:
            self._keep(self.folder, row, policy)
        return [row]

    def _keep(self, folder: Path, row: Row, policy: Policy | None) -> None:
        """Writes the policy, the text of a random task, and then the row."""
        texts = {} if policy is None else {folder / f"{self.id}.policy.json": policy.text()}
        if self.path is None:
            texts[folder / f"{self.id}.nsl"] = random_task(self.seed)
        write_files(texts)
        with Results(folder, self.id) as results:
            results.add(json.dumps(asdict(row), allow_nan=False).encode() + b"\n")


@dataclass(frozen=True, slots=True)
class PolicyCampaign:
    """Tasks, and what is done for each.

    Attributes:
        wanted: What is done.
        rows: The tasks, in the order of the table.
    """

    wanted: Wanted
    rows: tuple[TaskJob, ...]

    @property
    def name(self) -> str:
        """Its name, for people."""
        return f"policies for {self.wanted.aim}"

    @property
    def digest(self) -> str:
        """Of all rows."""
        facts = [[row.id, row.digest] for row in self.rows]
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def campaign_of(
    files: Sequence[Path], random_tasks: int, seed: int, wanted: Wanted
) -> PolicyCampaign:
    """The campaign for some files and some random tasks.

    Args:
        files: Environments; policies are learned with this seed.
        random_tasks: So many random tasks, with this seed and those after it.
        seed: The first seed.
        wanted: What is done for each.

    Raises:
        InputError: There is no task, two have the same name, or a file has mistakes.
    """
    jobs = [TaskJob(path.stem, path.absolute(), seed, wanted) for path in files]
    seeds = range(seed, seed + random_tasks)
    jobs += [TaskJob(name_of(one), None, one, wanted) for one in seeds]
    if not jobs:
        raise InputError("there is no task\nhint: give files, or --random N for N random tasks")
    seen: set[str] = set()
    for job in jobs:
        if job.id.lower() in seen:
            raise InputError(f"two tasks have the name {job.id}\nhint: rename a file")
        seen.add(job.id.lower())
    checked = [replace(job, digest=_digest_of(job, job.load()), version=identity()) for job in jobs]
    return PolicyCampaign(wanted, tuple(checked))


def carry_out(
    campaign: PolicyCampaign,
    crew_of: Callable[[], Crew[TaskJob]],
    notify: Callable[[Row], None],
    folder: Path | None = None,
    *,
    resume: bool = False,
) -> dict[str, Any]:
    """Makes the rows that are missing.

    Args:
        campaign: What to make.
        crew_of: Engages who makes it; is not called if nothing is missing.
        notify: Is told of each row, also of those that the folder holds.
        folder: The folder for rows, policies, random tasks and the table; None to keep nothing.
        resume: Whether the folder may hold rows of this campaign.

    Returns:
        The table, as `document_of` makes it.

    Raises:
        InputError: The folder cannot be used, or somebody cannot work.
        KeyboardInterrupt: The user wants an end.
    """
    folder = None if folder is None else folder.absolute()
    place = contextlib.nullcontext() if folder is None else taken(folder, campaign, resume=resume)
    with place:
        rows = {} if folder is None else finished(folder, campaign)
        for row in rows.values():
            notify(row)
        missing = [replace(job, folder=folder) for job in campaign.rows if job.id not in rows]

        def take(done: Done[TaskJob]) -> list[TaskJob]:
            made = done.made or [
                Row(done.job.id, done.job.seed, "refused", "its worker died, perhaps of memory")
            ]
            for row in made:
                rows[row.task] = row
                notify(row)
            return []

        if missing:
            work_off(crew_of(), missing, take)
        document = document_of(campaign, rows)
        if folder is not None:
            write_files({folder / TABLE: json.dumps(document, indent=1, allow_nan=False) + "\n"})
    return document


def finished(folder: Path, campaign: PolicyCampaign) -> dict[str, Row]:
    """The finished rows of a campaign that its folder holds, by task."""
    wanted = {job.id for job in campaign.rows}
    return {row.task: row for row in _rows_in(folder) if row.task in wanted}


def _rows_in(folder: Path) -> Iterator[Row]:
    for line in lines_in(folder):
        with contextlib.suppress(ValueError):
            yield value_from_json(json.loads(line), Row)


def document_of(campaign: PolicyCampaign, rows: Mapping[str, Row]) -> dict[str, Any]:
    """The table as plain data: what was wanted, the rows that are done, and their sum."""
    done = [rows[job.id] for job in campaign.rows if job.id in rows]
    return {
        "ntagen": identity(),
        "wanted": asdict(campaign.wanted),
        "tasks": len(campaign.rows),
        "confidence": CONFIDENCE,
        "rows": [asdict(row) for row in done],
        "sum": _sum_of(done),
    }


def _sum_of(rows: Sequence[Row]) -> dict[str, Any]:
    """How many tasks came to what, the mean difference over tasks, and all drives together."""
    found = [row for row in rows if row.compared is not None]
    kept = [row for row in found if not row.is_silent]
    verdicts = [row.compared.verdict for row in found if row.compared is not None]
    drives: dict[str, dict[str, int]] = {}
    for way in WAYS:
        made = [row.drives[way] for row in found if way in row.drives]
        if made:
            counted = {"arrived": sum(one.arrived for one in made)}
            drives[way] = counted | {"hits": sum(one.hits for one in made)}
    return {
        **{word: sum(row.verdict == word for row in rows) for word in ("found", "none", "unknown")},
        "refused": sum(row.verdict == "refused" for row in rows),
        **{word: verdicts.count(word) for word in ("better", "alike", "worse")},
        "silent": len(found) - len(kept),
        "difference": _mean_of(found),
        "kept_difference": _mean_of(kept),
        "drives": drives,
    }


def _mean_of(rows: Sequence[Row]) -> dict[str, float] | None:
    """The mean difference over tasks, with Student's interval; None for fewer than two."""
    values = [row.compared.difference.value for row in rows if row.compared is not None]
    if len(values) < 2:
        return None
    # Importing the statistics of SciPy takes 0.5 s; this function is all of it.
    from scipy.special import stdtrit  # type: ignore[import-untyped]

    mean, error = fmean(values), stdev(values) / math.sqrt(len(values))
    half = float(stdtrit(len(values) - 1, 0.5 + 0.5 * CONFIDENCE)) * error
    return asdict(Mean(mean, mean - half, mean + half))


def _digest_of(job: TaskJob, task: Task) -> str:
    """The digest of a task and of what is done for it."""
    given = [[one.parameter.field, one.value] for one in task.given]
    facts = [scene_to_json(task.scene), given, job.seed, asdict(job.wanted)]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def _made(job: TaskJob, task: Task) -> tuple[Row, Policy | None]:
    """The row of a task, and its policy if there is one."""
    wanted = job.wanted
    row = Row(job.id, job.seed, "found")
    # The workers share the processors already.
    sampling = replace(sampling_of(wanted.runs, job.seed), threads=1)
    try:
        best, steered = best_policy(task, wanted.aim, sampling)
        if steered is None:
            return replace(row, verdict=best.verdict), None
        drives = _drives(steered, task, wanted)
    except NtagenError as error:  # one task must not end a campaign of a hundred
        reason, *_ = str(error).splitlines()
        return replace(row, verdict="refused", reason=reason), None
    row = replace(
        row,
        plan=str(steered.plan),
        is_silent=steered.policy.is_silent,
        guard=steered.guard,
        compared=steered.aims[wanted.aim],
        learning_runs=steered.learning_runs,
        drives=drives,
    )
    return row, steered.policy


def _drives(steered: Steered, task: Task, wanted: Wanted) -> dict[str, Drives]:
    """How needles fare that are driven in each way; their seeds are 1, 2, and so on."""
    if not wanted.drives:
        return {}
    found: dict[str, Drives] = {}
    for way in WAYS:
        if way == "policy" and steered.policy.is_silent:
            # It is driven as without a policy, so nothing new would be seen.
            found[way] = found["re-planning"]
            continue
        seeds = range(1, wanted.drives + 1)
        ends = [_end(way, steered, task, wanted.needle, seed) for seed in seeds]
        found[way] = Drives(
            arrived=sum(is_there and not is_hit for is_there, is_hit in ends),
            hits=sum(is_hit for _, is_hit in ends),
        )
    return found


def _end(way: str, steered: Steered, task: Task, needle: str, seed: int) -> tuple[bool, bool]:
    """Whether a needle arrived in the target, and whether it touched a critical region."""
    configuration = _configuration(task, needle, seed)
    if way == "plan":
        blind = drive_blindly(steered.plan, task.scene, configuration, seed)
        return blind.is_reached, blind.clearance_mm <= 0.0
    settings = configuration.settings
    result = simulate(
        task.scene,
        synthesiser_for(settings),
        settings,
        Journals(),
        errors=configuration.errors,
        make=configuration.needle.made_in(task.scene),
        seed=seed,
        policy=steered.policy if way == "policy" else None,
    )
    says_reached = result.ended.outcome == State.TARGET_REACHED.value
    return says_reached and result.target_distance_mm <= 0.0, result.clearance_mm <= 0.0


def _configuration(task: Task, needle: str, seed: int) -> Configuration:
    given = Given(BY_FIELD["needle.seed"], seed, "campaign")
    return configure((*task.given, given), task.scene, needle=needle)
