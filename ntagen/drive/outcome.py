"""What a run gives to its caller, besides its records: the end, and how long its syntheses took."""

from __future__ import annotations

from dataclasses import dataclass

from ntagen.drive.records import Ended, Guaranteed, Promised, Record
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene


@dataclass(frozen=True, slots=True)
class Made:
    """A synthesis that was made.

    Attributes:
        found: The number of plans that were found.
        hold: The number of those that hold in exact kinematics and fit into the time left.
        engine_seconds: The engine's time.
        loop_seconds: The time of the whole synthesis.
    """

    found: int
    hold: int
    engine_seconds: float
    loop_seconds: float


@dataclass(frozen=True, slots=True)
class Driven:
    """The end of a run.

    Attributes:
        ended: The driver's own last record.
        syntheses: Every synthesis, in order.
        guaranteed: How long the guarantee of a strategy held that was followed.
        promised: What it promised where it began, against all that the estimate left open.
    """

    ended: Ended
    syntheses: tuple[Made, ...]
    guaranteed: Guaranteed | None
    promised: Promised | None


class SynthesisCounter:
    """A journal that notes every synthesis, and how long a guarantee held.

    Attributes:
        syntheses: What was noted.
        guaranteed: What was noted.
        promised: What the last guarantee promised where it began.
    """

    def __init__(self) -> None:
        self.syntheses: list[Made] = []
        self.guaranteed: Guaranteed | None = None
        self.promised: Promised | None = None
        self._is_promised = False

    def record(self, record: Record) -> None:
        """Notes how long a guarantee held."""
        if isinstance(record, Guaranteed):
            self.guaranteed = record
            self._is_promised = False
        elif isinstance(record, Promised) and not self._is_promised:
            self.promised = record
            self._is_promised = True

    def started(self, scene: Scene) -> None:
        """Does nothing: the scene is known."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Notes what was found, and how long that took."""
        self.syntheses.append(
            Made(
                found=synthesis.found,
                hold=len(synthesis.candidates),
                engine_seconds=synthesis.seconds,
                loop_seconds=synthesis.loop_seconds,
            )
        )
