"""Whether there is a blank between two tokens of a model on a line.

It follows from the kinds of both. Where it depends on what they mean, as in ``id_t &x`` and
``a & b``, the author's choice stays.
"""

from __future__ import annotations

from typing import Final

from ntagen.values import dataclass
from ntagen.xta.tokens import Token
from ntagen.xta.words import MODEL_WORDS

_VALUES: Final = {"true", "false", "deadlock"}
_LIKE_FUNCTIONS: Final = {"exit", "spawn", "numOf"}
_QUANTIFIERS: Final = {"forall", "exists", "sum"}
_PREFIXES: Final = {"-", "+", "!", "&", "++", "--"}
_STEPS: Final = {"++", "--"}
_TIGHT_BEFORE: Final = {";", ",", ")", "]", ".", "'"}
_TIGHT_BEHIND: Final = {"(", "[", "."}


@dataclass(frozen=True, slots=True)
class Neighbours:
    """Two tokens on a line.

    Attributes:
        before: The first.
        token: The second.
        written: What stands between them.
        earlier: The text of the token before both, comments aside; empty if there is none.
        is_last: Whether a label ends behind the second.
        is_block: Whether the innermost bracket has statements in it.
    """

    before: Token
    token: Token
    written: str
    earlier: str
    is_last: bool
    is_block: bool


def between(two: Neighbours) -> str:
    """The blanks between both."""
    before, token = two.before, two.token
    as_written = " " if two.written else ""
    if token.kind == "comment":
        # Comments behind lines stay below each other.
        return two.written if set(two.written) == {" "} else " "
    if "comment" in (before.kind, token.kind) or "unknown" in (before.kind, token.kind):
        return as_written
    if before.text == "{" or token.text == "}":
        is_empty = before.text == "{" and token.text == "}"
        return " " if two.is_block and not is_empty else as_written
    if token.text in _TIGHT_BEFORE or before.text in _TIGHT_BEHIND:
        return ""
    if token.text in ("(", "["):
        return _before_bracket(two, as_written)
    if "&" in (before.text, token.text) or "#" in (before.text, token.text):
        return as_written
    return "" if _is_tight(two) else " "


def _before_bracket(two: Neighbours, as_written: str) -> str:
    """The blanks before a parenthesis or a bracket."""
    before = two.before.text
    if before in _QUANTIFIERS or (before == ")" and two.token.text == "("):
        return as_written
    if _ends_value(two.before) or before in _LIKE_FUNCTIONS:
        return ""
    if two.token.text == "[" and two.before.kind == "word":
        # A range, such as `int[0, 3]`.
        return ""
    return "" if _is_prefix(two) else " "


def _is_tight(two: Neighbours) -> bool:
    """Whether there is no blank around an operator."""
    token, before = two.token.text, two.before
    if _is_prefix(two):
        # `- -x` has two operators.
        return not (token in _PREFIXES and token[0] == before.text[-1])
    if not _ends_value(before) and before.text != "}":
        return False
    # The direction of a synchronisation; `?` is part of a choice, too.
    return token in _STEPS or token == "!" or (token == "?" and two.is_last)


def _is_prefix(two: Neighbours) -> bool:
    """Whether the first of both is an operator before its only value."""
    if two.before.text not in _PREFIXES:
        return False
    return not _is_value(two.earlier)


def _ends_value(token: Token) -> bool:
    """Whether a value may end with a token."""
    return token.kind in ("number", "string") or _is_value(token.text)


def _is_value(text: str) -> bool:
    if text in (")", "]", "'"):
        return True
    is_word = text[:1].isalnum() or text[:1] in ("_", '"')
    return is_word and (text in _VALUES or text not in MODEL_WORDS)
