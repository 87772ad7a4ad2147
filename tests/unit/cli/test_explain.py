"""`ntagen explain`, and that every page shows its mistake and how to fix it.

The examples of the engine's pages are tried in ``checker/tests/language/explanations.rs``.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ntagen import nsl
from ntagen.cli import main
from ntagen.explanations import explanations
from ntagen.nsl.diagnostics import KINDS

WITHOUT_EXAMPLE = {"N001", "N002", "N006", "N007"} | {
    *("N100", "N101", "N102", "N103", "N104", "N105", "N106", "N107", "N109", "N111"),
}
"""Codes about files that are not there, cannot be read or are too large to be shown."""


def example(page: str, role: str) -> bytes | None:
    """The example of a page, with escaped bytes as bytes."""
    match = re.search(rf"```nsl {role}\n(.*?)\n```", page, re.DOTALL)
    if match is None:
        return None
    parts = re.split(r"\\x([0-9A-F]{2})", match[1])
    return b"".join(
        bytes([int(part, 16)]) if index % 2 else part.encode() for index, part in enumerate(parts)
    )


def codes_of(data: bytes, folder: Path) -> set[str]:
    """The codes of all that is said about an environment."""
    path = folder / "example.nsl"
    path.write_bytes(data)
    try:
        _, warnings = nsl.load_with_warnings(path)
    except nsl.SourceError as error:
        return {diagnostic.code for diagnostic in error.diagnostics}
    return {diagnostic.code for diagnostic in warnings}


@pytest.mark.parametrize("code", [kind.code for kind in KINDS.values()])
def test_page_shows_its_mistake_and_the_way_out(code: str, tmp_path: Path) -> None:
    page = explanations()[code].page
    wrong, right = example(page, "wrong"), example(page, "right")
    if code in WITHOUT_EXAMPLE:
        assert wrong is None
        return
    assert wrong is not None
    assert right is not None
    assert codes_of(wrong, tmp_path) == {code}
    assert codes_of(right, tmp_path) == set()


def test_no_page_is_left_over() -> None:
    pages = {path.stem for path in (Path(nsl.__file__).parent / "pages").glob("*.md")}
    assert pages == {kind.code for kind in KINDS.values()}


@pytest.mark.parametrize("name", ["E0201", "e0201", "[E0201]", "name-unknown"])
def test_a_page_is_found_by_code_and_name(capsys: pytest.CaptureFixture[str], name: str) -> None:
    assert main(["explain", name]) == 0
    out = capsys.readouterr().out
    assert out.startswith("error[E0201]: name-unknown\n\nThis name is not declared at this place")
    assert "\nWrong:\n\n    int length;\n" in out
    assert "\nRight:\n\n    const int length = 3;\n" in out
    assert "```" not in out


def test_all_codes_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "E0201  error    name-unknown" in lines
    assert "W0202  warning  invariant-strict" in lines
    assert "N023  error    unknown-unit" in lines
    assert len(lines) == len(explanations())


def test_every_page_can_be_shown(capsys: pytest.CaptureFixture[str]) -> None:
    for code in explanations():
        assert main(["explain", code]) == 0
        out = capsys.readouterr().out
        assert "```" not in out
        assert max(len(line) for line in out.splitlines()) < 420


def test_an_unknown_code_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "E0021"]) == 2
    err = capsys.readouterr().err
    assert "there is no diagnostic with the code E0021" in err
    assert "hint: did you mean E0" in err
