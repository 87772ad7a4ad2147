"""What `ntagen check` does about a task: its plans are certified and ranked, its tissue answers."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ntagen.cli.models.evidence import Outputs, Questions
from ntagen.cli.models.outcomes import Outcome
from ntagen.cli.models.plan_lists import LINES, ListLimits, Written, counting, stopped, write_pages
from ntagen.cli.terminal import echo
from ntagen.files import write_files

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model, Options
    from ntagen.cli.models.queries import Asked
    from ntagen.nsl import Task
    from ntagen.plan.against_tissue import Defence
    from ntagen.plan.rank import Candidate
    from ntagen.plan.synthesise import Margins
    from ntagen.scene import Scene

BEST_SHOWN: Final = 3
"""Plans that the table shows."""


class TaskQuestions(Questions):
    """The queries of the model of a task.

    Args:
        model: The model.
        task: The task from which it was made.
    """

    ranks_plans = True

    def __init__(self, model: Model, task: Task) -> None:
        super().__init__(model)
        self._task = task
        self._found: Defence | None = None

    def options(self, query: Asked, options: Options) -> dict[str, Any]:
        """A guide for the task's game; if the tissue answers, no list of plans."""
        if not _seeks_target(query):
            return {}
        from ntagen.plan.synthesise import GUIDE

        guided = {"guide": options.guide or GUIDE}
        return guided | {"plans": "none"} if self._is_defence(query) else guided

    def answer(self, query: Asked, options: Options) -> Answer:
        """The answer to a query, of a tissue that answers by a strategy against it.

        If plans are all that is wanted, the model is that for plans alone, which has the same ones
        in the same order: several times fewer states are explored.
        """
        self._found = None
        if self._is_defence(query):
            self._found = self._defended(options)
            # A strategy that is written as it is, is one of the compiled model.
            return super().answer(query, options) if options.strategy else _answer_of(self._found)
        is_more_wanted = options.strategy or options.trace or options.verify or options.certificate
        if options.plans == "none" or is_more_wanted or not _seeks_target(query):
            return super().answer(query, options)
        from ntagen import checker
        from ntagen.plan.synthesise import STRATEGY_QUERY
        from ntagen.render import render

        model = checker.load(render(self._task.scene, only_plans=True))
        model.overflow = self.model.overflow
        return model.answer(STRATEGY_QUERY, options)

    def write_plans(self, answer: Answer, target: str, outputs: Outputs) -> Written:
        """Writes the plans with their certificates; in a document and in a list they are ranked."""
        if Path(target).suffix == LINES:
            return write_certified(answer, Path(target), outputs.limits, self._task)
        return self._write_ranked(answer, target, outputs)

    def completed(self, outcome: Outcome, outputs: Outputs) -> Outcome:
        """The outcome with what holds against a tissue that answers."""
        found = self._found
        if found is None or not self._is_defence(outcome.query):
            return outcome
        outputs.written.add("--plans")
        notes = (*outcome.notes, *_defence_notes(found, outputs.plans))
        return replace(outcome, answer=_answer_of(found), notes=notes)

    def _is_defence(self, query: Asked) -> bool:
        """Whether a query asks for a strategy against a tissue that answers."""
        return self._task.scene.tissue.is_adversarial and _seeks_target(query)

    def _defended(self, options: Options) -> Defence:
        from ntagen.plan.against_tissue import defend

        return defend(
            self._task.scene,
            timeout_s=options.timeout_s,
            memory_bytes=options.memory_bytes,
            verify=options.verify,
            options=options,
        )

    def _write_ranked(self, answer: Answer, target: str, outputs: Outputs) -> Written:
        from ntagen.drive.configure import configure
        from ntagen.plan.document import document
        from ntagen.plan.rank import rank
        from ntagen.plan.wording import counted, judged, ranked_by, required

        scene = self._task.scene
        settings = configure(self._task.given, scene).settings
        criteria, margins = outputs.ranking or settings.ranking, settings.margins
        candidates, stop = _certified_within(answer, scene, outputs.limits)
        ranked = rank(candidates, criteria)
        holding = [candidate for candidate in ranked if margins.allow(candidate.certificate)]
        is_complete = stop is None and not answer.has_more_plans
        notes = [
            counted(len(ranked), len(holding), is_complete=is_complete),
            *stopped(len(ranked), stop),
            required(margins),
        ]
        if target == "-":
            shown = list(enumerate(ranked, start=1))
        else:
            plans = document(scene, ranked, criteria, margins)
            pieces = json.JSONEncoder(indent=1).iterencode(plans)
            write_files({Path(target): chain(pieces, ["\n"])})
            notes.insert(0, f"plans written to {target}")
            best = holding[:BEST_SHOWN]
            shown = [one for one in enumerate(ranked, start=1) if one[1] in best]
        if shown:
            notes.append(f"{ranked_by(criteria)}:")
        for place, candidate in shown:
            verdict = judged(candidate.certificate, margins)
            notes.append(f"  {place:>3}. {verdict}  {candidate.plan}")
        return Written(tuple(notes), stop)


