"""The grammar of the language, `environment.lark`, as a lexer of texts and a parser of statements.

Only what reads a text imports this module: lark takes a third of the time in which a command
starts.

Computing the tables of a parser takes longer than all other work on a file (some 100 ms). So lark
stores them in the user's cache folder; it computes them again if the grammar or lark has changed,
or if the folder cannot be used. Each grammar has a file of its own, so that two versions of this
program do not compute them again and again.
"""

from __future__ import annotations

import functools
import sys
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal, cast

import lark
from lark import Lark, UnexpectedToken
from lark import Token as LarkToken

from ntagen.cache import cache_folder
from ntagen.nsl import tree
from ntagen.nsl.convert import TreeBuilder
from ntagen.nsl.tokens import Token

FILE: Final = Path(__file__).with_name("environment.lark")


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
    parser = grammar().parse_interactive("", start="statement")
    word: Token | None = None
    try:
        for word in words:
            # lark looks at the type of a token alone, and gives the token to `TreeBuilder`.
            parser.feed_token(cast(LarkToken, word))
        word = None
        return cast(tree.Statement, parser.feed_eof())  # type: ignore[no-untyped-call]
    except UnexpectedToken:
        accepted = cast("set[str]", parser.accepts())  # type: ignore[no-untyped-call]
        raise UnexpectedTokenError(word, sorted(accepted)) from None


@functools.cache
def grammar() -> Lark:
    """The lexer of whole texts, and the parser of single statements."""
    text = FILE.read_text("utf-8")
    return Lark(
        text,
        parser="lalr",
        lexer=_lexer(),
        start=["statement", "outside"],
        keep_all_tokens=True,
        maybe_placeholders=False,
        transformer=TreeBuilder(),
        cache=_tables(text) or False,
    )


def _lexer() -> Literal["basic"]:
    """The lexer that knows no context, by the name that it has in the version of lark at hand.

    Before version 1 it was called ``standard``. The ROS 2 packages for pip bring lark 0.12, which
    takes the place of the newer one in the same folder.
    """
    is_old = lark.__version__.startswith("0.")
    return cast(Literal["basic"], "standard" if is_old else "basic")


def _tables(text: str) -> str | None:
    """The file with the tables of a grammar; None if there is no cache folder."""
    folder = cache_folder()
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    name = f"nsl-grammar-{version}-{zlib.crc32(text.encode()):08x}.tables"
    return None if folder is None else str(folder / name)
