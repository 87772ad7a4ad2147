"""The pictures of `ntagen plot` that show models: traces of queries."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.cli.asked import Asked, queries_of
from ntagen.cli.models import load_model, pointing_to_explanations
from ntagen.cli.progress import shown_progress
from ntagen.errors import InputError, LimitError, ModelError

if TYPE_CHECKING:
    from ntagen.checker import Model
    from ntagen.checker.picture.page import Svg
    from ntagen.checker.runs import Run

MODELS: Final = (".xml", ".xta", ".ta")
"""The endings of UPPAAL models."""

KINDS: Final = {
    "gantt": "the trace of a query as a chart, where each process is when",
    "sequence": "the trace, and what passes between the processes",
}
"""The pictures of a model, each with what it shows."""


def plot_model(
    source: Path, path: Path, kind: str, asked: str | None, include: Sequence[Path]
) -> None:
    """Writes a picture of a model.

    Raises:
        InputError: The model, the query or the name of the picture is wrong, or there is nothing
            to draw.
    """
    if path.suffix.lower() != ".svg":
        raise InputError(
            f"cannot draw {path}: the pictures of a model are SVG\n"
            "hint: choose a file name that ends in .svg"
        )
    with pointing_to_explanations(True):
        model = load_model(source, include).model
        query = _query(model, asked)
        run = _trace(model, query)
    _drawn(run, kind).save(path)


def _drawn(run: Run, kind: str) -> Svg:
    return run.gantt() if kind == "gantt" else run.sequence()


def _query(model: Model, asked: str | None) -> Asked:
    """The query that was asked for, or the only one of the model."""
    queries = queries_of(model, () if asked is None else (asked,), None)
    if len(queries) > 1:
        names = "\n".join(f"  {query.name or query.text}" for query in queries[:10])
        raise InputError(
            f"the model has {len(queries)} queries\nhint: choose one with --query:\n{names}"
        )
    return queries[0]


def _trace(model: Model, query: Asked) -> Run:
    """The trace of a query, with exact times."""
    with shown_progress(query.text, quiet=False) as report:
        answer = model.check(query.text, trace=True, progress=report)
    if answer.verdict == "error":
        raise ModelError(answer.message or "the model has a run-time error")
    if answer.verdict == "unknown":
        raise LimitError(f"the search was stopped by the {answer.limit_text}")
    run = answer.trace
    if run is not None:
        return run
    if answer.trace_json():
        why = (answer.trace_text() or "").rpartition("No exact times: ")[2].strip()
        raise InputError(f"the trace of {query.text} has no exact times: {why}")
    raise InputError(
        f"{query.text} is {answer.verdict}, and has no trace\n"
        "hint: E<> p that is satisfied and A[] p that is not have one"
    )
