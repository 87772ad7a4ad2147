"""The words of the languages are those of the engine."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ntagen.checker.survey import Texts, survey
from ntagen.xta import FUNCTIONS, MODEL_WORDS, QUERY_WORDS, is_name

KEYWORDS = Path(__file__).parents[3] / "checker" / "src" / "syntax" / "keywords.rs"
BUILTINS = KEYWORDS.parents[1] / "builtins"


def codes(text: str) -> set[str]:
    return {one.code for one in survey(Texts("a.xta", text)).mistakes if one.severity == "error"}


def test_words_are_those_of_the_engine() -> None:
    table = KEYWORDS.read_text("utf-8").partition("match word {")[2].partition("_ => 0")[0]
    in_model, in_query = set(), set()
    for words, dialects in re.findall(r"([^=>]+)=>\s*([A-Z |]+),", table):
        named = set(re.findall(r'"(\w+)"', words))
        in_model |= named if "NEW" in dialects else set()
        in_query |= named if "QUERY" in dialects else set()
    assert in_model == MODEL_WORDS
    assert in_query == QUERY_WORDS


@pytest.mark.parametrize("word", sorted(MODEL_WORDS - {"string"}))
def test_no_word_of_the_language_names_a_variable(word: str) -> None:
    assert codes(f"int {word};\n")
    assert not is_name(word)


def test_functions_are_built_in() -> None:
    calls = "\n".join(f"double v{number} = {name}();" for number, name in enumerate(FUNCTIONS))
    found = survey(Texts("a.xta", f"{calls}\nprocess P() {{ state A; init A; }}\nsystem P;\n"))
    assert not [one.message for one in found.mistakes if "unknown" in one.message]


@pytest.mark.parametrize("name", ["x", "_a1", "A"])
def test_names(name: str) -> None:
    assert is_name(name)
    assert not codes(f"int {name};\nprocess P() {{ state A; init A; }}\nsystem P;\n")


@pytest.mark.parametrize("text", ["", "1a", "a b", "a.b", "ü", "control", "system"])
def test_no_names(text: str) -> None:
    assert not is_name(text)
