"""The text of a document: its places as the protocol counts them, and as characters."""

from __future__ import annotations

from bisect import bisect_right

from lsprotocol import types
from pygls.workspace import PositionCodec


class Text:
    """A text, and where its lines begin.

    Attributes:
        source: The text.
    """

    def __init__(self, source: str, codec: PositionCodec) -> None:
        self.source = source
        self._codec = codec
        self._starts = [0]
        start = source.find("\n")
        while start >= 0:
            self._starts.append(start + 1)
            start = source.find("\n", start + 1)

    def place(self, offset: int) -> types.Position:
        """Where a character stands; one behind the end stands at the end."""
        line = bisect_right(self._starts, offset) - 1
        before = self.source[self._starts[line] : offset]
        return types.Position(line, self._codec.client_num_units(before))

    def area(self, start: int, end: int) -> types.Range:
        """Where some characters stand."""
        return types.Range(self.place(start), self.place(end))

    def offset(self, position: types.Position) -> int:
        """The character at a place; a place behind the end of a line is the end."""
        if position.line >= len(self._starts):
            return len(self.source)
        start = self._starts[position.line]
        units = 0
        while start < len(self.source) and units < position.character:
            if self.source[start] == "\n":
                break
            units += self._codec.client_num_units(self.source[start])
            start += 1
        return start

    def in_line(self, line: int, column: int) -> types.Position:
        """A place by its line and the character in it, both from 0."""
        if line >= len(self._starts):
            return types.Position(line, 0)
        return self.place(self._starts[line] + column)
