"""Writes the evidence for an answer: traces, certificates, strategies, controllers and plans."""

from __future__ import annotations

import json
from dataclasses import field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.cli.asked import Asked
from ntagen.cli.plan_lists import (
    LINES,
    ListLimits,
    Written,
    certified_within,
    stopped,
    write_document,
    write_lines,
)
from ntagen.cli.terminal import echo
from ntagen.files import write_files
from ntagen.values import dataclass

if TYPE_CHECKING:
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
    controller: Path | None
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
        return self.strategy is not None or self.controller is not None

    def wanted(self) -> dict[str, str | Path | None]:
        """Where the output of each option is written."""
        return {
            "--trace": self.trace,
            "--certificate": self.certificate,
            "--strategy": self.strategy,
            "--controller": self.controller,
            "--plans": self.plans,
        }


def write_evidence(answer: Answer, query: Asked, outputs: Outputs, loaded: Loaded) -> list[str]:
    """Writes what was asked for; returns a line for the user about each output."""
    task = loaded.task
    notes: list[str] = []
    if outputs.trace and (trace := answer.trace_json()) is not None:
        outputs.written.add("--trace")
        notes += _write_trace(answer, query, outputs.trace, trace, loaded.model)
    certificate = answer.certificate_text() if outputs.certificate else None
    if outputs.certificate and certificate is not None:
        write_files({outputs.certificate: certificate})
        outputs.written.add("--certificate")
        states = certificate.count("\n") - 1
        notes.append(f"certificate of {states} states written to {outputs.certificate}")
    if outputs.strategy and (text := _strategy_text(answer, query, outputs.strategy)) is not None:
        outputs.written.add("--strategy")
        notes += _write_strategy(answer, outputs.strategy, text)
    controller = answer.controller_c() if outputs.controller else None
    if outputs.controller and controller is not None:
        write_files({outputs.controller: controller})
        outputs.written.add("--controller")
        notes.append(f"controller written to {outputs.controller}")
    if outputs.plans and answer.plan_count is not None:
        outputs.written.add("--plans")
        notes += _write_plans(answer, query, outputs, outputs.plans, task)
    return notes


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


def _strategy_text(answer: Answer, query: Asked, target: str) -> str | None:
    """The strategy in the form that `target` asks for, and no other: large ones take seconds."""
    is_json = Path(target).suffix == ".json"
    text = answer.strategy_json() if is_json else answer.strategy_text()
    if text is None or target == "-":
        return text
    return f"{text}\n" if is_json else f"{query.text}\n\n{text}"


def _write_strategy(answer: Answer, target: str, text: str) -> list[str]:
    if target == "-":
        echo(text, nl=False)
        return []
    write_files({Path(target): text})
    whose = "strategy" if answer.verdict == "satisfied" else "counter-strategy"
    return [f"{whose} written to {target}"]


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
