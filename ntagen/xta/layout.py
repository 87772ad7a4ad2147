"""The standard layout of a textual model: indentation and blanks.

Lines stay as they are divided. A line is indented by the brackets that are open around it, and
once more if it goes on with a statement; behind `state` and `trans`, what goes on stands below the
first entry. Of empty lines, one in a row is kept.

Invariants: tokens and comments and their order stay the same, and so do the lines inside comments;
a text in the layout is not changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ntagen.values import dataclass
from ntagen.xta.blanks import Neighbours, between
from ntagen.xta.tokens import Token, tokenise

_STEP: Final = 2
_OPENING: Final = {"(", "[", "{"}
_CLOSING: Final = {")", "]", "}"}
_LISTS: Final = {"state", "trans"}


def format_model(text: str) -> str:
    """The text of a model in the standard layout; it may have mistakes."""
    end = "\r\n" if "\r\n" in text else "\n"
    writer = _Writer(text)
    done = "".join(writer.written(line) + end for line in _lines(text))
    # Tokens that only a blank kept apart must not become one: then the author's layout stays.
    return done if _words(done) == _words(text) else text


def _words(text: str) -> list[str]:
    return [token.text for token in tokenise(text)]


def _lines(text: str) -> list[list[Token]]:
    """The tokens of each line that is kept."""
    lines: list[list[Token]] = []
    last = 0
    for token in tokenise(text):
        breaks = text.count("\n", last, token.start)
        if not lines or breaks:
            lines += [[], []] if lines and breaks > 1 else [[]]
        lines[-1].append(token)
        last = token.end
    return lines


@dataclass(frozen=True, slots=True)
class _Statement:
    """A statement that is not over: where it begins, where it goes on, and its first word."""

    start: int
    further: int
    word: str


@dataclass(frozen=True, slots=True)
class _Bracket:
    """A bracket that is open.

    Attributes:
        column: Where the line of the bracket begins, or the entry of a list.
        is_block: Whether statements are in it.
        around: The statement that it is part of.
        goes_on: Whether the statement goes on behind it.
    """

    column: int
    is_block: bool
    around: _Statement | None
    goes_on: bool


class _Writer:
    """Writes one line after the other; it knows what is open."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._open: list[_Bracket] = []
        self._statement: _Statement | None = None
        # The last three tokens that are no comments, the last one first.
        self._code: list[str] = []

    def written(self, line: Sequence[Token]) -> str:
        """A line in the layout."""
        if not line:
            return ""
        column = anchor = self._column(line)
        parts = [" " * column]
        for number, token in enumerate(line):
            if number:
                blanks = self._blanks(line, number)
                parts.append(blanks)
                column += len(blanks)
            if number and line[number - 1].text in _LISTS and self._is_first(line[number - 1]):
                anchor = column
                self._statement = _Statement(anchor, anchor, line[number - 1].text)
            if token.kind != "comment":
                self._pass(token.text, anchor)
            parts.append(token.text)
            column += len(token.text)
        return "".join(parts).rstrip()

    def _is_first(self, token: Token) -> bool:
        """Whether the word before began its statement."""
        return self._statement is not None and self._code[:1] == [token.text]

    def _column(self, line: Sequence[Token]) -> int:
        """Where a line begins."""
        closed = 0
        while closed < min(len(line), len(self._open)) and line[closed].text in _CLOSING:
            closed += 1
        if closed:
            return self._open[-closed].column
        statement = self._statement
        if statement is not None:
            is_body = line[0].text == "{" and statement.word not in _LISTS
            return statement.start if is_body and self._opens_block() else statement.further
        return self._open[-1].column + _STEP if self._open else 0

    def _opens_block(self) -> bool:
        """Whether a brace here has statements in it, and not values."""
        before = self._code[0] if self._code else ""
        if before in ("=", ":=", ",", "(", "["):
            return False
        return before != "{" or not self._open or self._open[-1].is_block

    def _blanks(self, line: Sequence[Token], number: int) -> str:
        before, token = line[number - 1], line[number]
        behind = line[number + 1] if number + 1 < len(line) else None
        neighbours = Neighbours(
            before=before,
            token=token,
            written=self._text[before.end : token.start],
            earlier=self._code[1] if len(self._code) > 1 else "",
            is_last=behind is None or behind.kind == "comment" or behind.text in (";", "}"),
            is_block=bool(self._open) and self._open[-1].is_block,
        )
        return between(neighbours)

    def _pass(self, text: str, anchor: int) -> None:
        """Goes over a token of an entry that begins at a column."""
        in_block = not self._open or self._open[-1].is_block
        if text in _CLOSING:
            self._close()
        elif text == ";" and in_block:
            self._statement = None
        elif self._statement is None:
            self._statement = _Statement(anchor, anchor + _STEP, text)
        if text in _OPENING:
            self._open_bracket(text, anchor)
        self._code = [text, *self._code[:2]]

    def _open_bracket(self, text: str, column: int) -> None:
        is_block = text == "{" and self._opens_block()
        around = self._statement
        is_part = around is not None and around.word in _LISTS
        goes_on = is_part or not is_block or self._code[:1] == ["struct"]
        self._open.append(_Bracket(column, is_block, around, goes_on))
        inside = _Statement(column, column + _STEP, "")
        self._statement = None if is_block else inside

    def _close(self) -> None:
        if self._open:
            bracket = self._open.pop()
            self._statement = bracket.around if bracket.goes_on else None
