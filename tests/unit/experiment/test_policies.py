"""Campaigns of policies: rows, sums, going on, and the command."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from ntagen import cli
from ntagen.drive.blind import drive_blindly
from ntagen.drive.configure import configure
from ntagen.errors import InputError
from ntagen.experiment import policies
from ntagen.experiment.crew import Here
from ntagen.experiment.policies import (
    Drives,
    Row,
    TaskJob,
    Wanted,
    campaign_of,
    carry_out,
    document_of,
    finished,
)
from ntagen.experiment.random_tasks import random_task
from ntagen.nsl import load_task, loads_task
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.policy import Policy, read_policy
from ntagen.plan.steering import Comparison, Mean
from ntagen.units import rad_from_deg

ROOT = Path(__file__).resolve().parents[3]
CHANCE = ROOT / "examples" / "chance" / "chance.nsl"
FEW = Wanted("probability", runs=200, drives=0)


def found(task: str, gain: float, low: float, *, is_silent: bool = False) -> Row:
    """A row whose policy is better by so much."""
    difference = Mean(gain, low, 2.0 * gain - low)
    compared = Comparison(Mean(0.5, 0.4, 0.6), Mean(0.6, 0.5, 0.7), difference, 100, 0.95)
    drives = {way: Drives(2, 1) for way in policies.WAYS}
    return Row(task, 1, "found", is_silent=is_silent, compared=compared, drives=drives)


ROWS = {
    "random_1": found("random_1", 0.1, 0.05),
    "random_2": found("random_2", 0.0, 0.0, is_silent=True),
    "random_3": Row("random_3", 3, "none"),
    "random_4": found("random_4", -0.1, -0.12),
    "random_5": Row("random_5", 5, "refused", "a reason"),
}


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Rows are made at once; the tasks that were made, in their order."""
    made: list[str] = []

    def at_once(job: TaskJob, _: object) -> tuple[Row, Policy | None]:
        made.append(job.id)
        if job.id == "random_99":
            raise KeyboardInterrupt
        return ROWS[job.id], None

    monkeypatch.setattr(policies, "_made", at_once)
    return made


def timeless(document: dict[str, Any]) -> dict[str, Any]:
    """A table without what the computer took."""
    return document | {"rows": [row | {"seconds": 0.0} for row in document["rows"]]}


def test_random_tasks_are_the_same_for_a_seed_and_have_chance() -> None:
    texts = [random_task(seed) for seed in range(30)]
    assert len(set(texts)) == len(texts)
    assert texts == [random_task(seed) for seed in range(30)]
    for text in texts:
        scene = loads_task(text).scene
        assert scene.tissue.is_stochastic
        assert len(scene.targets) == 1
        assert 1 <= len(scene.criticals) <= 3


def test_the_sum_counts_tasks_and_drives() -> None:
    total = document_of(campaign_of([], 5, 1, Wanted("probability", 200, 3)), ROWS)["sum"]
    words = ("found", "none", "unknown", "refused", "better", "alike", "worse", "silent")
    assert [total[word] for word in words] == [3, 1, 0, 1, 1, 1, 1, 1]
    assert total["difference"]["value"] == pytest.approx(0.0)
    # Student's t for two degrees of freedom is 4.3027, and the standard error 0.1 / sqrt(3).
    assert total["difference"]["upper"] == pytest.approx(4.3027 * 0.1 / 3.0**0.5, rel=1e-4)
    assert total["kept_difference"]["value"] == pytest.approx(0.0)
    assert total["drives"] == {way: {"arrived": 6, "hits": 3} for way in policies.WAYS}


def test_a_mean_needs_two_tasks() -> None:
    campaign = campaign_of([], 2, 1, FEW)
    assert document_of(campaign, {"random_1": ROWS["random_1"]})["sum"]["difference"] is None


