"""Suites as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

from ntagen.checker.runs import State
from ntagen.errors import InputError
from ntagen.files import EVIDENCE_BYTES, json_of, read_file
from ntagen.suites.goals import Covered, Goal
from ntagen.suites.suite import Case, CaseStep, Suite

FORMAT: Final = "ntagen-suite"
VERSION: Final = 1


def suite_json(suite: Suite) -> str:
    """The suite as one JSON object.

    Times are texts such as ``"3/2"``. ``trace`` of a test is what `ntagen verify` reads.
    """
    value = {
        "format": FORMAT,
        "version": VERSION,
        "model": suite.model,
        "goals": [
            {**asdict(one.goal), "verdict": one.verdict, "tests": one.tests, "reason": one.reason}
            for one in suite.goals
        ],
        "tests": [_case(case) for case in suite.tests],
    }
    return json.dumps(value, default=str, ensure_ascii=False) + "\n"


def _case(case: Case) -> dict[str, Any]:
    return {
        "name": case.name,
        "goal": case.goal,
        "initial": _state(case.initial),
        "steps": [_step(step) for step in case.steps],
        "wait": str(case.wait),
        "duration": str(case.duration),
        "templates": case.templates,
        "trace": case.trace,
    }


def _state(state: State) -> dict[str, Any]:
    clocks = {name: str(value) for name, value in state.clocks.items()}
    return {"locations": state.locations, "variables": state.variables, "clocks": clocks}


def _step(step: CaseStep) -> dict[str, Any]:
    edges = [asdict(edge) for edge in step.edges]
    for edge in edges:
        del edge["codes"]
    times: dict[str, Fraction] = {"delay": step.delay, "time": step.time}
    return {
        **{name: str(value) for name, value in times.items()},
        "edges": edges,
        "after": _state(step.after),
    }


def read_suite(path: Path) -> Suite:
    """Reads a suite that `suite_json` has written. Its traces are not checked against a model.

    Raises:
        InputError: The file is no suite.
        OSError: The file cannot be read.
    """
    try:
        value = json_of(read_file(path, EVIDENCE_BYTES), most_values=100_000_000)
        if value["format"] != FORMAT or value["version"] != VERSION:
            raise ValueError("its format is another one")
        goals = tuple(
            Covered(
                Goal(*(one[key] for key in ("kind", "name", "template", "index", "process"))),
                one["verdict"],
                tuple(one["tests"]),
                one["reason"],
            )
            for one in value["goals"]
        )
        cases = tuple(
            Case(*(one[key] for key in ("name", "goal", "templates", "trace")))
            for one in value["tests"]
        )
        for case in cases:
            # What is missing in a trace is said now, and not in the middle of the work.
            if len(case.steps) + 1 != len(case.run.states):
                raise ValueError("a trace is not complete")
    except (LookupError, TypeError, ValueError, RecursionError) as error:
        raise InputError(
            f"{path} is no test suite: {error}\nhint: `ntagen test MODEL -o FILE.json` writes one"
        ) from error
    return Suite(value["model"], cases, goals)
