"""What may be written at a place of a model or of queries.

What was already typed of the word is left out of account: editors choose by it themselves.
"""

from __future__ import annotations

import re
from collections import deque
from html import unescape
from typing import Final, Literal

from ntagen.checker.names import Names
from ntagen.checker.survey import Symbol, SymbolKind
from ntagen.values import dataclass
from ntagen.xta import FUNCTIONS, MODEL_WORDS, QUERY_WORDS, tokenise

Language = Literal["model", "declarations", "label", "queries"]
"""A whole textual model, a part of one in XML that declares something, an expression, a query."""

_CHAIN: Final = re.compile(
    r"(?<![\w.\])])((?:[A-Za-z_]\w*(?:\[[^\[\]]*\]|\([^()]*\))*\s*\.\s*)+)\w*\Z"
)
_BRACKETS: Final = re.compile(r"\[[^\[\]]*\]|\([^()]*\)")
_WORD: Final = re.compile(r"\w*\Z")
_DECLARES: Final = re.compile(
    r"\b(?:int(?:\s*\[[^\[\]]*\])?|bool|clock|chan|double|string|void|process|state)\s+\Z"
)
_TAG: Final = re.compile(r"<(/?)([A-Za-z_][\w.-]*)((?:[^<>\"']|\"[^\"]*\"|'[^']*')*)>\s*\Z")
_KIND: Final = re.compile(r"""\bkind\s*=\s*["'](\w+)["']""")

_ELEMENTS: Final[dict[str, Language]] = {
    "declaration": "declarations",
    "system": "declarations",
    "instantiation": "declarations",
    "parameter": "declarations",
    "label": "label",
    "formula": "queries",
}
_LABELS: Final = {"select", "guard", "synchronisation", "assignment", "probability"} | {
    "invariant",
    "exponentialrate",
}

_IN_EXPRESSIONS: Final = frozenset(
    {"true", "false", "and", "or", "not", "imply", "xor", "forall", "exists", "sum", "int"}
)
_OF_PROCESSES: Final = frozenset(
    {"process", "state", "init", "trans", "guard", "sync", "assign", "commit", "probability"}
    | {"branchpoint", "location", "query", "select"}
)
_WORDS: Final[dict[Language, frozenset[str]]] = {
    "model": MODEL_WORDS,
    "declarations": MODEL_WORDS - _OF_PROCESSES,
    "label": _IN_EXPRESSIONS,
    "queries": QUERY_WORDS - {"system", "location"},
}


@dataclass(frozen=True, slots=True)
class Possible:
    """A word that may be written.

    Attributes:
        text: The word.
        kind: What it is.
        detail: Its declaration; empty for words of the language.
        comment: The comment of its declaration.
    """

    text: str
    kind: SymbolKind | Literal["keyword", "built-in"]
    detail: str = ""
    comment: str = ""


def possible(names: Names, file: int, text: str, offset: int, language: Language) -> list[Possible]:
    """The words that may be written at a place, names first.

    Args:
        names: The names of the model.
        file: Which text it is.
        text: The text; of XML only what is in the element around the place.
        offset: The place, as the survey counts it.
        language: What the text is.
    """
    if _is_in_comment(text):
        return []
    chain = _CHAIN.search(text)
    if chain is not None:
        parts = re.sub(r"\s", "", _BRACKETS.sub("", chain[1])).rstrip(".").split(".")
        return [_named(one) for one in names.members(file, offset, parts)]
    typed = _WORD.search(text)
    before = text[: typed.start()] if typed else text
    if (typed and typed[0][:1].isdigit()) or before.endswith(".") or _DECLARES.search(before):
        return []
    usable = list(names.usable(file, offset).values())
    own = [_named(one) for one in reversed(usable) if one.at is not None]
    known = [_named(one) for one in usable if one.at is None]
    words = [Possible(one, "keyword") for one in sorted(_WORDS[language])]
    functions = [Possible(one, "built-in") for one in sorted(FUNCTIONS)]
    return [*own, *words, *functions, *known]


def part_of_xml(text: str, offset: int) -> tuple[str, Language] | None:
    """What stands before a place in the part of a model in XML around it.

    Returns:
        The text without the escapes of XML, and its language; ``None`` if the place is in none.
    """
    before = text[:offset]
    verbatim = before.rfind("<![CDATA[")
    if verbatim > before.rfind("]]>"):
        element, inside = before[:verbatim], before[verbatim + len("<![CDATA[") :]
    else:
        end = before.rfind(">")
        if before.rfind("<") > end or end < 0:
            return None
        element, inside = before[: end + 1], unescape(before[end + 1 :])
    tag = _TAG.search(element[max(0, len(element) - 500) :])
    if tag is None or tag[1] or tag[3].endswith("/"):
        return None
    language = _ELEMENTS.get(tag[2])
    if tag[2] == "label":
        kind = _KIND.search(tag[3])
        language = "label" if kind is not None and kind[1] in _LABELS else None
    return None if language is None else (inside, language)


def _named(symbol: Symbol) -> Possible:
    return Possible(symbol.name, symbol.kind, symbol.detail, symbol.comment)


def _is_in_comment(text: str) -> bool:
    """Whether a text ends inside a comment or a text in quotes."""
    tokens = deque(tokenise(text), maxlen=1)
    if not tokens:
        return False
    last = tokens[0]
    if last.text.startswith("//"):
        return "\n" not in text[last.end :]
    if last.text.startswith("/*"):
        return len(last.text) < len("/**/") or not last.text.endswith("*/")
    return text.rpartition("\n")[2].count('"') % 2 == 1
