"""What a file says about the answers to its queries, and whether an answer is as it says.

UPPAAL writes ``<expect>`` or the last ``<result>`` beside a query, and ``.q`` files have comments
such as ``// EXPECT:T``: the engine reads these. A line of a comment that is only a verdict, such as
``// false`` or ``expected: yes``, counts if the file has none of them for the query.
"""

from __future__ import annotations

import re
from typing import Final

from ntagen.checker.queries import Query

Expected = str | float
"""A verdict, or the value of ``sup`` or ``inf``. Besides the verdicts of answers there are ``maybe
satisfied`` and ``maybe not satisfied``, which allow the answer that they lean to."""

_WORDS: Final[dict[str, str]] = {
    "true": "satisfied",
    "yes": "satisfied",
    "satisfied": "satisfied",
    "false": "not satisfied",
    "no": "not satisfied",
    "not satisfied": "not satisfied",
    "maybe": "maybe",
    "error": "error",
}

_LINE: Final = re.compile(
    rf"(?:(?:expect(?:ed)?|result)\s*[:=]?\s*)?({'|'.join(_WORDS)})\s*[.!]?", re.IGNORECASE
)

_ALLOWED: Final[dict[str, tuple[str, ...]]] = {
    "maybe satisfied": ("maybe", "satisfied"),
    "maybe not satisfied": ("maybe", "not satisfied"),
    "error": ("error", "refused"),
}
"""The verdicts that are as expected, where they are not just the expected one."""


def expected_of(query: Query) -> Expected | None:
    """What the file says about the answer to one of its queries; ``None`` if nothing."""
    if query.expect is not None:
        return query.expect
    said = [found[1].lower() for line in _lines(query) if (found := _LINE.fullmatch(line))]
    return _WORDS[said[-1]] if said else None


def remark_of(query: Query) -> tuple[str, ...]:
    """The lines of a query's comment without those that only say what is expected."""
    return tuple(line for line in _lines(query) if line and not _LINE.fullmatch(line))


def is_as_expected(expected: Expected, verdict: str, value: object = None) -> bool | None:
    """Whether an answer is as expected; ``None`` if a limit came before an answer.

    Args:
        expected: What is expected.
        verdict: The verdict of the answer; ``refused`` if there is none.
        value: The value of ``sup`` or ``inf``.
    """
    if verdict == "unknown":
        return None
    if isinstance(expected, str):
        return verdict in _ALLOWED.get(expected, (expected,))
    return isinstance(value, int | float) and float(value) == expected


def _lines(query: Query) -> list[str]:
    return [line.strip() for line in query.comment.strip().splitlines()]
