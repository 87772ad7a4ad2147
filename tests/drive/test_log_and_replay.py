"""Logs of whole runs: killed writers lose nothing, and replay reaches the same decisions."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from ntagen.drive.log import Log, metadata_of
from ntagen.drive.reading import RunLog, read_log
from ntagen.drive.records import Ended, Estimated, Journals, Measured, Transition
from ntagen.drive.replay import Comparison, replay
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate
from ntagen.drive.states import Event, State
from ntagen.needle.virtual import Errors, VirtualNeedle
from ntagen.plan.rank import rank
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene
from tests.drive.runs import Diary
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import HIDDEN

ROOT = Path(__file__).parents[2]


def logged(path: Path, settings: Settings | None = None, noise_mm: float = 0.1) -> RunLog:
    """The log of a run with noise and a contact."""
    chosen = settings or Settings()
    with Log(path, metadata_of({"settings": chosen.to_json()}), {}) as log:
        simulate(HIDDEN, oracle_synthesis, chosen, log, known="C1", errors=Errors(noise_mm), seed=2)
    return read_log(path)


@pytest.fixture(scope="module")
def usual_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a run with the usual settings."""
    path = tmp_path_factory.mktemp("usual") / "run.mcap"
    logged(path)
    return path


@pytest.fixture(scope="module")
def usual(usual_path: Path) -> RunLog:
    """A run with the usual settings."""
    return read_log(usual_path)


def check_same(comparison: Comparison, *, complete: bool) -> None:
    assert comparison.is_same, comparison
    assert comparison.complete is complete


def test_a_run_is_decided_again_in_the_same_way(usual: RunLog) -> None:
    assert Event.FORCE.value in [r.event for r in usual.records if isinstance(r, Transition)]
    check_same(replay(usual, oracle_synthesis), complete=True)


@pytest.mark.parametrize("settings", [Settings(timeout_s=20.0), Settings(initial_push_mm=2.0)])
def test_runs_with_other_settings_and_ends_are_decided_again(
    tmp_path: Path, settings: Settings
) -> None:
    check_same(replay(logged(tmp_path / "run.mcap", settings), oracle_synthesis), complete=True)


@pytest.mark.parametrize("share", [0.1, 0.4, 0.6])
def test_a_torn_log_is_decided_again_up_to_the_tear(
    tmp_path: Path, usual_path: Path, share: float
) -> None:
    data = usual_path.read_bytes()
    (tmp_path / "torn.mcap").write_bytes(data[: int(len(data) * share)])
    check_same(replay(read_log(tmp_path / "torn.mcap"), oracle_synthesis), complete=False)


def test_an_interrupted_run_is_decided_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Interrupted(VirtualNeedle):
        """A needle whose operator loses patience."""

        def push(self, length_mm: float) -> None:
            if self.now_s() > 12.0:
                raise KeyboardInterrupt
            super().push(length_mm)

    monkeypatch.setattr("ntagen.drive.simulate.VirtualNeedle", Interrupted)
    run = logged(tmp_path / "run.mcap")
    assert State.INTERRUPTED.value in [r.outcome for r in run.records if isinstance(r, Ended)]
    check_same(replay(run, oracle_synthesis), complete=True)


def test_a_changed_measurement_is_noticed(usual: RunLog) -> None:
    place = next(
        i for i, r in enumerate(usual.records) if isinstance(r, Measured) and r.time_s > 4.0
    )
    measured = usual.records[place]
    assert isinstance(measured, Measured)
    x, y, z = measured.position_mm
    changed = replace(measured, position_mm=(x + 0.5, y, z))
    records = (*usual.records[:place], changed, *usual.records[place + 1 :])
    comparison = replay(replace(usual, records=records), oracle_synthesis)
    assert isinstance(comparison.logged, Estimated)
    assert isinstance(comparison.decided, Estimated)


def test_another_choice_of_plan_is_noticed(usual: RunLog) -> None:
    def other(scene: Scene) -> Synthesis:
        synthesis = oracle_synthesis(scene)
        return replace(synthesis, candidates=rank(synthesis.candidates, ("length",)))

    assert not replay(usual, other).is_same


def test_each_synthesis_is_attached_with_its_scene_model_and_plans(usual: RunLog) -> None:
    diary = Diary()
    simulate(
        HIDDEN,
        oracle_synthesis,
        Settings(),
        Journals(diary),
        known="C1",
        errors=Errors(0.1),
        seed=2,
    )
    for number, synthesis in enumerate(diary.syntheses, start=1):
        folder = f"rebuild-{number:04d}"
        assert {f"{folder}/scene.json", f"{folder}/model.xml"} <= set(usual.attachments)
        plans = json.loads(usual.attachments[f"{folder}/plans.json"])["plans"]
        assert len(plans) == min(200, len(synthesis.candidates))


@pytest.mark.parametrize(
    "after", [1, *(pytest.param(count, marks=pytest.mark.slow) for count in (30, 333))]
)
def test_a_killed_writer_loses_nothing_that_was_acknowledged(tmp_path: Path, after: int) -> None:
    path = tmp_path / "run.mcap"
    command = [sys.executable, "-m", "tests.drive.victim", str(path)]
    with subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as victim:
        assert victim.stdout is not None
        for _ in itertools.islice(victim.stdout, after):
            pass
        victim.kill()
        # What still was in the pipe was acknowledged before the kill, too.
        acknowledged = after + sum(line.endswith("\n") for line in victim.stdout)
    run = read_log(path)
    assert run.torn_at_byte is not None
    assert len(run.records) >= acknowledged >= after
    check_same(
        replay(run, oracle_synthesis), complete=any(isinstance(r, Ended) for r in run.records)
    )
