"""A tracker that an OpenIGTLink server publishes, as a sensor of the needle."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Protocol

import numpy as np

from ntagen.errors import DeviceError, InputError
from ntagen.needle.measurement import Measurement
from ntagen.needle.shape import Shape, measurement_of
from ntagen.openigtlink.client import Client
from ntagen.openigtlink.messages import Points
from ntagen.openigtlink.messages import Sensor as Readings
from ntagen.openigtlink.samples import Policy, Pose, Sample
from ntagen.tracking.frames import ANATOMICAL, LPS, Transform
from ntagen.tracking.mount import Mount, Tip, tip_of

ANY_FRAME: Final = "tracker"
"""A registration from this frame holds for whatever frame the tracker uses."""

N_PER: Final = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
"""Newtons in one unit of force."""

LATER_S: Final = 1.0
"""By its time stamps, a sample may come so much later than the soonest one. Some senders have wrong
fractions of seconds, which is up to one second."""

_DEVICE_IN_FRAME: Final = re.compile(r".+To(?P<frame>[A-Z].*)")
"""Servers often name a transform after the frames that it leads from and to."""


@dataclass(frozen=True, slots=True)
class Source:
    """What is used of what a server publishes.

    Attributes:
        host: The server.
        port: Its port.
        device: The device, or tool of TDATA; `None` if the server has only one.
        mount: How the needle lies in the frame of the device.
        force: The device of the SENSOR messages with the force; `None` if there is none.
        force_index: Which of its numbers is the force, from 0.
        force_unit: The unit of the force, if the messages do not name it.
        latency_s: How long a sample is under way. A measurement is a sample that was made after it
            was asked for, so it must come this much later.
        repeats: Whether the server sends all the time. One that sends changes only, as Slicer does,
            gives no newer sample of a needle at rest: then the newest one counts, of any age.
        policy: How to connect, and how old a sample may be.
    """

    host: str
    port: int
    device: str | None = None
    mount: Mount = field(default_factory=Mount)
    force: str | None = None
    force_index: int = 0
    force_unit: str | None = None
    latency_s: float = 0.0
    repeats: bool = True
    policy: Policy = field(default_factory=Policy)


class Receiver(Protocol):
    """What has the newest samples of a tracker; see `ntagen.openigtlink.client.Client`."""

    def now_s(self) -> float:
        """The clock of all times of receipt."""

    def pose(
        self,
        device: str | None = None,
        *,
        after_s: float | None = None,
        any_age: bool = False,
        waits: bool = True,
    ) -> Sample[Pose]:
        """The newest sample that says where a device is.

        Raises:
            DeviceError: There is none in time.
        """

    def sensor(
        self, device: str | None = None, *, any_age: bool = False, waits: bool = True
    ) -> Sample[Readings]:
        """The newest reading of a sensor, as `pose`."""

    def close(self) -> None:
        """Ends what receives."""


class LiveTracker:
    """A `ntagen.drive.device.Sensor` behind an OpenIGTLink server; use it as a context manager.

    Args:
        source: What to listen to.
        transform: From the tracker's frame to that of the scene.
        now_s: The clock for the times of measurements; that of the actuator.
        receiver: What has the samples, if they do not come from such a server.

    Raises:
        InputError: The transform is not for this device.
        DeviceError: There is no connection.
    """

    def __init__(
        self,
        source: Source,
        transform: Transform,
        now_s: Callable[[], float],
        receiver: Receiver | None = None,
    ) -> None:
        require_frame(source, transform)
        self._source = source
        self._transform = transform
        self._now_s = now_s
        self._least_delay_s = math.inf
        self.client = receiver or Client(source.host, source.port, source.policy)

    def __enter__(self) -> LiveTracker:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def measures_force(self) -> bool:
        """Whether measurements have a force; without it, the force is always 0."""
        return self._source.force is not None

    def close(self) -> None:
        """Closes the connection."""
        self.client.close()

    def measure(self) -> Measurement:
        """Measures the needle now: with the next sample, unless the server sends changes only.

        Raises:
            DeviceError: There is no sample in time, or it is impossible.
        """
        return self.measure_after(self.client.now_s())

    def measure_after(self, asked_s: float) -> Measurement:
        """The same with a sample that came after a moment on the client's clock."""
        source = self._source
        return self._measurement(asked_s + source.latency_s if source.repeats else None, True)

    def newest(self) -> Measurement:
        """The newest measurement that is not stale, at once: for whoever watches a motion.

        Raises:
            DeviceError: There is none, the tool is hidden, or the sample is impossible.
        """
        return self._measurement(None, False)

    def _measurement(self, after_s: float | None, waits: bool) -> Measurement:
        source = self._source
        sample = self._visible(after_s, waits)
        self._require_in_time(sample)
        tip = tip_of(sample.content, source.mount, sample.device)
        force_n = self._force_n(waits)
        age_s = self.client.now_s() - sample.received_s + source.latency_s
        time_s = self._now_s() - age_s
        if isinstance(sample.content, Points):
            places = [self._transform.point(one) for one in sample.content.positions_mm]
            return measurement_of(Shape(np.array(places), time_s), force_n)
        return _in_scene(tip, self._transform, time_s, force_n)

    def _visible(self, after_s: float | None, waits: bool) -> Sample[Pose]:
        """The next sample in which the tool is visible."""
        source = self._source
        end_s = self.client.now_s() + source.policy.stale_s
        while True:
            sample = self.client.pose(
                source.device, after_s=after_s, any_age=not source.repeats, waits=waits
            )
            hidden = hidden_status(sample)
            if not hidden:
                return sample
            if self.client.now_s() >= end_s or not source.repeats or not waits:
                raise not_seen(sample.device, hidden)
            after_s = sample.received_s

    def _require_in_time(self, sample: Sample[Pose]) -> None:
        """Refuses a sample that was under way for longer than others, by its time stamp.

        The clocks of the sender and of this machine need not agree: only changes count.

        Raises:
            DeviceError: It is late.
        """
        if sample.stamp_s is None:
            return
        delay_s = sample.received_s - sample.stamp_s
        self._least_delay_s = min(self._least_delay_s, delay_s)
        later_s = delay_s - self._least_delay_s
        if later_s > LATER_S:
            raise DeviceError(
                f"by its time stamp, the position of '{sample.device}' came {later_s:.1f} s later "
                f"than others; {LATER_S:g} s is allowed\n"
                "hint: is the tracker or the network too slow, or was the tracker's clock set?"
            )

    def _force_n(self, waits: bool) -> float:
        source = self._source
        if source.force is None:
            return 0.0
        sample = self.client.sensor(source.force, any_age=not source.repeats, waits=waits)
        return _newtons(sample, source)


