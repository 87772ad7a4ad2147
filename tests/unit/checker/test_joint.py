"""Statistical queries that are answered from the same runs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen.checker import Model, load_file
from ntagen.cli import main
from ntagen.errors import InputError

MODEL = """
clock x;
int[0, 9] n = 0;
process P() {
  state A { x <= 2 };
  init A;
  trans A -> A { guard x >= 1 && n < 9; assign n++, x = 0; };
}
process Q() { state A { ; 1:2 }, B; init A; trans A -> B { }; }
system P, Q;
"""
QUERIES = (
    "Pr[<=6](<> n >= 4)",
    "E[<=6; 200](max: n)",
    "Pr[<=6](<> Q.B) >= 0.5",
    "Pr[#<=3](<> Q.B)",
)


@pytest.fixture
def model(tmp_path: Path) -> Model:
    path = tmp_path / "model.xta"
    path.write_text(MODEL, "utf-8")
    return load_file(path)


def test_each_query_has_the_answer_that_it_has_alone(model: Model) -> None:
    together = model.check_jointly(QUERIES, alpha=0.1, beta=0.08, seed=3)
    for query, answer in zip(QUERIES, together, strict=True):
        alone = model.check(query, alpha=0.1 / 4, beta=0.08 / 4, seed=3)
        assert answer.estimate == alone.estimate
        assert answer.verdict == alone.verdict
        assert answer.query == query
        assert "all 4 intervals hold together at 90 %" in (answer.message or "")
    assert model.check_jointly(QUERIES, threads=2)[1].estimate == (
        model.check_jointly(QUERIES)[1].estimate
    )
    assert model.check_jointly([]) == []


def test_a_single_query_keeps_its_risk(model: Model) -> None:
    (only,) = model.check_jointly(QUERIES[:1])
    assert only.estimate == model.check(QUERIES[0]).estimate
    assert only.message is None


def test_other_queries_have_no_part_in_it(model: Model) -> None:
    for query, reason in (
        ("E<> n == 4", "only statistical queries"),
        ("simulate[<=6; 2]{n}", "simulate shows runs"),
        ("Pr[<=6](<> m)", "m"),
    ):
        with pytest.raises(InputError, match=reason):
            model.check_jointly([QUERIES[0], query])
    # The model answers on.
    assert model.check(QUERIES[0]).satisfied


def test_the_command_line_answers_jointly(
    model: Model, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(tmp_path / "model.xta")
    words = ["check", path, "--joint", "--json", "--seed", "3"]
    asked = [*QUERIES[:2], "E<> n == 4", "simulate[<=6; 2]{n}"]
    for query in asked:
        words += ["--query", query]
    assert main(words) == 0
    records = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["query"] for one in records] == asked
    for record, answer in zip(records, model.check_jointly(QUERIES[:2], seed=3), strict=False):
        assert answer.estimate is not None
        assert record["confidence"] == pytest.approx(0.975)
        assert record["value"] == answer.estimate.value
        assert record["lower"] == answer.estimate.lower
    wrong = ["check", path, "--joint", "--query", QUERIES[0], "--query", "Pr[<=6](<> m)"]
    assert main(wrong) == 2
    shown = capsys.readouterr()
    assert shown.out.count("refused") >= 2
    assert main(["check", path, "--joint", "--query", "E<> n == 4"]) == 0
    assert "--joint has no effect here" in capsys.readouterr().err
