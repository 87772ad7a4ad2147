"""The words of messages: what was expected, what was found, what to write."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ntagen.nsl.tokens import SOLIDS, Token
from ntagen.parameters import BY_WORDS

STRAY_HINTS: Final = {
    ";": "statements need no separator; between the components of a vector write commas",
    ":": "leave it out: a value stands right behind its word, for example `radius 30 mm`",
    "#": "comments begin with `//`",
    ".": "write a digit on both sides of a decimal point",
    "°": "write `deg`",
    "µ": "write `um`",
    "μ": "write `um`",
    "\N{MINUS SIGN}": "write the hyphen `-`",
    "\N{EN DASH}": "write the hyphen `-`",
    "\N{MULTIPLICATION SIGN}": "write `*`",
    "·": "write `*`",
    "^": "write a product, for example `r * r`",
    "'": 'write `"`',
    "“": 'write `"`',
    "”": 'write `"`',
    "\ufeff": "the file has a byte order mark inside its text: delete it",
}

UNCLOSED: Final = {
    "UNCLOSED_COMMENT": ("unclosed-comment", "this comment is never closed", "end it with `*/`"),
    "UNCLOSED_STRING": (
        "unclosed-string",
        "this quote is never closed",
        'end the path with `"` on the same line',
    ),
}
"""What is wrong with tokens that have no end, by their terminals: the kind, the message, a hint."""

FORMS: Final = {
    "environment": "write `environment NAME { … }`",
    "needle": "write `needle { … }`",
    "motion": "write `motion { … }`",
    "drive": "write for example `drive { pull 4 mm  push 2 mm }`",
    "device": 'write for example `device grbl "/dev/ttyACM0" { … }`',
    "insert": "write for example `insert X 80 steps/mm`",
    "tracker": 'write for example `tracker openigtlink "localhost:18944" "Needle"`',
    "for": "write for example `for i in 0..7 { … }`",
    "let": "write for example `let depth = 50 mm`",
    "include": 'write for example `include "needle.nsl"`',
    "box": "write for example `box (0, -20, 5) mm size (10, 4, 6) mm turned 30 deg about +z`",
    "capsule": "write for example `capsule (0, -10, 0) mm to (5, -30, 2) mm radius 2 mm to 1 mm`",
    "cylinder": "write for example `cylinder (0, -10, 0) mm to (0, -30, 0) mm radius 3 mm`",
    "ellipsoid": "write for example `ellipsoid (0, -25, 0) mm radii (3, 5, 2) mm`",
    "mesh": 'write for example `mesh "liver.stl" in LPS mm`',
    "segmentation": 'write for example `segmentation "ct.seg.nrrd" segment "tumor"`',
    "markups": 'write for example `markups "plan.mrk.json" radius 2 mm`',
    "transform": 'write for example `transform from LPS "ct.tfm"`',
    "halfspace": "write for example `halfspace (0, -60, 0) mm towards -y`",
    "target": "write for example `target T1 sphere (0, -50, 0) mm radius 10 mm`",
    "critical": "write for example `critical C1 sphere (0, -25, 0) mm radius 2 mm`",
    "detection": "write for example `detection D1 around C1 margin 3 mm`",
    "unexplored": "write for example `unexplored U1 sphere (9, -25, 0) mm radius 3 mm`",
    "safe": "write for example `safe S1 sphere (0, -9, 0) mm radius 5 mm`",
    "tip": "write for example `tip (0, 0, 0) mm`",
    "heading": "write for example `heading -y` or `heading (0, -1, 0)`",
    "bevel": "write for example `bevel +z`, `bevel (0, 0, 1)`, or `bevel free`",
    "radius": "write for example `radius 30 mm`",
    "speed": "write for example `speed 1 mm/s`",
    "length": "write for example `length 150 mm`",
    "step": "write for example `step 2 s`",
    "wait": "write for example `wait 0.5 s at most 2 times`",
    "push": "write for example `push only while phase between 200 deg and 340 deg`",
    "moves": "write for example `moves 12 mm along +z every 4 s phase 90 deg`",
    "roll": "write for example `roll by 90, 180 deg at most 2 times at least 2 mm apart`",
    "spin": "write for example `spin 20 %, 40 %, 60 %`",
    "tissue": "write `tissue static`, `tissue adversarial curvature 10 % roll 5 deg` or "
    "`tissue stochastic`",
    "resolution": "write for example `resolution 1000 per mm`",
    "safety": "write `safety sampled` or `safety swept`",
}

TERMINAL_WORDS: Final = {
    "LPAR": "(",
    "RPAR": ")",
    "LSQB": "[",
    "RSQB": "]",
    "COMMA": ",",
    "EQUAL": "=",
    "RANGE": "..",
    "STRING": "a text in quotes",
    "NAME": "a name",
    "RATIO": "a unit",
    "PERCENT": "%",
    "TISSUE_PART": "curvature, roll or tip",
}
_VALUE_TERMINALS: Final = frozenset({"NUMBER", "NAME", "LPAR", "SIGN"})
_OPERATORS: Final = frozenset({"SIGN", "SCALE", "RATIO"})


def form_of(first: Token) -> str | None:
    """A hint how a statement is written that begins with this token."""
    if first.type == "PARAMETER":
        return f"write for example `{BY_WORDS[first.text].example}`"
    if first.type == "AXIS" and first.text == "roll":
        return "write for example `roll A 8.89 steps/deg`"
    return FORMS.get(first.text)


def solid_in(words: Sequence[Token]) -> Token:
    """The word of a motion in a statement, or of a shape besides the sphere; else the first."""
    moves = (word for word in words if word.type == "MOVES")
    solids = (word for word in words if word.text in SOLIDS and word.type != "NAME")
    return next(moves, next(solids, words[0]))


def describe(terminals: set[str]) -> str:
    """The terminals that may stand at a place, in words: ``a value``, `` `margin` or a unit``."""
    rest = set(terminals)
    words: list[str] = []
    if rest >= _VALUE_TERMINALS:
        rest -= _VALUE_TERMINALS
        words.append("a value")
    elif "SCALE" in rest:
        # After a value nearly anything can follow; the message names only what must follow.
        if "RATIO" in rest:
            rest -= {"NAME"}
            words.append("a unit")
        rest -= _OPERATORS
    rest.discard("$END")
    words = (
        sorted(
            TERMINAL_WORDS[t]
            if " " in TERMINAL_WORDS.get(t, "")
            else f"`{TERMINAL_WORDS.get(t, t.lower())}`"
            for t in rest
        )
        + words
    )
    return "the end of the statement" if not words else _either(words)


def _either(words: Sequence[str]) -> str:
    """Alternatives as a list: ``a, b or c``."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def quoted(token: Token) -> str:
    """A token as a message shows it."""
    text = token.text if len(token.text) <= 30 else token.text[:27] + "..."
    return f"`{text}`"


def visible(text: str) -> str:
    """Characters as a message shows them; invisible ones are shown by their number."""
    if text.startswith("#"):
        return "character `#`"
    if len(text) > 1:
        return f"characters `{text[:20]}`"
    return f"character `{text}`" if text.isprintable() else f"character U+{ord(text):04X}"


def article(word: str) -> str:
    """The article of a word."""
    return "an" if word[0] in "aeiou" else "a"
