"""What an OpenIGTLink server sends: to see its devices before one of them steers a needle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from ntagen.errors import DeviceError
from ntagen.openigtlink.client import Client
from ntagen.openigtlink.messages import Freedom, Points, Position, Sensor, Tool
from ntagen.openigtlink.packets import Counts
from ntagen.openigtlink.samples import Pose, Sample, Statistics
from ntagen.scene import Vector
from ntagen.tracking.live import Source, hidden_status, not_seen
from ntagen.tracking.mount import tip_of

_FREEDOM: Final[dict[int, str]] = {
    Freedom.TRACKER: "the tracker itself",
    Freedom.POSE: "a whole pose",
    Freedom.POSITION: "a position only",
    Freedom.HEADING: "without the roll",
}


@dataclass(frozen=True, slots=True)
class Found:
    """A device that says where it is.

    Attributes:
        name: Its name.
        kind: What it sends, in words.
        rate_hz: How often; 0 if it sent only once.
        repeats: How often its last sample came again, with the same time stamp.
        position_mm: Where it was at last, in the tracker's frame; None if the tracker did not see
            it, or sent no numbers.
        has_stamp: Whether its messages have a time stamp.
        problem: Why its last message could not steer a needle; empty if it could.
    """

    name: str
    kind: str
    rate_hz: float
    repeats: int
    position_mm: Vector | None
    has_stamp: bool
    problem: str


@dataclass(frozen=True, slots=True)
class Look:
    """What a server sent.

    Attributes:
        devices: The devices that say where they are, by name.
        sensors: The last numbers of each sensor, in newtons if they are forces, with words for it.
        statuses: The last STATUS of each device, in words.
        counts: The messages that were read and skipped.
    """

    devices: tuple[Found, ...]
    sensors: tuple[tuple[str, str], ...]
    statuses: tuple[tuple[str, str], ...]
    counts: Counts


def look(source: Source, seconds: float) -> Look:
    """What a server sends in some time.

    Args:
        source: The server, and the device that shall steer; its mount must fit what that sends.
        seconds: How long to listen.

    Raises:
        DeviceError: There is no connection, or no message of use, or not from the device.
    """
    with Client(source.host, source.port, source.policy) as client:
        client.listen(seconds)
        held = client.held()
        # For its message: with no such device, it says which there are.
        if source.device is not None or not held.poses:
            client.pose(source.device, any_age=True, waits=False)
        statistics = client.statistics()
    devices = tuple(_found(held.poses[name], source, statistics) for name in sorted(held.poses))
    return Look(
        devices=devices,
        sensors=tuple((name, _words(held.sensors[name].content)) for name in sorted(held.sensors)),
        statuses=tuple((name, str(held.statuses[name].content)) for name in sorted(held.statuses)),
        counts=statistics.counts,
    )


def _found(sample: Sample[Pose], source: Source, statistics: Statistics) -> Found:
    rate_hz = statistics.rates_hz.get(sample.device, 0.0)
    repeats = statistics.repeats.get(sample.device, 0)
    problem = ""
    if source.device in (None, sample.device):
        try:
            _require_use(sample, source, repeats if rate_hz == 0.0 else 0)
        except DeviceError as error:
            problem = str(error)
    match sample.content:
        case Position(position_mm, quaternion):
            kind = "POSITION, a position only" if quaternion is None else "POSITION"
        case Points(positions_mm):
            kind, position_mm = f"POINT, a shape of {len(positions_mm)} places", positions_mm[-1]
        case Tool(freedom=freedom, message=message):
            kind = f"{message}, {_FREEDOM.get(freedom, f'a tool of the unknown type {freedom}')}"
            position_mm = sample.content.columns[3]
        case _:
            kind, position_mm = "TRANSFORM", sample.content.columns[3]
    is_known = not hidden_status(sample) and all(map(math.isfinite, position_mm))
    return Found(
        name=sample.device,
        kind=kind,
        rate_hz=rate_hz,
        repeats=repeats,
        position_mm=position_mm if is_known else None,
        has_stamp=sample.stamp_s is not None,
        problem=problem,
    )


def _require_use(sample: Sample[Pose], source: Source, repeats: int) -> None:
    """Refuses what could not steer a needle.

    Args:
        sample: The last sample of a device.
        source: How the needle lies in its frame, and what the server sends.
        repeats: How often it came again, if it is the only one.

    Raises:
        DeviceError: The tracker does not see the tool, its pose is impossible, or it never changes.
    """
    status = hidden_status(sample)
    if status:
        raise not_seen(sample.device, status)
    tip_of(sample.content, source.mount, sample.device)
    if repeats and source.repeats:
        raise DeviceError(
            f"the samples of '{sample.device}' never change: the same one, with the same time "
            f"stamp, came {repeats + 1} times\n"
            "hint: does the tracker measure, or does its server repeat an old sample?"
        )


def _words(sensor: Sensor) -> str:
    factor = sensor.newtons
    numbers = ", ".join(f"{value * (factor or 1.0):.4g}" for value in sensor.values)
    unit = "N" if factor is not None else "in a unit that is not told or no force"
    return f"{numbers} {unit}"
