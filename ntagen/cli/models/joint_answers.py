"""`ntagen check --set "joint on"`: statistical queries that are answered from the same runs."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ntagen.cli.models.queries import Asked
from ntagen.cli.progress import shown_progress
from ntagen.errors import InputError
from ntagen.verifyta.statistical import of_model

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model, Options


def joint_answers(
    model: Model, queries: Sequence[Asked], options: Options, given: Collection[str], *, quiet: bool
) -> dict[int, Answer | InputError]:
    """The answers to the statistical queries among these, by their places in the list.

    If one of them is wrong, none has an answer: each has the mistake instead.

    Args:
        model: The model.
        queries: All queries.
        options: How they are to be answered, unless the file says otherwise of a query.
        given: The options and settings on the command line, which win over those of the file.
        quiet: Whether no progress is shown.
    """
    places = [place for place, query in enumerate(queries) if _is_joint(query)]
    if not places:
        return {}
    with shown_progress(f"{len(places)} queries together", quiet=quiet) as report:
        options = replace(options, progress=report)
        asked = [
            (query.text, replace(options, **of_model(query.options, given)))
            for query in (queries[place] for place in places)
        ]
        try:
            answers = model.answer_jointly(asked)
        except InputError as error:
            return dict.fromkeys(places, error)
    return dict(zip(places, answers, strict=True))


def _is_joint(query: Asked) -> bool:
    form = query.form
    return form is not None and form.is_statistical and form.kind != "simulate"
