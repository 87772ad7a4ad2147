"""What a file of an experiment asks for: rows, each of which is driven with several seeds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ntagen.drive.configure import Configuration, configure
from ntagen.drive.scene_json import scene_to_json
from ntagen.nsl import Task
from ntagen.parameters import BY_FIELD, Given, Value

SPEED: Final = "speed"
"""The key of a row for the speed of a lab."""


@dataclass(frozen=True, slots=True)
class Row:
    """What is driven with several seeds: one line of the table.

    Attributes:
        id: Its name in the experiment, which is also a part of file names.
        scenario: The file of the scene; absolute.
        known: The critical regions that the driver knows (`ntagen.drive.knowledge.told`).
        needle: The name of the simulated needle (`ntagen.drive.needles`), or that of the lab.
        values: The settings that the file gives, by field, in the unit of the field.
        seeds: The seeds, in the order of the file; none twice.
        paper: The name of the paper's line to compare with, or empty.
        digest: Two rows with the same digest give the same runs for the same seeds; in a lab, runs
            of the same kind.
        speed: How many seconds pass in the lab in one second; None without a lab.
    """

    id: str
    scenario: Path
    known: str
    needle: str
    values: Mapping[str, Value]
    seeds: tuple[int, ...]
    paper: str = ""
    digest: str = ""
    speed: float | None = None

    def configuration(self, task: Task, seed: int) -> Configuration:
        """The settings of a run: defaults, the scene's, the row's; a later one wins.

        Raises:
            InputError: The driver cannot work with these values together.
        """
        given = [Given(BY_FIELD[field], value, "row") for field, value in self.values.items()]
        given.append(Given(BY_FIELD["needle.seed"], seed, "row"))
        return configure((*task.given, *given), task.scene, self.known, self.needle)

    def numbers(self) -> dict[str, float]:
        """The settings that are quantities, by words and usual unit, in this unit."""
        return {
            BY_FIELD[field].words_and_unit: BY_FIELD[field].in_usual_unit(value)
            for field, value in self.values.items()
            if BY_FIELD[field].is_quantity and not isinstance(value, tuple)
        }

    def shown_values(self) -> dict[str, str]:
        """The settings by their words, as a person writes them."""
        shown = {} if self.speed is None else {SPEED: f"{self.speed:g} x"}
        return shown | {
            BY_FIELD[field].words: BY_FIELD[field].shown(value)
            for field, value in self.values.items()
        }


@dataclass(frozen=True, slots=True)
class Experiment:
    """A file of an experiment.

    Attributes:
        name: Its name, for people.
        rows: Its rows, in the order of the file.
    """

    name: str
    rows: tuple[Row, ...]

    @property
    def runs(self) -> int:
        """The number of runs."""
        return sum(len(row.seeds) for row in self.rows)

    @property
    def digest(self) -> str:
        """Of all rows, without their seeds: more seeds may be added to an experiment."""
        facts = [[row.id, row.digest] for row in self.rows]
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def digest_of(row: Row, task: Task) -> str:
    """The digest of a row for the task that its file describes."""
    facts: dict[str, Any] = {
        "known": row.known,
        "needle": row.needle,
        "speed": row.speed,
        "values": dict(sorted(row.values.items())),
        "scene": scene_to_json(task.scene),
        "given": [[one.parameter.field, one.value] for one in task.given],
    }
    if row.speed is not None and task.device is not None:
        # A lab has the axes of the task's device; its port is that of the hardware.
        axes = (task.device.insert, task.device.roll)
        facts["axes"] = [[axis.letter, axis.steps_per_unit] for axis in axes]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()