def _seeks_target(query: Asked) -> bool:
    """Whether a query is the paper's question for a strategy that reaches the target."""
    from ntagen.rules import PAPER_QUERIES

    text = query.text.partition("=")[2] if query.text.startswith("strategy") else query.text
    return text.strip() == PAPER_QUERIES["ReachFinalTR"]


def _answer_of(found: Defence) -> Answer:
    """The answer of the engine, with the verdict and the counts of all plays."""
    answer = copy.copy(found.answer)
    answer.verdict, answer.stop = found.verdict, found.stop
    answer.seconds, answer.explored, answer.stored = found.seconds, found.explored, found.stored
    return answer


def _defence_notes(found: Defence, target: str | None) -> list[str]:
    """What holds for the strategy on all its branches; writes it as a tree if that is wanted."""
    from ntagen.drive.trees import document_of

    notes = list(found.guarantee())
    if not found.holds or found.tree is None:
        return notes
    if target is not None:
        text = json.dumps(document_of(found))
        if target == "-":
            echo(text)
        else:
            write_files({Path(target): text + "\n"})
            notes.append(f"strategy with {found.tree.leaves} branches written to {target}")
    return notes


def write_certified(answer: Answer, path: Path, limits: ListLimits, task: Task) -> Written:
    """Writes one certified plan on each line, in the order of the model.

    Raises:
        InputError: The file cannot be written any further; see `write_pages`.
    """
    from ntagen.drive.configure import configure
    from ntagen.plan.wording import counted, required

    margins = configure(task.given, task.scene).settings.margins
    pages = _certified_lines(answer, task.scene, margins)
    count, holding, stop = write_pages(path, pages, limits)
    is_complete = stop is None and not answer.has_more_plans
    notes = (
        f"plans written to {path}, in the order of the model",
        counted(count, holding, is_complete=is_complete),
        *stopped(count, stop),
        required(margins),
    )
    return Written(notes, stop)


def _certified_within(
    answer: Answer, scene: Scene, limits: ListLimits
) -> tuple[list[Candidate], str | None]:
    """The plans with their certificates, and which limit came before the last one, if any."""
    candidates: list[Candidate] = []
    with counting(limits.quiet) as show:
        for page in _certified(answer, scene):
            if (stop := limits.stop(len(candidates) + len(page))) is not None:
                return candidates, stop
            candidates += page
            show(len(candidates))
    return candidates, None


def _certified(answer: Answer, scene: Scene) -> Iterator[list[Candidate]]:
    from ntagen.plan.extract import pages_of
    from ntagen.plan.rank import in_pages

    return in_pages(chain.from_iterable(pages_of(answer, scene)), scene)


def _certified_lines(
    answer: Answer, scene: Scene, margins: Margins
) -> Iterator[tuple[list[str], int]]:
    """Pages of lines, each with the number of plans in it that hold."""
    from ntagen.plan.document import plan_line

    for page in _certified(answer, scene):
        held = sum(margins.allow(candidate.certificate) for candidate in page)
        yield [plan_line(candidate, margins) for candidate in page], held
