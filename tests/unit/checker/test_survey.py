"""Surveys of models, in characters of their texts."""

from __future__ import annotations

import pytest

from ntagen.checker.survey import Texts, survey

MODEL = """\
// Größe \N{ROCKET}
const int size = 1; /* ö */ int other = size;
process P() { state A; init A; }
system P;
"""
TEXTS = Texts("a.xta", MODEL, "a.q", "A[] size < 1 // größer\nE<> P.B\n")


def test_places_count_characters() -> None:
    found = survey(TEXTS)
    for one in found.uses:
        name = found.symbols[one.symbol].name
        assert TEXTS.of(one.at.file)[one.at.start : one.at.end] == name
    (mistake,) = found.mistakes
    assert mistake.at is not None
    assert "B" in TEXTS.queries[mistake.at.start : mistake.at.end]
    assert [one.text for one in found.queries] == ["A[] size < 1", "E<> P.B"]


@pytest.mark.parametrize("encoding", ["utf-8", "ISO-8859-1"])
def test_the_text_counts_and_not_its_encoding(encoding: str) -> None:
    text = (
        f'<?xml version="1.0" encoding="{encoding}"?>\n<nta><declaration>// ö\nint x = y;'
        "</declaration><template><name>P</name><location id='a'/><init ref='a'/></template>"
        "<system>system P;</system></nta>\n"
    )
    mistake = next(one for one in survey(Texts("a.xml", text)).mistakes if one.code == "E0201")
    assert mistake.at is not None
    assert text[mistake.at.start : mistake.at.end] == "y"
