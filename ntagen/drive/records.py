"""The events of a run as flat values, for the log, the terminal and the replay.

Every record is a frozen dataclass of numbers, texts and vectors, so that the log can make a message
type from it (`ntagen.drive.messages`). A record is *decided* if it follows from the driver's
decisions alone; a replay compares those. Times are seconds on the device's clock.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist
from typing import ClassVar, Final, Protocol

from ntagen.errors import DeviceError
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Pose, Region, Scene, Vector


class JournalError(DeviceError):
    """A record cannot be kept: what nobody can tell afterwards must not be done.

    A journal raises it once, and then takes records without keeping them: so the other journals
    can tell how the run ends.
    """


@dataclass(frozen=True, slots=True)
class Record:
    """An event of a run.

    Attributes:
        time_s: The time of the event.
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
    """A command: ``push`` or ``pull`` with mm, ``roll`` with rad, ``wait`` with s, or ``stop``.

    Attributes:
        kind: The command.
        value: How much of it.
        spin: In this part of a push the needle spins.
    """

    kind: str
    value: float
    spin: float = 0.0


@dataclass(frozen=True, slots=True)
class Measured(Record):
    """A measurement; an empty heading, bevel or shape was not measured.

    Attributes:
        shape_mm: Places along the needle from its base to its tip: x, y and z of each, one place
            after the other.
    """

    decided: ClassVar[bool] = False

    depth_mm: float
    position_mm: Vector
    force_n: float
    heading: tuple[float, ...]
    bevel: tuple[float, ...]
    shape_mm: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuses a shape that is cut off.

        Raises:
            ValueError: It is.
        """
        if len(self.shape_mm) % 3:
            raise ValueError(f"shape_mm has {len(self.shape_mm)} numbers, not three for each place")

    @property
    def shape(self) -> tuple[Vector, ...]:
        """The places of the shape."""
        numbers = iter(self.shape_mm)
        return tuple(zip(numbers, numbers, numbers, strict=True))


@dataclass(frozen=True, slots=True)
class Predicted(Record):
    """The position that the plan expected, and its distance from the measured one."""

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
        number: The number of the synthesis in the run, from 1.
        depth_mm: The depth at which the plans start; it is less than the tip's depth if the driver
            looks for a place behind the tip.
        found: The number of plans that were found.
        accepted: The number of plans that hold in exact kinematics and fit into the time left.
        plan: The best of them in words; empty if there is none.
        clearance_mm: Its distance to critical regions; -1 if there is no plan, 1e9 if there is no
            region.
        model_sha256: The digest of the model that was checked.
        partial: Whether the model may have more plans than those found: earlier logs list all.
    """

    number: int
    depth_mm: float
    found: int
    accepted: int
    plan: str
    clearance_mm: float
    model_sha256: str
    partial: bool = False


@dataclass(frozen=True, slots=True)
class Timed(Record):
    """The computer's time for a synthesis; simulated time stands still during it.

    Attributes:
        number: The number of the synthesis.
        seconds: The engine's time.
        loop_seconds: The time of all: rendering, loading, solving, certifying and ranking.
    """

    decided: ClassVar[bool] = False

    number: int
    seconds: float
    loop_seconds: float


_FARTHEST_MM: Final = 1000.0
"""A region is not written as a larger ball: JSON has no infinity, for a half-space."""


@dataclass(frozen=True, slots=True)
class Learned(Record):
    """A region was learned or grew; of one that is no sphere, a ball about its middle."""

    name: str
    kind: str
    center_mm: Vector
    radius_mm: float

    @staticmethod
    def of(time_s: float, region: Region) -> Learned:
        """The record of a region."""
        reach_mm = min(region.shape.reach_mm(), _FARTHEST_MM)
        return Learned(time_s, region.name, region.kind, region.center_mm, reach_mm)


@dataclass(frozen=True, slots=True)
class Visited(Record):
    """A target was reached."""

    target: str


