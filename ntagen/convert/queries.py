"""Queries between the files of UPPAAL: within XML, and in ``.q`` files beside other formats."""

from __future__ import annotations

from typing import Final

from ntagen.build import Model, Outcome, Query, outcome_of
from ntagen.checker import Expected, expected_of, remark_of
from ntagen.checker.queries import Query as FileQuery
from ntagen.errors import InputError

MARK: Final = "// Written by ntagen convert.\n"
"""The last line of a ``.q`` file that may be replaced."""

_WORDS: Final = {"success": "T", "failure": "F", "maybe_true": "MT", "maybe_false": "MF"}


def written_queries(queries: list[Query]) -> str:
    """A ``.q`` file of queries, with comments and what is expected; headings become comments."""
    blocks = []
    for query in queries:
        lines = [f"// {line}".rstrip() for line in query.comment.strip().splitlines()]
        formula = " ".join(query.formula.split())
        if formula and (expected := _expectation(query.expect)):
            lines.append(f"// EXPECT:{expected}")
        if formula:
            lines.append(formula)
        if lines:
            blocks.append("\n".join(lines))
    return "\n\n".join([*blocks, MARK])


def _expectation(outcome: Outcome | None) -> str:
    if outcome is None:
        return ""
    if outcome.type == "quantity" and outcome.value:
        return outcome.value
    return _WORDS.get(outcome.outcome, "E" if outcome.outcome == "error" else "")


def add_queries(model: Model, queries: tuple[FileQuery, ...]) -> None:
    """Adds queries of a ``.q`` file, or of an XTA text, to a model; those that it has stay away."""
    known = {" ".join(one.formula.split()) for one in model.queries}
    for one in queries:
        if " ".join(one.text.split()) not in known:
            model.queries.append(
                Query(one.text, "\n".join(remark_of(one)), _outcome(expected_of(one)))
            )


def _outcome(expected: Expected | None) -> Outcome | None:
    try:
        return None if expected is None else outcome_of(expected)
    except InputError:
        return None  # for `maybe`, UPPAAL's files have no word
