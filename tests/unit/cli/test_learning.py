"""What `ntagen check` and `ntagen verifyta` say of queries for the best strategy, and write."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from ntagen.cli import main
from tests.unit.checker.test_learned import QUERY, SHOP

FEW = ("--set", "good-runs 300", "--set", "eval-runs 100", "--set", "max-iterations 2")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a model, which is the current one."""
    (tmp_path / "shop.xta").write_text(SHOP)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def check(capsys: pytest.CaptureFixture[str], *words: str, query: str = QUERY) -> str:
    assert main(["check", "shop.xta", "--query", query, "--runs", "1000", *words]) == 0
    out, err = capsys.readouterr()
    assert "Traceback" not in out + err
    return out + err


def record_of(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    """The answer as JSON, without the warnings behind it."""
    record: dict[str, Any] = json.loads(check(capsys, "--json", *words).splitlines()[0])
    return record


def test_a_row_says_what_it_is_worth_and_sees(capsys: pytest.CaptureFixture[str]) -> None:
    out = check(capsys, *FEW)
    assert "at 95 % confidence\n          1,000 runs, " in out
    assert "strategy: 18 leaves; it sees {parts, left} -> {}\n" in out
    assert "learned from 800 runs in 2 iterations; better than the uniform choice" in out


def test_json_has_what_learning_took(capsys: pytest.CaptureFixture[str]) -> None:
    record = record_of(capsys, *FEW)
    assert (record["runs"], record["confidence"]) == (1000, 0.95)
    assert record["lower"] < record["value"] < record["upper"]
    assert (record["iterations"], record["resets"], record["learning_runs"]) == (2, 0, 800)
    assert [one["runs"] for one in record["history"]] == [400, 800]
    assert record["better"] is True
    assert record["uniform"]["lower"] < record["uniform"]["value"] < record["uniform"]["upper"]
    assert '"better"' not in check(capsys, "--json", query="E<> Shop.Done")


def test_strategies_are_written_in_the_form_of_the_file(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, what in (("s.json", "strategy"), ("s.c", "controller"), ("s.py", "controller")):
        assert f"{what} written to {name}" in check(capsys, "--strategy", name, *FEW)
    assert json.loads((folder / "s.json").read_text())["type"] == "state->regressor"
    # The names are those of the strategy in the query.
    assert "int S_decide(" in (folder / "s.c").read_text()
    source = (folder / "s.c").read_text()
    (folder / "main.c").write_text(
        f"{source}\nint main(void)\n{{\n    double seen[2] = {{1, 1}};\n"
        "    unsigned char enabled[S_ACTIONS] = {0, 1, 0};\n"
        "    return S_decide(seen, seen, enabled);\n}\n"
    )
    flags = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["cc", *flags, "-o", "main", "main.c"], check=True)
    assert subprocess.run([folder / "main"], check=False).returncode == 1
    assert "def decide(" in (folder / "s.py").read_text()
    assert check(capsys, "--strategy", "-", *FEW).count('"state->regressor"') == 1


def test_methods_have_names_and_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    answers = [
        record_of(capsys, "--learning-method", method, *FEW)["leaves"]
        for method in ("q", "4", "m", "5")
    ]
    assert answers[0] == answers[1]
    assert answers[2] == answers[3]
    with pytest.raises(SystemExit):
        raise SystemExit(main(["check", "shop.xta", "--learning-method", "x"]))
    assert "is not a method of learning; write q (4) or m (5)" in capsys.readouterr().err


def test_settings_without_effect_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    out = check(capsys, "--set", "good-runs 9", query="E<> Shop.Done")
    assert "--set 'good-runs …' has no effect here: no query is for the best strategy" in out
    out = check(capsys, "--set", "qlearning-alpha 9", *FEW)
    assert "--set 'qlearning-alpha …' has no effect without --learning-method q" in out


def test_options_of_the_model_count(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "shop.xta"]) == 0
    capsys.readouterr()
    options = {"good-runs": 120, "eval-runs": 10, "max-iterations": 1, "total-runs": 50}
    rows = "".join(f'<option key="--{key}" value="{value}"/>' for key, value in options.items())
    formula = QUERY.replace("parts, left", "").replace("<", "&lt;").replace(">", "&gt;")
    ends = '<source ref="id0"/><target ref="id1"/>'
    edges = "".join(
        f'<transition>{ends}<label kind="assignment">cost = {cost} + 0 * random(1.0)</label>'
        "</transition>"
        for cost in (5, 2)
    )
    model = f"""<?xml version="1.0" encoding="utf-8"?>
<nta><declaration>double cost;</declaration>
<template><name>Shop</name>
<location id="id0"><name>Choose</name><urgent/></location>
<location id="id1"><name>Done</name></location>
<init ref="id0"/>{edges}</template>
<system>system Shop;</system>
<queries>{rows}<query><formula>{formula}</formula><comment/></query></queries></nta>"""
    (folder / "shop.xml").write_text(model)
    assert main(["check", "shop.xml", "--runs", "100", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert (record["learning_runs"], record["value"]) == (130, 2.0)
    assert main(["verifyta", "-s", "shop.xml"]) == 0
    out = capsys.readouterr().out
    assert out.count("Without effect on learning in ntagen: --total-runs\n") == 1
    assert " -- Formula is satisfied.\n -- Result: (130 runs)\n" in out
    assert main(["verifyta", "-s", "--good-runs", "20", "shop.xml"]) == 0
    assert " -- Result: (30 runs)\n" in capsys.readouterr().out


def test_verifyta_says_how_it_was_learned(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "s.q").write_text(f'{QUERY}\n\nsaveStrategy("s.json", S)\n')
    words = ["-s", "-q", "--good-runs=100", "--eval-runs=1", "--max-iterations=1", "--filter", "0"]
    assert main(["verifyta", *words, "shop.xta", "s.q"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out == (
        "\nVerifying formula 1 at s.q:1\n -- Formula is satisfied.\n -- Result: (101 runs)\n"
        "Learning statistics for best strategy: \n\tNumber of resets: 0\n"
        "\tNumber of iterations in last reset: 1\n\tNumber of iterations in total: 1\n\n"
        "\nVerifying formula 2 at s.q:3\n -- Formula is satisfied.\n"
    )
    assert (folder / "s.json").exists()
