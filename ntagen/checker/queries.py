"""The queries of a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

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