def require_frame(source: Source, transform: Transform) -> None:
    """Refuses a transform that cannot be meant for the device.

    Raises:
        InputError: It is from LPS, or from another frame than that in the device's name.
    """
    if transform.source == LPS:
        raise InputError(
            "the registration is from positions in LPS, but OpenIGTLink has positions in RAS or in "
            "a tracker's own frame\nhint: make it again with `ntagen calibrate --from RAS`"
        )
    found = _DEVICE_IN_FRAME.fullmatch(source.device or "")
    if not found or transform.source in (*ANATOMICAL, ANY_FRAME, transform.target):
        return
    if found["frame"].lower() != transform.source.lower():
        raise InputError(
            f"'{source.device}' comes in the frame {found['frame']}, but the registration is from "
            f"{transform.source}\nhint: choose another device, or calibrate in {found['frame']}"
        )


def hidden_status(sample: Sample[Pose]) -> str:
    """The status of a tool that the tracker does not see, as PLUS tells it; empty if it sees it."""
    status = sample.metadata.get("TransformStatus", "OK")
    if status.upper() != "OK":
        return status or "not told"
    is_valid = sample.metadata.get("TransformValid", "True").lower() not in ("false", "0")
    return "" if is_valid else "not valid"


def not_seen(device: str, status: str) -> DeviceError:
    """The error about a tool that the tracker does not see."""
    return DeviceError(
        f"the tracker does not see '{device}': its status is {status}\n"
        "hint: is the tool in view, and is it plugged in?"
    )


def _newtons(sample: Sample[Readings], source: Source) -> float:
    """The force in a message.

    Raises:
        DeviceError: There is none, or it has no known unit.
    """
    values, unit = sample.content.values, sample.content.unit
    if source.force_index >= len(values):
        raise DeviceError(
            f"the sensor '{sample.device}' sends {len(values)} numbers, and number "
            f"{source.force_index + 1} should be the force"
        )
    factor = sample.content.newtons
    if unit == 0 and source.force_unit is not None:
        factor = N_PER[source.force_unit]
    if factor is None:
        told = "does not say the unit of its numbers" if unit == 0 else "sends no force"
        raise DeviceError(
            f"the sensor '{sample.device}' {told}\n"
            "hint: name another sensor, or add force-unit=N if it sends newtons without saying so"
        )
    return values[source.force_index] * factor


def _in_scene(tip: Tip, transform: Transform, time_s: float, force_n: float) -> Measurement:
    return Measurement(
        time_s=time_s,
        position_mm=transform.point(tip.position_mm),
        force_n=force_n,
        heading=None if tip.heading is None else transform.direction(tip.heading),
        bevel=None if tip.bevel is None else transform.direction(tip.bevel),
    )
