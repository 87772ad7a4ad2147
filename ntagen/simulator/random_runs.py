"""Random runs of ``simulate`` queries in blocks, so that they can be drawn while they come in."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from ntagen.checker import Model
from ntagen.checker.queries import form_of
from ntagen.errors import InputError, LimitError, ModelError

MOST_RUNS: Final = 100
"""A block has at most so many runs."""

_MOST_POINTS: Final = 400
"""More points of a run are thinned out: a picture has no more columns that can be told apart."""


def block(
    model: Model, query: str, seed: int, count: int, timeout_s: float | None
) -> dict[str, Any]:
    """Some random runs of a query; blocks with other seeds have other runs.

    Returns:
        ``expressions`` are the texts of what is shown, and each of ``runs`` has the points of
        each, pairs of a moment and a value.

    Raises:
        InputError: The query is wrong, or no ``simulate``; or a number is out of range.
        LimitError: The time was over before the first run.
        ModelError: The model fails in a run.
    """
    form = form_of(query)
    if form is None and query.strip():
        # It is no query at all; the engine says where it goes wrong.
        model.check(query, timeout_s=timeout_s)
    if form is None or form.kind != "simulate":
        raise InputError(
            f"{query.strip() or 'this'} shows no runs\n"
            "hint: ask simulate [<=100; 10] {expression, …}"
        )
    if not 1 <= count <= MOST_RUNS or seed < 0:
        raise InputError(f"a block has 1 to {MOST_RUNS} runs, and a seed of at least 0")
    answer = model.check(query, seed=seed, runs=count, timeout_s=timeout_s)
    if answer.verdict == "error":
        raise ModelError(answer.message or "the model has a run-time error")
    found = answer.trajectories
    if not found:
        if answer.verdict == "unknown":
            raise LimitError(f"the runs were stopped by the {answer.limit_text}")
        raise InputError("no run of this block shows what is asked for")
    return {
        "expressions": list(found[0].expressions),
        "runs": [[list(_thinned(points)) for points in one.points.values()] for one in found],
    }


def _thinned(points: list[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """At most about so many points as a picture shows: of each stretch the least and greatest."""
    if len(points) <= _MOST_POINTS:
        yield from points
        return
    size = -(-4 * len(points) // _MOST_POINTS)
    for start in range(0, len(points), size):
        piece = points[start : start + size]
        kept = {0, len(piece) - 1}
        kept |= {pick(range(len(piece)), key=lambda at: piece[at][1]) for pick in (min, max)}
        yield from (piece[at] for at in sorted(kept))
