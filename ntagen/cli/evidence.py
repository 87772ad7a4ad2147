"""Writes the evidence for an answer: traces, certificates, strategies and plans."""

from __future__ import annotations

import json
from dataclasses import field, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.cli.asked import Asked
from ntagen.cli.guard import doing
from ntagen.cli.outcomes import Outcome
from ntagen.cli.plan_lists import (
    LINES,
    ListLimits,
    Written,
    certified_within,
    stopped,
    write_document,
    write_lines,
)
from ntagen.cli.signals import LimitReached
from ntagen.cli.terminal import echo
from ntagen.files import write_files
from ntagen.values import dataclass

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ntagen.checker import Answer, Model
    from ntagen.loading import Loaded
    from ntagen.nsl import Task

BEST_SHOWN: Final = 3
"""Plans that the table shows."""


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

    @property
    def wants_strategy(self) -> bool:
        """Whether a strategy is written in some form."""
        return self.strategy is not None

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


def backed(outcome: Outcome, outputs: Outputs, loaded: Loaded, *, verify: bool) -> Outcome:
    """Writes the evidence of an answer; the outcome with notes about it, and the limit that came.

    Args:
        outcome: The answer to a query.
        outputs: What is wanted, and where.
        loaded: The model.
        verify: Whether the notes begin with what checks have covered.
    """
    answer, query = outcome.answer, outcome.query
    if answer is None:
        return outcome
    notes = list(answer.verification if verify else ())
    stop: str | None = answer.stopped[0][1] if answer.stopped else None
    try:
        _write_evidence(answer, query, outputs, loaded, notes)
    except LimitReached as reached:
        notes.append(f"{reached}; not written: {', '.join(outputs.missing())}")
        stop = reached.limit
    stop = outputs.stops.get(query.text, stop)
    return replace(outcome, notes=tuple(notes), stop=stop)


def _write_evidence(
    answer: Answer, query: Asked, outputs: Outputs, loaded: Loaded, notes: list[str]
) -> None:
    """Writes what was asked for, and adds a line for the user about each output to `notes`."""
    task = loaded.task
    if outputs.trace:
        with doing("writing the trace"):
            if (trace := answer.trace_json()) is not None:
                notes += _write_trace(answer, query, outputs.trace, trace, loaded.model)
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
            notes += _write_plans(answer, query, outputs, outputs.plans, task)
            outputs.written.add("--plans")


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
    suffix = Path(target).suffix
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


def _write_strategy(answer: Answer, target: str, pieces: Iterable[str]) -> list[str]:
    if target == "-":
        for piece in pieces:
            echo(piece, nl=False)
        return []
    write_files({Path(target): pieces})
    what = "strategy" if answer.verdict == "satisfied" else "counter-strategy"
    if Path(target).suffix == ".c":
        what = "controller"
    return [f"{what} written to {target}"]


def _write_plans(
    answer: Answer, query: Asked, outputs: Outputs, target: str, task: Task | None
) -> list[str]:
    if Path(target).suffix == LINES:
        written = write_lines(answer, Path(target), outputs.limits, task)
    elif task is None:
        written = write_document(answer, target, outputs.limits)
    else:
        written = _write_ranked(answer, target, outputs, task)
    stop = written.stop or answer.plans_stop
    if stop is not None:
        outputs.stops[query.text] = stop
    return list(written.notes)


def _write_ranked(answer: Answer, target: str, outputs: Outputs, task: Task) -> Written:
    from ntagen.drive.configure import configure
    from ntagen.plan.document import document
    from ntagen.plan.rank import rank
    from ntagen.plan.wording import counted, judged, ranked_by, required

    scene, settings = task.scene, configure(task.given, task.scene).settings
    criteria, margins = outputs.ranking or settings.ranking, settings.margins
    candidates, stop = certified_within(answer, scene, outputs.limits)
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