@dataclass(frozen=True, slots=True)
class Ended(Record):
    """The run is over.

    Attributes:
        outcome: The value of `State` at the end.
        reason: The reason, in words. A replay compares them, so new words make old logs differ.
        depth_mm: The insertion depth at the end.
        adjustments: The number of times that the needle was pulled back.
        syntheses: The number of syntheses.
        cut_mm: The length of all channels that were cut.
        confidence: The probability that the tip is in the last target, by the last estimate; 0 if
            the target was not reached.
        error_mm: The standard deviation of the tip's position by that estimate, in the direction
            that is known worst.
    """

    outcome: str
    reason: str
    depth_mm: float
    adjustments: int
    syntheses: int
    cut_mm: float = 0.0
    confidence: float = 0.0
    error_mm: float = 0.0


@dataclass(frozen=True, slots=True)
class Truth(Record):
    """The truth, which only the simulation knows. It is written in each cycle and at the end.

    Attributes:
        position_mm: The true position of the tip.
        clearance_mm: The smallest distance of the needle's path to any actual critical region; 1e9
            without one.
    """

    decided: ClassVar[bool] = False

    position_mm: Vector
    clearance_mm: float


@dataclass(frozen=True, slots=True)
class Relied(Record):
    """What the driver relies on, in words; the first record of a run."""

    text: str


@dataclass(frozen=True, slots=True)
class Forgotten(Record):
    """A learned region is no more: a larger one takes its place."""

    name: str
    kind: str


@dataclass(frozen=True, slots=True)
class CutShort(Record):
    """A push was ended early by what was seen during it (`ntagen.drive.supervisor`).

    Attributes:
        made_mm: How far the needle got.
        reason: Why it was ended, in words.
    """

    decided: ClassVar[bool] = False

    made_mm: float
    reason: str


@dataclass(frozen=True, slots=True)
class Breathed(Record):
    """A time of the breath counted for a decision; only runs with moving regions have it.

    Attributes:
        clock_s: The time on the clock of the breath, within its period.
    """

    clock_s: float


@dataclass(frozen=True, slots=True)
class Followed(Record):
    """A branch of a strategy against the tissue was followed to its end.

    Attributes:
        depth_mm: The insertion depth.
        way: The numbers of the branches from the root of the strategy to this one.
        factor: What explains the readings best: the curvature, relative to the needle's.
        roll_error_rad: And by how much the roll before went too far.
        off_mm: How far the tip is from the path of the branch, in the mean of the last readings.
        decision: What the strategy decides then, in words.
    """

    depth_mm: float
    way: tuple[float, ...]
    factor: float
    roll_error_rad: float
    off_mm: float
    decision: str


@dataclass(frozen=True, slots=True)
class Guaranteed(Record):
    """A strategy against the tissue was followed so far.

    Attributes:
        until_mm: The depth up to which its guarantee held.
        most_off_mm: The greatest distance of the tip from the path until then.
        allowed_mm: The distance that is allowed.
        reason: Why the guarantee has ended, in words; empty if it held up to the target.
    """

    until_mm: float
    most_off_mm: float
    allowed_mm: float
    reason: str


@dataclass(frozen=True, slots=True)
class Foreseen(Record):
    """The tube of a plan, or of the rest of one, that is followed from here (`ntagen.drive.tube`).

    It ends where the driver looks at its plan again. Needles that bend exactly as planned have
    none. The lists have an item for each of the same places.

    Attributes:
        depth_mm: The insertion depth at its start.
        length_mm: How far the places are from there along the plan.
        std_mm: The standard deviation of the tip's position there, in the direction that is known
            worst.
        x_mm: Where the places are.
        y_mm: The same.
        z_mm: The same.
        confidence: The probability that the tip touches no known critical region in the tube.
    """

    depth_mm: float
    length_mm: tuple[float, ...]
    std_mm: tuple[float, ...]
    x_mm: tuple[float, ...]
    y_mm: tuple[float, ...]
    z_mm: tuple[float, ...]
    confidence: float

    def tube(self, accept: float) -> list[tuple[Vector, float]]:
        """The places, and how far the tip may be from each in mm at a confidence."""
        sigmas = max(0.0, NormalDist().inv_cdf(accept))
        places = zip(self.x_mm, self.y_mm, self.z_mm, self.std_mm, strict=False)
        return [((x, y, z), sigmas * std_mm) for x, y, z, std_mm in places]


