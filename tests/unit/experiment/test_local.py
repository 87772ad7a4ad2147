"""Worker processes: the same table on any number of them, and workers that die."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from ntagen.drive.configure import Configuration
from ntagen.experiment import local
from ntagen.experiment.campaign import Progress, carry_out
from ntagen.experiment.crew import Crew, Done, Here
from ntagen.experiment.description import Row
from ntagen.experiment.local import LocalCrew
from ntagen.experiment.making import Block
from ntagen.experiment.reading import read_experiment
from ntagen.experiment.record import Run
from ntagen.experiment.table import timeless
from ntagen.nsl import Task
from tests.unit.experiment.files import written

TEXT = '[[row]]\nscenario = ["large_mid_cr.nsl", "no_cr.nsl"]\nnoise = 0.1\nseeds = 6\n'


class Deadly(LocalCrew):
    """Kills the first worker that has made a run of a block with several."""

    def __init__(self, folder: Path) -> None:
        super().__init__(2)
        self._folder = folder
        self.killed = 0

    def wait(self) -> list[Done]:
        while not self.killed and not self._is_in_the_middle():
            pass
        if not self.killed:
            os.kill(self._pids()[0], signal.SIGKILL)
            self.killed = 1
        return super().wait()

    def _pids(self) -> list[int]:
        """The numbers of the processes that are making a block."""
        return [pid for worker, _ in self._busy.values() if (pid := worker.pid) is not None]

    def _is_in_the_middle(self) -> bool:
        return bool(self._pids()) and any((self._folder / "runs").glob(".*.part"))


def made(
    tmp_path: Path,
    folder: str,
    crew: Callable[[], Crew],
    notify: Callable[[Progress], None] = lambda _: None,
    *,
    resume: bool = False,
) -> Mapping[str, Any]:
    experiment = read_experiment(written(tmp_path, TEXT))
    return carry_out(experiment, tmp_path / folder, crew, resume=resume, notify=notify).document


@pytest.mark.slow
def test_any_number_of_workers_gives_the_same_table(tmp_path: Path) -> None:
    one, three = (made(tmp_path, f"x{n}", lambda n=n: LocalCrew(n)) for n in (1, 3))
    assert timeless(one) == timeless(three) == timeless(made(tmp_path, "here", Here))


@pytest.mark.slow
def test_a_worker_that_is_killed_in_the_middle_is_replaced(tmp_path: Path) -> None:
    crews: list[Deadly] = []
    notes: list[str] = []

    def crew() -> Deadly:
        crews.append(Deadly(tmp_path / "x"))
        return crews[0]

    def note(progress: Progress) -> None:
        notes.append(progress.note)

    document = made(tmp_path, "x", crew, notify=note)
    assert crews[0].killed == 1
    assert any("a worker died at seed" in one for one in notes)
    assert document["lost"] == []
    assert timeless(document) == timeless(made(tmp_path, "here", Here))
    assert not list((tmp_path / "x" / "runs").glob(".*"))


def deadly_block(block: Block) -> list[Run]:
    """Makes a block, and dies at the seed 3 of the scene without regions."""
    from ntagen.experiment import making

    drive = making._driven

    def driven(row: Row, task: Task, configuration: Configuration, seed: int, *rest: object) -> Run:
        if (row.scenario.stem, seed) == ("no_cr", 3):
            os.kill(os.getpid(), signal.SIGKILL)
        return drive(row, task, configuration, seed, *rest)  # type: ignore[arg-type]

    making._driven = driven
    return making.make_block(block)


@pytest.mark.slow
def test_a_run_that_kills_its_worker_twice_is_given_up_and_the_rest_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(local, "made_by", deadly_block)
    document = made(tmp_path, "x", lambda: LocalCrew(2))
    assert document["lost"] == [{"row": "no_cr", "seed": 3, "reason": "its worker died 2 times"}]
    assert [row["runs"] for row in document["rows"]] == [6, 5]
    monkeypatch.undo()
    # What was given up is tried again when somebody goes on.
    again = made(tmp_path, "x", lambda: LocalCrew(1), resume=True)
    assert [row["runs"] for row in again["rows"]] == [6, 6]
    assert again["lost"] == []


@pytest.mark.slow
def test_a_script_without_a_main_part_gets_a_hint(tmp_path: Path) -> None:
    written(tmp_path, TEXT)
    script = tmp_path / "script.py"
    script.write_text("import ntagen\nntagen.campaign('quick.toml', workers=1)\n", "utf-8")
    paths = os.pathsep.join([str(Path(__file__).resolve().parents[3]), *sys.path])
    ended = subprocess.run(
        [sys.executable, str(script)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ended.returncode == 1
    assert "a worker cannot start workers" in ended.stderr
    last = ended.stderr.splitlines()[-2:]
    assert "workers end before they begin" in last[0]
    assert last[1].startswith("hint: a script must call this below `if __name__")
