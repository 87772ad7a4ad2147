"""`ntagen verify`: traces and certificates that hold, and those that were changed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen.cli import main

LAMP = """
clock x;
process Lamp() {
  state Off, On { x <= 5 }, Dim;
  init Off;
  trans Off -> On { guard x > 1; assign x = 0; },
        Off -> Dim { guard x >= 4; },
        On -> Off { guard x >= 2; assign x = 0; },
        On -> Dim { guard x > 3; };
}
system Lamp;
"""


DETOUR = """
clock x;
process P() {
  state Start, Left, Right, End;
  commit Left;
  init Start;
  trans Start -> End { guard x >= 10; },
        Start -> Left { guard x >= 2; },
        Left -> Right { },
        Right -> End { };
}
system P;
"""


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    path = tmp_path / "lamp.xta"
    path.write_text(LAMP)
    return path


def check_exit(code: int, *arguments: str | Path) -> None:
    assert main([str(argument) for argument in arguments]) == code


def test_trace_holds_until_a_wait_is_changed(
    lamp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "trace.json"
    check_exit(
        0, "check", lamp, "--query", "E<> Lamp.Dim", "--set", "trace fastest", "--trace", trace
    )
    check_exit(0, "verify", lamp, trace)
    assert "trace replayed: 2 states, 1 moves" in capsys.readouterr().out
    file = json.loads(trace.read_text())
    assert file["format"] == "ntagen-trace"
    file["run"]["steps"][0]["wait"] -= 1
    trace.write_text(json.dumps(file))
    check_exit(1, "verify", lamp, trace)
    assert "the move is not possible here" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"hello", "it is no JSON: expected value at line 1 column 1"),
        (b"", "it is no JSON"),
        (b"[1]", 'its "format" is null and its "version" null'),
        (b'{"format": "ntagen-trace", "version": 9}', '"ntagen-trace" and its "version" 9'),
    ],
)
def test_what_is_no_evidence_is_refused_with_the_formats_that_are(
    data: bytes, said: str, lamp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    file.write_bytes(data)
    check_exit(2, "verify", lamp, file)
    told = capsys.readouterr().err
    assert f"error: {file}: " in told
    assert said in told
    for kind in ("certificate", "trace", "strategy", "machine"):
        assert f"ntagen-{kind}" in told
    file.write_bytes(b"\xff")
    check_exit(2, "verify", lamp, file)
    assert "not text in UTF-8" in (told := capsys.readouterr().err)
    assert "hint: give a trace, certificate or strategy as JSON" in told


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (("states", 1, "locations", "Lamp"), "On", "states[1].locations.Lamp"),
        (("states", 1, "zone"), ["x <= 3"], "does not hold in its run"),
        (("run", "states", 1, "locations", "Lamp"), "Off", "run.states[1].locations.Lamp"),
        (("run", "states", 1, "clocks", "x"), 9, "run.states[1].clocks.x"),
        (("transitions", 0, 0, "guard"), "x > 9", "transitions[0][0].guard"),
    ],
)
def test_trace_that_shows_what_is_not_so_is_violated(
    place: tuple[str | int, ...],
    value: object,
    said: str,
    lamp: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    trace = tmp_path / "trace.json"
    check_exit(0, "check", lamp, "--query", "E<> Lamp.Dim", "--trace", trace)
    check_exit(0, "verify", lamp, trace)
    assert "not checked: that zones hold nothing else" in capsys.readouterr().out
    file = json.loads(trace.read_text())
    part = file
    for key in place[:-1]:
        part = part[key]
    part[place[-1]] = value
    trace.write_text(json.dumps(file))
    check_exit(1, "verify", lamp, trace)
    assert said in capsys.readouterr().out


@pytest.mark.parametrize(
    "place",
    [
        (),
        ("run",),
        ("states", 0),
        ("states", 0, "locations"),
        ("states", 0, "variables"),
        ("run", "states", 0, "clocks"),
        ("run", "steps", 0, "edges", 0),
    ],
)
def test_names_that_nothing_knows_are_refused(
    place: tuple[str | int, ...], lamp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "trace.json"
    check_exit(0, "check", lamp, "--query", "E<> Lamp.Dim", "--trace", trace)
    file = json.loads(trace.read_text())
    part = file
    for key in place:
        part = part[key]
    part["surprise"] = 1
    trace.write_text(json.dumps(file))
    check_exit(2, "verify", lamp, trace)
    assert "surprise" in capsys.readouterr().err


def test_shortest_and_fastest_traces_differ(lamp: Path, tmp_path: Path) -> None:
    def found(wanted: str) -> tuple[int, float]:
        trace = tmp_path / "trace.json"
        options = ("--set", f"trace {wanted}", "--trace", trace)
        lamp.write_text(DETOUR)
        check_exit(0, "check", lamp, "--query", "E<> P.End", *options)
        run = json.loads(trace.read_text())["run"]
        waits = sum(step["wait"] for step in run["steps"]) + run["end"]["wait"]
        return len(run["steps"]), waits / run["ticks_per_unit"]

    assert found("shortest") == (1, 10)
    assert found("fastest") == (3, 2)


def test_traces_of_values_are_all_replayed(
    lamp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "trace.json"
    check_exit(0, "check", lamp, "--query", "bounds{Lamp.On}: x", "--trace", trace)
    check_exit(0, "verify", lamp, trace)
    assert capsys.readouterr().out.count("trace replayed") == 2
    file = json.loads(trace.read_text())
    assert [one["title"] for one in file["traces"]] == ["least x", "greatest x"]
    file["traces"][1]["value"]["value"] = 4
    trace.write_text(json.dumps(file))
    check_exit(1, "verify", lamp, trace)
    assert "the value is another one" in capsys.readouterr().out


def test_certificate_holds_until_a_state_is_taken_away(
    lamp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    certificate = tmp_path / "safe.jsonl"
    query = "A[] Lamp.On imply x <= 5"
    check_exit(0, "check", lamp, "--query", query, "--certificate", certificate)
    assert "certificate of 3 states written" in capsys.readouterr().out
    check_exit(0, "verify", lamp, certificate)
    assert "certificate verified: 3 words" in capsys.readouterr().out
    lines = certificate.read_text().splitlines()
    header = json.loads(lines[0])
    assert (header["query"], header["clocks"]) == (query, ["x"])
    header["states"] -= 1
    certificate.write_text("\n".join([json.dumps(header), *lines[1:-1]]))
    check_exit(1, "verify", lamp, certificate)
    assert "a move leads out of it" in capsys.readouterr().out


def test_file_that_is_no_evidence_is_rejected(
    lamp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    for content in (b"no json", b"{}", b"\xff\xfe", b'{"format": "ntagen-trace", "version": 9}'):
        file.write_bytes(content)
        check_exit(2, "verify", lamp, file)
        assert "error" in capsys.readouterr().err


def test_certificate_of_another_model_is_rejected(
    lamp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    certificate = tmp_path / "safe.jsonl"
    check_exit(0, "check", lamp, "--query", "A[] true", "--certificate", certificate)
    lamp.write_text(LAMP.replace("clock x;", "clock x; int n;"))
    check_exit(2, "verify", lamp, certificate)
    assert "a model with other processes, variables or clocks" in capsys.readouterr().err


RACE = """
process P() {
  clock x;
  state L { x <= 2 }, G, Bad;
  init L;
  trans L -> G { guard x >= 1; },
        L -u-> Bad { guard x > 1; };
}
system P;
"""


@pytest.mark.parametrize(
    ("query", "code", "owner", "changed", "said"),
    [
        ("control: A<> P.G", 0, "controller", ('["P.x < 1"]', '["P.x < 0"]'), "has no decision"),
        ("control: A[] not P.Bad", 0, "controller", ('["P.x < 1"]', '["P.x <= 2"]'), "may not"),
        ("control: A<> P.Bad", 1, "environment", ('"goal": false', '"goal": true'), "no decision"),
    ],
)
def test_strategy_holds_until_a_decision_is_changed(
    query: str,
    code: int,
    owner: str,
    changed: tuple[str, str],
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    model = tmp_path / "race.xta"
    model.write_text(RACE)
    path = tmp_path / "strategy.json"
    check_exit(code, "check", model, "--query", query, "--strategy", path)
    check_exit(0, "verify", model, path)
    assert "strategy verified: " in capsys.readouterr().out
    file = json.loads(path.read_text())
    assert (file["format"], file["owner"]) == ("ntagen-strategy", owner)
    text = json.dumps(file)
    assert changed[0] in text, text
    path.write_text(text.replace(*changed))
    check_exit(1, "verify", model, path)
    assert said in capsys.readouterr().out


def test_strategy_depends_on_the_rule_for_forced_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "forced.xta"
    model.write_text(
        "process P() { clock x; state I { x <= 5 }, G, S; init I; "
        "trans I -u-> G { }, I -> S { }; }\nsystem P;\n"
    )
    path = tmp_path / "strategy.json"
    query = ("--query", "control: A<> P.G", "--strategy", path)
    check_exit(0, "check", model, *query, "--forced", "neutral")
    check_exit(0, "verify", model, path, "--forced", "neutral")
    check_exit(1, "verify", model, path)
    assert "time cannot pass" in capsys.readouterr().out


def test_strategy_of_another_query_or_model_is_rejected(
    lamp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "race.xta"
    model.write_text(RACE)
    path = tmp_path / "strategy.json"
    check_exit(0, "check", model, "--query", "control: A<> P.G", "--strategy", path)
    text = path.read_text()
    path.write_text(text.replace("control: A<> P.G", "E<> P.G"))
    check_exit(2, "verify", model, path)
    assert "begins with control:" in capsys.readouterr().err
    path.write_text(text.replace("control: A<> P.G", "control: A<> Lamp.On"))
    check_exit(2, "verify", lamp, path)
    said = capsys.readouterr().err
    assert "strategy.json: at states[0].locations: the model's process Lamp" in said


def test_rules_without_an_effect_are_named(
    lamp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace, certificate = tmp_path / "trace.json", tmp_path / "safe.jsonl"
    strategy = tmp_path / "strategy.json"
    check_exit(0, "check", lamp, "--query", "E<> Lamp.Dim", "--trace", trace)
    check_exit(0, "check", lamp, "--query", "A[] x >= 0", "--certificate", certificate)
    check_exit(0, "check", lamp, "--query", "control: A[] not Lamp.Dim", "--strategy", strategy)
    capsys.readouterr()
    for file, kind in ((trace, "trace"), (certificate, "certificate"), (strategy, None)):
        check_exit(0, "verify", lamp, file, "--forced", "tiga")
        err = capsys.readouterr().err
        note = f"--forced has no effect here: it is a rule for strategies, and the file is a {kind}"
        assert err == (f"note: {note}\n" if kind else "")
