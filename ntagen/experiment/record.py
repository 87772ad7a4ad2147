"""What is kept of a run: one line of JSON.

Everything but `seconds`, `engine_s` and `loop_s` follows from the row and the seed alone.
"""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass
from typing import Any, Final

from ntagen.drive.json_values import value_from_json
from ntagen.drive.records import Measured, Predicted, Record, Transition, Truth
from ntagen.drive.states import Event
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene, Vector

_DIGITS: Final = 4
"""Profiles are kept to so many digits after the point, in mm."""


@dataclass(frozen=True, slots=True)
class Synthesised:
    """A synthesis of a run.

    Attributes:
        found: The number of plans that were found.
        hold: The number of those that hold in exact kinematics and fit into the time left.
        engine_s: The engine's time.
        loop_s: The time of the whole synthesis.
    """

    found: int
    hold: int
    engine_s: float
    loop_s: float


@dataclass(frozen=True, slots=True)
class Profile:
    """A run by its depth: one value for each mm that was measured in.

    Attributes:
        depth_mm: The whole mm below each measured depth, ascending.
        distance_mm: The least distance of the true tip to a critical region; empty without one.
        deviation_mm: The greatest distance from the plan; None where no plan was followed.
    """

    depth_mm: tuple[int, ...] = ()
    distance_mm: tuple[float, ...] = ()
    deviation_mm: tuple[float | None, ...] = ()


@dataclass(frozen=True, slots=True)
class Felt:
    """A place where the force rose.

    Attributes:
        depth_mm: The insertion depth.
        position_mm: The true position of the tip.
    """

    depth_mm: float
    position_mm: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Run:
    """A finished run.

    Attributes:
        row: The name of its row.
        seed: Its seed.
        outcome: How it ended (`ntagen.drive.states.State`), or ``failed`` if the driver broke.
        reason: The reason, in words.
        is_reached: Whether the driver says that it is in the last target, and it is true.
        is_hit: Whether the needle's true path meets a critical region.
        clearance_mm: The least distance of this path to any; negative inside, None without one.
        target_mm: The distance of the true tip to the last target's surface; negative inside.
        depth_mm: The insertion depth at the end.
        adjustments: How often the needle was pulled back.
        cut_mm: The length of all channels that were cut.
        confidence: The probability that the tip is in the last target, by the last estimate; None
            if the driver does not say that it is there.
        error_mm: The standard deviation of the tip's position by that estimate.
        needle_s: The time on the needle's clock, which stands still during syntheses.
        syntheses: Each synthesis.
        profile: The run by its depth.
        felt: Where the force rose.
        seconds: The computer's time for the run, with its log.
        log: The file of its log, relative to the folder of the experiment; empty without one.
    """

    row: str
    seed: int
    outcome: str
    reason: str
    is_reached: bool = False
    is_hit: bool = False
    clearance_mm: float | None = None
    target_mm: float | None = None
    depth_mm: float = 0.0
    adjustments: int = 0
    cut_mm: float = 0.0
    confidence: float | None = None
    error_mm: float | None = None
    needle_s: float = 0.0
    syntheses: tuple[Synthesised, ...] = ()
    profile: Profile = Profile()
    felt: tuple[Felt, ...] = ()
    seconds: float = 0.0
    log: str = ""

    @property
    def key(self) -> tuple[str, int]:
        """Row and seed, which name a run in its experiment."""
        return self.row, self.seed

    @property
    def overall_s(self) -> float:
        """The time that the run would take: that of the needle and that of all syntheses."""
        return self.needle_s + sum(one.loop_s for one in self.syntheses)

    def to_json(self) -> dict[str, Any]:
        """The run as JSON."""
        return dataclasses.asdict(self)


def line_of(run: Run) -> bytes:
    """A run as a line."""
    return json.dumps(run.to_json(), allow_nan=False).encode() + b"\n"


def run_of(line: bytes) -> Run | None:
    """The run of a line; None if the line is torn or none of ours."""
    try:
        return value_from_json(json.loads(line), Run)
    except ValueError:
        return None


class Observer:
    """A journal that keeps what `Run` needs of the true path and of the plan."""

    def __init__(self, scene: Scene) -> None:
        self._still = [region for region in scene.criticals if region.motion is None]
        self._depth_mm = 0.0
        self._tip_mm: Vector = scene.needle.tip.position_mm
        self._distances_mm: dict[int, float] = {}
        self._deviations_mm: dict[int, float] = {}
        self._felt: list[Felt] = []

    def record(self, record: Record) -> None:
        """Notes it."""
        match record:
            case Measured():
                self._depth_mm = record.depth_mm
            case Truth():
                self._note_truth(record.position_mm)
            case Predicted():
                most_mm = self._deviations_mm.get(self._bin, 0.0)
                self._deviations_mm[self._bin] = max(most_mm, record.deviation_mm)
            case Transition() if record.event == Event.FORCE.value:
                x, y, z = (round(value, _DIGITS) for value in self._tip_mm)
                self._felt.append(Felt(round(self._depth_mm, _DIGITS), (x, y, z)))

    def started(self, scene: Scene) -> None:
        """Does nothing: the scene is known."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Does nothing: syntheses are counted elsewhere."""

    @property
    def profile(self) -> Profile:
        """What was noted, by depth."""
        depths = sorted(self._distances_mm)
        deviations = [self._deviations_mm.get(depth) for depth in depths]
        return Profile(
            tuple(depths),
            tuple(round(self._distances_mm[d], _DIGITS) for d in depths) if self._still else (),
            tuple(None if value is None else round(value, _DIGITS) for value in deviations),
        )

    @property
    def felt(self) -> tuple[Felt, ...]:
        """Where the force rose."""
        return tuple(self._felt)

    @property
    def _bin(self) -> int:
        return math.floor(self._depth_mm)

    def _note_truth(self, tip_mm: Vector) -> None:
        """Notes the first place in each mm: those between two are at most that far away."""
        self._tip_mm = tip_mm
        if self._bin not in self._distances_mm:
            self._distances_mm[self._bin] = min(
                (region.distance_mm(tip_mm) for region in self._still), default=0.0
            )
