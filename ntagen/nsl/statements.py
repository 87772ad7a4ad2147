"""Reads a single statement from its words, by the grammar of the language (`grammar.lark`).

The parser cuts a file into statements first (see parser.py), so that a mistake in one does not hide
a mistake in another.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from ntagen.nsl import tree
from ntagen.nsl.tokens import Token

if TYPE_CHECKING:
    import lark


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


def read_statement(words: Sequence[Token]) -> tree.Statement:
    """The tree of a statement, without the statements in its braces.

    Args:
        words: The tokens of the statement; no parentheses are nested deeper than recursion can go.

    Raises:
        UnexpectedTokenError: A token cannot stand at its place.
    """
    from lark import UnexpectedToken

    from ntagen.nsl.grammar import grammar

    parser = grammar().parse_interactive("", start="statement")
    word: Token | None = None
    try:
        for word in words:
            # lark looks at the type of a token alone, and gives the token to `TreeBuilder`.
            parser.feed_token(cast("lark.Token", word))
        word = None
        return cast(tree.Statement, parser.feed_eof())  # type: ignore[no-untyped-call]
    except UnexpectedToken:
        accepted = cast("set[str]", parser.accepts())  # type: ignore[no-untyped-call]
        raise UnexpectedTokenError(word, sorted(accepted)) from None
