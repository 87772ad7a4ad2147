"""What an OpenIGTLink server sends: to see its devices before one of them steers a needle."""

from __future__ import annotations

from dataclasses import dataclass

from ntagen.errors import DeviceError
from ntagen.openigtlink.client import Client
from ntagen.openigtlink.messages import Freedom, Position, Sensor, Tool
from ntagen.openigtlink.packets import Counts
from ntagen.openigtlink.samples import Pose, Sample
from ntagen.scene import Vector
from ntagen.tracking.live import Source
from ntagen.tracking.mount import tip_of

_FREEDOM = {
    Freedom.TRACKER: "TDATA, the tracker itself",
    Freedom.POSE: "TDATA, a whole pose",
    Freedom.POSITION: "TDATA, a position only",
    Freedom.HEADING: "TDATA, without the roll",
}


@dataclass(frozen=True, slots=True)
class Found:
    """A device that says where it is.

    Attributes:
        name: Its name.
        kind: What it sends, in words.
        rate_hz: How often; 0 if it sent only once.
        position_mm: Where it was at last, in the tracker's frame.
        has_stamp: Whether its messages have a time stamp.
        problem: Why its last message could not steer a needle; empty if it could.
    """

    name: str
    kind: str
    rate_hz: float
    position_mm: Vector
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
    devices = tuple(
        _found(held.poses[name], source, statistics.rates_hz.get(name, 0.0))
        for name in sorted(held.poses)
    )
    return Look(
        devices=devices,
        sensors=tuple((name, _words(held.sensors[name].content)) for name in sorted(held.sensors)),
        statuses=tuple((name, str(held.statuses[name].content)) for name in sorted(held.statuses)),
        counts=statistics.counts,
    )


def _found(sample: Sample[Pose], source: Source, rate_hz: float) -> Found:
    problem = ""
    if source.device in (None, sample.device):
        try:
            tip_of(sample.content, source.mount, sample.device)
        except DeviceError as error:
            problem = str(error)
    match sample.content:
        case Position(position_mm, quaternion):
            kind = "POSITION, a position only" if quaternion is None else "POSITION"
        case Tool():
            kind, position_mm = _FREEDOM[sample.content.freedom], sample.content.columns[3]
        case _:
            kind, position_mm = "TRANSFORM", sample.content.columns[3]
    has_stamp = sample.stamp_s is not None
    return Found(sample.device, kind, rate_hz, position_mm, has_stamp, problem)


def _words(sensor: Sensor) -> str:
    factor = sensor.newtons
    numbers = ", ".join(f"{value * (factor or 1.0):.4g}" for value in sensor.values)
    unit = "N" if factor is not None else "in a unit that is not told or no force"
    return f"{numbers} {unit}"
