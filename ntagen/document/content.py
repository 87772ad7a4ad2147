"""The text of an element, with the place of each of its characters in the file.

What is replaced in it is as little as possible: what is in front of the first new character and
behind the last one stays as it was written, and so do comments in the text.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Final

from ntagen.document.elements import Element
from ntagen.errors import InputError
from ntagen.values import dataclass

_IN_XML: Final = re.compile(
    rb"(?P<cdata><!\[CDATA\[)(?P<inside>.*?)\]\]>|(?P<markup><!--.*?-->|<\?.*?\?>)"
    rb"|&(?P<entity>[^;]*);|(?P<plain>[^<&]+)",
    re.DOTALL,
)
_LINE: Final = re.compile(rb"\r\n?|[^\r]+")
_NAMED: Final = {b"lt": "<", b"gt": ">", b"amp": "&", b"quot": '"', b"apos": "'"}
_ESCAPES: Final = {"&": "&amp;", "<": "&lt;", ">": "&gt;"}
_NOT_IN_XML: Final = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")


@dataclass(frozen=True, slots=True)
class Change:
    """Bytes of the text that are replaced.

    Attributes:
        start: Where they begin.
        end: Where they end.
        text: What comes in their place, as UTF-8.
    """

    start: int
    end: int
    text: bytes


@dataclass(frozen=True, slots=True)
class _Run:
    """Bytes that stand for characters, or for none if they are markup."""

    start: int
    end: int
    text: str
    is_cdata: bool = False


class Content:
    """The characters between two places of a text.

    Attributes:
        start: Where they begin, in bytes.
        end: Where they end.
    """

    def __init__(self, data: bytes, start: int, end: int, runs: Sequence[_Run]) -> None:
        self.start = start
        self.end = end
        self._data = data
        self._runs = runs

    @cached_property
    def text(self) -> str:
        """The characters; line ends are line feeds."""
        return "".join(run.text for run in self._runs)

    @cached_property
    def _places(self) -> tuple[list[int], list[int], list[bool]]:
        """Of each character, where its bytes begin and end, and whether it is in CDATA."""
        starts: list[int] = []
        ends: list[int] = []
        for run in self._runs:
            if len(run.text) == 1:
                starts.append(run.start)
                ends.append(run.end)
            elif len(run.text) == run.end - run.start:
                starts.extend(range(run.start, run.end))
                ends.extend(range(run.start + 1, run.end + 1))
            else:
                at = run.start
                for one in run.text:
                    starts.append(at)
                    at += len(one.encode("utf-8"))
                    ends.append(at)
        return starts, ends, [run.is_cdata for run in self._runs for _ in run.text]

    def byte_at(self, index: int) -> int:
        """Where a character begins, in bytes; where the last one ends if there are no more."""
        starts, ends, _ = self._places
        if index < len(starts):
            return starts[index]
        return ends[-1] if ends else self.end

    def index_at(self, byte: int) -> int:
        """The character that a byte belongs to, or the next one."""
        return bisect_right(self._places[1], byte)

    def replaced(self, new: str, form: Form) -> Change | None:
        """The least change after which it has another text; ``None`` if it has this text."""
        old = self.text
        if new == old:
            return None
        first = _shared(old, new)
        tail = _shared(old[first:][::-1], new[first:][::-1])
        start, end, is_cdata = self._between(first, len(old) - tail)
        fresh = new[first : len(new) - tail]
        if is_cdata and not all(map(form.has, fresh)):
            return self.rewritten(new, form)
        marks = b"".join(
            self._data[run.start : run.end]
            for run in self._runs
            if not run.text and start <= run.start and run.end <= end
        )
        written = form.in_cdata(fresh) if is_cdata else form.escaped(fresh)
        return Change(start, end, written + marks)

    def rewritten(self, new: str, form: Form) -> Change:
        """The change that writes the whole text anew."""
        return Change(self.start, self.end, form.escaped(new))

    def _between(self, first: int, last: int) -> tuple[int, int, bool]:
        """The bytes of some characters, and whether the first is in CDATA; none may be none."""
        starts, ends, is_cdata = self._places
        if first < last:
            return starts[first], ends[last - 1], is_cdata[first]
        if first:
            return ends[first - 1], ends[first - 1], is_cdata[first - 1]
        if starts:
            return starts[0], starts[0], is_cdata[0]
        inside = next((run.end for run in self._runs if run.is_cdata), None)
        at = self.start if inside is None else inside
        return at, at, inside is not None


@dataclass(frozen=True, slots=True)
class Form:
    """How characters are written in a file.

    Attributes:
        line_end: How a line ends.
        has: Whether the encoding of the file has a character.
        is_xml: Whether characters that mean something in XML are escaped.
    """

    line_end: str
    has: Callable[[str], bool]
    is_xml: bool

    def escaped(self, text: str) -> bytes:
        """The bytes of a text, as UTF-8."""
        if self.is_xml:
            text = "".join(
                _ESCAPES.get(one) or (one if self.has(one) else f"&#{ord(one)};") for one in text
            )
        return text.replace("\n", self.line_end).encode("utf-8")

    def in_cdata(self, text: str) -> bytes:
        """The bytes of a text within CDATA."""
        return text.replace("]]>", "]]]]><![CDATA[>").replace("\n", self.line_end).encode("utf-8")


def _shared(one: str, other: str) -> int:
    """How many characters two texts begin with in common."""
    low, high = 0, min(len(one), len(other))
    while low < high:
        middle = (low + high + 1) // 2
        if one[low:middle] == other[low:middle]:
            low = middle
        else:
            high = middle - 1
    return low


def require_characters(text: str) -> None:
    """Refuses a text that no file of a model can hold.

    Raises:
        InputError: It has a character that XML cannot hold.
    """
    if found := _NOT_IN_XML.search(text):
        raise InputError(
            f"the text has the character U+{ord(found[0]):04X}, which no model can have\n"
            "hint: delete it"
        )


def content_of(data: bytes, element: Element) -> Content:
    """The text of an element. What is written by an element in it counts as no text."""
    start, end = element.open_end, element.close
    runs: list[_Run] = []
    at = start
    for child in element.children:
        runs.extend(_xml_runs(data, at, child.start))
        runs.append(_Run(child.start, child.end, ""))
        at = child.end
    runs.extend(_xml_runs(data, at, end))
    return Content(data, start, end, runs)


def whole_content(data: bytes) -> Content:
    """The whole text of a file, without regard to what it means."""
    return Content(data, 0, len(data), list(_line_runs(data, 0, len(data), is_cdata=False)))


def _xml_runs(data: bytes, start: int, end: int) -> Iterator[_Run]:
    for found in _IN_XML.finditer(data, start, end):
        first, last = found.span()
        if found["cdata"]:
            inner, outer = found.span("inside")
            yield _Run(first, inner, "", is_cdata=True)
            yield from _line_runs(data, inner, outer, is_cdata=True)
            yield _Run(outer, last, "")
        elif found["entity"] is not None:
            yield _Run(first, last, _character(found["entity"]))
        elif found["plain"]:
            yield from _line_runs(data, first, last, is_cdata=False)
        else:
            yield _Run(first, last, "")


def _line_runs(data: bytes, start: int, end: int, *, is_cdata: bool) -> Iterator[_Run]:
    """Runs of bytes that are characters; a line end is one character, whatever its bytes."""
    for found in _LINE.finditer(data, start, end):
        text = "\n" if found[0].startswith(b"\r") else found[0].decode("utf-8")
        yield _Run(*found.span(), text, is_cdata)


def _character(entity: bytes) -> str:
    """What a reference stands for; a carriage return is a part of a line end, as in files."""
    if entity.startswith(b"#x"):
        return chr(int(entity[2:], 16)).replace("\r", "")
    if entity.startswith(b"#"):
        return chr(int(entity[1:])).replace("\r", "")
    return _NAMED.get(entity, "")
