"""`ntagen plan`: what it prints, writes and answers with its exit code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen import cli

EXAMPLES = Path(__file__).parents[3] / "examples"
PAPER = str(EXAMPLES / "paper.nsl")
LARGE = str(EXAMPLES / "scenarios" / "large_mid_cr.nsl")


def test_the_best_plan_and_what_is_known_of_better_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["plan", PAPER, "--within", "1min"]) == 0
    out = capsys.readouterr().out
    assert "ms  found: " in out
    assert "clearance: 5 mm; no plan is better" in out
    assert "rolls: 1; no plan that is as good so far is better" in out


def test_the_file_has_the_best_plans(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "plans.json"
    assert cli.main(["plan", PAPER, "--best", "4", "--within", "1min", "-o", str(path)]) == 0
    document = json.loads(path.read_text("utf-8"))
    assert document["format"] == "ntagen-plans"
    assert [plan["rank"] for plan in document["plans"]] == [1, 2, 3, 4]
    assert all(plan["holds"] for plan in document["plans"])
    assert f"plans written to {path}" in capsys.readouterr().out


def test_json_has_a_line_for_each_answer(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["plan", PAPER, "--json", "--rank", "rolls", "--within", "1min"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["is_final"] for line in lines] == [False] * (len(lines) - 1) + [True]
    assert lines[-1]["verdict"] == "found"
    assert lines[-1]["limits"] == {"rolls": 1}
    assert lines[-1]["plans"][0]["certificate"]["rolls"] == 1


def test_no_plan_is_a_proof(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["plan", LARGE, "--within", "1min"]) == 1
    assert "it is proved that the model has none" in capsys.readouterr().out


def test_without_time_the_answer_is_unknown(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["plan", LARGE, "--within", "0ms"]) == 3
    assert "hint: give more time with --within" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--rank", "beauty"], "choose from"),
        (["--within", "soon"], "write a number and one of"),
        (["--best", "0"], "--best"),
        (["-o", PAPER], "paper.nsl"),
    ],
)
def test_wrong_options_are_refused(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["plan", PAPER, *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert words in err
