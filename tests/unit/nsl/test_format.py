"""The layout of environment files, and the command for it."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest
from click.testing import CliRunner

from ntagen import nsl
from ntagen.cli.needle.fmt import command
from ntagen.errors import InputError

SMALLEST = """environment e {
  needle {
    radius 30 mm  speed 1 mm/s
  }
  target T1  sphere (0, -50, 0) mm  radius 10 mm
}
"""


def check_layout(text: str, expected: str) -> None:
    """A text gets a layout, which is its own layout."""
    assert nsl.format_text(text) == expected
    assert nsl.format_text(expected) == expected


def test_words_and_clauses_are_spaced() -> None:
    check_layout("let a=-( 1+2 )*- 3 mm/s/min( a,2 )\n", "let a = -(1 + 2) * -3 mm/s / min(a, 2)\n")
    check_layout("let b = ( 0,- 1 , 0 )mm /s", "let b = (0, -1, 0) mm/s\n")
    check_layout("let b = 1 mm\n/\ns", "let b = 1 mm/s\n")
    check_layout("for i in 0 .. - 1{}", "for i in 0..-1 {\n}\n")
    check_layout("query  A  =A[]  x  ", "query A = A[]  x\n")


def test_settings_and_axes_are_laid_out_like_other_statements() -> None:
    check_layout(
        "drive{depth in\ntarget 0.3 mm force rise 1 N /mm"
        " ranking length,rolls prior roll -( 1 )deg}",
        "drive {\n"
        "  depth in target 0.3 mm  force rise 1 N/mm  ranking length, rolls  prior roll -(1) deg\n"
        "}\n",
    )
    check_layout(
        'device grbl "p"{insert X-80 steps/ mm\nroll A 8 - 1 steps/deg}'
        'tracker openigtlink "h:1""n"',
        'device grbl "p" {\n'
        "  insert X -80 steps/mm\n"
        "  roll A 8 - 1 steps/deg\n"
        "}\n"
        'tracker openigtlink "h:1" "n"\n',
    )


def test_a_setting_whose_first_word_is_a_kind_of_regions_is_no_region() -> None:
    check_layout(
        "drive {\ndetection clearance 1 mm\ndetection clearance 2 mm pull 1 mm\n}",
        "drive {\n  detection clearance 1 mm\n  detection clearance 2 mm  pull 1 mm\n}\n",
    )


def test_words_of_settings_are_names_elsewhere() -> None:
    check_layout("let depth=1 let pull=2\n", "let depth = 1  let pull = 2\n")
    check_layout("drive { pull pull*2 push 1 mm }", "drive {\n  pull pull * 2  push 1 mm\n}\n")


def test_braces_get_their_own_lines() -> None:
    check_layout(
        "environment e{needle{radius 30 mm speed 1 mm/s}"
        "target T1 sphere (0,-50,0) mm radius 10 mm}",
        SMALLEST,
    )


def test_line_breaks_between_statements_stay() -> None:
    check_layout("let a = 1 let b = 2\nlet c\n = 3", "let a = 1  let b = 2\nlet c = 3\n")


def test_empty_lines_become_one_and_none_at_braces() -> None:
    check_layout(
        "\n\nlet a = 1\n\n\n\nlet b = 2\nfor i in 0..1 {\n\nlet c = 3\n\n}\n\n",
        "let a = 1\n\nlet b = 2\nfor i in 0..1 {\n  let c = 3\n}\n",
    )


def test_regions_stand_in_columns() -> None:
    check_layout(
        "target T sphere (0,-50,0) mm radius 1 mm\n"
        "critical Long sphere (0,-5,0) mm radius 10 mm // c\n"
        "\n"
        "target U sphere (0,-50,0) mm radius 1 mm\n",
        "target   T     sphere (0, -50, 0) mm  radius 1 mm\n"
        "critical Long  sphere (0, -5, 0) mm   radius 10 mm   // c\n"
        "\n"
        "target U  sphere (0, -50, 0) mm  radius 1 mm\n",
    )


def test_regions_of_two_shapes_share_kind_and_name() -> None:
    check_layout(
        "critical C[ i ] sphere (0,-5,0) mm radius 10 mm\ndetection D around C[i] margin 1 mm\n",
        "critical  C[i]  sphere (0, -5, 0) mm  radius 10 mm\n"
        "detection D     around C[i]  margin 1 mm\n",
    )


def test_comments_stay_where_they_belong() -> None:
    check_layout(
        "// head\nlet a = 1 // one\nlet bcd = /* two */ 2 // and\n  /* own\n line */\nlet c = 3",
        "// head\n"
        "let a = 1               // one\n"
        "let bcd = /* two */ 2   // and\n"
        "/* own\n line */\n"
        "let c = 3\n",
    )
    check_layout("let a = // why\n 3", "let a = // why\n      3\n")


def test_text_with_mistakes_of_form_has_no_layout() -> None:
    with pytest.raises(nsl.SourceError):
        nsl.format_text("let a = = 3")


def test_text_with_mistakes_of_meaning_has_a_layout() -> None:
    check_layout("let a=3 mmm", "let a = 3 mmm\n")


def test_command_writes_in_place(tmp_path: Path) -> None:
    path = tmp_path / "env.nsl"
    path.write_text(SMALLEST.replace("  ", " "))
    result = CliRunner().invoke(command, [str(path)])
    assert result.exit_code == 0
    assert path.read_text() == SMALLEST
    assert f"reformatted {path}" in result.stderr


def test_command_checks_without_writing(tmp_path: Path) -> None:
    path = tmp_path / "env.nsl"
    untidy = SMALLEST.replace("  ", " ")
    path.write_text(untidy)
    assert CliRunner().invoke(command, ["--check", str(path)]).exit_code == 1
    assert path.read_text() == untidy
    path.write_text(SMALLEST)
    assert CliRunner().invoke(command, ["--check", str(path)]).exit_code == 0


def test_command_filters_standard_input() -> None:
    result = CliRunner().invoke(command, ["-"], input=SMALLEST.replace("  ", " "))
    assert (result.exit_code, result.stdout) == (0, SMALLEST)
    assert CliRunner().invoke(command, ["--check", "-"], input=SMALLEST).exit_code == 0
    assert CliRunner().invoke(command, ["--check", "-"], input="let  a = 1").exit_code == 1


def test_command_reports_the_mistakes_of_all_files_and_formats_the_others(tmp_path: Path) -> None:
    (tmp_path / "a.nsl").write_text("let a = = 3\n")
    (tmp_path / "b.nsl").write_text("let  b = 3\n")
    paths = [str(tmp_path / name) for name in ("a.nsl", "b.nsl", "c.nsl")]
    result = CliRunner().invoke(command, paths)
    assert isinstance(result.exception, nsl.SourceError)
    assert [d.code for d in result.exception.diagnostics] == ["N015", "N001"]
    assert (tmp_path / "a.nsl").read_text() == "let a = = 3\n"
    assert (tmp_path / "b.nsl").read_text() == "let b = 3\n"


def test_command_says_when_it_cannot_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "env.nsl"
    path.write_text("let  b = 3\n")

    def refuse(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("ntagen.files.os.fsync", refuse)
    result = CliRunner().invoke(command, [str(path)])
    assert isinstance(result.exception, InputError)
    assert str(path) in str(result.exception)
    assert [(one.name, one.read_text()) for one in tmp_path.iterdir()] == [
        ("env.nsl", "let  b = 3\n")
    ]
    assert [(one.name, one.read_text()) for one in tmp_path.iterdir()] == [
        ("env.nsl", "let  b = 3\n")
    ]
