"""How `ntagen check` asks the queries of a model; about a task's model more can be said."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ntagen.cli.models.outcomes import Outcome
from ntagen.cli.models.plan_lists import LINES, Written, write_document, write_lines

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model, Options
    from ntagen.cli.models.outputs import Outputs
    from ntagen.cli.models.queries import Asked


class Questions:
    """The queries of a model.

    Args:
        model: The model.
    """

    ranks_plans = False
    """Whether lists of plans are ranked, and certified."""

    def __init__(self, model: Model) -> None:
        self.model = model

    def options(self, query: Asked, options: Options) -> dict[str, Any]:
        """Options that a query needs besides those that are given."""
        return {}

    def answer(self, query: Asked, options: Options) -> Answer:
        """The answer to a query.

        Raises:
            InputError: The query is wrong.
        """
        return self.model.answer(query.text, options)

    def write_plans(self, answer: Answer, target: str, outputs: Outputs) -> Written:
        """Writes the plans of an answer."""
        if Path(target).suffix == LINES:
            return write_lines(answer, Path(target), outputs.limits)
        return write_document(answer, target, outputs.limits)

    def completed(self, outcome: Outcome, outputs: Outputs) -> Outcome:
        """An outcome whose evidence is written, with what else is to be said of it."""
        return outcome
