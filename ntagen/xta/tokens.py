"""From the text of a model to tokens and comments, which lie in it in order.

Source: the lexer of the engine, `checker/src/syntax/lexer.rs`. Every text has tokens: what begins
none is a token of kind ``unknown``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, Literal, NamedTuple

Kind = Literal["word", "number", "string", "symbol", "comment", "unknown"]

_SYMBOLS: Final = re.findall(
    r"\S+",
    """
    -u-> A[] A<> E[] E<> --> <<= >>= -> := += -= *= /= %= |= &= ^= <? >? ** << >> || && <= >= =< =>
    == != ++ -- [] <> . , ; : { } [ ] ( ) ? ' ! = + - * / % | & ^ < > #
    """,
)

_TOKEN: Final = re.compile(
    rf"""
    (?P<comment>//[^\n]*|/\*.*?(?:\*/|\Z))
    |(?P<symbol>{"|".join(map(re.escape, _SYMBOLS[:5]))})
    |(?P<word>[A-Za-z_][A-Za-z0-9_]*)
    |(?P<number>[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?)
    |(?P<string>"[^"\n]*")
    |(?P<other>{"|".join(map(re.escape, _SYMBOLS[5:]))})
    |(?P<unknown>[^\s])
    """,
    re.VERBOSE | re.DOTALL,
)

_KINDS: Final[dict[str, Kind]] = {
    "comment": "comment",
    "word": "word",
    "number": "number",
    "string": "string",
    "symbol": "symbol",
    "other": "symbol",
    "unknown": "unknown",
}
"""By group of the pattern: `A[]` is tried before words, the other symbols behind numbers."""


class Token(NamedTuple):
    """A token or a comment.

    Attributes:
        kind: What it is; a comment that is never closed reaches to the end.
        text: How it is written.
        start: Its first character.
    """

    kind: Kind
    text: str
    start: int

    @property
    def end(self) -> int:
        """The character behind it."""
        return self.start + len(self.text)


def tokenise(text: str) -> Iterator[Token]:
    """The tokens and comments of a text. A comment to the end of its line has no blanks there."""
    for found in _TOKEN.finditer(text):
        words = found[0].rstrip() if found[0].startswith("//") else found[0]
        yield Token(_KINDS[found.lastgroup or ""], words, found.start())
