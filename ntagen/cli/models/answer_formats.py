"""The answers of `ntagen check` for programs: JSON lines, GitHub, JUnit and SARIF.

JSON and GitHub print an answer as soon as it is
there; a JUnit or SARIF report is one document at the end.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ntagen.cli.models.answer_rows import Format, Human
from ntagen.cli.models.outcomes import Mistake, Outcome, fault_of, mistakes_in, summary
from ntagen.cli.terminal import echo, safe
from ntagen.version import VERSION

if TYPE_CHECKING:
    from ntagen.checker import Estimate


class JsonLines(Format):
    """A JSON object for each query, on one line."""

    def one(self, outcome: Outcome) -> None:
        """Prints the line of a query."""
        if outcome.answer is None:
            echo(outcome.refusal, err=True)
        # They are all there before the first is printed, so that no limit leaves half of a line.
        for piece in _line(outcome):
            echo(piece, nl=False)
        echo()


def _line(outcome: Outcome) -> list[str]:
    """The pieces of the JSON object that the command line promises.

    Runs that are shown may be long: each is written by itself, so that limits and Ctrl-C hold
    between two of them, and is in memory once.
    """
    text = json.dumps(_record(outcome))
    answer = outcome.answer
    if answer is None or not outcome.shows_runs:
        return [text]
    runs = list(answer.trajectories_json())
    separated = [piece for run in runs for piece in (", ", run)]
    pieces = [text[:-1], ', "trajectories": [', *separated[1:], "]"]
    if len(runs) > 1:
        pieces.append(f', "over_time": {json.dumps(answer.frequency_over_time().to_json())}')
    return [*pieces, "}"]


def _record(outcome: Outcome) -> dict[str, object]:
    """The answer without the runs that it shows."""
    query, answer = outcome.query, outcome.answer
    mistake = next(mistakes_in(outcome.refusal), None)
    record: dict[str, object] = {
        "query": query.text,
        "name": query.name,
        "verdict": outcome.verdict,
        "value": None if answer is None else answer.value,
        "message": outcome.refusal if answer is None else answer.message,
        "wrapped": asdict(answer.wrapped) if answer is not None and answer.wrapped else None,
        "stop": outcome.stop if answer is None else answer.stop or outcome.stop,
        "explored": 0 if answer is None else answer.explored,
        "stored": 0 if answer is None else answer.stored,
        "seconds": 0.0 if answer is None else answer.seconds,
        "load_seconds": 0.0 if answer is None else answer.load_seconds,
        "peak_bytes": 0 if answer is None else answer.peak_bytes,
        "plans": None if answer is None else answer.plan_count,
    }
    if answer is not None and answer.estimate is not None:
        record |= asdict(answer.estimate)
        if answer.estimate.compared is None:
            del record["compared"]
    if answer is not None and (found := answer.optimised) is not None:
        record |= {
            "iterations": found.iterations,
            "resets": found.resets,
            "learning_runs": found.runs,
            "leaves": found.leaves,
            "uniform": found.uniform and _interval(found.uniform),
            "better": found.comparison and found.comparison == "better",
        }
    if answer is not None and (shielded := answer.shielded) is not None:
        record |= {
            "cells": shielded.cells,
            "safe_cells": shielded.safe_cells,
            "choice_cells": shielded.choice_cells,
            "unseen_pairs": shielded.unseen_pairs,
            "trial": shielded.trial and _interval(shielded.trial),
        }
    if answer is not None and answer.distribution is not None:
        record["distribution"] = answer.distribution.to_json()
    if answer is None:
        place = f"{mistake.path}:{mistake.line}:{mistake.column}" if mistake else None
        record |= {"place": place, "code": mistake and mistake.code}
    if outcome.is_compared:
        record |= {"expected": outcome.is_as_expected, "expectation": outcome.expected}
    return record


def _interval(estimate: Estimate) -> dict[str, float | None]:
    return {name: getattr(estimate, name) for name in ("value", "lower", "upper", "confidence")}


class GitHub(Format):
    """Annotations of GitHub Actions for what is wrong, and all queries on one line."""

    def refused(self, rejection: str) -> None:
        """Prints an annotation for each mistake of the model."""
        for mistake in _mistakes(self.path, rejection):
            self._annotate(mistake, "The model is rejected", "\n".join(mistake.lines))

    def one(self, outcome: Outcome) -> None:
        """Prints an annotation if the run fails because of the query."""
        if outcome.is_fault:
            title = outcome.query.name or outcome.query.text
            self._annotate(_fault(outcome, self.path), title, _explained(outcome))

    def end(self, outcomes: Sequence[Outcome]) -> None:
        """Prints all queries on one line."""
        echo(f"{self.path}: {summary(outcomes)}")

    def _annotate(self, at: Mistake, title: str, text: str) -> None:
        fields = {"file": at.path, "line": at.line, "col": at.column, "title": title}
        shown = ",".join(f"{name}={_field(str(one))}" for name, one in fields.items() if one)
        echo(f"::{at.severity} {shown}::{_data(text)}")


class JUnit(Format):
    """A JUnit report: a test case for each query."""

    def refused(self, rejection: str) -> None:
        """Prints a report with one test case: the model itself."""
        first = rejection.partition("\n")[0]
        case = _case(self.path, "model", f"<error message={_attribute(first)}>", rejection, "error")
        self._print([case], errors=1, failures=0, seconds=0.0)

    def end(self, outcomes: Sequence[Outcome]) -> None:
        """Prints the report."""
        kinds = [_kind(one) for one in outcomes]
        cases = []
        for outcome, kind in zip(outcomes, kinds, strict=True):
            query, tag = outcome.query, ""
            if kind is not None:
                tag = f"<{kind} message={_attribute(fault_of(outcome))}>"
            name = f"{query.name}: {query.text}" if query.name else query.text
            cases.append(_case(self.path, name, tag, _explained(outcome), kind, _seconds(outcome)))
        self._print(
            cases,
            errors=kinds.count("error"),
            failures=kinds.count("failure"),
            seconds=sum(map(_seconds, outcomes)),
        )

    def _print(self, cases: list[str], *, errors: int, failures: int, seconds: float) -> None:
        counts = (
            f'tests="{len(cases)}" failures="{failures}" errors="{errors}" time="{seconds:.3f}"'
        )
        body = "\n".join(cases)
        echo(
            '<?xml version="1.0" encoding="utf-8"?>\n'
            f'<testsuites name="ntagen" {counts}>\n'
            f"<testsuite name={_attribute(self.path)} {counts}>\n"
            f"{body}\n</testsuite>\n</testsuites>"
        )


def _kind(outcome: Outcome) -> str | None:
    """Whether a query is a ``failure`` (the answer is not the right one) or an ``error``."""
    if not outcome.is_fault:
        return None
    return "failure" if outcome.code == 1 else "error"


def _case(path: str, name: str, tag: str, text: str, kind: str | None, seconds: float = 0.0) -> str:
    start = (
        f"<testcase classname={_attribute(path)} name={_attribute(name)} "
        f'file={_attribute(path)} time="{seconds:.3f}"'
    )
    # It imports what reads from the network, which takes longer than a small model.
    from xml.sax.saxutils import escape

    return f"{start}>{tag}{escape(safe(text))}</{kind}></testcase>" if kind else f"{start}/>"


class Sarif(Format):
    """A SARIF 2.1.0 report: a result for each thing that is wrong."""

    def refused(self, rejection: str) -> None:
        """Prints a report with the mistakes of the model."""
        self._print([_result(one, "\n".join(one.lines)) for one in _mistakes(self.path, rejection)])

    def end(self, outcomes: Sequence[Outcome]) -> None:
        """Prints the report."""
        faults = [one for one in outcomes if one.is_fault]
        self._print([_result(_fault(one, self.path), _explained(one)) for one in faults])

    def _print(self, results: list[dict[str, Any]]) -> None:
        tool = {
            "name": "ntagen",
            "version": VERSION,
            "rules": [{"id": rule} for rule in sorted({one["ruleId"] for one in results})],
        }
        document = {
            "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
            "version": "2.1.0",
            "runs": [{"tool": {"driver": tool}, "results": results}],
        }
        echo(json.dumps(document, indent=1))


def _result(at: Mistake, text: str) -> dict[str, Any]:
    place: dict[str, Any] = {"artifactLocation": {"uri": Path(at.path).as_posix()}}
    if at.line:
        place["region"] = {"startLine": at.line, "startColumn": max(at.column, 1)}
    return {
        "ruleId": at.code,
        "level": at.severity,
        "message": {"text": text},
        "locations": [{"physicalLocation": place}],
    }


_RULES: Final = {"maybe": "undecided", "unknown": "stopped", "error": "run-time-error"}
"""The rules of SARIF by verdict, where it is not about an answer that is not the right one."""


def _fault(outcome: Outcome, model_path: str) -> Mistake:
    """Where and how a run fails because of a query."""
    path, line, column = outcome.query.place or (model_path, 0, 0)
    mistake = next(mistakes_in(outcome.refusal), None)
    if mistake is not None and mistake.path != path and not Path(mistake.path).exists():
        # The query stands on the command line, and not in a file.
        return Mistake(path, line, column, mistake.code, mistake.text, "error")
    if mistake is not None:
        return mistake
    wrong = "not-satisfied" if not outcome.is_compared else "not-as-expected"
    rule = wrong if outcome.code == 1 else _RULES.get(outcome.verdict, "stopped")
    severity = "warning" if outcome.verdict in ("maybe", "unknown") else "error"
    return Mistake(path, line, column, rule, fault_of(outcome), severity)


def _explained(outcome: Outcome) -> str:
    """What is wrong with a query: the query, and the reason in full."""
    if outcome.answer is None:
        return f"{outcome.query.text}\n{outcome.refusal}"
    lines = [f"{outcome.query.text} is {fault_of(outcome)}", *outcome.query.remark, *outcome.notes]
    return "\n".join(lines)


def _mistakes(path: str, rejection: str) -> list[Mistake]:
    """The diagnostics of a rejected file; one for the file if the text has none."""
    found = list(mistakes_in(rejection))
    first = rejection.partition("\n")[0]
    return found or [Mistake(path, 0, 0, "rejected", first, "error", (rejection,))]


def _seconds(outcome: Outcome) -> float:
    return 0.0 if outcome.answer is None else outcome.answer.seconds


def _attribute(text: str) -> str:
    from xml.sax.saxutils import quoteattr

    return quoteattr(safe(text), {"\n": "&#10;"})


def _data(text: str) -> str:
    """Text of an annotation, in which a line feed would end it."""
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _field(text: str) -> str:
    return re.sub("[:,]", lambda sign: f"%{ord(sign[0]):02X}", _data(text))


FORMATS: Final[dict[str, type[Format]]] = {
    "human": Human,
    "json": JsonLines,
    "github": GitHub,
    "junit": JUnit,
    "sarif": Sarif,
}
"""The formats of answers, by their names on the command line."""
