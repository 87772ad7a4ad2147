"""Plain regions are read in a quicker way, and the tree is the same with all its places."""

from __future__ import annotations

from pathlib import Path

import pytest

from ntagen.nsl import parser, tree
from ntagen.nsl.diagnostics import Diagnostic, Reporter
from ntagen.nsl.plain import plain_regions
from ntagen.nsl.source import Source

ROOT = Path(__file__).parents[3]
FILES = sorted([*ROOT.glob("examples/**/*.nsl"), *ROOT.glob("tests/corpus/nsl/**/*.nsl")])


def parsed(source: Source) -> tuple[tree.File, tuple[Diagnostic, ...]]:
    reporter = Reporter()
    return parser.parse(source, reporter), tuple(reporter.diagnostics)


def check_same(source: Source, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(parser, "LONG_TEXT", 0)
        quick = parsed(source)
        patch.setattr(parser, "LONG_TEXT", len(source.text) + 1)
        assert parsed(source) == quick


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_tree_of_a_file_is_the_same(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_same(Source(str(path), path.read_bytes().decode("utf-8", "replace")), monkeypatch)


PLAIN = [
    "critical C sphere (1, -2.5, +3e1) mm radius 2 mm",
    "target  T\tsphere(0,-50,0)mm radius 1cm  // the tumour",
    "detection D around C margin 3 mm",
    "critical B box (0, -20, 5) mm size (10, 4, 6) mm",
    "critical B box (0, -20, 5) mm size (10, 4, 6) mm turned -30 deg about -z",
    "critical V capsule (0, -10, 0) mm to (5, -30, 2) mm radius 2 mm to 1.5 mm",
    "critical V capsule (0, -10, 0) mm to (5, -30, 2) mm radius 2 mm",
    "critical K cylinder (0, -10, 0) mm to (0, -30, 0) mm radius 3 mm",
    "safe E ellipsoid (0, -25, 0) mm radii (3, 5, 2) mm turned 20 deg about +x",
    "unexplored H halfspace (0, -60, 0) mm towards -y",
]
NOT_PLAIN = [
    "critical C[1] sphere (1, -2, 3) mm radius 2 mm",
    "critical C sphere (1, -2, 3) mm radius 2 mm * 2",
    "critical C sphere (1, -2, 3) mm radius 2 mm\n+ 1 mm",
    "critical C sphere (1, -2, 3) mm radius 2 mm // half\n+ 1 mm",
    "critical C sphere (1, 1 + 1, 3) mm radius 2 mm",
    "critical C sphere (1, -2, 3) mm radius 2 parsec",
    "critical radius sphere (1, -2, 3) mm radius 2 mm",
    "critical C sphere (1, -2) mm radius 2 mm",
    "critical C sphere (1, -2, 3) mm radius 2 mm;",
    "/* critical C sphere (1, -2, 3) mm radius 2 mm\n} */",
    "critical B box (0, -20, 5) mm size (10, 4, 6) mm turned 30 deg about (0, 0, 1)",
]


@pytest.mark.parametrize("line", PLAIN)
def test_plain_regions(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    source = Source("e.nsl", f"environment e {{\n{line}\n  {line}\r\n}}\n")
    assert len(list(plain_regions(source))) == 2
    check_same(source, monkeypatch)


@pytest.mark.parametrize("line", NOT_PLAIN)
def test_what_is_not_plain_is_left_to_the_usual_way(
    line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = Source("e.nsl", f"environment e {{\n{line}\n}}\n")
    assert list(plain_regions(source)) == []
    check_same(source, monkeypatch)


@pytest.mark.parametrize(
    "text",
    [
        "needle {{ radius 30 mm\n{}\n}}",
        "let x = 3 +\n{}\n}}",
        "environment e {{\n{}\n",
        "drive {{\n{}\n}}",
        "for i in 0..3 {{\n{}\n}}",
        "query A = E<> x\n{}\n}}",
        "critical C sphere (1, 2, 3) mm\n{}\n}}",
        "critical\n{}\n}}",
        "motion\n{}\n}}",
    ],
)
def test_mistakes_around_a_plain_region_are_reported_alike(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = Source("e.nsl", text.format(PLAIN[0]))
    assert len(list(plain_regions(source))) == 1
    check_same(source, monkeypatch)
