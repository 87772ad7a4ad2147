"""`ntagen plan`: what it prints, writes and answers with its exit code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen import cli

EXAMPLES = Path(__file__).parents[3] / "examples"
PAPER = str(EXAMPLES / "paper.nsl")
CHANCE = str(EXAMPLES / "chance" / "chance.nsl")
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


def test_runs_say_how_likely_the_best_plan_arrives(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["plan", CHANCE, "--within", "1min", "--runs", "300"]) == 0
    out = capsys.readouterr().out
    assert "clearance: " in out
    assert "300 random runs of the plan, open loop; each interval holds at 0.95 confidence" in out
    for words in ("reaches the target, and touches nothing: ", "touches a critical region: "):
        assert words in out
    assert "distinguishable" not in out


def test_plans_are_ranked_by_probability(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "plans.json"
    arguments = ["--within", "1min", "--runs", "300", "--best", "3"]
    assert cli.main(["plan", CHANCE, "--rank", "probability", *arguments, "-o", str(path)]) == 0
    out = capsys.readouterr().out
    assert "compared: the 3 best plans by reserve" in out
    assert "300 random runs of each of 3 plans" in out
    assert out.count("reaches the target") == 3
    plans = json.loads(path.read_text("utf-8"))["plans"]
    values = [plan["chance"]["reach"]["value"] for plan in plans]
    assert len(values) == 3
    assert values == sorted(values, reverse=True)
    best = plans[0]["chance"]
    assert best["is_apart"] is False
    assert best["reach"]["lower"] <= best["reach"]["value"] <= best["reach"]["upper"]
    assert best["reach"]["runs"] == 300
    assert best["clearance_mm"]["value"] < plans[0]["certificate"]["critical_clearance_mm"]


def test_the_last_line_of_json_has_the_probabilities(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--json", "--rank", "probability", "--within", "1min", "--runs", "50"]
    assert cli.main(["plan", CHANCE, *arguments]) == 0
    *before, last = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert last["is_final"]
    assert [set(plan["chance"]) for plan in last["plans"]] == [
        {"reach", "touch", "clearance_mm", "is_apart"}
    ]
    assert not any("chance" in plan for line in before for plan in line["plans"])


def test_static_tissue_has_no_probabilities(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["plan", PAPER, "--rank", "probability"]) == 2
    assert "no probability in a tissue that is static" in capsys.readouterr().err
    assert cli.main(["plan", PAPER, "--runs", "9", "--within", "1min"]) == 0
    assert "--runs has no effect in a tissue that is static" in capsys.readouterr().err


def test_other_commands_do_not_rank_by_probability(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", CHANCE, "--plans", "-", "--set", "ranking probability"]) == 2
    assert "by `ntagen plan` only" in capsys.readouterr().err


@pytest.mark.slow
def test_a_policy_is_learned_compared_and_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "t.policy.json"
    wanted = ["plan", CHANCE, "--optimise", "probability", "--runs", "6000", "-o", str(path)]
    assert cli.main(wanted) == 0
    out, err = capsys.readouterr()
    assert "reaches the target, and touches nothing (optimised)" in out
    assert f"policy written to {path}" in out
    written = json.loads(path.read_text("utf-8"))
    assert (written["format"], written["aim"]) == ("ntagen policy", "probability")
    assert cli.main([*wanted[:-2], "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["aims"] == written["values"]
    compared = found["aims"]["probability"]
    assert found["is_better"] == (compared["difference"]["lower"] > 0.0)
    assert (", better" in out) == found["is_better"]
    decided = found["guard"]["difference"]["lower"] <= 0.0
    assert found["is_silent"] == written["is_silent"] == decided
    assert ("so the policy is silent" in err) == found["is_silent"]


@pytest.mark.slow
def test_a_policy_that_is_no_better_is_written_with_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "t.policy.json"
    wanted = ["plan", CHANCE, "--optimise", "probability", "--runs", "200", "-o", str(path)]
    assert cli.main(wanted) == 0
    out, err = capsys.readouterr()
    assert "warning: what was learned is not better than the plan in 40 other tissues" in err
    assert "hint: drive without a policy, or learn from more --runs" in err
    assert "difference: +0 % (from +0 to +0 %), alike" in out
    written = json.loads(path.read_text("utf-8"))
    assert written["is_silent"]
    assert written["around"]["window"] == 0


@pytest.mark.parametrize(
    ("task", "exit_code", "words"),
    [
        (PAPER, 2, "there is nothing to optimise in a tissue that is static"),
        ("{task}", 2, "a policy is for one target"),
        ("{wall}", 1, "there is no policy"),
    ],
)
def test_without_a_policy_no_file_is_written(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    task: str,
    exit_code: int,
    words: str,
) -> None:
    text = Path(CHANCE).read_text("utf-8")
    two = text.replace("  critical", "  target T2 sphere (0, -56, 4) mm radius 4 mm\n  critical")
    wall = text.replace("radius 4.5 mm", "radius 20 mm")
    places = {"task": tmp_path / "two.nsl", "wall": tmp_path / "wall.nsl"}
    places["task"].write_text(two, "utf-8")
    places["wall"].write_text(wall, "utf-8")
    path = tmp_path / "t.policy.json"
    path.write_text("an earlier policy")
    asked = ["plan", task.format(**places), "--optimise", "miss", "--within", "1min"]
    assert cli.main([*asked, "-o", str(path)]) == exit_code
    said = capsys.readouterr()
    assert words in said.out + said.err
    assert path.read_text() == "an earlier policy"
