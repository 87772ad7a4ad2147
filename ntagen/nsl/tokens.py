"""The words of the language: tokens, comments, and the keywords that begin a statement.

The terminals are those of `environment.lark`: a word in quotes there is a terminal of its own,
named by its capitals. `ntagen.nsl.lexer` finds them in a text.
"""

from __future__ import annotations

from typing import Final, Literal

from ntagen.nsl.source import Span
from ntagen.parameters import BY_WORDS
from ntagen.values import dataclass

BlockKind = Literal["file", "environment", "needle", "motion", "for", "drive", "device"]
"""The place of a statement: at the top of a file, or in the braces of another one."""

REGIONS: Final = frozenset({"target", "critical", "detection", "unexplored", "safe"})
_NEEDLE_ITEMS: Final = frozenset({"tip", "heading", "bevel", "radius", "speed", "length"})
_LATER_MOTION: Final = frozenset({"wait", "push", "spin"})
_MOTION_ITEMS: Final = frozenset({"step", "roll"}) | _LATER_MOTION
_BODY_ITEMS: Final = REGIONS | {
    "tissue",
    "resolution",
    "safety",
    "transform",
    "query",
    "needle",
    "motion",
    "for",
    "drive",
    "device",
    "tracker",
}

ALLOWED: Final[dict[BlockKind, frozenset[str]]] = {
    "file": frozenset({"let", "include", "environment"}),
    "environment": _BODY_ITEMS | {"let", "include"},
    "needle": _NEEDLE_ITEMS,
    "motion": _MOTION_ITEMS,
    "for": REGIONS | {"let", "for"},
    "drive": frozenset(BY_WORDS),
    "device": frozenset({"insert", "roll"}),
}
"""The statements that are allowed at each place."""

PHRASES: Final[dict[str, str]] = {"drive": "PARAMETER", "device": "AXIS"}
"""The braces whose statements begin with words that may be names elsewhere, and the terminal to
which `tokenise` joins these words."""

KEYWORDS: Final = frozenset().union(*(ALLOWED[kind] for kind in ALLOWED if kind not in PHRASES))
"""The words that begin a statement, wherever they stand."""

_OTHER_WORDS: Final = frozenset(
    {"sphere", "around", "margin", "by", "at", "most", "least", "times", "apart", "per", "in"}
)
IMAGES: Final = frozenset({"mesh", "segmentation", "markups"})
"""The shapes from files."""

SOLIDS: Final = frozenset({"box", "capsule", "cylinder", "ellipsoid", "halfspace"}) | IMAGES
"""The shapes whose words are not reserved: they came later, and older files use them as names."""

SOLID_WORDS: Final = SOLIDS | {
    *("size", "to", "radii", "turned", "about", "towards"),
    *("segment", "point", "label", "grid"),
}
MOVES_WORDS: Final = frozenset({"moves", "along", "every", "phase", "through", "after", "as"})
MOTION_WORDS: Final = _LATER_MOTION | {"only", "while", "phase", "between", "and"}
"""The words of later shapes, of motions and of waits, gates and spins: names in other places."""

TISSUE_BOUNDS: Final = ("curvature", "roll", "tip")
"""The bounds of an adversarial tissue, and the spreads of a stochastic one."""

RESERVED: Final = (KEYWORDS | _OTHER_WORDS) - _LATER_MOTION
"""All words that cannot be names because of the grammar."""

BLOCKS: Final[dict[str, BlockKind]] = {kind: kind for kind in ALLOWED if kind != "file"}
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


WORDS: Final = {
    word: "REGION_KIND" if word in REGIONS else word.upper()
    for word in KEYWORDS | _OTHER_WORDS | SOLID_WORDS | MOVES_WORDS | MOTION_WORDS
}
"""The terminals of words that are no names everywhere."""


def keyword_of(token: Token) -> str:
    """The keyword of a statement that begins with this token; settings have all their words."""
    return token.text if token.type in PHRASES.values() else token.text.split()[0]


def begins_statement(token: Token, kind: BlockKind | None) -> bool:
    """Whether a token begins a statement in a block; None is any block but a needle.

    `radius` begins one only in a needle: elsewhere it is a clause of a sphere.
    """
    if token.type in ("QUERY", "PARAMETER", "AXIS"):
        return True
    if token.type in ("NAME", "TISSUE_PART"):
        return False  # One of the words that a setting can have.
    return token.text in KEYWORDS and (token.text != "radius" or kind == "needle")
