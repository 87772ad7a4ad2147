"""Reads a single statement from its words, by the grammar of the language (`grammar.lark`).

The parser cuts a file into statements first (see parser.py), so that a mistake in one does not hide
a mistake in another.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from ntagen.nsl import tree
from ntagen.nsl.source import Source
from ntagen.nsl.tokens import Token


class UnexpectedTokenError(Exception):
    """A token that cannot stand at its place.

    Attributes:
        token: The token; None is the end of the statement.
        expected: The terminals that could stand there, sorted.
    """

    def __init__(self, token: Token | None, expected: Sequence[str]) -> None:
        super().__init__(token, expected)
        self.token = token
        self.expected = expected


def read_statement(source: Source, words: Sequence[Token]) -> tree.Statement:
    """The tree of a statement, without the statements in its braces.

    Args:
        source: The text.
        words: The tokens of the statement; no parentheses are nested deeper than recursion can go.

    Raises:
        UnexpectedTokenError: A token cannot stand at its place.
    """
    import lark

    from ntagen.nsl.convert import TreeBuilder
    from ntagen.nsl.grammar import grammar

    parser = grammar().parse_interactive("", start="statement")
    last: lark.Token | None = None
    word: Token | None = None
    try:
        for word in words:
            start, end = word.span.start, word.span.end
            last = lark.Token(word.type, word.text, start_pos=start, end_pos=end)
            parser.feed_token(last)
        word = None
        parsed = parser.feed_eof(last)  # type: ignore[no-untyped-call]
    except lark.UnexpectedToken:
        accepted = cast("set[str]", parser.accepts())  # type: ignore[no-untyped-call]
        raise UnexpectedTokenError(word, sorted(accepted)) from None
    span = words[0].span.to(words[-1].span)
    return TreeBuilder(source).statement(cast("lark.Tree[lark.Token]", parsed), span)
