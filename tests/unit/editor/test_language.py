"""What an editor is told about environments, also while they are typed."""

from __future__ import annotations

from pathlib import Path

import pytest

from ntagen.editor import language
from ntagen.nsl.tokens import KEYWORDS, NAMING
from ntagen.parameters import BY_WORDS

PAPER = (Path(__file__).parents[3] / "examples" / "paper.nsl").read_text("utf-8")


def possible(text: str) -> list[str]:
    """The words at the place of the bar, or at the end."""
    before, _, after = text.partition("|")
    return [word.text for word in language.possible(before + after, len(before))]


def meaning(text: str, word: str) -> str | None:
    found = language.meaning(text, text.index(word))
    return found and found[0]


def test_mistakes_are_those_of_check() -> None:
    assert language.mistakes(PAPER, "paper.nsl") == ()
    codes = [
        one.code for one in language.mistakes(PAPER.replace("radius 10", "raduis 10"), "a.nsl")
    ]
    assert codes == ["N015"]


def test_words_are_explained() -> None:
    told = meaning(PAPER, "bevel")
    assert told is not None
    assert "write for example `bevel +z`" in told
    assert "default: `+z`" in told
    assert "required: no" in told
    assert meaning("environment e { drive { initial push 3 mm } }", "push") == meaning(
        "environment e { drive { initial push 3 mm } }", "initial"
    )
    assert "such as `initial push 2 mm`" in (
        meaning("environment e { drive { initial push 3", "ini") or ""
    )
    assert "target on line 16" in (meaning(PAPER, "T1") or "")
    assert meaning(PAPER, "0, 0") is None
    assert language.meaning("", 0) is None


def test_every_keyword_has_a_row_in_the_page_of_the_language() -> None:
    assert set(language.statements()) >= KEYWORDS - {"wait", "push"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", {"environment", "include", "let"}),
        ("environment e { needle { ra", {"radius", "speed", "tip", "heading", "bevel", "length"}),
        ("environment e { tissue ", {"static", "adversarial", "stochastic"}),
        ("environment e { drive { ranking ", {"clearance", "reserve", "rolls", "length", "target"}),
        ("environment e { critical A sphere (0, 0, 0) mm ", {"radius"}),
        ('environment e { device grbl "x" { ', {"insert", "roll"}),
    ],
)
def test_exactly_the_words_that_may_stand_there(text: str, words: set[str]) -> None:
    assert set(possible(text)) == words


def test_words_that_go_on_come_before_those_that_begin() -> None:
    words = possible("environment e { target T sphere (0, -9, 0) mm radius 1 mm | }")
    assert words[0] == "moves"
    assert {"critical", "needle"} <= set(words)


def test_names_are_offered_where_they_fit() -> None:
    regions = (
        "environment e { critical A sphere (0, 0, 1) mm radius 1 mm target B sphere (0, 0, 9) mm"
    )
    assert possible(regions + " radius 1 mm detection C around ") == ["A"]
    assert possible("let near = 3 mm let far = ") == ["near", "far"]
    assert set(BY_WORDS) == set(possible("environment e { drive { "))


@pytest.mark.parametrize(
    "text",
    [
        "// a comment |",
        "/* a comment | */",
        '"a pa|th"',
        'include "a',
        "environment e { query Q = E<> |",
        "environment ",
        "let ",
        *(f"environment e {{ {word} " for word in sorted(NAMING - {"environment"})),
    ],
)
def test_nothing_is_offered_where_anything_may_stand(text: str) -> None:
    assert possible(text) == []


def test_names_are_listed() -> None:
    names = [(one.kind, one.name) for one in language.declared(PAPER)]
    assert names == [
        ("environment", "paper"),
        ("target", "T1"),
        ("critical", "C1"),
        ("detection", "D1"),
    ]
    one = language.declared(PAPER)[1]
    assert PAPER[one.start : one.end] == "target    T1"


@pytest.mark.slow
def test_any_text_on_the_way_has_answers() -> None:
    text = PAPER + '}} { drive { \N{ROCKET} query " /* '
    for end in range(0, len(text), 7):
        part = text[:end]
        language.mistakes(part, "part.nsl")
        language.possible(part, end)
        language.declared(part)
        for offset in range(max(0, end - 7), end + 1):
            language.meaning(part, offset)
