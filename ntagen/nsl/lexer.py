"""The tokens of a text: lark cuts it, and what is a word or a name is told by the place.

lark is imported when the first text is read, not before.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, cast

from ntagen.nsl.source import Source, Span
from ntagen.nsl.tokens import (
    ALLOWED,
    KEYWORDS,
    MAX_STRAY,
    MOTION_WORDS,
    MOVES_WORDS,
    PHRASES,
    RESERVED,
    SOLID_WORDS,
    SOLIDS,
    STRAY,
    TISSUE_BOUNDS,
    BlockKind,
    Comment,
    Token,
)
from ntagen.parameters import BY_WORDS


def tokenise(source: Source, kind: BlockKind | None = None) -> list[Token | Comment]:
    """All tokens and comments of a source; with the white space they are the whole text.

    Args:
        source: The text.
        kind: The braces in which the text stands, if they are some of `PHRASES`.

    After `MAX_STRAY` tokens that are not part of the language, the rest of the text is left out.
    """
    # lark takes a third of the time in which a command starts, and few read a text.
    from ntagen.nsl.grammar import grammar

    found: list[Token | Comment] = []
    stray_count = 0
    for token in grammar().lex(source.text):
        start, line = cast(int, token.start_pos), cast(int, token.line)
        span = Span(source, start, start + len(token))
        if token.type in ("LINE_COMMENT", "BLOCK_COMMENT"):
            found.append(Comment(token.rstrip(), span, line))
            continue
        found.append(Token(token.type, str(token), span, line))
        stray_count += token.type in STRAY
        if stray_count > MAX_STRAY:
            break
    return list(_joined(_named(found), kind if kind in PHRASES else None))


def _named(items: Sequence[Token | Comment]) -> list[Token | Comment]:
    """The items, with the words of later statements as names wherever they are none of these.

    The words of later shapes are words only in a region, from the shape's word on, which is the
    first thing behind the region's name; those of a motion from `moves` on; and those of waits,
    gates and spins only in the braces of `motion`. All of them not in parentheses, and not where a
    value must begin. The words of bounds, which begin statements elsewhere or are names, are bounds
    in the statement of the tissue.
    """
    named: list[Token | Comment] = []
    words = _Words()
    for item in items:
        if isinstance(item, Token):
            item = words.named(item)
        named.append(item)
    return named


class _Words:
    """Knows which words are words of a statement at a place, going from token to token."""

    def __init__(self) -> None:
        self._awaited = ""
        self._depth = 0
        self._is_region = False
        self._is_solid = False
        self._is_moving = False
        self._is_tissue = False
        self._motion = ""
        self._expects_value = False

    def named(self, item: Token) -> Token:
        """The next token, perhaps as a name."""
        self._depth += {"LPAR": 1, "LSQB": 1, "RPAR": -1, "RSQB": -1}.get(item.type, 0)
        self._enter(item)
        is_free = self._depth == 0 and not self._expects_value
        if item.text == "moves" and self._is_region and is_free and not self._awaited:
            self._is_solid, self._is_moving = False, True
        is_word = is_free and (
            (self._is_solid and item.text in SOLID_WORDS)
            or (self._is_moving and item.text in MOVES_WORDS)
            or (self._motion == "in" and item.text in MOTION_WORDS)
        )
        if self._is_tissue and self._depth == 0 and item.text in TISSUE_BOUNDS:
            item = Token("TISSUE_PART", item.text, item.span, item.line)
        elif item.text in _LATER_WORDS and not is_word:
            item = Token("NAME", item.text, item.span, item.line)
        # In a gate, `phase` is followed by another word.
        is_gate = self._motion == "in" and item.type == "PHASE"
        self._expects_value = item.type in _BEFORE_VALUE and not is_gate
        return item

    def _enter(self, item: Token) -> None:
        """Notes where regions, shapes, the tissue and the braces of `motion` begin and end."""
        if item.text == "tissue":
            self._is_tissue, self._depth = True, 0
        elif item.type in ("BRACE", "QUERY") or item.text in _NO_BOUNDS:
            self._is_tissue = False
        if item.type == "REGION_KIND":
            self._awaited, self._depth = "name", 0
            self._is_region, self._is_solid, self._is_moving = True, False, False
        elif item.type == "BRACE" or item.text in _BEGINNINGS:
            self._awaited = ""
            self._is_region = self._is_solid = self._is_moving = False
            if item.type == "BRACE":
                self._motion = "in" if self._motion == "before" and item.text == "{" else ""
                self._depth = 0
            elif item.type == "MOTION":
                self._motion = "before"
        elif self._awaited == "name":
            self._awaited = "shape"
        elif self._awaited == "shape" and self._depth == 0 and item.type != "RSQB":
            self._awaited, self._is_solid = "", item.text in SOLIDS


_NO_BOUNDS: Final = KEYWORDS.difference(TISSUE_BOUNDS)
_BEGINNINGS: Final = (RESERVED & KEYWORDS) - {"radius"}
_LATER_WORDS: Final = SOLID_WORDS | MOVES_WORDS | MOTION_WORDS
_BEFORE_VALUE: Final = frozenset(
    word.upper() for word in (SOLID_WORDS | MOVES_WORDS) - {"moves"}
) | {"SIGN", "SCALE", "RADIUS", "STEP", "BY", "MOST", "LEAST", "WAIT", "SPIN", "BETWEEN", "AND"}


def _joined(items: Sequence[Token | Comment], block: BlockKind | None) -> Iterator[Token | Comment]:
    """The items, with the words that begin a statement in `PHRASES` joined to one token."""
    depth = 0 if block is None else 1
    phrase: Token | None = None
    expects_value = False
    skipped = 0
    for index, item in enumerate(items):
        if skipped > 0:
            skipped -= 1
        elif not isinstance(item, Token) or block is None or depth == 0:
            if isinstance(item, Token):
                block, depth = _head(item, block)
            yield item
        elif item.type == "BRACE":
            depth += 1 if item.text == "{" else -1
            block = block if depth > 0 else None
            phrase, expects_value = None, False
            yield item
        else:
            # Where a value must come, a name stands, whatever it is.
            count = 0 if expects_value else _phrase_at(items, index, block)
            expects_value = count > 0 or item.type in _BEFORE_VALUES
            if count > 0:
                last = items[index + count - 1].span
                text = " ".join(one.text for one in items[index : index + count])
                phrase = Token(PHRASES[block], text, item.span.to(last), item.line)
                skipped = count - 1
                yield phrase
            else:
                yield _as_choice(item, phrase)


_BEFORE_VALUES: Final = frozenset({"COMMA", "SIGN", "SCALE", "LPAR"})


def _head(token: Token, block: BlockKind | None) -> tuple[BlockKind | None, int]:
    """The block and its depth after a token that is not in the braces of `PHRASES`."""
    if token.text in PHRASES:
        return cast(BlockKind, token.text), 0
    if block is not None and token.text == "{":
        return block, 1
    return (block if token.type in ("NAME", "STRING") else None), 0


def _as_choice(token: Token, phrase: Token | None) -> Token:
    """A token as a name, if it is one of the words that the setting before it can have."""
    parameter = BY_WORDS.get(phrase.text) if phrase is not None else None
    if parameter is None or token.text not in parameter.choices:
        return token
    return Token("NAME", token.text, token.span, token.line)


def _phrase_at(items: Sequence[Token | Comment], index: int, block: BlockKind) -> int:
    """The number of items from an index that are the words of a statement of a block; else 0."""
    longest = 0
    for phrase in ALLOWED[block]:
        words = phrase.split()
        found = [item.text for item in items[index : index + len(words)]]
        if found == words and len(words) > longest:
            longest = len(words)
    return longest
