"""`ntagen convert`: formats by endings and options, queries beside a model, and wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen import build
from ntagen.cli import main

ROOT = Path(__file__).resolve().parents[3]
FISCHER = ROOT / "examples" / "models" / "fischer.xta"

LAMP = """clock x;
process Lamp() { state Off, On { x <= 9 }; init Off; trans Off -> On { assign x = 0; }; }
system Lamp;
"""


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    path = tmp_path / "lamp.xta"
    path.write_text(LAMP)
    (tmp_path / "lamp.q").write_text("// it can shine\n// EXPECT:T\nE<> Lamp.On\n")
    return path


def run(
    capsys: pytest.CaptureFixture[str], code: int, *arguments: str | Path
) -> tuple[str, list[str]]:
    """The command ends with the exit code; its output, and the lines of its messages."""
    assert main(["convert", *(str(one) for one in arguments)]) == code
    captured = capsys.readouterr()
    assert "Traceback" not in captured.out + captured.err
    return captured.out, captured.err.splitlines()


def test_queries_come_along_in_both_directions(
    capsys: pytest.CaptureFixture[str], lamp: Path, tmp_path: Path
) -> None:
    xml, xta = tmp_path / "made.xml", tmp_path / "back.xta"
    out, err = run(capsys, 0, lamp, "-o", xml)
    assert out == f"wrote {xml}\n"
    assert err == [f"note: read 1 query of {tmp_path / 'lamp.q'}"]
    query = build.read(xml).queries[0]
    assert (query.formula, query.comment) == ("E<> Lamp.On", "it can shine")
    assert query.expect is not None
    assert query.expect.outcome == "success"
    out, err = run(capsys, 0, xml, "-o", xta)
    assert out == f"wrote {xta} and {tmp_path / 'back.q'}\n"
    assert err == []
    assert main(["check", str(xta), str(tmp_path / "back.q"), "--expect"]) == 0


def test_queries_of_somebody_else_stay(
    capsys: pytest.CaptureFixture[str], lamp: Path, tmp_path: Path
) -> None:
    xml = tmp_path / "made.xml"
    run(capsys, 0, lamp, "-o", xml)
    other = tmp_path / "other.xta"
    run(capsys, 0, xml, "-o", other)
    run(capsys, 0, xml, "-o", other)  # its own it replaces
    (tmp_path / "other.q").write_text("E<> Lamp.Off\n")
    _, err = run(capsys, 2, xml, "-o", other)
    assert err == [
        f"error: the queries would replace {tmp_path / 'other.q'}, which ntagen convert has not "
        "written",
        "hint: choose another name for FILE, or move that file",
    ]
    assert (tmp_path / "other.q").read_text() == "E<> Lamp.Off\n"


def test_a_printed_model_is_all_that_is_printed(
    capsys: pytest.CaptureFixture[str], lamp: Path, tmp_path: Path
) -> None:
    out, err = run(capsys, 0, lamp, "-o", "-", "--to", "tck")
    assert out.startswith("system:lamp\nclock:1:x\n")
    assert len(err) == 1
    out, _ = run(capsys, 0, lamp, "-o", "-", "--to", "jani")
    assert json.loads(out)["type"] == "pta"
    out, err = run(capsys, 0, lamp, "-o", "-", "--to", "xta")
    assert "process Lamp()" in out
    assert err[-1] == "note: 1 query left out; -o FILE writes them beside it"
    out, _ = run(capsys, 0, lamp, "-o", "-", "--to", "dot")
    assert out.startswith('digraph "lamp" {')


def test_tchecker_and_back(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    tck, xml = tmp_path / "fischer.tck", tmp_path / "again.xml"
    out, err = run(capsys, 0, FISCHER, "-o", tck)
    assert out == f"wrote {tck}\n"
    assert err[1].startswith("note: query 1 is only a comment, for labels cannot express it: A[] ")
    run(capsys, 0, tck, "-o", xml)
    assert [one.formula for one in build.read(xml).queries] == ["E<> P_1.Critical"]
    assert main(["check", str(xml)]) == 0


def test_an_environment_is_compiled_first(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out, _ = run(capsys, 0, ROOT / "examples" / "paper.nsl", "-o", tmp_path / "paper.xta")
    assert out == f"wrote {tmp_path / 'paper.xta'} and {tmp_path / 'paper.q'}\n"
    assert main(["info", str(tmp_path / "paper.xta")]) == 0


def test_options_say_what_endings_do_not(
    capsys: pytest.CaptureFixture[str], lamp: Path, tmp_path: Path
) -> None:
    given, wanted = tmp_path / "lamp.txt", tmp_path / "lamp.out"
    given.write_text(LAMP)
    run(capsys, 0, given, "-o", wanted, "--from", "xta", "--to", "xml")
    assert wanted.read_text().startswith("<?xml")
    _, err = run(capsys, 2, given, "-o", wanted, "--to", "xml")
    assert err == [
        f"error: the ending of MODEL {given} names no format",
        "hint: say it with --from: xml, xta, ta, tck, nsl",
    ]
    _, err = run(capsys, 2, lamp, "-o", wanted)
    assert err[0] == f"error: the ending of -o {wanted} names no format"
    _, err = run(capsys, 2, lamp, "-o", "-")
    assert err == ["error: -o - has no ending", "hint: say the format: --to xml|xta|tck|jani|dot"]


def test_a_model_does_not_replace_itself(capsys: pytest.CaptureFixture[str], lamp: Path) -> None:
    _, err = run(capsys, 2, lamp, "-o", lamp)
    assert err[0] == f"error: -o {lamp} would replace the model {lamp}"
    assert lamp.read_text() == LAMP


def test_what_is_refused_leaves_no_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    game = tmp_path / "game.xta"
    game.write_text(LAMP.replace("->", "-u->"))
    _, err = run(capsys, 2, game, "-o", tmp_path / "game.tck")
    assert err == [
        f"error: {game}: template Lamp, edge Off → On: TChecker has no games, and this edge is the "
        "environment's",
        'hint: write -> for -u->, or delete controllable="false"',
    ]
    assert not (tmp_path / "game.tck").exists()
    wrong = tmp_path / "wrong.xta"
    wrong.write_text("process P() { state A; init A; } system Q;")
    _, err = run(capsys, 2, wrong, "-o", tmp_path / "wrong.xml")
    assert err[0].startswith(f"{wrong}:1:41: error[")
    assert err[-1].startswith("for an example and how to fix it: ntagen explain E")
