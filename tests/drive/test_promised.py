"""Runs that are won from somewhere on, by the estimate: what is promised, kept, and lost."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from ntagen.cli import main
from ntagen.drive.configure import Configuration, configure
from ntagen.drive.log import Log, metadata_of
from ntagen.drive.reading import RunLog, read_log
from ntagen.drive.records import Guaranteed, Journals, Promised, Transition
from ntagen.drive.replay import replay
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import Result, simulate, synthesiser_for
from ntagen.drive.states import Event, State
from ntagen.drive.story import tell
from tests.drive.runs import Diary
from tests.steering import scene, sphere

# A stiff needle and a large target.
THICK = replace(
    scene(
        sphere("C1", "critical", (9.0, -20.0, 0.0), 3.0),
        targets=[sphere("T1", "target", (0.0, -45.0, -9.0), 8.0)],
        name="thick",
    ).with_needle(scene().needle.tip, 100.0),
    safety="swept",
)


def configured(**changes: object) -> Configuration:
    """The settings of a phantom needle."""
    configuration = configure([], THICK, needle="phantom")
    settings = replace(configuration.settings, **changes)  # type: ignore[arg-type]
    return replace(configuration, settings=settings)


def drive(
    path: Path, *, seed: int = 1, settings: Settings | None = None
) -> tuple[Result, Diary, RunLog]:
    """A run, its diary and its log."""
    configuration, diary = configured(), Diary()
    chosen = settings or configuration.settings
    with Log(path, metadata_of({"settings": chosen.to_json()}), {}) as log:
        result = simulate(
            THICK,
            synthesiser_for(chosen),
            chosen,
            Journals(log, diary),
            make=configuration.needle.make,
            seed=seed,
        )
    return result, diary, read_log(path)


def check_decided_again(log: RunLog, settings: Settings) -> None:
    comparison = replay(log, synthesiser_for(settings))
    assert comparison.is_same, comparison
    assert comparison.complete


@pytest.mark.parametrize("seed", [1, 2])
def test_a_run_in_an_easy_task_is_won_on_the_way(tmp_path: Path, seed: int) -> None:
    result, diary, log = drive(tmp_path / "run.mcap", seed=seed)
    assert result.ended.outcome == State.TARGET_REACHED.value
    assert result.target_distance_mm < 0.0
    first, *later = diary.of(Promised)
    assert 0.0 < first.depth_mm < result.ended.depth_mm - 10.0
    assert first.branches >= 3
    assert first.confidence == 0.98
    assert 0.02 < first.curvature_ratio < 0.5
    assert 0.3 < first.tip_mm < 8.0
    # It is looked for anew at each review, and then says more.
    assert later[-1].tip_mm < first.tip_mm
    assert result.promised == first
    (kept,) = diary.of(Guaranteed)
    assert kept.reason == ""
    assert kept.most_off_mm < later[-1].tip_mm
    assert first.depth_mm < kept.until_mm <= result.ended.depth_mm
    said = tell(first) or ""
    assert f"{first.tip_mm:.2f} mm off for other reasons" in said
    assert "confidence of 0.98" in said
    check_decided_again(log, configured().settings)


def test_without_it_the_run_goes_by_plans(tmp_path: Path) -> None:
    settings = configured(guarantee=False).settings
    result, diary, log = drive(tmp_path / "run.mcap", settings=settings)
    assert result.ended.outcome == State.TARGET_REACHED.value
    assert result.promised is None
    assert diary.of(Promised) == diary.of(Guaranteed) == []
    check_decided_again(log, settings)


def test_a_needle_that_leaves_the_bounds_goes_on_by_plans(tmp_path: Path) -> None:
    # The estimator believes in a tissue that changes nothing.
    usual = configured().settings
    sure = replace(usual.priors, curvature_drift=1e-4, turn_drift_rad=1e-4, distortion_mm=0.0)
    settings = replace(usual, priors=sure, accept=0.5, review_mm=40.0)
    ended = None
    for seed in range(12):
        result, diary, log = drive(tmp_path / f"{seed}.mcap", seed=seed, settings=settings)
        lost = [one for one in diary.of(Guaranteed) if "off the nearest branch" in one.reason]
        if lost:
            ended = lost[0]
            break
    assert ended is not None
    assert diary.of(Promised)[0].depth_mm <= ended.until_mm < result.ended.depth_mm
    assert result.guaranteed is not None
    assert Event.OFF_TREE.value in [one.event for one in diary.of(Transition)]
    assert f"{ended.until_mm:.2f} mm" in (tell(ended) or "")
    check_decided_again(log, settings)


def test_the_command_line_says_what_is_guaranteed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    task, log = tmp_path / "thick.nsl", tmp_path / "run.mcap"
    task.write_text(
        "environment thick {\n"
        "  needle { tip (0, 0, 0) mm heading -y bevel +z radius 100 mm speed 1 mm/s }\n"
        "  motion { step 2 s roll by 90, 180, 270 deg at most 2 times at least 4 mm apart }\n"
        "  target T sphere (0, -45, -9) mm radius 8 mm\n"
        "  critical C sphere (9, -20, 0) mm radius 3 mm\n"
        "  safety swept\n"
        "}\n"
    )
    arguments = ["drive", str(task), "--needle", "phantom", "--seed", "1"]
    assert main([*arguments, "--json", "--log", str(log)]) == 0
    kept = json.loads(capsys.readouterr().out)["guarantee"]
    assert (kept["by"], kept["held"], kept["reason"]) == ("estimate", True, "")
    assert kept["from_mm"] < kept["until_mm"]
    assert kept["confidence"] == 0.98
    assert kept["most_off_mm"] < kept["tip_mm"]
    assert main(["replay", str(log)]) == 0
    assert "a strategy with 3 branches is guaranteed" in capsys.readouterr().out
    assert main(["plot", str(log), "-o", str(tmp_path / "run.png")]) == 0
    assert main([*arguments, "--json", "--set", "guarantee off"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["guarantee"] is None
    assert main([*arguments, "--set", "guarantee maybe"]) == 2
    assert "write `on` or `off`" in capsys.readouterr().err
