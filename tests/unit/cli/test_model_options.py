"""Options of statistical queries that a model file says itself."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen.cli import main

MODEL = """<?xml version="1.0" encoding="utf-8"?>
<nta>
<declaration>clock x;</declaration>
<template><name>P</name>
<location id="a"><name>A</name><label kind="exponentialrate">1</label></location>
<location id="b"><name>B</name></location>
<init ref="a"/><transition><source ref="a"/><target ref="b"/></transition></template>
<system>system P;</system>
<queries>
<option key="--diagnostic" value="0"/>
<option key="--alpha" value="0.01"/>
<option key="--epsilon" value="0.2"/>
<query><formula>Pr[&lt;=1](&lt;&gt; P.B)</formula>
<result outcome="success" type="quality"><option key="--alpha" value="0.3"/></result></query>
<query><formula>Pr[&lt;=2](&lt;&gt; P.B)</formula>
<option key="--epsilon" value="0.1"/><option key="--beta" value="much"/></query>
</queries>
</nta>
"""


@pytest.fixture
def path(tmp_path: Path) -> str:
    path = tmp_path / "model.xml"
    path.write_text(MODEL, "utf-8")
    return str(path)


def check_widths(
    words: list[str], expected: list[tuple[float, float]], capsys: pytest.CaptureFixture[str]
) -> None:
    """Compares, for each query, the confidence, and epsilon with half the width."""
    assert main([*words, "--json"]) == 0
    records = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["confidence"] for one in records] == [1 - alpha for alpha, _ in expected]
    for record, (_, epsilon) in zip(records, expected, strict=True):
        half = max(record["upper"] - record["value"], record["value"] - record["lower"])
        assert 0.8 * epsilon < half <= epsilon


def test_options_of_the_file_count(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    check_widths(["check", path], [(0.01, 0.2), (0.01, 0.1)], capsys)


def test_the_command_line_counts_more(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["--epsilon", "0.15"]
    check_widths(["check", path, *given], [(0.01, 0.15), (0.01, 0.15)], capsys)


def test_verifyta_reads_them_too(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verifyta", path]) == 0
    assert capsys.readouterr().out.count("(99% CI)") == 2
    assert main(["verifyta", "-a", "0.1", path]) == 0
    assert capsys.readouterr().out.count("(90% CI)") == 2


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--set", "beta 3"], "--set 'beta RISK': '3' is not a number between 0 and 1"),
        (["--set", "levels"], "--set 'levels EXPR': no value"),
        (["--set", "levles n"], "there is no setting 'levles n'; did you mean 'levels'?"),
        (["--set", "beta 0.1", "--set", "beta 0.2"], "the setting 'beta' is given twice"),
        (
            ["--value-bounds=0,20"],
            "no such option: --value-bounds; write --set 'value bounds 0,20'",
        ),
        (["--anytime"], "no such option: --anytime; write --set 'anytime on'"),
        (["--rank", "rolls"], "no such option: --rank; write --set 'ranking rolls'"),
        (["--shortest"], "no such option: --shortest; write --set 'trace shortest'"),
        (["--controller", "a.c"], "no such option: --controller; write --strategy a.c"),
    ],
)
def test_settings_are_checked_and_former_options_say_what_replaces_them(
    capsys: pytest.CaptureFixture[str], words: list[str], says: str
) -> None:
    assert main(["check", "model.xta", *words]) == 2
    assert says in capsys.readouterr().err


def test_all_settings_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    for command, words in (("check", "mean interval"), ("plot", "bucket width")):
        assert main([command, "--help-settings"]) == 0
        assert f"\n  {words} " in capsys.readouterr().out
