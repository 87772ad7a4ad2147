"""`ntagen compile`: files in, files out, and what can go wrong on the way."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from ntagen import cli
from ntagen.files import write_files
from ntagen.nsl import load
from ntagen.render import render, render_queries

EXAMPLES = Path(__file__).parents[3] / "examples"
PAPER = EXAMPLES / "paper.nsl"


def check_refused(capsys: pytest.CaptureFixture[str], arguments: list[str], *parts: str) -> None:
    """A command line that ends with code 2, says why, and shows no trace."""
    assert cli.main(["compile", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Traceback" not in err
    for part in parts:
        assert part in err


TASKS = sorted(p for p in EXAMPLES.rglob("*.nsl") if "environment " in p.read_text("utf-8"))
"""The examples that are whole; the others are included by them."""


@pytest.mark.parametrize("path", TASKS, ids=lambda path: path.stem)
def test_every_example_compiles(path: Path, tmp_path: Path) -> None:
    assert cli.main(["compile", str(path), "-o", str(tmp_path / "new" / "folder")]) == 0
    folder = tmp_path / "new" / "folder"
    assert sorted(file.name for file in folder.iterdir()) == [f"{path.stem}.q", f"{path.stem}.xml"]
    scene = load(path)
    assert (folder / f"{path.stem}.xml").read_text("utf-8") == render(scene, path.name)
    assert (folder / f"{path.stem}.q").read_text("utf-8") == render_queries(scene)


def test_files_are_replaced(tmp_path: Path) -> None:
    (tmp_path / "paper.xml").write_text("old")
    assert cli.main(["compile", str(PAPER), "-o", str(tmp_path)]) == 0
    assert (tmp_path / "paper.xml").read_text("utf-8").startswith("<?xml")


def test_a_missing_file_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    check_refused(capsys, [str(tmp_path / "none.nsl")], "none.nsl", "no such file")


def test_a_folder_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    check_refused(capsys, [str(tmp_path)], "it is a folder")


@pytest.mark.parametrize("content", [b"", b"\x00\xff\x80", b"<nta/>", b"environment {"])
def test_what_is_no_environment_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, content: bytes
) -> None:
    source = tmp_path / "bad.nsl"
    source.write_bytes(content)
    check_refused(capsys, [str(source), "-o", str(tmp_path)], "bad.nsl", "error[N")
    assert [file.name for file in tmp_path.iterdir()] == ["bad.nsl"]


def test_a_file_in_place_of_the_folder_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    check_refused(capsys, [str(PAPER), "-o", str(tmp_path / "file")], "cannot write", "hint")


def test_a_folder_in_place_of_the_file_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "paper.q").mkdir()
    check_refused(capsys, [str(PAPER), "-o", str(tmp_path)], "paper.q: it is a folder")
    assert [file.name for file in tmp_path.iterdir()] == ["paper.q"]


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_a_folder_without_permission_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    tmp_path.chmod(0o500)
    check_refused(capsys, [str(PAPER), "-o", str(tmp_path)], "cannot write", "permission denied")


def test_an_error_while_writing_leaves_all_files_as_they_were(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "paper.xml").write_text("old")

    def fail(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    check_refused(capsys, [str(PAPER), "-o", str(tmp_path)], "paper.xml: no space left on device")
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == {"paper.xml": "old"}


def test_files_get_the_permissions_of_new_files(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("")
    write_files({tmp_path / "written": "text\n"})
    assert (tmp_path / "written").stat().st_mode == (tmp_path / "plain").stat().st_mode
