"""Nothing that stands in a file is a command to the terminal."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import click
import pytest

from ntagen.cli import main
from ntagen.cli.terminal import Styled, echo, echo_exactly, echo_message, safe

COMMANDS = "\x1b]0;title\x07\x1b[2J\x9b31m\x7f\x08\u202e\u2066"
"""Control sequences in seven and eight bits, and what turns the direction of writing."""

MODEL = f"""clock x;
process P() {{
  state A, B;
  init A;
  trans A -> B {{ guard x >= 1 /*{COMMANDS}*/ && x < 9; }};
}}
system P;
"""

QUERIES = (
    f"//{COMMANDS} name\nE<> P.B && /*{COMMANDS}*/ true\n\n/*{COMMANDS}\n*/\nE<> P.Z{COMMANDS}\n"
)


def unsafe_in(text: str) -> list[str]:
    return re.findall("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", text)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "model.xta"
    path.write_text(MODEL, "utf-8")
    return path


def test_safe_text_is_the_same_to_a_reader_of_json() -> None:
    text = f"a{COMMANDS}\tb\nc é 字 \U0001f600"
    shown = safe(text)
    assert unsafe_in(shown) == []
    lines = [json.loads(f'"{line}"'.replace("\t", "\\t")) for line in shown.split("\n")]
    assert "\n".join(lines) == text
    assert safe("x\r\ny") == "x\ny"


def test_styles_are_ours_only(capsys: pytest.CaptureFixture[str]) -> None:
    echo("a\x1b[1m", Styled("b\x1b[0m", fg="red"), "c", nl=False)
    assert "\x1b[1m" not in capsys.readouterr().out


@pytest.mark.parametrize("is_terminal", [False, True])
def test_documents_are_exact_except_on_a_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, is_terminal: bool
) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: is_terminal)
    document = f"// {COMMANDS}\n"
    echo_exactly(document, nl=False)
    assert capsys.readouterr().out == (safe(document) if is_terminal else document)


@pytest.mark.parametrize("extra", [[], ["--json"], ["--trace", "-"]])
def test_answers_command_nothing(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], extra: list[str]
) -> None:
    queries = tmp_path / "model.q"
    queries.write_text(QUERIES, "utf-8")
    main(["check", str(model), str(queries), *extra])
    main(["check", str(model), "--query", f"E<> P.B && /*{COMMANDS}*/ true", *extra])
    printed = capsys.readouterr()
    assert "P.B" in printed.out
    assert unsafe_in(printed.out) == []
    assert unsafe_in(printed.err) == []


def test_diagnostics_command_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "wrong.xta"
    path.write_text(MODEL.replace("x < 9", f"y < 9 /*{COMMANDS}*/"), "utf-8")
    assert main(["check", str(path)]) == 2
    printed = capsys.readouterr()
    assert "E0201" in printed.err
    assert unsafe_in(printed.out + printed.err) == []


def test_info_and_missing_files_command_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "model.xta"
    path.write_text(f"{MODEL}query {{ E<> P.B /*{COMMANDS}*/ && true }}", "utf-8")
    assert main(["info", str(path)]) == 0
    assert main(["info", str(path), "--json"]) == 0
    main(["check", str(tmp_path / f"none{COMMANDS}.xta")])
    printed = capsys.readouterr()
    assert unsafe_in(printed.out + printed.err) == []


def test_severities_are_coloured_on_a_terminal_only(capsys: pytest.CaptureFixture[str]) -> None:
    text = "a.xml:1:2: error[E0201]: odd\n  | error: x\n  hint: a \x1b[31m\nwarning: none"
    echo_message(text)
    assert capsys.readouterr().err == safe(text) + "\n"
    with click.Context(click.Command("check"), color=True):
        echo_message(text)
    coloured = capsys.readouterr().err
    assert click.unstyle(coloured) == safe(text) + "\n"
    assert "a.xml:1:2: \x1b[31m\x1b[1merror[E0201]:\x1b[0m odd\n  | error: x\n" in coloured
    assert "\x1b[36m\x1b[1m  hint:\x1b[0m a \\u001b[31m\n\x1b[33m\x1b[1mwarning:" in coloured
