"""What happens in a run, as flat values: the vocabulary of the log, of the terminal and of replay.

Every record is a frozen dataclass of numbers, texts and vectors, so that the log can give it a
message type by itself (`ntagen.drive.messages`). A record is *decided* if the driver's decisions
alone determine it; replay compares those. Times are seconds on the device's clock.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Pose, Region, Scene, Vector


@dataclass(frozen=True, slots=True)
class Record:
    """Something that happened.

    Attributes:
        time_s: When.
    """

    decided: ClassVar[bool] = True

    time_s: float


@dataclass(frozen=True, slots=True)
class Transition(Record):
    """The state machine moved on; the fields are the values of `State` and `Event`."""

    state: str
    event: str
    following: str


@dataclass(frozen=True, slots=True)
class Command(Record):
    """A command to the device: ``push`` or ``pull`` with mm, ``roll`` with rad, or ``stop``."""

    kind: str
    value: float


@dataclass(frozen=True, slots=True)
class Measured(Record):
    """The sensor reported; an empty heading or bevel was not measured."""

    decided: ClassVar[bool] = False

    depth_mm: float
    position_mm: Vector
    force_n: float
    heading: tuple[float, ...]
    bevel: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Predicted(Record):
    """Where the plan expected the tip, and how far from there it was measured."""

    position_mm: Vector
    heading: Vector
    bevel: Vector
    deviation_mm: float


@dataclass(frozen=True, slots=True)
class Estimated(Record):
    """The pose and the circle were estimated."""

    position_mm: Vector
    heading: Vector
    bevel: Vector
    radius_mm: float
    radius_std_mm: float
    rms_mm: float

    @property
    def pose(self) -> Pose:
        """The pose of the tip."""
        return Pose(self.position_mm, self.heading, self.bevel)


@dataclass(frozen=True, slots=True)
class Synthesised(Record):
    """A strategy was looked for.

    Attributes:
        number: The synthesis's number in the run, from 1.
        depth_mm: The depth from which a plan was asked for: less than the tip's when looking back.
        found: How many plans the model has.
        accepted: How many of them hold in exact kinematics and can be driven in the time left.
        plan: The best of them in words; empty if there is none.
        clearance_mm: Its distance to critical regions; -1 if there is no plan, 1e9 if there is no
            region.
        model_sha256: Digest of the model that was checked.
    """

    number: int
    depth_mm: float
    found: int
    accepted: int
    plan: str
    clearance_mm: float
    model_sha256: str


@dataclass(frozen=True, slots=True)
class Timed(Record):
    """How long a synthesis took on the computer; simulated time stands still meanwhile."""

    decided: ClassVar[bool] = False

    number: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Learned(Record):
    """A region was learned or grew."""

    name: str
    kind: str
    center_mm: Vector
    radius_mm: float

    @staticmethod
    def of(time_s: float, region: Region) -> Learned:
        """The record of a region."""
        return Learned(time_s, region.name, region.kind, region.center_mm, region.radius_mm)


@dataclass(frozen=True, slots=True)
class Visited(Record):
    """A target was reached."""

    target: str


@dataclass(frozen=True, slots=True)
class Ended(Record):
    """The run is over.

    Attributes:
        outcome: The end's value of `State`.
        reason: Why, in words.
        depth_mm: The insertion depth at the end.
        adjustments: How often the needle was pulled back.
        syntheses: How often a strategy was looked for.
    """

    outcome: str
    reason: str
    depth_mm: float
    adjustments: int
    syntheses: int


@dataclass(frozen=True, slots=True)
class Truth(Record):
    """What was really so; only the simulation knows. Written at each cycle and at the end.

    Attributes:
        position_mm: Where the tip is.
        clearance_mm: Smallest distance of all that was pierced to any actual critical region; 1e9
            without one.
    """

    decided: ClassVar[bool] = False

    position_mm: Vector
    clearance_mm: float


class Journal(Protocol):
    """Whoever wants to know what happens in a run: the log, the terminal, a replay."""

    def record(self, record: Record) -> None:
        """Takes a record; when this returns, the record is acknowledged."""

    def started(self, scene: Scene) -> None:
        """Is told the a-priori scene before the first record."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Is shown a whole synthesis, before its record."""


class Journals:
    """Several journals as one."""

    def __init__(self, *journals: Journal) -> None:
        self._journals = journals

    def record(self, record: Record) -> None:
        """Gives the record to each."""
        for journal in self._journals:
            journal.record(record)

    def started(self, scene: Scene) -> None:
        """Tells each."""
        for journal in self._journals:
            journal.started(scene)

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Shows each."""
        for journal in self._journals:
            journal.synthesised(number, synthesis)
