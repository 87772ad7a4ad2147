"""The words of the language: tokens, comments, and the keywords that begin a statement.

The terminals are those of `grammar.lark`; lark is imported when the first text is read, not before.
"""

from __future__ import annotations

import functools
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, cast

from ntagen.cache import cache_folder
from ntagen.nsl.source import Source, Span

if TYPE_CHECKING:
    import lark

BlockKind = Literal["file", "environment", "needle", "motion", "for"]
"""The place of a statement: at the top of a file, or in the braces of another one."""

REGIONS: Final = frozenset({"target", "critical", "detection"})
_NEEDLE_ITEMS: Final = frozenset({"tip", "heading", "bevel", "radius", "speed", "length"})
_MOTION_ITEMS: Final = frozenset({"step", "roll"})
_BODY_ITEMS: Final = REGIONS | {
    "tissue",
    "resolution",
    "safety",
    "query",
    "needle",
    "motion",
    "for",
}

ALLOWED: Final[dict[BlockKind, frozenset[str]]] = {
    "file": frozenset({"let", "include", "environment"}),
    "environment": _BODY_ITEMS | {"let", "include"},
    "needle": _NEEDLE_ITEMS,
    "motion": _MOTION_ITEMS,
    "for": REGIONS | {"let", "for"},
}
"""The statements that are allowed at each place."""

KEYWORDS: Final = frozenset().union(*ALLOWED.values())
"""The words that begin a statement."""

_OTHER_WORDS: Final = frozenset(
    {"sphere", "around", "margin", "by", "at", "most", "least", "times", "apart", "per", "in"}
)
RESERVED: Final = KEYWORDS | _OTHER_WORDS
"""All words that cannot be names because of the grammar."""

BLOCKS: Final[dict[str, BlockKind]] = {
    "environment": "environment",
    "needle": "needle",
    "motion": "motion",
    "for": "for",
}
"""The statements that have braces."""

NAMING: Final = REGIONS | {"environment", "let", "for"}
"""The statements that declare a name, right after the keyword."""

STRAY: Final = frozenset({"STRAY", "HASH", "UNCLOSED_STRING", "UNCLOSED_COMMENT"})
"""Terminals of characters that are not part of the language."""

MAX_STRAY: Final = 1000
"""A text with more of them is not an environment."""


@dataclass(frozen=True, slots=True)
class Token:
    """A token: its terminal in the grammar, its text and its place."""

    type: str
    text: str
    span: Span
    line: int


@dataclass(frozen=True, slots=True)
class Comment:
    """A comment, with its slashes."""

    text: str
    span: Span
    line: int


@functools.cache
def grammar() -> lark.Lark:
    """The parser of single statements.

    Computing its tables takes longer than all other work on a file (about 80 ms). So lark stores
    them in the user's cache folder; it computes them again if the grammar or lark has changed, or
    if the folder cannot be used.
    """
    import lark

    text = Path(__file__).with_name("grammar.lark").read_text("utf-8")
    return lark.Lark(
        text,
        parser="lalr",
        lexer="basic",
        start=["statement", "outside"],
        propagate_positions=True,
        maybe_placeholders=False,
        cache=_cache_file() or False,
    )


def _cache_file() -> str | None:
    """The file with the grammar's tables; None if there is no cache folder."""
    folder = cache_folder()
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    return None if folder is None else str(folder / f"nsl-grammar-{version}.tables")


def tokenise(source: Source) -> list[Token | Comment]:
    """All tokens and comments of a source; with the white space they are the whole text.

    After `MAX_STRAY` tokens that are not part of the language, the rest of the text is left out.
    """
    found: list[Token | Comment] = []
    stray_count = 0
    for token in grammar().lex(source.text, dont_ignore=True):
        start = cast(int, token.start_pos)
        span = source.span(start, start + len(token))
        if token.type in ("LINE_COMMENT", "BLOCK_COMMENT"):
            found.append(Comment(str(token).rstrip(), span, cast(int, token.line)))
        elif token.type != "SPACE":
            found.append(Token(token.type, str(token), span, cast(int, token.line)))
            stray_count += token.type in STRAY
            if stray_count > MAX_STRAY:
                break
    return found


def begins_statement(token: Token, kind: BlockKind | None) -> bool:
    """Whether a token begins a statement in a block; None is any block but a needle.

    `radius` begins one only in a needle: elsewhere it is a clause of a sphere.
    """
    if token.type == "QUERY":
        return True
    return token.text in KEYWORDS and (token.text != "radius" or kind == "needle")
