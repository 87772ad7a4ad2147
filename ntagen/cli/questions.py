"""How `ntagen check` asks a query: which model, which options of the engine, which limits."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ntagen.cli.against import answer_of, defended, is_adversarial
from ntagen.cli.asked import Asked
from ntagen.cli.plan_lists import LINES, ListLimits

if TYPE_CHECKING:
    from ntagen.checker import Answer, Options
    from ntagen.loading import Loaded
    from ntagen.nsl import Task
    from ntagen.plan.against_tissue import Defence


def most_plans(target: str | None) -> dict[str, int]:
    """Any number of plans, if they are written on lines: they take no memory."""
    is_free = target is not None and Path(target).suffix == LINES
    return {"max_plans": sys.maxsize} if is_free else {}


def list_limits(options: Options, *, quiet: bool) -> ListLimits:
    """The limits of a list of plans of a query that is asked now."""
    return ListLimits(options.timeout_s, options.memory_bytes, quiet=quiet)


def answer_to(
    loaded: Loaded,
    query: Asked,
    options: Options,
    overflow: Any,  # noqa: ANN401
) -> Answer:
    """The answer to a query.

    If an environment's plans are all that is wanted, the model is that for plans alone, which has
    the same ones in the same order: several times fewer states are explored.
    """
    task = loaded.task
    is_more_wanted = options.strategy or options.trace or options.verify or options.certificate
    if task is None or options.plans == "none" or is_more_wanted or not seeks_target(query):
        return loaded.model.answer(query.text, options)
    from ntagen import checker
    from ntagen.plan.synthesise import STRATEGY_QUERY
    from ntagen.render import render

    model = checker.load(render(task.scene, only_plans=True))
    model.overflow = overflow
    return model.answer(STRATEGY_QUERY, options)


def answered(
    loaded: Loaded,
    query: Asked,
    options: Options,
    overflow: Any,  # noqa: ANN401
) -> tuple[Answer, Defence | None]:
    """The answer to a query, and what it rests on if the tissue of an environment answers."""
    if loaded.task is None or not is_defence(loaded.task, query):
        return answer_to(loaded, query, options, overflow), None
    found = defended(loaded.task, options)
    # A strategy that is written as it is, is one of the compiled model.
    if options.strategy:
        return loaded.model.answer(query.text, options), found
    return answer_of(found), found


def seeks_target(query: Asked) -> bool:
    """Whether a query is the paper's question for a strategy that reaches the target."""
    from ntagen.rules import PAPER_QUERIES

    text = query.text.partition("=")[2] if query.text.startswith("strategy") else query.text
    return text.strip() == PAPER_QUERIES["ReachFinalTR"]


def is_defence(task: Task | None, query: Asked) -> bool:
    """Whether a query asks for a strategy against a tissue that answers."""
    return is_adversarial(task) and seeks_target(query)


def for_task(options: Options, task: Task | None, query: Asked) -> dict[str, Any]:
    """Options of an environment's game: a guide; if the tissue answers, no list of plans."""
    if task is None or not seeks_target(query):
        return {}
    from ntagen.plan.synthesise import GUIDE

    guided = {"guide": options.guide or GUIDE}
    return guided | {"plans": "none"} if is_defence(task, query) else guided
