"""The queries that a command answers: those of the command line, of a file, or of the model."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING

from ntagen.errors import InputError
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Expected, Model, QueryForm
    from ntagen.checker.facts import Query


@dataclass(frozen=True, slots=True)
class Asked:
    """A query to be answered."""

    name: str | None
    text: str
    form: QueryForm | None
    """What it asks for; ``None`` if the text is no query."""

    folder: Path | None = None
    """The folder of files that the query names; ``None`` is that of the model."""

    remark: tuple[str, ...] = ()
    """The lines of its comment, without its name and without what is expected."""

    options: Mapping[str, str] = field(default_factory=dict)
    """The options that the file gives for the query."""

    expected: Expected | None = None
    """What the file says about the answer."""

    place: tuple[str, int, int] | None = None
    """File, line and column, from 1, if it stands in a file."""


def queries_of(model: Model, asked: Sequence[str], file: Path | None) -> list[Asked]:
    """The queries to answer: those asked for, else those of the file, else those of the model."""
    if file is not None and file.suffix.lower() in (".xml", ".xta", ".nsl"):
        raise InputError(
            f"{file} is a model, not a list of queries (.q); check one model at a time"
        )
    known = [_asked(query) for query in model.queries]
    from_file = [_asked(one, file.parent) for one in model.read_queries(file)] if file else []
    if file and not from_file:
        raise InputError(f"{file} has no queries")
    if asked:
        named = {query.name: query for query in [*known, *from_file] if query.name}
        return [_find(text, named) for text in asked]
    if not (from_file or known):
        raise InputError("the model has no queries\nhint: give one with --query or --queries")
    return from_file or known


def with_strategies(
    model: Model, asked: Sequence[Asked], known: Collection[str] = ()
) -> list[Asked]:
    """Queries, each after the query of the model that defines the strategy that it is asked under.

    A strategy that is known, or defined by one of the queries before, or nowhere, adds none.
    """
    definitions = {
        query.form.defines: query
        for query in map(_asked, model.queries)
        if query.form and query.form.defines not in (None, *known)
    }
    complete: list[Asked] = []
    added: list[Asked] = []

    def add(query: Asked) -> None:
        defined = {one.form.defines for one in complete if one.form}
        uses = query.form and query.form.uses
        if uses and uses not in defined and uses in definitions:
            added.append(definitions.pop(uses))
            add(added[-1])
        complete.append(query)

    for query in asked:
        if query not in added:
            add(query)
    return complete


def is_used_by(query: Asked, later: Sequence[Asked]) -> bool:
    """Whether the strategy that a query defines is used by those after it."""
    name = query.form and query.form.defines
    return name is not None and any(other.form and other.form.uses == name for other in later)


def _asked(query: Query, folder: Path | None = None) -> Asked:
    """A query of a file, named by the first line of its comment or by its strategy."""
    from ntagen.checker import expected_of, form_of, remark_of

    remark = remark_of(query)
    form = form_of(query.text)
    name = form.defines if form else None
    if remark and re.fullmatch(r"[A-Za-z_]\w*", remark[0]):
        name, remark = remark[0], remark[1:]
    place = (query.path, query.line, query.column) if query.line else None
    expected = expected_of(query)
    return Asked(name, query.text, form, folder, remark, query.options, expected, place)


def _find(text: str, named: dict[str, Asked]) -> Asked:
    """The query with this name, or the text itself as a query."""
    from ntagen.checker import form_of

    stripped = text.strip()
    if stripped in named:
        return named[stripped]
    if re.fullmatch(r"[A-Za-z_]\w*", stripped):
        names = ", ".join(sorted(named)) or "none"
        raise InputError(
            f"there is no query with the name {stripped}\nhint: queries with a name: {names}"
        )
    return Asked(None, stripped, form_of(stripped))
