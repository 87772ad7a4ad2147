"""`ntagen sweep`: what it prints and writes, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen.cli import main
from tests.unit.experiment.files import SCENARIOS

QUICK = ["sweep", str(SCENARIOS / "no_cr.nsl"), "--needle", "virtual", "--runs", "1", "--no-logs"]
NOISE = ["--over", "noise", "--values", "0.1,0.5mm"]


@pytest.mark.slow
@pytest.mark.usefixtures("here")
def test_a_sweep_is_driven_and_drawn_and_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*QUICK, *NOISE, "--set", "deviation 2 mm"]) == 0
    said = capsys.readouterr()
    assert "noise: all runs reached the target at 0.1 mm, 0.5 mm: " in said.out
    assert "report.html, no_cr-noise/sweep.png" in said.out
    assert Path("no_cr-noise/sweep.png").read_bytes().startswith(b"\x89PNG")
    table = json.loads(Path("no_cr-noise/table.json").read_bytes())
    assert table["rows"][1]["settings"] == {"noise": "0.5 mm", "deviation": "2 mm"}
    # More runs are added to those that are finished.
    more = [
        *QUICK,
        *NOISE,
        "--set",
        "deviation 2 mm",
        "--runs",
        "2",
        "--resume",
    ]
    assert main(more) == 0
    assert Path("no_cr-noise/sweep.svg").read_text("utf-8").startswith("<?xml")
    table = json.loads(Path("no_cr-noise/table.json").read_bytes())
    assert [row["runs"] for row in table["rows"]] == [2, 2]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--over", "noise"], "Missing option '--values'"),
        (["--values", "1,2mm"], "Missing option '--over'"),
        (["--over", "niose", "--values", "1,2mm"], "did you mean noise?"),
        (["--over", "noise", "--values", "1mm"], "one value is no sweep"),
        (["--over", "noise", "--values", "-1,2mm"], "must be at least 0 mm"),
        (["--over", "delay", "--values", "0,1s"], "means nothing to the virtual needle"),
        ([*NOISE, "--set", "noise 1 mm"], "`noise` is swept, and --set fixes it"),
        ([*NOISE, "--figure", "x.gif"], "the folder has sweep.png and sweep.svg"),
        ([*NOISE, "--runs", "0"], "0 is not in the range"),
        ([*NOISE, "--seed", "3"], "No such option"),
        ([*NOISE, "--set", "seed 3"], "--runs says how many there are"),
        ([*NOISE, "--timeout", "9s"], "write --set 'time limit 9s'"),
    ],
)
@pytest.mark.usefixtures("here")
def test_mistakes_are_told_before_anything_is_driven(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    options: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*QUICK, *options]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_missing_task(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sweep", str(tmp_path / "no.nsl"), *NOISE]) == 2
    assert "no.nsl" in capsys.readouterr().err
