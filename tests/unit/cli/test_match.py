"""`ntagen match`: what it prints, draws and refuses."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from ntagen.cli import main
from tests.traces import FOLDER, MAKE

BENCH = str(FOLDER / "bench.nsl")
TRACE = str(FOLDER / "two_rolls.csv")


def documents(capsys: pytest.CaptureFixture[str], *words: str) -> list[dict[str, Any]]:
    assert main(["match", BENCH, *words, "--json"]) == 0
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def check_refused(capsys: pytest.CaptureFixture[str], words: list[str], *said: str) -> None:
    assert main(["match", *words]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert all(word in output.err for word in said), output.err


def test_the_example_is_what_its_script_makes() -> None:
    script = [sys.executable, str(FOLDER / "make_trace.py"), "two_rolls", "--seed", "1"]
    made = subprocess.run(script, capture_output=True, text=True, check=True)
    assert made.stdout == Path(TRACE).read_text("utf-8")


def test_a_table_says_what_explains_the_trace(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["match", BENCH, TRACE]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("bench: pushes of 2 mm, at most 2 rolls by 90, 180, 270 deg")
    assert lines[1].split() == ["trace", "points", "length", "min", "avg", "max", "radius", "rolls"]
    row = lines[3].split()
    assert row[0] == "two_rolls.csv"
    assert " ".join(row[7:]) == "90 deg at 32 mm, 180 deg at 66 mm"
    assert 0.0 <= float(row[3]) <= float(row[4]) <= 0.1


def test_json_says_the_same_with_the_start(capsys: pytest.CaptureFixture[str]) -> None:
    (found,) = documents(capsys, TRACE, "--predict", "--radius", "fit")
    assert found["rolls"] == [
        {"depth_mm": 32.0, "angle_deg": 90.0},
        {"depth_mm": 66.0, "angle_deg": 180.0},
    ]
    assert [next(iter(action)) for action in found["actions"]] == [
        *("push_mm", "roll_deg", "push_mm", "roll_deg", "push_mm")
    ]
    assert found["min_mm"] < found["avg_mm"] < found["max_mm"] < 0.3
    assert len(found["start"]["heading"]) == 3
    assert [one["from_mm"] for one in found["predictions"]] == [20.0, 30.0, 40.0]
    assert found["radius_mm"] == pytest.approx(60.0, rel=0.02)


def test_several_traces_have_a_line_for_all(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "arc.csv"
    other.write_text(MAKE.table(MAKE.make("arc", 1), 0.5))
    assert main(["match", BENCH, TRACE, str(other), "--predict"]) == 0
    text = capsys.readouterr().out
    assert "all 2: least min, mean of avg, greatest max" in text
    assert "from   10 mm   20 mm   40 mm" in text
    assert [line.partition(" ")[0] for line in text.splitlines()].count("median") == 3


def test_a_bad_trace_does_not_keep_the_others_back(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("x_mm,y_mm,z_mm\n0,0,0\n")
    assert main(["match", BENCH, str(bad), TRACE, "--json"]) == 2
    output = capsys.readouterr()
    assert len(output.out.splitlines()) == 1
    assert "bad.csv: there are no positions" in output.err
    assert "hint: " in output.err


@pytest.mark.parametrize("way", ["free", "fit", "model"])
def test_the_start_is_chosen_in_three_ways(way: str, capsys: pytest.CaptureFixture[str]) -> None:
    (found,) = documents(capsys, TRACE, "--start", way)
    assert found["avg_mm"] < {"free": 0.1, "model": 0.3, "fit": 0.8}[way]


def test_a_log_of_a_run_is_a_trace(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = str(tmp_path / "run.mcap")
    task = str(FOLDER.parent / "scenarios" / "no_cr.nsl")
    assert main(["drive", task, "--seed", "1", "--log", log]) == 0
    capsys.readouterr()
    assert main(["match", task, log, "--json"]) == 0
    (found,) = map(json.loads, capsys.readouterr().out.splitlines())
    assert found["avg_mm"] < 0.3


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["png", "pdf", "svg"])
def test_a_picture_is_drawn(
    ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / f"match.{ending}"
    assert main(["match", BENCH, TRACE, "-o", str(picture), "--json"]) == 0
    output = capsys.readouterr()
    assert f"wrote {picture}" in output.err
    assert json.loads(output.out)
    assert picture.stat().st_size > 10_000


def test_what_cannot_be_drawn_is_refused_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    check_refused(capsys, [BENCH, TRACE, "-o", "picture.txt"], "unknown kind of picture")
    many = [TRACE] * 25
    check_refused(capsys, [BENCH, *many, "-o", str(tmp_path / "m.png")], "too many for one picture")
    copy = tmp_path / "trace.svg"
    copy.write_text(Path(TRACE).read_text())
    check_refused(capsys, [BENCH, str(copy), "-o", str(copy)], "would replace")


def test_wrong_words_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    check_refused(capsys, [BENCH], "Missing argument")
    check_refused(capsys, [BENCH, TRACE, "--until", "5ft"], "is not a length")
    check_refused(capsys, [BENCH, TRACE, "--rolls", "3"], "the scene allows 2")
    check_refused(capsys, [BENCH, TRACE, "--columns", "tip"], "time_s, x_mm, y_mm, z_mm")
    check_refused(capsys, [BENCH, TRACE, "--until", "5mm"], "at least 10 mm")
