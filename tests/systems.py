"""Shared by the tests of the converter: what a model reaches, whatever its clocks say."""

from __future__ import annotations

from ntagen import checker
from ntagen.convert import Source, convert, source_of, source_of_tck


def source(text: str, path: str = "model.xta") -> Source:
    return source_of(checker.load(text, path), path)


def reached(model: checker.Model) -> set[tuple[tuple[str, ...], tuple[float, ...]]]:
    """The locations and variables that are reached, but those that only hold a location."""
    return {
        (
            tuple(state.locations.values()),
            tuple(value for name, value in state.variables.items() if not name.endswith("_place")),
        )
        for state in model.states()
    }


def through_tck(text: str) -> tuple[checker.Model, checker.Model]:
    """A model, and the one that comes back from TChecker's format."""
    given = source(text)
    return given.model, source_of_tck(convert(given, "tck").text, "model.tck").model
