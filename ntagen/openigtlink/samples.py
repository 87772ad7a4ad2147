"""What a client of OpenIGTLink puts up with, and what it gives: samples and statistics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from ntagen.openigtlink.messages import Points, Position, Sensor, Status, Tool, Transform
from ntagen.openigtlink.packets import Counts


@dataclass(frozen=True, slots=True)
class Policy:
    """How a client connects and what it puts up with.

    Attributes:
        stale_s: A sample that came earlier is not used, and an answer is waited for so long.
        connect_s: How long to wait for a connection.
        reconnects: Whether to connect again after the connection was lost.
        first_delay_s: The time to the first attempt; each further one takes twice as long.
        longest_delay_s: The longest time between two attempts.
        interval_ms: If given, TDATA is asked for with this interval (STT_TDATA).
        frame: The frame in which TDATA is asked for; empty for the server's own.
        needs_checksum: Whether messages with a checksum of 0 are skipped as damaged ones.
    """

    stale_s: float = 0.5
    connect_s: float = 2.0
    reconnects: bool = True
    first_delay_s: float = 0.05
    longest_delay_s: float = 1.0
    interval_ms: int | None = None
    frame: str = ""
    needs_checksum: bool = True


Pose = Transform | Position | Tool | Points
"""What says where a device is; of points, the last one is."""

Kind = TypeVar("Kind")


@dataclass(frozen=True, slots=True)
class Sample(Generic[Kind]):
    """What a device sent, and when it came.

    Attributes:
        device: The name of the device, or of the tool of TDATA.
        content: What it sent.
        received_s: When it came, on the monotonic clock of this machine.
        stamp_s: When the sender made it, in seconds since 1970 by its clock; `None` if not told.
        metadata: The metadata of the message.
    """

    device: str
    content: Kind
    received_s: float
    stamp_s: float | None
    metadata: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Held:
    """The newest samples of a connection, by the names of the devices."""

    poses: Mapping[str, Sample[Pose]]
    sensors: Mapping[str, Sample[Sensor]]
    statuses: Mapping[str, Sample[Status]]


@dataclass(frozen=True, slots=True)
class Statistics:
    """What a client has seen until now.

    Attributes:
        counts: The messages that were read and skipped, over all connections.
        connections: How often it was connected.
        gaps: How often a device was silent for longer than `Policy.stale_s`.
        repeats: Samples of each device that were those before them, with the same time stamp: not
            new.
        rates_hz: The rate of the last samples of each device that says where it is.
    """

    counts: Counts
    connections: int
    gaps: int
    repeats: Mapping[str, int]
    rates_hz: Mapping[str, float]
