"""The standard layout of environment files.

* Each brace indents by two spaces. Words of a clause are one space apart, clauses two.
* Statements on the same line stay on one line, and statements on different lines stay apart. Line
  breaks within a statement are removed. At most one empty line is kept, and none next to a brace.
* Regions on neighbouring lines are aligned in columns, and so are comments at the ends of lines.

Only white space changes: the tokens and comments of the result are those of the text. Formatting
the result changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Final

from ntagen.nsl.diagnostics import Reporter, SourceError
from ntagen.nsl.lexer import tokenise
from ntagen.nsl.parser import parse
from ntagen.nsl.source import Source
from ntagen.nsl.tokens import (
    BLOCKS,
    REGIONS,
    BlockKind,
    Comment,
    Token,
    begins_statement,
    keyword_of,
)

_INDENT: Final = "  "
_CONTINUATION: Final = "      "
_COMMENT_GAP: Final = 3

_NONE_AFTER: Final = frozenset({"LPAR", "LSQB", "RANGE"})
_NONE_BEFORE: Final = frozenset({"RPAR", "RSQB", "LSQB", "COMMA", "RANGE"})
_OPERAND_ENDS: Final = frozenset({"NAME", "NUMBER", "RATIO", "PERCENT", "RPAR", "RSQB"})
_CLAUSES: Final = frozenset(
    {"SPHERE", "AROUND", "MARGIN", "RADIUS", "AT", "MOVES", "TISSUE_PART"}
) | {
    *("BOX", "SIZE", "TURNED", "CAPSULE", "CYLINDER", "ELLIPSOID", "RADII", "HALFSPACE", "TOWARDS"),
    *("MESH", "SEGMENTATION", "MARKUPS", "SEGMENT", "POINT", "LABEL", "GRID"),
}


_ROWS_AT: Final = 3
"""The rows of a transform begin here; a parenthesis behind a name is no call there."""


def format_source(source: Source) -> str:
    """The text of a source in the standard layout.

    Raises:
        SourceError: The text has syntax errors; its meaning is not checked.
    """
    reporter = Reporter()
    reporter.enter(source.path)
    parse(source, reporter, kind=None)
    if reporter.has_errors:
        raise SourceError(reporter.diagnostics)
    lines = _Layout().lines(tokenise(source))
    return "".join(f"{text}\n" for text in _render(lines))


@dataclass(slots=True)
class _Line:
    """A line of the result before it is aligned with its neighbours.

    Attributes:
        depth: The number of braces around it.
        cells: Its clauses; the whole line if it is not aligned.
        comment: The comment at its end.
        follows_gap: Whether an empty line comes before it.
        is_region: Whether it is one region, whose cells are aligned with those of its neighbours.
        is_opening: Whether it ends in an opening brace.
    """

    depth: int
    cells: list[str] = field(default_factory=list)
    comment: str | None = None
    follows_gap: bool = False
    is_region: bool = False
    is_opening: bool = False

    @property
    def is_single(self) -> bool:
        """Whether it is also one line in the text, and more than a closing brace."""
        return self.cells != ["}"] and not any("\n" in cell for cell in self.cells)

    def append(self, cells: Sequence[str]) -> None:
        """Adds clauses; a line with more than a region is not aligned."""
        if self.is_region and self.cells:
            self.cells[:2] = [" ".join(self.cells[:2])]
            self.is_region = False
        self.cells.extend(cells)


class _Layout:
    """Puts tokens and comments on lines."""

    def __init__(self) -> None:
        self._lines: list[_Line] = []
        self._blocks: list[BlockKind | None] = []
        self._keyword = ""
        self._statement: list[Token | Comment] = []
        self._end_line = 0

    def lines(self, items: Sequence[Token | Comment]) -> list[_Line]:
        """The lines of a file."""
        following = _following_tokens(items)
        for item, token in zip(items, following, strict=True):
            if isinstance(item, Comment):
                self._comment(item, token)
            else:
                self._token(item)
            self._end_line = item.line + item.text.count("\n")
        self._end_statement()
        return self._lines

    def _block(self) -> BlockKind | None:
        """The kind of the innermost open braces."""
        return self._blocks[-1] if self._blocks else None

    def _token(self, token: Token) -> None:
        """Adds a token to the right line."""
        if token.type == "BRACE" and token.text == "{":
            self._statement.append(token)
            self._blocks.append(BLOCKS.get(self._keyword))
            self._end_statement()
            self._lines[-1].is_opening = True
        elif token.type == "BRACE":
            self._end_statement()
            self._blocks.pop()
            self._open_line(token).cells.append("}")
            self._lines[-1].follows_gap = False
        elif not self._statement or begins_statement(token, self._block()):
            self._end_statement()
            if token.line > self._end_line or not self._can_continue():
                self._open_line(token)
            self._keyword = keyword_of(token)
            self._statement.append(token)
        else:
            self._statement.append(token)

    def _comment(self, comment: Comment, following: Token | None) -> None:
        """Adds a comment: within a statement, at the end of a line or on lines of its own."""
        is_inside = (
            bool(self._statement)
            and following is not None
            and following.text != "}"
            and not begins_statement(following, self._block())
        )
        if is_inside:
            self._statement.append(comment)
            return
        is_line_shared = comment.line == self._end_line and bool(self._lines)
        is_followed = (
            following is not None and following.text != "}" and following.line == comment.line
        )
        self._end_statement()
        line = self._lines[-1] if self._lines else None
        if line is None or not is_line_shared or line.comment is not None:
            self._open_line(comment).cells.append(comment.text)
        elif is_followed and comment.text.startswith("/*") and self._can_continue():
            line.append([comment.text])
        else:
            line.comment = comment.text

    def _can_continue(self) -> bool:
        """Whether another statement may be added to the current line."""
        if not self._lines or self._lines[-1].comment is not None:
            return False
        cells = self._lines[-1].cells
        return bool(cells) and not (cells[-1].endswith(("{", "}")) or cells[0].startswith("/"))

    def _open_line(self, item: Token | Comment) -> _Line:
        """Begins a line; empty lines before it become one, or none next to a brace."""
        is_first = not self._lines or self._lines[-1].is_opening
        line = _Line(len(self._blocks))
        line.follows_gap = item.line > self._end_line + 1 and not is_first
        self._lines.append(line)
        return line

    def _end_statement(self) -> None:
        """Adds the collected statement to the current line."""
        if not self._statement:
            return
        line = self._lines[-1]
        cells = list(_cells(self._statement))
        is_region = self._keyword in REGIONS
        if is_region and not line.cells:
            line.is_region = True
        elif is_region:
            cells = [" ".join(cells[:2]), *cells[2:]]
        line.append(cells)
        self._statement = []


def _following_tokens(items: Sequence[Token | Comment]) -> list[Token | None]:
    """The first token after each item."""
    following: list[Token | None] = []
    token: Token | None = None
    for item in reversed(items):
        following.append(token)
        if isinstance(item, Token):
            token = item
    return following[::-1]


def _cells(items: Sequence[Token | Comment]) -> Iterator[str]:
    """The clauses of a statement; those of a region begin with its kind and its name."""
    cell = ""
    previous: Token | Comment | None = None
    last_token: Token | None = None
    is_prefix = False
    first = items[0]
    for index, item in enumerate(items):
        if _begins_clause(previous, item):
            yield cell
            cell = ""
        elif previous is not None and not is_prefix:
            is_row = index == _ROWS_AT and isinstance(first, Token) and first.text == "transform"
            cell += " " if is_row else _space(previous, item)
        cell += _text(item)
        is_letter = previous is items[0] and isinstance(previous, Token) and previous.type == "AXIS"
        is_prefix = _is_prefix(last_token, item)
        previous = item
        if is_letter:
            # The letter of an axis is no operand: a sign after it belongs to the steps.
            last_token = None
            continue
        last_token = item if isinstance(item, Token) else last_token
    yield cell


def _begins_clause(previous: Token | Comment | None, item: Token | Comment) -> bool:
    """Whether a new clause begins between two neighbours of a statement."""
    return (
        isinstance(item, Token)
        and isinstance(previous, Token)
        and (item.type in _CLAUSES or previous.type == "REGION_KIND")
    )


def _is_prefix(last_token: Token | None, item: Token | Comment) -> bool:
    """Whether an item is a sign of the following value, not an operator."""
    if isinstance(item, Comment) or item.type != "SIGN":
        return False
    return last_token is None or last_token.type not in _OPERAND_ENDS


def _space(previous: Token | Comment, item: Token | Comment) -> str:
    """The white space between two neighbours of a clause."""
    if isinstance(previous, Comment):
        return "\n" + _CONTINUATION if previous.text.startswith("//") else " "
    if isinstance(item, Comment):
        return " "
    is_call = item.type == "LPAR" and previous.type == "NAME"
    is_tight = previous.type in _NONE_AFTER or item.type in _NONE_BEFORE
    return "" if is_call or is_tight else " "


def _text(item: Token | Comment) -> str:
    """The text of a token or comment."""
    if isinstance(item, Token) and item.type == "RATIO":
        return "".join(item.text.split())
    if isinstance(item, Token) and item.type == "QUERY":
        head, _, text = item.text.partition("=")
        return f"query {head.removeprefix('query').strip()} = {text.strip()}"
    return item.text


def _render(lines: Sequence[_Line]) -> Iterator[str]:
    """The text of the lines, aligned."""
    bodies = [
        body for group in _runs(lines, lambda line: line.is_region) for body in _bodies(group)
    ]
    position = 0
    for group in _runs(lines, lambda line: line.comment is not None and line.is_single):
        texts = bodies[position : position + len(group)]
        position += len(group)
        column = max(map(len, texts)) + _COMMENT_GAP
        for line, text in zip(group, texts, strict=True):
            if line.follows_gap:
                yield ""
            if line.comment is None:
                yield text
            elif line.is_single:
                yield f"{text:<{column}}{line.comment}"
            else:
                yield f"{text}{' ' * _COMMENT_GAP}{line.comment}"


def _runs(lines: Sequence[_Line], is_member: Callable[[_Line], bool]) -> Iterator[list[_Line]]:
    """Groups of neighbouring lines that are aligned together; any other line is a group alone."""
    run: list[_Line] = []
    for line in lines:
        if run and not (
            is_member(run[-1])
            and is_member(line)
            and run[-1].depth == line.depth
            and not line.follows_gap
        ):
            yield run
            run = []
        run.append(line)
    if run:
        yield run


def _bodies(lines: Sequence[_Line]) -> Iterator[str]:
    """Lines without their comments; the clauses of several regions are aligned in columns."""
    aligned = [line for line in lines if line.is_region and line.is_single]
    columns = zip_longest(*(line.cells[:-1] for line in aligned), fillvalue="")
    widths = [max(map(len, column)) for column in columns]
    if len({line.cells[2].partition(" ")[0] for line in aligned}) > 1:
        # Spheres and `around` clauses differ too much in length to share a column.
        del widths[2:]
    for line in lines:
        cells = line.cells
        if line in aligned:
            padded = [f"{cell:<{width}}" for cell, width in zip(cells[:-1], widths, strict=False)]
            cells = [*padded, *cells[len(padded) :]]
        yield _INDENT * line.depth + _joined(cells, is_region=line.is_region)


def _joined(cells: Sequence[str], *, is_region: bool) -> str:
    """The clauses of a line; a region's kind stands one space before its name."""
    if is_region and len(cells) > 1:
        return f"{cells[0]} {'  '.join(cells[1:])}"
    return "  ".join(cells)