@dataclass(frozen=True, slots=True)
class Promised(Record):
    """From here on a strategy reaches the target, whatever the tissue does within bounds.

    Attributes:
        depth_mm: The insertion depth.
        branches: The number of ways on which the strategy reaches the target.
        curvature_ratio: The curvature may differ by this part from the estimate.
        roll_rad: Each roll may err by this.
        tip_mm: The tip may be off the way for other reasons by this.
        confidence: The probability that the tissue stays within these bounds, by the estimate.
    """

    depth_mm: float
    branches: int
    curvature_ratio: float
    roll_rad: float
    tip_mm: float
    confidence: float


@dataclass(frozen=True, slots=True)
class Advised(Record):
    """The policy of the run was asked (`ntagen.drive.advice`).

    Attributes:
        depth_mm: The insertion depth.
        move: What it says: ``push`` or ``roll``; empty where it says nothing.
        by: Who decided: ``policy``, or ``re-synthesis`` if the plan stays against it.
        reason: Why, in words; the new plan if there is one.
    """

    depth_mm: float
    move: str
    by: str
    reason: str


@dataclass(frozen=True, slots=True)
class Stood(Record):
    """Where the axes that move the needle stand, by the count of what moves it.

    Attributes:
        insert_mm: The axis that inserts, in the direction of insertion.
        roll_rad: The axis that rolls, right-handed about the heading.
    """

    decided: ClassVar[bool] = False

    insert_mm: float
    roll_rad: float


@dataclass(frozen=True, slots=True)
class Looked(Record):
    """A reading of a needle of which nobody knows yet how deep it lies."""

    decided: ClassVar[bool] = False

    position_mm: Vector
    force_n: float
    heading: tuple[float, ...]
    bevel: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Found(Record):
    """A needle was found in the channel that an earlier run has cut (`ntagen.drive.finding`).

    Attributes:
        depth_mm: The insertion depth.
        off_mm: How far the measured tip is from the channel.
        allowed_mm: How far it may be.
        text: What that relies on, in words.
        lack: Why the driver may not go on, in words; empty if it may.
    """

    depth_mm: float
    off_mm: float
    allowed_mm: float
    text: str
    lack: str


@dataclass(frozen=True, slots=True)
class Answered(Record):
    """The operator answered whether a run may go on.

    Attributes:
        question: What the needle would do.
        agrees: Whether it may.
    """

    decided: ClassVar[bool] = False

    question: str
    agrees: bool


class Journal(Protocol):
    """Anything that records a run: the log, the terminal, a replay."""

    def record(self, record: Record) -> None:
        """Takes a record; when this returns, the record is acknowledged.

        Raises:
            JournalError: It cannot be kept.
        """

    def started(self, scene: Scene) -> None:
        """Gets the a-priori scene before the first record."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Gets a whole synthesis, before its record."""


class Journals:
    """Several journals as one."""

    def __init__(self, *journals: Journal) -> None:
        self._journals = journals

    def record(self, record: Record) -> None:
        """Gives the record to each."""
        for journal in self._journals:
            journal.record(record)

    def started(self, scene: Scene) -> None:
        """Gives the scene to each."""
        for journal in self._journals:
            journal.started(scene)

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Gives the synthesis to each."""
        for journal in self._journals:
            journal.synthesised(number, synthesis)
