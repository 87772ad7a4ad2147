"""The experiment that is one sweep: a task, a quantity, and its values."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from ntagen.drive.needles import LAB
from ntagen.errors import InputError
from ntagen.experiment.description import Experiment, Row
from ntagen.experiment.reading import ERRORS, experiment_of
from ntagen.nsl import load_task
from ntagen.nsl.diagnostics import suggest
from ntagen.parameters import BY_WORDS, MEASURES, SEED, Parameter

_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_USUAL: Final = ("noise", "radius error", "roll lag", "delay")


def sweep_of_task(
    task: Path,
    over: Parameter,
    values: str,
    *,
    known: str,
    needle: str,
    runs: int,
    settings: Mapping[str, str],
) -> Experiment:
    """A sweep as an experiment: a row for each value.

    Args:
        task: The file of the task.
        over: What is swept.
        values: Its values, as in ``0, 0.5, 1 mm``.
        known: The critical regions that the driver knows.
        needle: The name of the simulated needle.
        runs: The number of runs for each value: their seeds are 1, 2, …
        settings: The other settings, by their words.

    Raises:
        InputError: Something in it is wrong, or cannot be driven.
    """
    if over.words in settings:
        raise InputError(
            f"`{over.words}` is swept, and --set fixes it\n"
            "hint: leave it out, or sweep something else"
        )
    if SEED in settings:
        raise InputError(
            "all values have the same seeds: 1, 2, …\nhint: --runs says how many there are"
        )
    if needle == LAB:
        raise InputError(
            "--needle lab: a sweep cannot say how fast its lab runs\n"
            'hint: write a row with needle = "lab", speed and a list of values in a file for '
            "`ntagen experiment`"
        )
    row: dict[str, object] = {"scenario": str(task), "known": known, "needle": needle}
    given = {**settings, over.words: listed_values(over, values)}
    errors = {key: given[one.words] for key, one in ERRORS.items() if one.words in given}
    drive = {words: one for words, one in given.items() if words.replace(" ", "_") not in errors}
    row |= {**errors, "seeds": runs, "drive": drive}
    experiment = experiment_of({"name": f"{task.stem} over {over.words}", "row": [row]})
    for one in experiment.rows:
        _require_effect(one, over)
    return experiment


def _require_effect(row: Row, over: Parameter) -> None:
    """Refuses a value in whose place the driver uses another one."""
    used = row.configuration(load_task(row.scenario), row.seeds[0]).value(over)
    wanted = row.values[over.field]
    if isinstance(used, float | int) and not math.isclose(used, float(wanted)):  # type: ignore[arg-type]
        raise InputError(
            f"`{over.words}` cannot be {over.shown(wanted)} here: {over.shown(used)} follows from "
            "the needle and the scene\nhint: choose other values, or sweep something else"
        )


def quantity_of(text: str) -> Parameter:
    """The setting that can be swept and that a person calls so.

    Raises:
        InputError: There is none.
    """
    words = re.sub(r"[\s_-]+", " ", text.strip().removeprefix("--"))
    options = {one.option.removeprefix("--"): one for one in BY_WORDS.values()}
    found = BY_WORDS.get(words) or options.get(words)
    if found is None:
        near = suggest(words, BY_WORDS)
        others = f"choose from {_usual()}, and what `ntagen sweep --help-settings` prints"
        hint = f"did you mean {_as_option(near)}?" if near else others
        raise InputError(f"there is no setting '{text}'\nhint: {hint}")
    if not found.is_quantity or found.words == SEED:
        kind = "the seeds are the same for all values" if found.is_quantity else "it is no quantity"
        raise InputError(f"`{found.words}` cannot be swept: {kind}\nhint: choose from {_usual()}")
    return found


def listed_values(over: Parameter, text: str) -> list[str]:
    """The values of a list with commas; the unit of the last one holds for numbers without one.

    Raises:
        InputError: There are fewer than two, or it cannot be told which unit a number has.
    """
    values = [one.strip() for one in text.split(",")]
    unit = MEASURES[over.kind].unit
    hint = f"\nhint: write for example --values 1,2,3{unit}"
    if "" in values:
        raise InputError(f"--values: a value is missing in '{text}'{hint}")
    if len(values) == 1:
        raise InputError(f"--values: one value is no sweep{hint}")
    plain = [one for one in values if _NUMBER.fullmatch(one)]
    last = _NUMBER.match(values[-1])
    if len(plain) == len(values) or last is None:
        return values
    if values[-1] in plain:
        raise InputError(
            f"--values: it cannot be told which unit {values[-1]} has\n"
            f"hint: give each value a unit, or only the last one, as in 1,2,3{unit}"
        )
    return [one + values[-1][last.end() :] if one in plain else one for one in values]


def _as_option(words: str) -> str:
    return words.replace(" ", "-")


def _usual() -> str:
    return ", ".join(map(_as_option, _USUAL))
