"""Drives for tests: a run with everything that happened in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeVar

from ntagen.drive.fitting import settings_for
from ntagen.drive.records import Record
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import Result, simulate
from ntagen.needle.virtual import Errors
from ntagen.plan.synthesise import Synthesis, Synthesiser
from ntagen.scene import Scene
from tests.oracles.synthesiser import oracle_synthesis

R = TypeVar("R", bound=Record)


@dataclass
class Diary:
    """A journal that keeps everything."""

    records: list[Record] = field(default_factory=list)
    syntheses: list[Synthesis] = field(default_factory=list)

    def record(self, record: Record) -> None:
        """Keeps the record."""
        self.records.append(record)

    def started(self, scene: Scene) -> None:
        """Nothing to keep."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Keeps the synthesis."""
        self.syntheses.append(synthesis)

    def of(self, kind: type[R]) -> list[R]:
        """The records of one kind."""
        return [record for record in self.records if isinstance(record, kind)]


def drive(
    scene: Scene,
    *,
    known: str = "all",
    noise_mm: float = 0.0,
    roll_rad: float = 0.0,
    seed: int = 1,
    settings: Settings | None = None,
    synthesise: Synthesiser = oracle_synthesis,
) -> tuple[Result, Diary]:
    """A simulated run and its diary."""
    errors = Errors(noise_mm, roll_rad)
    diary = Diary()
    result = simulate(
        scene,
        synthesise,
        settings_for(settings or Settings(), errors, scene, known),
        diary,
        known=known,
        errors=errors,
        seed=seed,
    )
    return result, diary
