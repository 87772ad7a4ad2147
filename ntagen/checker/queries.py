"""The queries of a file."""

from __future__ import annotations

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
    """

    text: str
    comment: str
    expect: str | float | None = None


def queries_from(entries: list[dict[str, Any]]) -> tuple[Query, ...]:
    """The values of the engine's list of queries."""
    return tuple(Query(**entry) for entry in entries)
