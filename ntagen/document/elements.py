"""The elements of an XML text, each with the bytes where it stands."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final
from xml.parsers import expat

from ntagen.errors import InputError

_TAG: Final = re.compile(rb"""<(?:[^"'>]++|"[^"]*+"|'[^']*+')*+>""")
_ATTRIBUTE: Final = re.compile(rb"""[\s]([^\s=/>"']+)\s*=\s*("[^"]*+"|'[^']*+')""")
_MOST_DEPTH: Final = 100


class Element:
    """An element of an XML text.

    Attributes:
        tag: Its tag.
        attributes: Its attributes, decoded.
        parent: The element around it.
        children: The elements in it.
        start: Where its opening tag begins, in bytes of the text.
        open_end: Where the opening tag ends.
        close: Where its closing tag begins; equal to `end` if the opening tag closes it, too.
        end: Where it ends.
    """

    __slots__ = ("attributes", "children", "close", "end", "open_end", "parent", "start", "tag")

    def __init__(
        self,
        tag: str,
        attributes: dict[str, str],
        parent: Element | None,
        start: int,
        open_end: int,
    ) -> None:
        self.tag = tag
        self.attributes = attributes
        self.parent = parent
        self.children: list[Element] = []
        self.start = start
        self.open_end = self.close = self.end = open_end

    def all(self, tag: str) -> list[Element]:
        """The children with a tag."""
        return [one for one in self.children if one.tag == tag]

    def first(self, tag: str) -> Element | None:
        """The first child with a tag: of two, the engine takes this one."""
        return next((one for one in self.children if one.tag == tag), None)

    def value_range(self, text: bytes, name: str) -> tuple[int, int] | None:
        """Where the value of an attribute stands, without its quotes."""
        for found in _ATTRIBUTE.finditer(text, self.start, self.open_end):
            if found[1].decode() == name:
                start, end = found.span(2)
                return start + 1, end - 1
        return None

    def within(self) -> Iterator[Element]:
        """This element and all in it, in the order of the text."""
        waiting = [self]
        while waiting:
            one = waiting.pop()
            yield one
            waiting.extend(reversed(one.children))


def root_of(text: bytes) -> Element:
    """The outermost element of an XML text.

    Raises:
        InputError: The text is not well-formed, or has entities of its own.
    """
    parser = expat.ParserCreate("utf-8")
    # Without a buffer no text is joined that nobody asks for.
    opened: list[Element] = []
    found: list[Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        at = parser.CurrentByteIndex
        parent = opened[-1] if opened else None
        one = Element(tag, attributes, parent, at, _end_of_tag(text, at))
        (parent.children if parent is not None else found).append(one)
        if len(opened) >= _MOST_DEPTH:
            raise InputError(f"elements are nested more than {_MOST_DEPTH} deep")
        opened.append(one)

    def end(_: str) -> None:
        one = opened.pop()
        if text[one.open_end - 2 : one.open_end] != b"/>":
            one.close = parser.CurrentByteIndex
            one.end = _end_of_tag(text, one.close)

    def declared(*_: object) -> None:
        raise InputError("the file declares entities, so only its whole text can be edited")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.EntityDeclHandler = declared
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise InputError(
            f"line {error.lineno}: the file is not well-formed XML: {expat.ErrorString(error.code)}"
        ) from None
    return found[0]


def _end_of_tag(text: bytes, start: int) -> int:
    found = _TAG.match(text, start)
    if found is None:
        raise InputError("the file is not well-formed XML: a tag does not end")
    return found.end()
