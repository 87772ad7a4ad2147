"""The corpus of environment files: what is accepted, and what is said about the rest.

Every file of ``tests/corpus/nsl/err`` is a file with mistakes, and says in comments which
diagnostics it must get, all of them and no others, in their order::

    // expect: N023 at 3:15 "part of the message"
    // expect: N020 at parts/lets.nsl:2:1 "a place in an included file"
    // expect: N005 at file "a defect of the file as a whole"

Files of ``tests/corpus/nsl/ok`` must load; warnings are expected in the same way. The folders
``parts`` hold what the files include.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ntagen import nsl
from ntagen.nsl.diagnostics import KINDS

CORPUS = Path(__file__).parents[2] / "corpus" / "nsl"
WRONG = sorted(CORPUS.glob("err/*.nsl"))
RIGHT = sorted(CORPUS.glob("ok/*.nsl"))

DIRECTIVE = re.compile(r"^// *([a-z]+):(.*)$", re.MULTILINE)
EXPECTATION = re.compile(r' (N\d{3}) at (?:(\S+\.nsl):)?(file|\d+:\d+) "(.+)"')

OUTSIDE_CORPUS = {"N001", "N002", "N006", "N007"} | {
    *("N100", "N101", "N102", "N103", "N104", "N105", "N106", "N107", "N109", "N111"),
}
"""Codes of files that are not kept: tested in test_files.py and test_images.py."""


def expectations(path: Path) -> list[tuple[str, str, str, str]]:
    """Code, file, place and part of the message of each diagnostic that a file expects."""
    text = path.read_bytes().decode("latin-1")
    found = []
    for name, argument in DIRECTIVE.findall(text):
        assert name == "expect", f"{path.name}: there is no directive `{name}`"
        match = EXPECTATION.fullmatch(argument.rstrip())
        assert match is not None, f"{path.name}: this expectation cannot be read:{argument}"
        code, file, place, message = match.groups()
        message = message.encode("latin-1").decode("utf-8")
        found.append((code, file or path.name, place, message))
    return found


def check_diagnostics(path: Path, diagnostics: tuple[nsl.Diagnostic, ...]) -> None:
    """The diagnostics of a file are those that it expects, and can be shown."""
    expected = expectations(path)
    described = [
        (
            diagnostic.code,
            Path(diagnostic.path).relative_to(path.parent).as_posix(),
            f"{diagnostic.line}:{diagnostic.column}" if diagnostic.line else "file",
            diagnostic.message,
        )
        for diagnostic in diagnostics
    ]
    rendered = "\n".join(diagnostic.render() for diagnostic in diagnostics)
    assert [d[:3] for d in described] == [e[:3] for e in expected], rendered
    for (_, _, _, message), (_, _, _, part) in zip(described, expected, strict=True):
        assert part in message
    for diagnostic in diagnostics:
        check_rendering(diagnostic)


def check_rendering(diagnostic: nsl.Diagnostic) -> None:
    """A diagnostic is shown with its place, and the caret stands below the right characters."""
    lines = diagnostic.render().splitlines()
    assert re.search(rf": {diagnostic.severity}\[{diagnostic.code}\]: ", lines[0])
    assert not diagnostic.message.endswith(".")
    assert "\n" not in diagnostic.message
    if diagnostic.line:
        assert lines[0].startswith(f"{diagnostic.path}:{diagnostic.line}:{diagnostic.column}: ")
        shown, caret = lines[1], lines[2]
        start, end = caret.index("^"), caret.rindex("^") + 1
        meant = diagnostic.source_line[diagnostic.column - 1 :][: diagnostic.length]
        assert meant.rstrip().startswith(shown[start:end].rstrip()) or not meant.isprintable()


def test_corpus_is_large_enough() -> None:
    assert len(WRONG) >= 60
    assert len(RIGHT) >= 10


@pytest.mark.parametrize("path", WRONG, ids=lambda path: path.stem)
def test_wrong_file_gets_its_diagnostics(path: Path) -> None:
    assert expectations(path), f"{path.name} expects nothing"
    with pytest.raises(nsl.SourceError) as caught:
        nsl.load(path)
    check_diagnostics(path, caught.value.diagnostics)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("path", RIGHT, ids=lambda path: path.stem)
def test_right_file_loads(path: Path) -> None:
    _, warnings = nsl.load_with_warnings(path)
    check_diagnostics(path, warnings)


def test_every_kind_of_defect_has_a_file() -> None:
    expected = {code for path in WRONG + RIGHT for code, *_ in expectations(path)}
    codes = {kind.code for kind in KINDS.values()}
    assert expected | OUTSIDE_CORPUS == codes


def test_codes_are_distinct_and_explained() -> None:
    assert len({kind.code for kind in KINDS.values()}) == len(KINDS)
    assert [kind.code for kind in KINDS.values()] == sorted(kind.code for kind in KINDS.values())
    assert all(kind.explanation.endswith(".") for kind in KINDS.values())
