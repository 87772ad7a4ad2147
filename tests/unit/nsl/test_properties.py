"""What holds for any text at all: a scene or a `SourceError`, and a layout that changes nothing."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen import nsl
from ntagen.nsl.lexer import tokenise
from ntagen.nsl.source import Source
from ntagen.nsl.tokens import RESERVED
from ntagen.parameters import BY_WORDS
from ntagen.scene import Scene
from tests.examples import examples

TESTS = Path(__file__).parents[2]
SEEDS = [
    path.read_bytes().decode()
    for path in [
        *sorted((TESTS / "corpus" / "nsl" / "ok").glob("*.nsl")),
        *sorted((TESTS.parent / "examples").glob("**/*.nsl")),
    ]
]
assert SEEDS

SIGNS = "{ } ( ) [ ] , = + - * / .. \" // /* */ # ; ~ ' \\ \n \r\n \t \0 é 0 1 1.5 1e9 1e999 -3"
NAMES = "mm s deg mm/s rad x y z pi sin sqrt C1 T1 Ring i 0..7 static swept sampled"
VOCABULARY = [
    *sorted(RESERVED),
    *sorted(BY_WORDS),
    *sorted({word for words in BY_WORDS for word in words.split()}),
    "drive { pull 4 mm }",
    'device grbl "p" { insert X 80 steps/mm',
    "80 steps/mm",
    "0.5 N/mm",
    "off",
    *SIGNS.split(" "),
    *NAMES.split(),
    "\n",
    " ",
    'include "nothing.nsl"',
    "query A = E<> x\n",
    "// comment\n",
    "/* comment */",
]


def outcome(text: str) -> Scene | tuple[tuple[str, int, int], ...]:
    """The scene of a text, or the codes and places of what is wrong with it, all of it shown."""
    try:
        return nsl.loads(text)
    except nsl.SourceError as error:
        mistakes, shown = error.diagnostics, str(error)
    assert mistakes
    assert shown
    return tuple((d.code, d.line, d.column) for d in mistakes)


def words(text: str) -> list[tuple[str, str]]:
    """The tokens and comments of a text, without the white space in them."""
    return [
        (getattr(item, "type", "COMMENT"), "".join(item.text.split()))
        for item in tokenise(Source("<text>", text))
    ]


SETTINGS = st.lists(st.sampled_from(sorted(BY_WORDS)), min_size=1, max_size=12, unique=True)
BLANKS = st.sampled_from([" ", "\n", "  ", " /* comment */ ", " // comment\n"])


@given(SETTINGS, st.data())
@settings(deadline=None, max_examples=examples(100))
def test_settings_keep_their_values_in_the_layout(chosen: list[str], data: st.DataObject) -> None:
    body = "".join(data.draw(BLANKS) + BY_WORDS[words].example for words in chosen)
    text = (
        "environment e { needle { radius 30 mm speed 1 mm/s }"
        f" target T sphere (0, -50, 0) mm radius 10 mm drive {{{body}{data.draw(BLANKS)}}} }}"
    )
    given_before = nsl.loads_task(text).given
    assert [one.parameter.words for one in given_before] == chosen
    formatted = nsl.format_text(text)
    assert nsl.format_text(formatted) == formatted
    after = nsl.loads_task(formatted).given
    assert [(g.parameter, g.value) for g in after] == [(g.parameter, g.value) for g in given_before]


def check_layout(text: str) -> None:
    """The layout of a text has its words, its meaning, and no better layout."""
    try:
        formatted = nsl.format_text(text)
    except nsl.SourceError:
        return
    assert words(formatted) == words(text)
    assert nsl.format_text(formatted) == formatted
    before, after = outcome(text), outcome(formatted)
    if isinstance(before, Scene):
        assert after == before
    else:
        assert not isinstance(after, Scene)
        assert sorted(code for code, *_ in after) == sorted(code for code, *_ in before)


def mutated(data: st.DataObject) -> str:
    """A file that was right, with a few changes."""
    text = data.draw(st.sampled_from(SEEDS))
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        end = min(len(text), start + data.draw(st.integers(0, 12)))
        kind = data.draw(st.sampled_from(["delete", "insert", "repeat", "swap", "cut"]))
        if kind == "delete":
            text = text[:start] + text[end:]
        elif kind == "insert":
            text = text[:start] + data.draw(st.sampled_from(VOCABULARY)) + text[start:]
        elif kind == "repeat":
            text = text[:end] + text[start:]
        elif kind == "swap":
            text = text[:start] + text[start:end][::-1] + text[end:]
        else:
            text = text[:start] if data.draw(st.booleans()) else text[start:]
    return text


@given(st.text())
@settings(deadline=None, max_examples=examples(100))
def test_any_text_is_answered(text: str) -> None:
    outcome(text)
    check_layout(text)


@given(st.lists(st.sampled_from(VOCABULARY), max_size=60), st.sampled_from(["", " "]))
@settings(deadline=None, max_examples=examples(150))
def test_any_words_are_answered(chosen: list[str], separator: str) -> None:
    text = separator.join(chosen)
    outcome(text)
    outcome(f"environment e {{ needle {{ {text} }} motion {{ {text} }} {text} }}")
    driven = f'environment e {{ drive {{ {text} }} device grbl "p" {{ {text} }} {text} }}'
    outcome(driven)
    check_layout(driven)
    check_layout(text)


@pytest.mark.slow
@given(st.data())
@settings(deadline=None, max_examples=examples(120))
def test_changed_files_are_answered(data: st.DataObject) -> None:
    text = mutated(data)
    outcome(text)
    check_layout(text)


COORDINATES = st.floats(-900.0, 900.0).map(lambda value: round(value, 6) + 0.0)
LENGTHS = st.floats(0.01, 100.0).map(lambda value: round(value, 6))


@given(
    st.tuples(COORDINATES, COORDINATES, COORDINATES),
    LENGTHS.filter(lambda radius: radius < 50.0),
    st.lists(st.integers(1, 359), min_size=1, max_size=8, unique=True),
    st.integers(0, 100),
    st.integers(100, 2000),
)
@settings(deadline=None, max_examples=examples(100))
def test_values_written_are_values_read(
    tip: tuple[float, float, float],
    radius_mm: float,
    rolls_deg: list[int],
    max_rolls: int,
    resolution: int,
) -> None:
    x, y, z = tip
    scene = nsl.loads(
        f"environment e {{ needle {{ tip ({x!r}, {y!r}, {z!r}) mm radius 30 mm speed 1 mm/s }}"
        f" motion {{ roll by {', '.join(map(str, rolls_deg))} deg at most {max_rolls} times }}"
        f" target T sphere ({x!r} + 60, {y!r} - 30, {z!r}) mm radius {radius_mm!r} mm"
        f" resolution {resolution} per mm }}"
    )
    assert scene.needle.tip.position_mm == tip
    assert scene.targets[0].radius_mm == radius_mm
    assert scene.targets[0].center_mm == (x + 60, y - 30, z)
    assert [angle * 180 / math.pi for angle in scene.limits.roll_angles_rad] == [
        math.radians(degrees) * 180 / math.pi for degrees in rolls_deg
    ]
    assert scene.limits.max_rolls == max_rolls
    assert scene.resolution_per_mm == resolution
