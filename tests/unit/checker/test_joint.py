"""Statistical queries that are answered from the same runs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ntagen.checker import Model, Options, load_file
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


def test_each_query_may_have_its_own_precision(model: Model) -> None:
    asked = [
        (QUERIES[0], Options(epsilon=0.02, alpha=0.02)),
        ("Pr[<=6](<> Q.B)", Options(runs=300, alpha=0.1)),
        ("E[<=6; 200](max: n)", Options(seed=9)),
    ]
    together = model.answer_jointly(asked)
    for (query, options), answer in zip(asked, together, strict=True):
        alone = model.answer(query, replace(options, alpha=options.alpha / 3))
        assert answer.estimate == alone.estimate
        # 2 %, 10 % and 5 %, each divided by 3.
        assert "all 3 intervals hold together at 94.3333 %" in (answer.message or "")


XML = """<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE nta PUBLIC '-//Uppaal Team//DTD Flat System 1.1//EN'
  'http://www.it.uu.se/research/group/darts/uppaal/flat-1_2.dtd'>
<nta>
  <declaration>clock x;</declaration>
  <template><name>P</name>
    <location id="id0"><name>A</name><label kind="exponentialrate">1</label></location>
    <location id="id1"><name>B</name></location>
    <init ref="id0"/>
    <transition><source ref="id0"/><target ref="id1"/></transition>
  </template>
  <system>system P;</system>
  <queries>
    <query><formula>Pr[&lt;=1](&lt;&gt; P.B)</formula>
      <option key="--epsilon" value="0.02"/></query>
    <query><formula>Pr[&lt;=1]([] P.A)</formula>
      <option key="--alpha" value="0.02"/></query>
  </queries>
</nta>
"""


def test_options_of_the_file_count(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "model.xml"
    path.write_text(XML, "utf-8")

    def records(*words: str) -> list[dict[str, Any]]:
        assert main(["check", str(path), "--set", "joint on", "--json", *words]) == 0
        return [json.loads(line) for line in capsys.readouterr().out.splitlines()]

    first, second = records()
    assert first["upper"] - first["lower"] <= 0.04
    assert 0.04 < second["upper"] - second["lower"] <= 0.1
    assert first["confidence"] == pytest.approx(0.975)
    assert second["confidence"] == pytest.approx(0.99)
    # What the command line says counts for all.
    first, second = records("--epsilon", "0.05", "--alpha", "0.1")
    assert 0.04 < first["upper"] - first["lower"] <= 0.1
    assert first["confidence"] == second["confidence"] == pytest.approx(0.95)


def test_the_command_line_answers_jointly(
    model: Model, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(tmp_path / "model.xta")
    words = ["check", path, "--set", "joint on", "--json", "--seed", "3"]
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
    wrong = ["check", path, "--set", "joint on", "--query", QUERIES[0], "--query", "Pr[<=6](<> m)"]
    assert main(wrong) == 2
    shown = capsys.readouterr()
    assert shown.out.count("refused") >= 2
    assert main(["check", path, "--set", "joint on", "--query", "E<> n == 4"]) == 0
    assert "--set 'joint …' has no effect here" in capsys.readouterr().err
