"""A simulated needle whose measurements go through OpenIGTLink on this machine.

The whole path is real: codec, sockets, threads, the choice of the newest sample. Only the peer is
our own server, and numbers lose what 32 bits cannot hold (4 nm at 100 mm).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from ntagen.drive.device import Sensor
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import cross, dot, norm, scale, subtract, unit
from ntagen.openigtlink.messages import NEWTON, Content, Points, Position, Transform
from ntagen.openigtlink.messages import Sensor as Readings
from ntagen.openigtlink.packets import Packet
from ntagen.openigtlink.samples import Policy
from ntagen.openigtlink.server import Server
from ntagen.scene import Vector
from ntagen.tracking.frames import IDENTITY
from ntagen.tracking.live import LiveTracker, Source
from ntagen.tracking.mount import Mount

NEEDLE: Final = "NeedleTip"
FORCE: Final = "Force"

_HOST: Final = "127.0.0.1"
_LOOPBACK: Final = Policy(stale_s=5.0)
"""Nothing here is late for any other reason than a busy machine."""


class SimulatedTracker:
    """A sensor that measures another one through OpenIGTLink; use it as a context manager.

    Args:
        needle: What is measured, in the frame of the scene.
        now_s: The clock of the needle.
        reports_pose: Whether its measurements have heading and bevel.
        policy: How long the client waits.

    Attributes:
        server: The server between the needle and the client.
    """

    def __init__(
        self,
        needle: Sensor,
        now_s: Callable[[], float],
        *,
        reports_pose: bool = False,
        policy: Policy = _LOOPBACK,
    ) -> None:
        self._needle = needle
        self.server = Server(_HOST)
        mount = Mount("+z", "+x") if reports_pose else Mount()
        source = Source(_HOST, self.server.port, NEEDLE, mount, force=FORCE, policy=policy)
        try:
            self._tracker = LiveTracker(source, IDENTITY, now_s)
        except BaseException:
            self.server.close()
            raise
        self.server.wait_for_clients(1, policy.connect_s)

    def __enter__(self) -> SimulatedTracker:
        return self

    def __exit__(self, *_: object) -> None:
        self._tracker.close()
        self.server.close()

    def measure(self) -> Measurement:
        """Measures the needle, publishes it, and returns what came back."""
        asked_s = self._tracker.client.now_s()
        sent = self._needle.measure()
        self.server.send(*packets_of(sent))
        # The way takes real time, which must not be mixed with the simulated time of the needle.
        return replace(self._tracker.measure_after(asked_s), time_s=sent.time_s)


def packets_of(measurement: Measurement) -> tuple[Packet, Packet]:
    """A measurement as messages: the force first, so that it is there when the position comes."""
    force = Packet(FORCE, Readings((measurement.force_n,), NEWTON))
    return force, Packet(NEEDLE, _pose_of(measurement))


def _pose_of(measurement: Measurement) -> Content:
    """The pose of a tool whose z axis is the heading, and x the bevel direction; or the shape."""
    heading = measurement.heading
    if measurement.shape:
        return Points(measurement.shape)
    if heading is None:
        return Position(measurement.position_mm)
    z = unit(heading)
    x = measurement.bevel or _across(z)
    x = unit(subtract(x, scale(dot(x, z), z)))
    return Transform((x, cross(z, x), z, measurement.position_mm))


def _across(z: Vector) -> Vector:
    """Some direction at a right angle to another."""
    least = min(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), key=lambda axis: abs(dot(axis, z)))
    return scale(1.0 / norm(cross(z, least)), cross(z, least))
