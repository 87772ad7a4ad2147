"""Random runs that queries share (``joint on``), or that a cluster makes (``dask ADDRESS``)."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from ntagen.cli.models.queries import Asked
from ntagen.cli.progress import shown_progress
from ntagen.cli.terminal import say
from ntagen.errors import InputError

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model, Options
    from ntagen.cluster.runs import DaskRuns


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
    from ntagen.verifyta.options import of_model

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


def _by_this_machine(query: str, reason: str) -> str:
    return f"{query}: runs are made by this machine: {reason}"


def _is_joint(query: Asked) -> bool:
    form = query.form
    return form is not None and form.is_statistical and form.kind != "simulate"


class Spreading:
    """Spreads the runs of queries over a cluster, or makes all of them here.

    Args:
        address: The address of the scheduler; None without a cluster.
        queries: The queries that will be asked.
        options: How they will be asked.
        why_not: Why no runs can be made elsewhere, whatever the query; empty if they can.

    Raises:
        InputError: The cluster cannot be used.
    """

    def __init__(
        self, address: str | None, queries: Sequence[Asked], options: Options, why_not: str
    ) -> None:
        self._reasons: dict[str, str | None] = {}
        self._cluster: DaskRuns | None = None
        if address is None:
            return
        from ntagen.cluster.runs import DaskRuns, why_here

        for query in queries:
            if query.form is not None and query.form.is_statistical:
                self._reasons[query.text] = why_not or why_here(query.text, options)
        say(
            [
                _by_this_machine(text, reason)
                for text, reason in self._reasons.items()
                if reason is not None
            ]
        )
        if None in self._reasons.values():
            self._cluster = DaskRuns(address)
            click.get_current_context().call_on_close(self._cluster.close)
            if not self._cluster.has_workers:
                say([f"the Dask cluster at {address} has no workers yet, and is waited for"])

    @contextlib.contextmanager
    def source(self, model: Model, query: Asked, options: Options) -> Iterator[dict[str, Any]]:
        """Gives the options of `ntagen.checker.Options` by which runs come from the cluster."""
        if self._cluster is None or self._reasons.get(query.text, "other") is not None:
            yield {}
            return
        from ntagen.cluster.runs import why_here_under

        if (reason := why_here_under(model, query.text)) is not None:
            say([_by_this_machine(query.text, reason)])
            yield {}
            return
        with self._cluster.runs_of(model, query.text, options) as source:
            yield {"run_source": source}
