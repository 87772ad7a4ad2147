"""What an editor is told of a survey of a model: mistakes, completions and declarations.

Places in the text of a file become places in one of its texts: an address and two characters, which
are counted as programs in browsers do, in units of UTF-16.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import cached_property
from typing import Any, Final

import msgspec

from ntagen.checker.names import Names as SurveyedNames
from ntagen.checker.survey import MODEL, Place, Survey
from ntagen.document.content import Content, content_of, whole_content
from ntagen.document.document import Document
from ntagen.document.outline import WHOLE, Outline
from ntagen.errors import InputError

_WORD: Final = re.compile(r"[A-Za-z_]\w*$", re.ASCII)
_WHOLE_WORD: Final = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_CHAIN: Final = re.compile(r"((?:[A-Za-z_]\w*(?:\s*\[[^\[\]]*\])*\s*\.\s*)+)$", re.ASCII)
_INDEX: Final = re.compile(r"\[[^\[\]]*\]")
_MOST_CHAIN: Final = 2000
_MOST_WORD: Final = 200

_OF_DECLARATIONS: Final = (
    *("bool", "broadcast", "chan", "clock", "const", "double", "else", "exists", "false", "for"),
    *("forall", "hybrid", "if", "imply", "int", "meta", "not", "or", "and", "return", "scalar"),
    *("string", "struct", "sum", "system", "true", "typedef", "urgent", "void", "while"),
)
_OF_LABELS: Final = ("and", "exists", "false", "forall", "imply", "not", "or", "sum", "true")
_OF_QUERIES: Final = (
    *("A[]", "A<>", "E[]", "E<>", "Pr", "control", "deadlock", "inf", "maxE", "maxPr", "minE"),
    *("minPr", "simulate", "strategy", "sup", "under", "saveStrategy", "loadStrategy"),
    *_OF_LABELS,
)
_WITH_TYPES: Final = ("declaration", "parameter", "instantiation", "system", "select", WHOLE)


class Names:
    """A survey of a version of a model.

    Attributes:
        version: The version.
    """

    def __init__(self, document: Document, words: str | bytes) -> None:
        """Reads what the engine says of the text of a document, as it is now.

        The document may change later; places are those of this version.
        """
        self.version = document.version
        self._data = document.text
        self._outline = document.outline if document.has_parts else None
        self._survey = msgspec.json.decode(words, type=Survey)
        self._texts = _texts_of(self._outline)
        self._contents: dict[str, Content | None] = {}

    def mistakes(self, *, whole: bool = False) -> list[dict[str, Any]]:
        """What is wrong, in the order of the text, each with its place if it has one.

        With `whole`, places are in the whole text of the file.
        """
        return [
            {
                "code": one.code,
                "severity": one.severity,
                "place": one.place,
                "message": one.message,
                "notes": list(one.notes),
                "hint": one.hint or "",
                "at": self._told(one.at, whole=whole),
            }
            for one in self._survey.mistakes
        ]

    def completions(self, address: str, text: str, index: int) -> dict[str, Any]:
        """What may stand at a place. A text that was typed since then is completed, too.

        Args:
            address: The address of a text.
            text: The text as it is now.
            index: The place in it.

        Returns:
            ``from`` is where the word begins that is typed, and each of ``options`` has a
            ``label``, a ``kind``, a ``detail`` and an ``info``.

        Raises:
            InputError: There was no such text.
        """
        at = _characters(text, index)
        typed = _WORD.search(text, max(0, at - _MOST_WORD), at)
        start = typed.start() if typed else at
        content = self._content(address)
        where = 0 if content is None else content.byte_at(min(start, len(content.text)))
        where = self._read_at(address, where)
        words: tuple[str, ...] = ()
        if chain := _CHAIN.search(text[max(0, start - _MOST_CHAIN) : start]):
            parts = _WHOLE_WORD.findall(_INDEX.sub("", chain[1]))
            found = self._names.members(MODEL, where, parts)
        else:
            found = list(self._names.usable(MODEL, where).values())
            kind = address.rpartition("/")[2]
            words = _OF_DECLARATIONS if kind in _WITH_TYPES else _OF_LABELS
            words = _OF_QUERIES if kind == "formula" else words
        options = [
            {"label": one.name, "kind": one.kind, "detail": one.detail, "info": one.comment}
            for one in found
        ]
        options += [{"label": one, "kind": "keyword", "detail": "", "info": ""} for one in words]
        return {"from": _units(text, start), "options": options}

    def definition(self, address: str, index: int) -> dict[str, Any]:
        """Where the name at a place is declared, and as what.

        Raises:
            InputError: There can be no such text.
        """
        content = self._content(address)
        if content is None:
            return {}
        at = content.byte_at(_characters(content.text, index))
        named = self._names.at(MODEL, at)
        if named is None:
            return {}
        symbol, _ = named
        told = {"name": symbol.name, "detail": symbol.detail, "comment": symbol.comment}
        return told | {"at": self._told(symbol.at)}

    def _content(self, address: str) -> Content | None:
        """A text; the places of its characters are found once."""
        if address not in self._contents:
            found = None
            if address == WHOLE:
                found = whole_content(self._data)
            elif self._outline is None:
                raise InputError(f"the model has no {address[:80]}\nhint: reload the page")
            elif (element := self._outline.text_element(address)) is not None:
                found = content_of(self._data, element)
            self._contents[address] = found
        return self._contents[address]

    @cached_property
    def _names(self) -> SurveyedNames:
        return SurveyedNames(self._survey)

    def _read_at(self, address: str, byte: int) -> int:
        """Where to ask what may be used at a byte.

        A text that is empty, or not understood, has what its template has at its name.
        """
        if address.startswith("templates/") and not self._names.is_read(MODEL, byte):
            content = self._content("/".join([*address.split("/")[:2], "name"]))
            if content is not None:
                return content.start
        return byte

    def _told(self, place: Place | None, *, whole: bool = False) -> dict[str, Any] | None:
        if place is None:
            return None
        starts, addresses = self._texts
        number = bisect_right(starts, place.start) - 1
        address = WHOLE if whole or number < 0 else addresses[number]
        content = self._content(address)
        if content is None or place.start > content.end:
            address, content = WHOLE, self._content(WHOLE)
        if content is None:
            return None
        first, last = (content.index_at(byte) for byte in (place.start, place.end))
        text = content.text
        return {"address": address, "from": _units(text, first), "to": _units(text, last)}


def _texts_of(outline: Outline | None) -> tuple[list[int], list[str]]:
    """Where the texts of a model begin, in order, and their addresses."""
    if outline is None:
        return [], []
    found = sorted((element.open_end, name) for name, element in outline.texts())
    return [start for start, _ in found], [name for _, name in found]


def _units(text: str, index: int) -> int:
    """The number of units of UTF-16 in front of a character."""
    return index + sum(one > "\uffff" for one in text[:index]) if not text.isascii() else index


def _characters(text: str, units: int) -> int:
    """The number of characters in so many units of UTF-16."""
    units = max(0, units)
    if text.isascii():
        return min(units, len(text))
    return len(text.encode("utf-16-le")[: 2 * units].decode("utf-16-le", "ignore"))
