"""Makes all runs of an experiment that are missing, and its table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from ntagen.cluster.identity import identity
from ntagen.experiment.crew import Crew, Done, work_off
from ntagen.experiment.description import Experiment, Row
from ntagen.experiment.making import Block
from ntagen.experiment.record import Run
from ntagen.experiment.report import section_of
from ntagen.experiment.results import Campaign
from ntagen.experiment.store import finished, finished_in, taken
from ntagen.experiment.table import document_of
from ntagen.nsl import load
from ntagen.scene import Scene

_DEATHS: Final = 2
"""A run that kills its worker so often is given up."""

_BLOCK_RUNS: Final = 10
"""Most runs in a block. To hand over a block takes milliseconds, a run a quarter of a second."""

_SHARES: Final = 8
"""A block has at most this share of what one worker still has to do. So blocks become smaller, and
the last worker does not end long after the others."""

Key = tuple[str, int]


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is.

    Attributes:
        done: The number of runs that are finished or given up.
        of: The number of all runs.
        before: The number of runs that were finished when this campaign began.
        reached: The finished runs that reached the target.
        hits: The finished runs that hit a critical region.
        note: Something that a person should know, or empty.
    """

    done: int
    of: int
    before: int
    reached: int
    hits: int
    note: str = ""


def carry_out(
    experiment: Experiment,
    folder: Path,
    crew_of: Callable[[], Crew[Block]],
    *,
    resume: bool = False,
    logs: bool = True,
    notify: Callable[[Progress], None] = lambda _: None,
) -> Campaign:
    """Makes the runs that are missing, and writes the table and the report.

    Args:
        experiment: What to make.
        folder: The folder for all results.
        crew_of: Engages who makes it; is not called if nothing is missing.
        resume: Whether the folder may hold runs of this experiment.
        logs: Whether each run has a log.
        notify: Is told after each block.

    Returns:
        The table, and what can be made of it.

    Raises:
        InputError: The folder cannot be used, or somebody cannot work.
        KeyboardInterrupt: The user wants an end. All finished runs are on the disk.
    """
    folder = folder.absolute()
    with taken(folder, experiment, resume=resume):
        scenes = _scenes_of(experiment)
        with Sections(experiment, scenes) as sections:
            runs = finished(folder, experiment)
            work = _Work(experiment, folder, logs, notify, sections, runs)
            work.make(crew_of)
            document = document_of(experiment, work.runs, work.lost)
            made = Campaign(document, folder, scenes, sections.texts())
        made.write()
    return made


def _scenes_of(experiment: Experiment) -> dict[str, Scene]:
    """The scene of each row, by the name of the row."""
    scenes = {path: load(path) for path in {row.scenario for row in experiment.rows}}
    return {row.id: scenes[row.scenario] for row in experiment.rows}


@dataclass(slots=True)
class _Work:
    """What is finished and what is missing."""

    experiment: Experiment
    folder: Path
    logs: bool
    notify: Callable[[Progress], None]
    sections: Sections
    runs: dict[Key, Run]
    lost: dict[Key, str] = field(default_factory=dict)
    deaths: Counter[Key] = field(default_factory=Counter)
    missing: Counter[str] = field(default_factory=Counter)
    before: int = 0
    reached: int = 0
    hits: int = 0

    def make(self, crew_of: Callable[[], Crew[Block]]) -> None:
        """Makes what is missing."""
        self.before = len(self.runs)
        self.missing.update({row.id: len(row.seeds) for row in self.experiment.rows})
        self._count(self.runs.values())
        self._tell()
        if self.before == self.experiment.runs:
            return
        crew = crew_of()
        work_off(crew, self._blocks(crew.size), self._take)

    def _take(self, done: Done[Block]) -> list[Block]:
        """Takes a block that is over, and gives what is to be made in its place."""
        if done.made is None:
            return self._left_by_death(done.job)
        self._add(done.made)
        return []

    def _blocks(self, workers: int) -> Iterator[Block]:
        """The missing runs, in blocks."""
        missing = self.experiment.runs - len(self.runs)
        for row in self.experiment.rows:
            seeds = tuple(seed for seed in row.seeds if (row.id, seed) not in self.runs)
            while seeds:
                size = max(1, min(_BLOCK_RUNS, missing // (workers * _SHARES)))
                part, seeds = seeds[:size], seeds[size:]
                missing -= len(part)
                yield Block(row, part, self.folder, identity(), self.logs)

    def _add(self, runs: list[Run]) -> None:
        """Adds finished runs."""
        new = {run.key: run for run in runs if run.key not in self.runs}
        self.runs.update(new)
        self._count(new.values())
        self._tell()

    def _count(self, runs: Iterable[Run]) -> None:
        """Counts new runs: to count all of them after each block would take ever longer.

        The section of a row is drawn with its last run.
        """
        for run in runs:
            self.reached += run.is_reached
            self.hits += run.is_hit
            self.missing[run.row] -= 1
            if not self.missing[run.row]:
                self.sections.draw(run.row, self.runs)

    def _left_by_death(self, block: Block) -> list[Block]:
        """What is left of a block whose worker died: the run at which it died is the first one."""
        made = finished_in(self.folder, block.name)
        self._add([run for run in made.values() if run.seed in block.seeds])
        left = [seed for seed in block.seeds if seed not in made]
        if not left:
            return []
        key = (block.row.id, left[0])
        self.deaths[key] += 1
        if self.deaths[key] < _DEATHS:
            self._tell(f"a worker died at seed {left[0]} of {block.row.id}; it is made again")
        else:
            self.lost[key] = f"its worker died {_DEATHS} times"
            left = left[1:]
            self._tell(f"given up: seed {key[1]} of {key[0]}, where a worker died twice")
        return [replace(block, seeds=tuple(left))] if left else []

    def _tell(self, note: str = "") -> None:
        self.notify(
            Progress(
                done=len(self.runs) + len(self.lost),
                of=self.experiment.runs,
                before=self.before,
                reached=self.reached,
                hits=self.hits,
                note=note,
            )
        )


class Sections:
    """The sections of the report, for some rows; use it as a context manager.

    A section takes as long to draw as a run or two to make, and depends on the runs of its row
    only. So it is drawn in a thread as soon as they are complete, while the workers make those of
    other rows.

    Args:
        experiment: The rows.
        scenes: The scene of each row, by the name of the row.
    """

    def __init__(self, experiment: Experiment, scenes: Mapping[str, Scene]) -> None:
        self._experiment = experiment
        self._scenes = scenes
        self._pool = ThreadPoolExecutor(1)
        self._drawn: dict[str, Future[str]] = {}

    def __enter__(self) -> Sections:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def draw(self, name: str, runs: Mapping[Key, Run]) -> None:
        """Begins to draw the section of a row.

        Args:
            name: The row.
            runs: All its runs, and perhaps those of other rows.
        """
        row = next(row for row in self._experiment.rows if row.id == name)
        own = {(name, seed): runs[name, seed] for seed in row.seeds}
        self._drawn[name] = self._pool.submit(self._draw, row, own)

    def texts(self) -> dict[str, str]:
        """The sections, by the name of the row; waits until they are drawn."""
        return {name: future.result() for name, future in self._drawn.items()}

    def _draw(self, row: Row, runs: Mapping[Key, Run]) -> str:
        document = document_of(replace(self._experiment, rows=(row,)), runs)
        return section_of(document, row.id, self._scenes[row.id])
