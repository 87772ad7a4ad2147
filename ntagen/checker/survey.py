"""What an editor asks about a model that is being typed: mistakes, names, and where they are used.

The engine answers for texts with mistakes, too. Places are characters of the texts here; the engine
counts bytes of UTF-8.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, Literal, NamedTuple, TypeVar

import msgspec
import numpy as np

import ntagen._checker as _checker
from ntagen.values import dataclass

MODEL: Final = 0
QUERIES: Final = 1
"""The number of a file in a place."""

OF_FORM: Final = "E01"
"""What the codes of mistakes of form begin with."""

SymbolKind = Literal[
    "constant",
    "variable",
    "clock",
    "channel",
    "type",
    "field",
    "function",
    "parameter",
    "template",
    "process",
    "location",
    "bound",
    "strategy",
]

_Placed = TypeVar("_Placed", "Mistake", "Symbol", "Asked")

_ENCODING: Final = re.compile(r"""<\?xml[^>]*?\bencoding\s*=\s*["']([\w.:-]+)""")


class Place(NamedTuple):
    """A part of a text: the number of the file, the first character, and the one behind it."""

    file: int
    start: int
    end: int


class Use(NamedTuple):
    """A place where a name is used, and the number of its symbol."""

    at: Place
    symbol: int


class Area(NamedTuple):
    """A part of a text in which the symbols of a scope may be used, and those around it."""

    at: Place
    scope: int


@dataclass(frozen=True, slots=True)
class Mistake:
    """What is wrong.

    Attributes:
        code: ``E0201``.
        severity: How bad it is.
        at: Where; ``None`` if it stands in neither text.
        place: The same in words, such as ``guard of T: A -> B``; empty in texts that are no XML.
        message: What is wrong.
        notes: More about it.
        hint: What to do, or ``None``.
    """

    code: str
    severity: Literal["error", "warning"]
    at: Place | None
    place: str
    message: str
    notes: tuple[str, ...]
    hint: str | None

    @property
    def is_of_form(self) -> bool:
        """Whether the text is not even well-formed here, so names may be missing around it."""
        return self.code.startswith(OF_FORM)


@dataclass(frozen=True, slots=True)
class Symbol:
    """A declared name.

    Attributes:
        name: The name.
        kind: What it is.
        at: Where the bare name is declared; ``None`` for what the language declares.
        detail: Its declaration.
        comment: The comment above it or behind it.
        members: The number of the group of symbols that may follow it behind a dot, or ``None``.
    """

    name: str
    kind: SymbolKind
    at: Place | None
    detail: str
    comment: str
    members: int | None


@dataclass(frozen=True, slots=True)
class Asked:
    """A query of either text.

    Attributes:
        at: Where its formula stands.
        text: The formula.
        comment: The comment of the query.
        expect: The verdict or number that the file states, or ``None``.
    """

    at: Place | None
    text: str
    comment: str
    expect: str | float | None


@dataclass(frozen=True, slots=True)
class Survey:
    """What was found in a model and in a file of queries about it.

    Attributes:
        mistakes: In the order of the text, those of queries last.
        symbols: In the order of the text, those of the language first.
        uses: Where names are used; declarations are not among them.
        everywhere: The symbols that may be used in the whole model.
        areas: Where others may be used, the inner places behind the outer ones.
        scopes: The symbols of the areas.
        groups: The symbols that may follow a dot.
        queries: Those of the model, then those of the other file.
    """

    mistakes: tuple[Mistake, ...]
    symbols: tuple[Symbol, ...]
    uses: tuple[Use, ...]
    everywhere: tuple[int, ...]
    areas: tuple[Area, ...]
    scopes: tuple[tuple[int, ...], ...]
    groups: tuple[tuple[int, ...], ...]
    queries: tuple[Asked, ...]


@dataclass(frozen=True, slots=True)
class Texts:
    """A model and the file of queries about it, as they are in an editor.

    Attributes:
        path: The file of the model; it names it in mistakes.
        model: The text of the model.
        queries_path: The file of queries, or ``None``.
        queries: The text of the queries.
    """

    path: str
    model: str
    queries_path: str | None = None
    queries: str = ""

    def of(self, file: int) -> str:
        """The text of a file."""
        return self.model if file == MODEL else self.queries


def survey(texts: Texts, allow_external: Sequence[str | Path] = ()) -> Survey:
    """Looks at a model and its queries.

    Args:
        texts: What to look at.
        allow_external: The libraries that the model may import, or their folders.
    """
    return read_survey(survey_json(texts, allow_external), texts)


def survey_json(texts: Texts, allow_external: Sequence[str | Path] = ()) -> str:
    """The engine's words: see `read_survey`."""
    queries = None
    if texts.queries_path is not None:
        queries = (texts.queries_path, texts.queries.encode("utf-8", "replace"))
    return _checker.survey(
        texts.path, _encoded(texts.model), queries, [Path(one) for one in allow_external]
    )


def read_survey(words: str, texts: Texts) -> Survey:
    """The survey of texts from the engine's words."""
    found = msgspec.json.decode(words, type=Survey)
    if texts.model.isascii() and texts.queries.isascii():
        return found
    return _in_characters(found, [_starts(texts.model), _starts(texts.queries)])


def _encoded(text: str) -> bytes:
    """The bytes of a model, in the encoding that it names: the engine reads it by that."""
    named = _ENCODING.match(text)
    if named is not None:
        try:
            return text.encode(named[1])
        except (LookupError, UnicodeEncodeError):
            pass
    return text.encode("utf-8", "replace")


def _starts(text: str) -> list[int] | None:
    """The character at each byte of a text as UTF-8; ``None`` if both count alike."""
    if text.isascii():
        return None
    data = np.frombuffer(text.encode("utf-8", "replace"), np.uint8)
    is_first = (data & 0xC0) != 0x80
    counted: list[int] = (np.cumsum(is_first) - 1).tolist()
    return [*counted, len(text)]


def _in_characters(found: Survey, starts: list[list[int] | None]) -> Survey:
    """The same with places that count characters."""

    def counted(at: Place) -> Place:
        table = starts[at.file]
        if table is None:
            return at
        last = len(table) - 1
        return Place(at.file, table[min(at.start, last)], table[min(at.end, last)])

    def moved(one: _Placed) -> _Placed:
        return one if one.at is None else replace(one, at=counted(one.at))

    return replace(
        found,
        mistakes=tuple(map(moved, found.mistakes)),
        symbols=tuple(map(moved, found.symbols)),
        uses=tuple(Use(counted(one.at), one.symbol) for one in found.uses),
        areas=tuple(Area(counted(one.at), one.scope) for one in found.areas),
        queries=tuple(map(moved, found.queries)),
    )
