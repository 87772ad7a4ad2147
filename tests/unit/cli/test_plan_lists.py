"""Plans on lines: the same as in a document, whole lines whatever happens, and limits."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from ntagen import checker
from ntagen.cli.models import plan_lists
from ntagen.cli.models.plan_lists import ListLimits, write_lines
from tests.unit.cli.test_check import PAPER, check_run

GRID = """
int[0, 3] x, y;
process Walker() {
  state Walking;
  init Walking;
  trans
    Walking -> Walking { guard x < 3; assign x = x + 1; },
    Walking -> Walking { select step : int[1, 2]; guard y + step <= 3; assign y = y + step; };
}
W = Walker();
system W;
"""
CORNER = "control: A<> x == 3 && y == 3"

Way = tuple[tuple[tuple[int, ...], ...], dict[str, Any]]


def ways_through(model: checker.Model) -> list[tuple[list[tuple[int, int]], dict[str, int]]]:
    """All ways to the corner, by trying each move: the steps of each, and its last state."""

    def follow(path: list[int]) -> list[tuple[list[tuple[int, int]], dict[str, int]]]:
        walk = model.walk("interpreter")
        steps = []
        for index in path:
            (edge,) = walk.moves()[index].edges
            steps.append((int("step" in edge.select), edge.select.get("step", 0)))
            walk.take(index)
        state = {name: int(value) for name, value in walk.variables.items()}
        if state["x"] == state["y"] == 3:
            return [(steps, state)]
        return [way for index in range(len(walk.moves())) for way in follow([*path, index])]

    return follow([])


def test_lists_have_the_plans_that_trying_finds_in_the_same_order(tmp_path: Path) -> None:
    path = tmp_path / "grid.xta"
    path.write_text(GRID)
    model = checker.load_file(path)
    expected = ways_through(model)
    for most in (len(expected), len(expected) + 1, 5, 2):
        answer = model.check(CORNER, plans="all", max_plans=most)
        plans = json.loads("".join(answer.plans_json_pieces()))["plans"]
        found = []
        for plan in plans:
            edges = [edge for step in plan["steps"] for edge in step["edges"]]
            steps = [(int(bool(e["select"])), e["select"].get("step", 0)) for e in edges]
            found.append((steps, plan["end"]["variables"]))
        assert found == expected[:most]
        assert answer.plan_count == len(found)
        assert answer.has_more_plans == (most < len(expected))


def test_lines_have_the_plans_of_the_document(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines, document = tmp_path / "plans.jsonl", tmp_path / "plans.json"
    out, _ = check_run(capsys, 0, PAPER, "--query", "ReachFinalTR", "--plans", lines)
    assert "129 plans found, 101 hold in exact kinematics" in out
    check_run(capsys, 0, PAPER, "--query", "ReachFinalTR", "--plans", document)
    plans = [json.loads(line) for line in lines.read_text().splitlines()]
    assert {plan.pop("rank") for plan in plans} == {None}
    ranked = json.loads(document.read_text())["plans"]
    assert [one.pop("rank") for one in ranked] == list(range(1, 130))
    by_actions = {json.dumps(plan["actions"]): plan for plan in ranked}
    assert len(plans) == len(by_actions) == 129
    for plan in plans:
        assert plan == by_actions[json.dumps(plan["actions"])]


def test_lines_of_a_model_are_those_of_its_document(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, lines, document = (tmp_path / name for name in ("grid.xta", "p.jsonl", "p.json"))
    path.write_text(GRID)
    check_run(capsys, 0, path, "--query", CORNER, "--plans", lines)
    check_run(capsys, 0, path, "--query", CORNER, "--plans", document)
    plans = json.loads(document.read_text())
    assert [json.loads(line) for line in lines.read_text().splitlines()] == plans["plans"]
    assert plans["count"] == len(plans["plans"])


def test_a_limit_ends_a_list_with_whole_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ListLimits, "stop", lambda self, in_memory=0: "time")
    path = tmp_path / "plans.jsonl"
    options = ("--query", "ReachFinalTR", "--plans", path)
    out, _ = check_run(capsys, 3, PAPER, *options)
    assert "listed 129 plans until the time limit" in out
    assert "129 plans looked at" in out
    out, _ = check_run(capsys, 3, PAPER, *options, "--json")
    assert json.loads(out)["stop"] == "time"
    assert len([json.loads(line) for line in path.read_text().splitlines()]) == 129


def test_memory_limits_count_plans_that_are_ranked() -> None:
    limits = ListLimits(memory_bytes=10 * 4096)
    assert limits.stop(9) is None
    assert limits.stop(10) == "memory"
    assert ListLimits(timeout_s=0.0).stop() == "time"
    assert ListLimits().stop(10**9) is None


def test_a_full_disk_is_named_with_the_number_of_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "plans.jsonl"
    path.symlink_to("/dev/full")
    _, err = check_run(capsys, 2, PAPER, "--query", "ReachFinalTR", "--plans", path)
    assert f"cannot write {path}: no space left on device; it has 0 plans" in err
    assert "hint: choose another place" in err


def test_an_interruption_leaves_whole_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    model_path, path = tmp_path / "grid.xta", tmp_path / "plans.jsonl"
    model_path.write_text(GRID)
    answer = checker.load_file(model_path).check(CORNER, plans="all")
    monkeypatch.setattr(plan_lists, "_PAGE_LINES", 4)

    class Interrupted:
        def plan_lines(self) -> Any:  # noqa: ANN401
            for number, line in enumerate(answer.plan_lines()):
                if number == 10:
                    raise KeyboardInterrupt
                yield line

    with pytest.raises(KeyboardInterrupt):
        write_lines(Interrupted(), path, ListLimits())  # type: ignore[arg-type]
    assert len([json.loads(line) for line in path.read_text().splitlines()]) == 8
    assert "interrupted after 8 plans" in capsys.readouterr().err
