"""The queries of a file: what they ask for, and what the file says about their answers.

UPPAAL writes ``<expect>`` or the last ``<result>`` beside a query, and ``.q`` files have comments
such as ``// EXPECT:T``: the engine reads these. A line of a comment that is only a verdict, such as
``// false`` or ``expected: yes``, counts if the file has none of them for the query.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import field
from typing import Any, Final

import ntagen._checker as _checker
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Query:
    """A query of a file.

    Attributes:
        text: Its formula.
        comment: The comment of the query.
        expect: The verdict that the file states, the number that ``sup`` or ``inf`` should give, or
            ``None``.
        options: Options that the file gives for the query, such as ``--epsilon`` with ``0.01``;
            those of all queries are among them.
        path: The file that has the query.
        line: The line of the file in which the formula begins, from 1.
        column: Where it begins in this line, from 1.
    """

    text: str
    comment: str
    expect: str | float | None = None
    options: Mapping[str, str] = field(default_factory=dict, compare=False)
    path: str = field(default="", compare=False)
    line: int = field(default=0, compare=False)
    column: int = field(default=0, compare=False)

    def __str__(self) -> str:
        return self.text


def queries_from(entries: list[dict[str, Any]]) -> tuple[Query, ...]:
    """The values of the engine's list of queries."""
    return tuple(Query(**entry) for entry in entries)


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


_GAMES: Final = ("control", "control_t*", "E<> control")


@dataclass(frozen=True, slots=True)
class QueryForm:
    """What a query asks for, by its text alone, without a model.

    Attributes:
        kind: How its kind is written: ``E<>``, ``A[]``, ``E[]``, ``A<>``, ``-->``, ``sup``,
            ``inf``, ``bounds``, ``control``, ``control_t*``, ``E<> control``, ``saveStrategy``,
            ``loadStrategy``, ``Pr``, ``E``, ``simulate`` (statistical queries), ``minE``, ``maxE``,
            ``minPr``, ``maxPr`` (queries for the best strategy), or ``unsupported``.
        defines: The name of the strategy that it defines, or ``None``.
        uses: The name of the strategy that it is asked under, or that it saves, or ``None``.
        is_observed: Whether it is a game in which the controller sees observations only.
    """

    kind: str
    defines: str | None
    uses: str | None
    is_observed: bool

    @property
    def is_statistical(self) -> bool:
        """Whether random runs answer it."""
        return self.kind in ("Pr", "E", "simulate")

    @property
    def is_learned(self) -> bool:
        """Whether it asks for the best strategy, which is learned from random runs."""
        return self.kind in ("minE", "maxE", "minPr", "maxPr")

    @property
    def is_shield(self) -> bool:
        """Whether it asks for a shield, which samples show."""
        return self.kind == "acontrol"

    @property
    def is_game(self) -> bool:
        """Whether it asks who wins a game."""
        return self.kind in _GAMES


def form_of(query: str) -> QueryForm | None:
    """The form of a query; ``None`` if the text is no query."""
    form = _checker.form_of_query(query)
    return None if form is None else QueryForm(*form)