def test_a_campaign_goes_on_where_it_was_ended(tmp_path: Path, quick: list[str]) -> None:
    notes: list[Row] = []
    first, whole = campaign_of([], 5, 1, FEW), tmp_path / "whole"
    wanted = carry_out(first, Here, notes.append, whole)
    assert quick == [row.task for row in notes] == list(ROWS)
    assert json.loads((whole / "table.json").read_text("utf-8")) == wanted
    assert (whole / "random_2.nsl").read_text("utf-8") == random_task(2)
    part = tmp_path / "part"
    with pytest.raises(KeyError):  # there is no row 6: the campaign ends in the middle
        carry_out(campaign_of([], 6, 1, FEW), Here, notes.append, part)
    assert set(finished(part, first)) == set(ROWS)
    quick.clear()
    ROWS["random_6"] = replace(ROWS["random_3"], task="random_6")
    try:
        again = carry_out(campaign_of([], 6, 1, FEW), Here, notes.append, part, resume=True)
    finally:
        del ROWS["random_6"]
    assert quick == ["random_6"]
    assert timeless({**again, "rows": again["rows"][:5]})["rows"] == timeless(wanted)["rows"]


def test_another_campaign_is_refused(tmp_path: Path, quick: list[str]) -> None:
    carry_out(campaign_of([], 2, 1, FEW), Here, lambda _: None, tmp_path)
    with pytest.raises(InputError, match=r"holds an experiment already\nhint: go on with it by"):
        carry_out(campaign_of([], 2, 1, FEW), Here, lambda _: None, tmp_path)
    other = campaign_of([], 2, 1, replace(FEW, runs=400))
    with pytest.raises(InputError, match="row random_1 or its scene has changed"):
        carry_out(other, Here, lambda _: None, tmp_path, resume=True)
    assert quick == ["random_1", "random_2"]


def test_a_worker_of_another_version_is_refused() -> None:
    job = replace(campaign_of([], 1, 1, FEW).rows[0], version="9.9.9")
    with pytest.raises(InputError, match="another version of ntagen"):
        job.make()


def test_a_file_that_has_changed_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.nsl"
    path.write_text(random_task(1), "utf-8")
    (job,) = campaign_of([path], 0, 1, FEW).rows
    path.write_text(random_task(2), "utf-8")
    with pytest.raises(InputError, match="has changed"):
        job.make()


def test_a_task_that_is_none_for_a_policy_is_a_row() -> None:
    paper = ROOT / "examples" / "paper.nsl"
    (row,) = campaign_of([paper], 0, 1, FEW).rows[0].make()
    assert (row.verdict, row.plan) == ("refused", "")
    assert row.reason == "there is nothing to optimise in a tissue that is static"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "there is no task\nhint: give files, or --random N"),
        ([str(CHANCE), str(CHANCE)], "two tasks have the name chance"),
        (["no.nsl"], "no.nsl"),
        (["--random", "1", "-o", str(CHANCE)], "is no folder"),
    ],
)
def test_mistakes_are_told(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["policies", *arguments]) == 2
    assert words in capsys.readouterr().err


def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ntagen.experiment.scripting.crew_of", lambda *_: Here)


