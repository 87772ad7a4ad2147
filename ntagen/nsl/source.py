"""Source text and places in it.

A `Source` is one file as it was read; a `Span` is a range of its characters. Lines and columns are
counted from 1, columns in characters (a tab is one). They are computed only when a diagnostic is
shown.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import field
from functools import cached_property
from typing import Final, NamedTuple

from ntagen.values import dataclass

MAX_SOURCE_BYTES: Final = 1024 * 1024
"""Larger files are refused: 10,000 regions, one on each line, take about 0.6 MB."""


@dataclass(frozen=True, eq=False)
class Source:
    """The text of one file, and the path by which the user knows it."""

    path: str
    text: str = field(repr=False)

    @cached_property
    def _line_starts(self) -> list[int]:
        """Offsets at which lines begin; only a line feed ends a line."""
        starts = [0]
        starts.extend(index + 1 for index, character in enumerate(self.text) if character == "\n")
        return starts

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of a character, both from 1."""
        line = bisect_right(self._line_starts, offset)
        return line, offset - self._line_starts[line - 1] + 1

    @cached_property
    def _shown_lines(self) -> dict[int, str]:
        """Lines that were used before, so that many diagnostics on a long line share its text."""
        return {}

    def line(self, number: int) -> str:
        """The text of a line, without its end."""
        if number not in self._shown_lines:
            self._shown_lines[number] = self._line(number)
        return self._shown_lines[number]

    def _line(self, number: int) -> str:
        """The text of a line, without the cache."""
        start = self._line_starts[number - 1]
        end = self.text.find("\n", start)
        return self.text[start : len(self.text) if end < 0 else end].rstrip("\r")

    def span(self, start: int, end: int) -> Span:
        """The characters from `start` up to `end`, without the one at `end`."""
        return Span(self, start, end)


class Span(NamedTuple):
    """A range in a source: the offsets of its first character and of the one after its last.

    A large file has a hundred thousand of them, and a tuple is made faster than a dataclass.
    """

    source: Source
    start: int
    end: int

    @property
    def text(self) -> str:
        """The characters themselves."""
        return self.source.text[self.start : self.end]

    @property
    def place(self) -> str:
        """The place where it begins, as a note shows it: ``path:line:column``."""
        line, column = self.source.position(self.start)
        return f"{self.source.path}:{line}:{column}"

    def to(self, other: Span) -> Span:
        """From the beginning of this one to the end of the other."""
        return Span(self.source, self.start, other.end)

    def behind(self) -> Span:
        """The empty range just after this one."""
        return Span(self.source, self.end, self.end)
