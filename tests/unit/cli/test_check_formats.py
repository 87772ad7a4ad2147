"""`ntagen check --expect` and `--format`: answers in scripts and in CI."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from ntagen.cli import main

GATE = """<nta>
<declaration>int n = 2; int[0,3] r = 3;</declaration>
<template><name>Gate</name>
<location id="a"><name>Shut</name></location><location id="b"><name>Open</name></location>
<location id="c"><name>Bad</name></location>
<init ref="a"/>
<transition><source ref="a"/><target ref="b"/></transition>
<transition><source ref="b"/><target ref="c"/><label kind="guard">n == 3</label>
<label kind="assignment">r = r + 1</label></transition>
</template>
<system>system Gate;</system>
<queries>
<query><formula>E&lt;&gt; Gate.Open</formula><comment>It can open.</comment>
<expect outcome="success" type="symbolic"/></query>
<query><formula>A[] Gate.Shut</formula><comment>No</comment></query>
<query><formula>A[] n == 2</formula><result outcome="failure"/></query>
<query><formula>E&lt;&gt; Gate.Opne</formula><comment>misspelt</comment></query>
</queries></nta>"""

QUERIES = """// The gate opens.
// true
E<> Gate.Open

A[] Gate.Shut   // expected: no
sup{Gate.Shut}: n   // EXPECT:2
E<> Gate.Shut
E<> Gate.Opne   // error
"""


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    path = tmp_path / "gate.xml"
    path.write_text(GATE)
    return path


def run(capsys: pytest.CaptureFixture[str], code: int, *arguments: str | Path) -> tuple[str, str]:
    """The two outputs of the command, which ends with this code."""
    assert main(["check", *map(str, arguments)]) == code
    captured = capsys.readouterr()
    return captured.out, captured.err


def test_answers_are_compared_with_what_the_file_says(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "gate.q"
    file.write_text(QUERIES)
    # The value after --expect is optional, also before the model.
    out, _ = run(capsys, 0, "--expect", gate, file)
    assert out.count("(as expected)") == 4
    assert out.count("The gate opens.") == 1
    assert out.splitlines()[-1].endswith(
        "; 4 as expected, 0 not as expected, 1 without an expectation"
    )
    records = [
        json.loads(line)
        for line in run(capsys, 0, gate, file, "--expect", "--json")[0].splitlines()
    ]
    assert [one["expected"] for one in records] == [True, True, True, None, True]
    assert [one["expectation"] for one in records] == [
        "satisfied",
        "not satisfied",
        2,
        None,
        "error",
    ]


def test_expectations_of_xml_files(gate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, err = run(capsys, 2, gate, "--expect")
    assert "A[] Gate.Shut  (as expected)" in out
    assert "A[] n == 2  (not as expected: not satisfied)" in out
    assert f"{gate}:17:32: error[E0266]" in err
    assert err.count("ntagen explain") == 1


@pytest.mark.parametrize(
    ("said", "query", "code"),
    [
        ("yes", "E<> Gate.Open", 0),
        ("no", "E<> Gate.Open", 1),
        ("no", "A[] Gate.Shut", 0),
        ("yes", "A[] Gate.Shut", 1),
        ("no", "E<> 1 / (n - 2) == 1", 4),
        ("no", "E<> Gate.Opne", 2),
    ],
)
def test_one_expectation_for_all_queries(
    gate: Path, capsys: pytest.CaptureFixture[str], said: str, query: str, code: int
) -> None:
    run(capsys, code, gate, "--query", query, "--expect", said)


def test_without_any_expectation_the_command_says_how_to_write_one(
    gate: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, err = run(capsys, 2, gate, "--query", "E<> Gate.Open", "--expect")
    assert "no query says what is expected\nhint: " in err


def test_github_annotations_have_file_line_and_title(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "gate.q"
    file.write_text("E<> Gate.Open\n\nE<> Gate.Shut\n  A[] Gate.Shut\nE<> Gate.Opne\n")
    out, _ = run(capsys, 2, gate, file, "--format", "github")
    wrong, refused, last = out.splitlines()
    assert wrong == (
        f"::error file={file},line=4,col=3,title=A[] Gate.Shut::A[] Gate.Shut is not satisfied"
    )
    assert refused.startswith(f"::error file={file},line=5,col=10,title=E<> Gate.Opne::")
    assert last == f"{gate}: 4 queries: 2 satisfied, 1 not satisfied, 1 refused"


def test_junit_has_a_test_case_for_each_query(
    gate: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, _ = run(capsys, 2, gate, "--format", "junit")
    suite = ElementTree.fromstring(out)[0]
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("4", "1", "1")
    assert [[part.tag for part in case] for case in suite] == [
        [],
        ["failure"],
        [],
        ["error"],
    ]
    assert suite[1][0].get("message") == "not satisfied"


def test_sarif_has_a_result_for_each_fault(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, _ = run(capsys, 2, gate, "--format", "sarif")
    results = json.loads(out)["runs"][0]["results"]
    assert [one["ruleId"] for one in results] == ["not-satisfied", "E0266"]
    region = results[0]["locations"][0]["physicalLocation"]["region"]
    assert region == {"startLine": 15, "startColumn": 17}
    broken = tmp_path / "broken.xta"
    broken.write_text("int i = j;\nsystem P;\n")
    out, _ = run(capsys, 2, broken, "--format", "sarif")
    assert [one["ruleId"] for one in json.loads(out)["runs"][0]["results"]] == ["E0201", "E0201"]


@pytest.mark.parametrize("form", ["json", "github", "junit", "sarif"])
def test_formats_for_programs_leave_standard_output_to_the_document(
    gate: Path, capsys: pytest.CaptureFixture[str], form: str
) -> None:
    _, err = run(capsys, 2, gate, "--format", form, "--trace", "-")
    assert f"--format {form} and --trace - both write to standard output" in err


@pytest.mark.parametrize(
    ("name", "text", "part"),
    [
        ("notes.md", "# Notes\n\nSee `x`; the system is int.\n", "this is no model; expected is"),
        ("page.xml", "<html></html>", "its root is `<html>`; expected is"),
        ("gate.q", "E<> Gate.Open\n", "is a list of queries; write the model before it"),
    ],
)
def test_a_file_of_another_kind_is_refused_on_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, text: str, part: str
) -> None:
    path = tmp_path / name
    path.write_text(text)
    _, err = run(capsys, 2, path)
    assert err.count("\n") == 1
    assert part in err


def test_limits_take_multiples(gate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    limits = ("--states", "10k", "--memory", "1GiB", "--timeout", "60", "--threads", "0")
    run(capsys, 0, gate, "--query", "E<> Gate.Open", *limits)
    _, err = run(capsys, 2, gate, "--memory", "4")
    assert "did you mean 4GiB or 4MiB?" in err


def test_a_closed_pipe_ends_the_command_quietly(gate: Path) -> None:
    command = [sys.executable, "-m", "ntagen", "check", str(gate), "--query", "E<> Gate.Open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 141
