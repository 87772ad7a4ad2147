"""What an editor asks about the text of an environment: mistakes, words, names, what may come next.

Places are offsets in the text, in characters. Any text has answers: one that is being typed is
seldom right.

What words mean is told where the language is told: the forms in `ntagen.nsl.wording`, the table of
statements in the README.md of `ntagen.nsl`, and the settings in `ntagen.parameters`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cache
from importlib import resources
from itertools import pairwise
from typing import Final, Literal

from ntagen.nsl import Diagnostic, SourceError, loads_task
from ntagen.nsl.driving import CHOICES
from ntagen.nsl.grammar import UnexpectedTokenError, read_statement
from ntagen.nsl.lexer import tokenise
from ntagen.nsl.source import Source
from ntagen.nsl.tokens import (
    ALLOWED,
    BLOCKS,
    KEYWORDS,
    NAMING,
    SOLIDS,
    WORDS,
    BlockKind,
    Comment,
    Token,
)
from ntagen.nsl.wording import FORMS
from ntagen.parameters import BY_WORDS, MEASURES
from ntagen.values import dataclass

WordKind = Literal["keyword", "setting", "name", "choice"]

_WORD: Final = re.compile(r"`(\w+)")
_CODE: Final = re.compile(r"`[^`]*`")


@dataclass(frozen=True, slots=True)
class Word:
    """A word that may be written at a place.

    Attributes:
        text: The word.
        kind: What it is.
        detail: What it means, on a line.
    """

    text: str
    kind: WordKind
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Declared:
    """A name and where it is declared.

    Attributes:
        name: The name.
        kind: The keyword before it: ``target``, ``let``, ``environment`` and so on.
        start: Where the declaration begins.
        end: Where the name ends.
    """

    name: str
    kind: str
    start: int
    end: int


def mistakes(text: str, path: str) -> tuple[Diagnostic, ...]:
    """The mistakes and warnings of a text, as `ntagen check` gives them; `path` is its file."""
    try:
        return loads_task(text, path).warnings
    except SourceError as error:
        return error.diagnostics


def meaning(text: str, offset: int) -> tuple[str, int, int] | None:
    """What the word at a place means, in Markdown, and where the word stands."""
    tokens = _tokens(text)
    index = next(
        (i for i, one in enumerate(tokens) if one.span.start <= offset < one.span.end), None
    )
    if index is None:
        return None
    token = tokens[index]
    told = _told(tokens, index)
    return (told, token.span.start, token.span.end) if told else None


def _told(tokens: Sequence[Token], index: int) -> str:
    token = tokens[index]
    if token.type == "PARAMETER":
        return _setting(token.text)
    if token.type == "AXIS":
        return "the motor of an axis: write for example `insert X 80 steps/mm`"
    if token.type not in ("NAME", "STRING") and (token.text in KEYWORDS or token.text in SOLIDS):
        return _keyword(token.text)
    if token.type == "NAME":
        for kind, one in _declarations(tokens):
            if one.text == token.text:
                line = one.span.source.line(one.line).strip()
                return f"```nsl\n{line}\n```\n{kind.text} on line {one.line}"
    return ""


def _keyword(word: str) -> str:
    """The form of a statement, and its row in the table of the language."""
    parts = [FORMS[word]] if word in FORMS else []
    row = statements().get(word)
    if row is not None:
        where, required, default = row
        parts.append(f"stands in {where}; required: {required}")
        parts += [f"default: {default}"] if default else []
    return "\n\n".join(parts)


def _setting(words: str) -> str:
    """The meaning and unit of a setting of the driver."""
    parameter = BY_WORDS[words]
    unit = MEASURES[parameter.kind].unit
    measure = f"{MEASURES[parameter.kind].noun}, such as `{parameter.example}`"
    choices = f"\n\none of: {', '.join(parameter.choices)}" if parameter.choices else ""
    usual = f" (usually in {unit})" if unit else ""
    return f"{parameter.help}\n\n{measure}{usual}{choices}"


@cache
def statements() -> dict[str, tuple[str, str, str]]:
    """By keyword: where it stands, whether it is required, and its default, in Markdown.

    They are read from the page of the language.
    """
    page = resources.files("ntagen.nsl").joinpath("README.md").read_text("utf-8")
    rows = {}
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not line.startswith("| `"):
            continue
        words, where, required, default = cells
        named = _WORD.findall(words)
        defaults = _CODE.findall(default)
        for number, word in enumerate(named):
            # A row about several statements has their defaults in the same order.
            own = defaults[number] if len(defaults) == len(named) else default
            rows[word] = (where, required, own)
    return rows


def declared(text: str) -> list[Declared]:
    """The names of a text in their order: of the environment, regions, values and loops."""
    return [
        Declared(name.text, kind.text, kind.span.start, name.span.end)
        for kind, name in _declarations(_tokens(text))
    ]


def possible(text: str, offset: int) -> list[Word]:
    """The words that may be written at a place, those that go on with a statement first.

    What was already typed of the word is left out of account: editors choose by it themselves.
    """
    every = list(_items(text))
    if any(_is_inside(one, offset) for one in every):
        return []
    tokens = [one for one in every if isinstance(one, Token)]
    before = [one for one in tokens if one.span.end <= offset]
    if before and before[-1].type == "QUERY" and "\n" not in text[before[-1].span.end : offset]:
        return []
    # The word that is being typed ends at the place.
    if before and before[-1].span.end == offset and _is_word(before[-1].text):
        before.pop()
    block, statement = _surroundings(before)
    if statement and statement[-1].text in NAMING:
        return []
    found: dict[str, Word] = {}
    ends = not statement
    if statement:
        ends, words = _continuations(statement, tokens)
        found |= {word.text: word for word in words}
    if ends:
        for word in sorted(ALLOWED[block]):
            found.setdefault(word, _beginning(block, word))
    return list(found.values())


def _beginning(block: BlockKind, word: str) -> Word:
    """A word that begins a statement."""
    if block == "drive":
        return Word(word, "setting", BY_WORDS[word].help)
    return Word(word, "keyword", FORMS.get(word, ""))


def _continuations(statement: Sequence[Token], tokens: Sequence[Token]) -> tuple[bool, list[Word]]:
    """Whether a statement may end after these words, and the words that may follow."""
    first = statement[0]
    if first.type == "PARAMETER" and len(statement) == 1:
        return False, [Word(one, "choice") for one in BY_WORDS[first.text].choices]
    try:
        read_statement(statement)
    except UnexpectedTokenError as error:
        if error.token is not None:
            # The mistake is before the place: anything may be meant.
            return True, _names_in(tokens)
        expected = set(error.expected)
    else:
        return True, [Word(one, "keyword") for one in sorted(WORDS) if _follows(statement, one)]
    words = [Word(one, "keyword") for one in sorted(WORDS) if WORDS[one] in expected]
    if "NAME" in expected and first.text in CHOICES:
        words += [Word(one, "choice") for one in CHOICES[first.text]]
    elif "NAME" in expected:
        only = "critical" if statement[-1].text == "around" else None
        words += _names_in(tokens, only)
    return False, words


def _names_in(tokens: Sequence[Token], only: str | None = None) -> list[Word]:
    """The names that are declared, or only those of one kind."""
    found = {
        name.text: Word(name.text, "name", kind.text)
        for kind, name in _declarations(tokens)
        if kind.text == only or (only is None and kind.text != "environment")
    }
    return list(found.values())


def _follows(statement: Sequence[Token], word: str) -> bool:
    """Whether a word goes on with a statement that could end."""
    last = statement[-1]
    added = Token(WORDS[word], word, last.span, last.line)
    try:
        read_statement([*statement, added])
    except UnexpectedTokenError as error:
        return error.token is not added
    return True


def _surroundings(before: Sequence[Token]) -> tuple[BlockKind, list[Token]]:
    """The braces that a place stands in, and the words of its statement so far."""
    stack: list[BlockKind] = ["file"]
    opened: BlockKind = "environment"
    statement: list[Token] = []
    for token in before:
        if token.text == "{" and token.type == "BRACE":
            stack.append(opened)
            statement = []
        elif token.text == "}" and token.type == "BRACE":
            if len(stack) > 1:
                stack.pop()
            statement = []
        elif token.type != "NAME" and token.text in ALLOWED[stack[-1]]:
            statement = [token]
            opened = BLOCKS.get(token.text, opened)
        elif statement:
            statement.append(token)
    return stack[-1], statement


def _declarations(tokens: Sequence[Token]) -> Iterator[tuple[Token, Token]]:
    """The names at their declarations, each after the keyword before it."""
    for kind, name in pairwise(tokens):
        if name.type == "NAME" and kind.type not in ("NAME", "STRING") and kind.text in NAMING:
            yield kind, name


def _is_word(text: str) -> bool:
    return bool(text) and (text[-1].isalnum() or text[-1] == "_")


def _is_inside(item: Token | Comment, offset: int) -> bool:
    """Whether a place is inside a comment, a text in quotes or a query."""
    start, end = item.span.start, item.span.end
    if isinstance(item, Comment):
        is_open = item.text.startswith("//")
        return start < offset and (offset < end or (is_open and offset == end))
    if item.type == "QUERY":
        return start + len("query") < offset < end
    is_text = item.type in ("STRING", "UNCLOSED_STRING", "UNCLOSED_COMMENT")
    return is_text and start < offset and (offset < end or item.type != "STRING")


def _tokens(text: str) -> list[Token]:
    return [one for one in _items(text) if isinstance(one, Token)]


def _items(text: str) -> Iterator[Token | Comment]:
    return iter(tokenise(Source("<text>", text)))
