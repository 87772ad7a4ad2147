"""The colours of both editors know all words of the language."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from ntagen.nsl.driving import CHOICES
from ntagen.nsl.tokens import KEYWORDS, WORDS
from ntagen.parameters import BY_WORDS
from ntagen.xta import MODEL_WORDS, QUERY_WORDS

EDITORS = Path(__file__).parents[3] / "editors"
CHOSEN = {word for words in CHOICES.values() for word in words}


def alternatives(pattern: str) -> set[str]:
    inner = re.fullmatch(r"\\b\((.*)\)\\b", pattern)
    assert inner is not None
    return {word.replace("\\s+", " ") for word in inner[1].split("|")}


def test_visual_studio_code_knows_all_words() -> None:
    grammar: dict[str, Any] = json.loads(
        (EDITORS / "vscode" / "syntaxes" / "nsl.tmLanguage.json").read_text("utf-8")
    )
    parts = grammar["repository"]
    statements, others, _ = parts["words"]["patterns"]
    assert alternatives(statements["match"]) == KEYWORDS
    assert alternatives(others["match"]) == set(WORDS) - KEYWORDS
    settings = next(one for one in parts["drive"]["patterns"] if "property" in one.get("name", ""))
    assert alternatives(settings["match"]) == set(BY_WORDS)
    assert alternatives(parts["values"]["patterns"][0]["match"]) >= CHOSEN


def test_a_setting_of_many_words_is_tried_before_its_first_words() -> None:
    grammar = (EDITORS / "vscode" / "syntaxes" / "nsl.tmLanguage.json").read_text("utf-8")
    drive = json.loads(grammar)["repository"]["drive"]["patterns"]
    pattern = next(one["match"] for one in drive if "property" in one.get("name", ""))
    for words in BY_WORDS:
        found = re.match(pattern, words)
        assert found is not None
        assert found[0] == words


def test_vim_knows_all_words() -> None:
    text = (EDITORS / "vim" / "syntax" / "nsl.vim").read_text("utf-8")

    def keywords(group: str) -> set[str]:
        rows = re.findall(rf"^syntax keyword {group} (.*)$", text, re.MULTILINE)
        return {word for row in rows for word in row.split()}

    # These two have rules of their own: what follows a query is another language, and a keyword
    # would win over the region of `drive`.
    assert keywords("nslStatement") == KEYWORDS - {"query", "drive"}
    assert re.search(r"^syntax region nslDrive .*start=/\\<drive", text, re.MULTILINE)
    assert keywords("nslWord") == set(WORDS) - KEYWORDS
    assert keywords("nslChoice") >= CHOSEN
    settings = re.findall(r"^syntax match nslSetting /\\<(.*)\\>/ contained$", text, re.MULTILINE)
    assert {one.replace("\\s\\+", " ") for one in settings} == set(BY_WORDS)


MODELS = [("xta", "xta", MODEL_WORDS), ("uppaalquery", "query", QUERY_WORDS)]


@pytest.mark.parametrize(("name", "group", "words"), MODELS)
def test_both_know_all_words_of_models(name: str, group: str, words: frozenset[str]) -> None:
    grammar = json.loads((EDITORS / f"vscode/syntaxes/{name}.tmLanguage.json").read_text("utf-8"))
    coloured = [one["match"] for one in grammar["patterns"] if "match" in one]
    for word in words:
        assert any(re.fullmatch(pattern, word) for pattern in coloured), word
    vim = (EDITORS / "vim" / "syntax" / f"{name}.vim").read_text("utf-8")
    rows = re.findall(rf"^syntax keyword {group}\w+ (.*)$", vim, re.MULTILINE)
    assert words <= {word for row in rows for word in row.split()}


def test_the_extension_starts_the_server() -> None:
    package = json.loads((EDITORS / "vscode" / "package.json").read_text("utf-8"))
    command = package["contributes"]["configuration"]["properties"]["ntagen.command"]
    assert command["default"] == ["ntagen", "lsp"]
    for path in ("main",):
        assert (EDITORS / "vscode" / package[path]).is_file()
    for part in ("languages", "grammars"):
        for one in package["contributes"][part]:
            named = one.get("path") or one["configuration"]
            assert (EDITORS / "vscode" / named).is_file()
