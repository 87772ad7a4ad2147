"""Makes runs: what a worker does, in a process of its own or on another machine."""

from __future__ import annotations

import functools
import gc
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ntagen.cluster.workers import require_same_version
from ntagen.drive.configure import Configuration
from ntagen.drive.log import Log
from ntagen.drive.log_facts import facts_of
from ntagen.drive.outcome import Driven
from ntagen.drive.records import Journal, JournalError, Journals
from ntagen.drive.simulate import Result, simulate, synthesiser_for
from ntagen.drive.states import State
from ntagen.errors import InputError
from ntagen.experiment.description import Row, digest_of
from ntagen.experiment.record import Observer, Run, Synthesised, line_of
from ntagen.experiment.store import Results, finished_in, new_log
from ntagen.nsl import Task, load_task

if TYPE_CHECKING:
    from ntagen.lab.lab import Truth

FAILED = "failed"
"""The outcome of a run in which the driver broke."""


@dataclass(frozen=True, slots=True)
class Block:
    """Some runs of a row that one worker makes, one after the other.

    Attributes:
        row: The row; its seeds count for nothing here.
        seeds: The seeds of the runs, in the order in which they are made.
        folder: The folder of the experiment; absolute.
        version: The ntagen that must make them (`ntagen.cluster.identity`).
        logs: Whether each run has a log.
    """

    row: Row
    seeds: tuple[int, ...]
    folder: Path
    version: str
    logs: bool = True

    @property
    def name(self) -> str:
        """A name that no block with other runs has."""
        return f"{self.row.id}-{self.seeds[0]}-{self.seeds[-1]}-{len(self.seeds)}"

    def make(self) -> list[Run]:
        """As `make_block`."""
        return make_block(self)


def make_block(block: Block, notify: Callable[[Run], None] = lambda _: None) -> list[Run]:
    """Makes the runs of a block that are not finished yet; each is on the disk at once.

    Args:
        block: The block.
        notify: Is told of each run that is on the disk.

    Returns:
        All runs of the block, in its order.

    Raises:
        InputError: This is another version of ntagen, the scene is not that of the row, or a run
            cannot be written.
    """
    require_same_version(block.version, ", then go on with --resume")
    task = _task(block.row.scenario)
    if digest_of(block.row, task) != block.row.digest:
        _task.cache_clear()
        raise InputError(
            f"{block.row.scenario} has changed, or is another file on the machine of a worker\n"
            "hint: restore it, and go on with --resume"
        )
    made = finished_in(block.folder, block.name)
    with Results(block.folder, block.name) as results:
        for seed in block.seeds:
            if seed not in made or (block.logs and not Path(block.folder, made[seed].log).exists()):
                made[seed] = _made(block, task, seed)
                results.add(line_of(made[seed]))
                notify(made[seed])
    return [made[seed] for seed in block.seeds]


@functools.lru_cache(maxsize=8)
def _task(path: Path) -> Task:
    task = load_task(path)
    # Nothing that was loaded is garbage: the collector need not look at it again and again.
    gc.freeze()
    return task


def _made(block: Block, task: Task, seed: int) -> Run:
    """Makes a run with its log, if one is wanted."""
    since = time.perf_counter()
    configuration = block.row.configuration(task, seed)
    if block.logs:
        run = _logged(block, task, configuration, seed)
    else:
        run = _driven(block.row, task, configuration, seed, (), "")
    return replace(run, seconds=time.perf_counter() - since)


def _logged(block: Block, task: Task, configuration: Configuration, seed: int) -> Run:
    tracker = "" if block.row.speed is None else "openigtlink, that of the lab"
    facts = facts_of(block.row.scenario, task.scene, configuration, block.row.known, tracker)
    with new_log(block.folder, block.row.id, seed) as (path, name):
        try:
            with Log(path, *facts, is_kept_up=False) as log:
                return _driven(block.row, task, configuration, seed, (log,), name)
        except JournalError as error:
            # The message names the file as it is called now, and has a hint for a single run.
            reason = str(error).partition("\nhint: ")[0].rpartition(": ")[2]
            raise InputError(
                f"cannot write the log {Path(block.folder, name)}: {reason}\n"
                "hint: make room, and go on with --resume"
            ) from error


def _driven(
    row: Row,
    task: Task,
    configuration: Configuration,
    seed: int,
    logs: Sequence[Journal],
    name: str,
) -> Run:
    """Drives, and keeps what counts. If the driver breaks, that is a result, too."""
    observer = Observer(task.scene)
    try:
        if row.speed is not None:
            # A lab opens ports: what that takes is imported for its rows only.
            from ntagen.experiment.in_lab import driven_in_lab

            journal = Journals(*logs, observer)
            made = driven_in_lab(task, configuration, row.known, row.speed, journal)
            return _run(row, seed, made.driven, made.truth, observer, name)
        result = simulate(
            task.scene,
            synthesiser_for(configuration.settings),
            configuration.settings,
            Journals(*logs, observer),
            known=row.known,
            errors=configuration.errors,
            make=configuration.needle.made_in(task.scene),
            seed=seed,
        )
    except (OSError, MemoryError):
        raise
    except Exception as error:  # a bug in one run must not end a campaign of thousands
        return _broken(row, seed, error, name)
    return _run(row, seed, result, result, observer, name)


def _run(
    row: Row,
    seed: int,
    driven: Driven,
    truth: Truth | Result,
    observer: Observer,
    log: str,
) -> Run:
    """What is kept of a run.

    The truth is that of the needle, which knows its own path: its clearance, and the distance of
    its tip to the target.
    """
    ended = driven.ended
    says_reached = ended.outcome == State.TARGET_REACHED.value
    clear_mm, target_mm = truth.clearance_mm, truth.target_distance_mm
    return Run(
        row=row.id,
        seed=seed,
        outcome=ended.outcome,
        reason=ended.reason,
        is_reached=says_reached and target_mm <= 0.0,
        is_hit=clear_mm <= 0.0,
        clearance_mm=clear_mm if math.isfinite(clear_mm) else None,
        target_mm=target_mm,
        depth_mm=ended.depth_mm,
        adjustments=ended.adjustments,
        cut_mm=ended.cut_mm,
        confidence=ended.confidence if says_reached else None,
        error_mm=ended.error_mm if says_reached else None,
        needle_s=ended.time_s,
        syntheses=tuple(
            Synthesised(one.found, one.hold, one.engine_seconds, one.loop_seconds)
            for one in driven.syntheses
        ),
        profile=observer.profile,
        felt=observer.felt,
        log=log,
    )


def _broken(row: Row, seed: int, error: Exception, log: str) -> Run:
    """The run of a driver that broke: it reached nothing, and nobody knows the rest."""
    said = " ".join(str(error).split())
    return Run(row.id, seed, FAILED, f"{type(error).__name__}: {said}", log=log)
