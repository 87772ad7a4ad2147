"""How the queries of a model are asked, and where the evidence for answers is written.

Evidence is a trace, a certificate, a strategy or a list of plans.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ntagen.cli.guard import doing
from ntagen.cli.models.outcomes import Outcome
from ntagen.cli.models.plan_lists import LINES, ListLimits, Written, write_document, write_lines
from ntagen.cli.models.queries import Asked
from ntagen.cli.signals import LimitReached
from ntagen.cli.terminal import echo
from ntagen.files import write_files
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model, Options


@dataclass(frozen=True, slots=True)
class Outputs:
    """Where evidence is written; ``None`` is nowhere."""

    trace: str | None
    certificate: Path | None
    strategy: str | None
    plans: str | None
    ranking: tuple[str, ...]
    limits: ListLimits = field(default_factory=ListLimits)
    written: set[str] = field(default_factory=set)
    """The options whose output has been written."""
    stops: dict[str, str] = field(default_factory=dict)
    """By query: ``time`` or ``memory`` if that limit ended a list of plans."""

    def missing(self) -> list[str]:
        """The options whose output was asked for and has not been written."""
        wanted = self.wanted().items()
        return [name for name, target in wanted if target and name not in self.written]

    def wanted(self) -> dict[str, str | Path | None]:
        """Where the output of each option is written."""
        return {
            "--trace": self.trace,
            "--certificate": self.certificate,
            "--strategy": self.strategy,
            "--plans": self.plans,
        }


class Questions:
    """How the queries of a model are asked; about a task's model more can be said.

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


def backed(outcome: Outcome, outputs: Outputs, questions: Questions, *, verify: bool) -> Outcome:
    """Writes the evidence of an answer; the outcome with notes about it, and the limit that came.

    Args:
        outcome: The answer to a query.
        outputs: What is wanted, and where.
        questions: How the model was asked.
        verify: Whether the notes begin with what checks have covered.
    """
    answer, query = outcome.answer, outcome.query
    if answer is None:
        return outcome
    notes = list(answer.verification if verify else ())
    stop: str | None = answer.stopped[0][1] if answer.stopped else None
    try:
        _write_evidence(answer, query, outputs, questions, notes)
    except LimitReached as reached:
        notes.append(f"{reached}; not written: {', '.join(outputs.missing())}")
        stop = reached.limit
    stop = outputs.stops.get(query.text, stop)
    return replace(outcome, notes=tuple(notes), stop=stop)


def _write_evidence(
    answer: Answer, query: Asked, outputs: Outputs, questions: Questions, notes: list[str]
) -> None:
    """Writes what was asked for, and adds a line for the user about each output to `notes`."""
    if outputs.trace:
        with doing("writing the trace"):
            if (trace := answer.trace_json()) is not None:
                notes += _write_trace(answer, query, outputs.trace, trace, questions.model)
                outputs.written.add("--trace")
    if outputs.certificate:
        with doing("writing the certificate"):
            if (states := answer.certificate_states) is not None:
                write_files({outputs.certificate: answer.certificate_pieces()})
                outputs.written.add("--certificate")
                notes.append(f"certificate of {states} states written to {outputs.certificate}")
    if outputs.strategy:
        with doing("the strategy was found; writing it"):
            if (pieces := _strategy_pieces(answer, query, outputs.strategy)) is not None:
                notes += _write_strategy(answer, outputs.strategy, pieces)
                outputs.written.add("--strategy")
    if outputs.plans and answer.plan_count is not None:
        with doing("writing the plans"):
            written = questions.write_plans(answer, outputs.plans, outputs)
            notes += written.notes
            outputs.written.add("--plans")
            if (stop := written.stop or answer.plans_stop) is not None:
                outputs.stops[query.text] = stop


def _write_trace(
    answer: Answer, query: Asked, target: str, as_json: str, model: Model
) -> list[str]:
    if target == "-":
        echo(f"{query.text} is {answer.verdict}:")
        for line in answer.trace_lines():
            echo(line)
        return []
    path = Path(target)
    write_files({path: _trace_file(answer, query, path.suffix, as_json, model)})
    return [f"trace written to {path}"]


def _trace_file(answer: Answer, query: Asked, suffix: str, as_json: str, model: Model) -> str:
    """The trace in the form that the end of the file's name asks for."""
    from ntagen.verifyta.trace_xml import trace_xml_text
    from ntagen.verifyta.xtr import xtr_text

    if suffix == ".json":
        return f"{as_json}\n"
    if suffix in (".xtr", ".xml"):
        return (xtr_text if suffix == ".xtr" else trace_xml_text)(model, answer) or ""
    text = "\n".join([f"{query.text} is {answer.verdict}", "", *answer.trace_lines()])
    return f"{text}\n"


def _strategy_pieces(answer: Answer, query: Asked, target: str) -> Iterable[str] | None:
    """The strategy in the form that `target` asks for, and no other: large ones take seconds."""
    from ntagen.checker import LearnedStrategy

    suffix = Path(target).suffix
    if isinstance(learned := answer.strategy, LearnedStrategy):
        defines = None if query.form is None else query.form.defines
        return [learned.file_text(suffix, defines or "strategy")]
    if answer.is_shield:
        return _shield_pieces(answer, query, suffix)
    if suffix == ".c":
        controller = answer.controller_c()
        return None if controller is None else [controller]
    pieces = answer.strategy_pieces("json" if suffix == ".json" else "text")
    if (first := next(pieces, None)) is None:
        return None
    if target == "-":
        return chain([first], pieces)
    if suffix == ".json":
        return chain([first], pieces, ["\n"])
    return chain([f"{query.text}\n\n", first], pieces)


def _shield_pieces(answer: Answer, query: Asked, suffix: str) -> Iterable[str]:
    """A shield as code or, in every other file, as JSON."""
    if suffix in (".c", ".py"):
        name = (query.form and query.form.defines) or "shield"
        return [answer.shield_code("c" if suffix == ".c" else "python", name)]
    return chain(answer.strategy_pieces("json"), ["\n"])


def _write_strategy(answer: Answer, target: str, pieces: Iterable[str]) -> list[str]:
    if target == "-":
        for piece in pieces:
            echo(piece, nl=False)
        return []
    write_files({Path(target): pieces})
    what = "strategy" if answer.verdict == "satisfied" else "counter-strategy"
    if Path(target).suffix in (".c", ".py"):
        what = "controller"
    return [f"{what} written to {target}"]