def test_the_command_prints_rows_and_sums(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], quick: list[str]
) -> None:
    in_this_process(monkeypatch)
    wanted = ["policies", "--random", "5", "--drives", "3", "--runs", "200"]
    assert cli.main(wanted) == 1, "one was refused"
    out, err = capsys.readouterr()
    assert "1 of 5 tasks: random_1: better, +10 % (from +5 to +15 %)" in err
    assert "2 of 5 tasks: random_2: alike (silent), +0 % (from +0 to +0 %)" in err
    lines = out.splitlines()
    assert lines[1].count("2 of 3") == 3
    assert "5 of 5 tasks are done, 1 without a plan, 1 refused" in out
    assert "of 3 with a policy it is better in 1, alike in 1 (silent in 1), worse in 1" in out
    assert "of 9 phantom needles arrived untouched: plan 6, touched 3; re-planning 6" in out
    assert cli.main([*wanted, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert [row["task"] for row in found["rows"]] == list(ROWS)
    assert found["sum"]["better"] == 1


def test_an_interruption_keeps_the_rows_that_are_done(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], quick: list[str]
) -> None:
    in_this_process(monkeypatch)
    monkeypatch.setitem(ROWS, "random_98", replace(ROWS["random_1"], task="random_98"))
    assert cli.main(["policies", "--random", "2", "--seed", "98", "--json"]) == 130
    out, err = capsys.readouterr()
    assert [row["task"] for row in json.loads(out)["rows"]] == ["random_98"]
    assert "interrupted: 1 of 2 tasks are done" in err


def test_virtual_needles_arrive_as_often_as_tissues_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    in_this_process(monkeypatch)
    monkeypatch.setattr(policies, "WAYS", ("plan",))
    path, usual = tmp_path / "much.nsl", "curvature 5 %  roll 5 deg  tip 0.3 mm"
    much = "curvature 10 %  roll 15 deg  tip 0.5 mm"
    path.write_text(CHANCE.read_text("utf-8").replace(usual, much), "utf-8")
    # Of phantom needles, whose tissue has no such chance, 83 arrive, of the others 62.
    wanted = ["policies", str(path), "--needle", "virtual", "--runs", "1000", "--drives", "100"]
    assert cli.main([*wanted, "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert 0.4 < row["compared"]["plan"]["value"] < 0.7
    arrived = row["drives"]["plan"]["arrived"]
    assert abs(arrived / 100.0 - row["compared"]["plan"]["value"]) < 0.15
    assert row["drives"]["plan"]["hits"] > 5


def test_a_blind_needle_goes_where_its_plan_says() -> None:
    task = load_task(CHANCE)
    half = Roll(rad_from_deg(180.0))
    for last_mm, is_reached in ((32.0, True), (12.0, False)):
        plan = Plan.of([half, Push(18.0), half, Push(last_mm)])
        virtual = configure(task.given, replace(task.scene, tissue=type(task.scene.tissue)()))
        end = drive_blindly(plan, replace(task.scene, tissue=type(task.scene.tissue)()), virtual, 1)
        assert end.is_reached == is_reached
        assert end.clearance_mm > 0.0


@pytest.mark.slow
def test_rows_do_not_depend_on_workers_and_policies_are_those_of_plan(tmp_path: Path) -> None:
    wanted = ["policies", str(CHANCE), "--random", "1", "--seed", "3", "--runs", "6000"]
    wanted += ["--drives", "1"]
    tables = []
    for workers in ("1", "2"):
        folder = tmp_path / workers
        assert cli.main([*wanted, "--workers", workers, "-o", str(folder)]) == 0
        tables.append(timeless(json.loads((folder / "table.json").read_text("utf-8"))))
    assert tables[0] == tables[1]
    row, _ = tables[0]["rows"]
    assert set(row["drives"]) == set(policies.WAYS)
    data = (tmp_path / "1" / "chance.policy.json").read_bytes()
    policy = read_policy(data, load_task(CHANCE).scene)
    alone = tmp_path / "alone.json"
    plan = ["plan", str(CHANCE), "--optimise", "probability", "--seed", "3", "--runs", "6000"]
    assert cli.main([*plan, "-o", str(alone)]) == 0
    assert alone.read_bytes() == data
    assert policy.is_silent == row["is_silent"]


@pytest.mark.slow
def test_ctrl_c_keeps_rows_and_ends_workers(tmp_path: Path) -> None:
    wanted = ["policies", "--random", "40", "--seed", "2", "--runs", "200", "--json"]
    words = [sys.executable, "-m", "ntagen", *wanted, "--workers", "1", "-o", str(tmp_path)]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        assert "1 of 40 tasks: random_2" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert f"kept in {tmp_path}; go on with --resume" in err
    rows = json.loads(out)["rows"]
    assert 1 <= len(rows) < 40
    # A row may be on the disk that nobody was told of.
    kept = finished(tmp_path, campaign_of([], 40, 2, FEW))
    assert rows == [asdict(kept[row["task"]]) for row in rows]
