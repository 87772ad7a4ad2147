"""A client that always has the newest sample of each device, and knows how old it is.

A thread reads the connection. It sees the end of the stream at once, and connects again with
growing delays. It never judges samples: whoever asks for one gets one that came lately, or an error
that says what happened and which devices were seen.

The age of a sample counts from its receipt by this machine's monotonic clock. The sender's time
stamp is kept beside it, but its clock may be wrong, and many senders leave it out. It shows one
thing: the same content with the same stamp is no new sample, but the old one sent again. Nothing in
the protocol shows that a silent peer is alive, so that silence is the only sign of a peer that is
gone.
"""

from __future__ import annotations

import contextlib
import math
import re
import socket
import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Final, Self

from ntagen.errors import DeviceError
from ntagen.openigtlink.messages import (
    Points,
    Position,
    Sensor,
    StartTracking,
    Status,
    StopTracking,
    TrackingData,
    TrackingReply,
    Transform,
)
from ntagen.openigtlink.packets import Counts, Decoder, Packet, ProtocolError
from ntagen.openigtlink.samples import Held, Kind, Policy, Pose, Sample, Statistics

_PIECE_BYTES: Final = 2**16
_NAMES: Final = 1000
"""So many devices are kept; a server that invents names must not fill the memory."""

_RATED: Final = 64
"""The rate of a device is that of its last samples, at most so many."""

_JOIN_S: Final = 5.0


class Client:
    """A connection to an OpenIGTLink server; use it as a context manager.

    Args:
        host: The server's name or address.
        port: Its port.
        policy: How to connect, and what to put up with.

    Raises:
        DeviceError: There is no connection within `Policy.connect_s`.
    """

    def __init__(self, host: str, port: int, policy: Policy | None = None) -> None:
        self._address = (host, port)
        self._place = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        self._policy = policy or Policy()
        self._changed = threading.Condition()
        self._poses: dict[str, Sample[Pose]] = {}
        self._sensors: dict[str, Sample[Sensor]] = {}
        self._statuses: dict[str, Sample[Status]] = {}
        self._receipts: dict[str, deque[float]] = {}
        self._gaps = 0
        self._repeats: dict[str, int] = {}
        self._connections = 0
        self._before = Counts()
        self._counts = Counts()
        self._trouble = ""
        self._earlier_trouble = ""
        self._ended = False
        self._refused = False
        self._closing = threading.Event()
        self._socket: socket.socket | None = None
        self._connect()
        self._thread = threading.Thread(target=self._work, name="igtl-client", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def now_s(self) -> float:
        """The clock of all times of receipt: monotonic, of this machine."""
        return time.monotonic()

    def pose(
        self,
        device: str | None = None,
        *,
        after_s: float | None = None,
        any_age: bool = False,
        waits: bool = True,
    ) -> Sample[Pose]:
        """The newest sample that says where a device is; waits for it for `Policy.stale_s`.

        Args:
            device: The name of the device; `None` if the server sends only one.
            after_s: The sample must have come after this time on the monotonic clock; by default
                it must be younger than `Policy.stale_s`.
            any_age: Whether a sample of any age will do, as long as the connection stands.
            waits: Whether to wait for it; if not, the answer comes at once.

        Raises:
            DeviceError: There is no such sample in this time.
        """
        least_s = -math.inf if any_age else after_s
        return self._newest(self._poses, device, least_s, "position", waits)

    def sensor(
        self, device: str | None = None, *, any_age: bool = False, waits: bool = True
    ) -> Sample[Sensor]:
        """The newest reading of a sensor, as `pose`."""
        least_s = -math.inf if any_age else None
        return self._newest(self._sensors, device, least_s, "sensor reading", waits)

    def status(self, device: str) -> Sample[Status] | None:
        """The newest STATUS of a device, of any age; `None` if there was none."""
        with self._changed:
            return self._statuses.get(device)

    def held(self) -> Held:
        """All newest samples, of any age."""
        with self._changed:
            return Held(dict(self._poses), dict(self._sensors), dict(self._statuses))

    def listen(self, seconds: float) -> None:
        """Waits, while samples come."""
        self._closing.wait(seconds)

    def devices(self) -> tuple[str, ...]:
        """The names of the devices that said where they are, sorted."""
        with self._changed:
            return tuple(sorted(self._poses))

    def statistics(self) -> Statistics:
        """What was seen until now."""
        with self._changed:
            rates = {name: _rate_hz(times) for name, times in self._receipts.items()}
            counts = self._before + self._counts
            return Statistics(counts, self._connections, self._gaps, dict(self._repeats), rates)

    def close(self) -> None:
        """Closes the connection and ends the thread. It may be called twice."""
        self._closing.set()
        with self._changed:
            connection = self._socket
        if connection is not None:
            if self._policy.interval_ms is not None:
                with contextlib.suppress(OSError):
                    connection.sendall(Packet("", StopTracking()).to_bytes())
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        self._thread.join(_JOIN_S)

    # What callers get.

    def _newest(
        self,
        samples: Mapping[str, Sample[Kind]],
        device: str | None,
        after_s: float | None,
        what: str,
        waits: bool,
    ) -> Sample[Kind]:
        end_s = time.monotonic() + (self._policy.stale_s if waits else 0.0)
        with self._changed:
            while True:
                now_s = time.monotonic()
                least_s = now_s - self._policy.stale_s if after_s is None else after_s
                sample = (
                    _only(samples, self._place, what) if device is None else samples.get(device)
                )
                # A sample of a connection that is lost says nothing, even if it is young.
                if sample is not None and sample.received_s > least_s and not self._trouble:
                    return sample
                if now_s >= end_s or self._ended:
                    raise DeviceError(self._why(samples, device, what, now_s))
                self._changed.wait(end_s - now_s)

    def _why(
        self, samples: Mapping[str, Sample[Kind]], device: str | None, what: str, now_s: float
    ) -> str:
        """Why there is no sample; the lock is held."""
        if self._trouble:
            return self._trouble
        if self._earlier_trouble and not self._counts.read:
            return self._earlier_trouble
        named = f"the {what} of '{device}'" if device else f"a {what}"
        if self._refused:
            return f"{self._place} refuses to send TDATA (its answer to STT_TDATA)"
        sample = samples.get(device) if device else next(iter(samples.values()), None)
        if sample is not None:
            status = self._statuses.get(sample.device)
            told = f"; its last STATUS is: {status.content}" if status else ""
            damaged = self._counts.wrong_crc
            if damaged:
                told += f"; {damaged} messages had a wrong checksum"
            repeats = self._repeats.get(sample.device, 0)
            if repeats:
                told += f"; since then the same sample came {repeats} times: the tracker hangs"
            return (
                f"{named} is stale: the last one from {self._place} came "
                f"{now_s - sample.received_s:.2f} s ago, and {self._policy.stale_s:g} s is "
                f"allowed{told}\nhint: is the tool in view, and does the server send all the time?"
            )
        if samples:
            seen = ", ".join(f"'{name}'" for name in sorted(samples))
            return f"{self._place} does not send {named}; it sends {seen}{_frames(device, samples)}"
        if self._counts.read:
            return (
                f"{self._place} does not send {named}, and no other {what}\n"
                "hint: does the server wait for a request? Then ask for TDATA"
            )
        but = f": {self._counts}" if self._counts.skipped else ""
        hint = "is the tracker on? Some servers wait for a request: then ask for TDATA"
        if self._counts.wrong_crc:
            hint = "the messages are damaged on the way, or the server computes another checksum"
        if self._counts.zero_crc:
            hint = "if the server leaves the checksum out, add checksum=optional"
        return (
            f"{self._place} accepts connections, but has sent nothing of use for "
            f"{self._policy.stale_s:g} s{but}\nhint: {hint}"
        )

    # The thread.

    def _work(self) -> None:
        delay_s = self._policy.first_delay_s
        while not self._closing.is_set():
            if self._socket is not None:
                self._read(self._socket)
                delay_s = self._policy.first_delay_s
                if not self._policy.reconnects:
                    break
            if self._closing.wait(delay_s):
                break
            delay_s = min(2.0 * delay_s, self._policy.longest_delay_s)
            with contextlib.suppress(DeviceError):
                self._connect()
        with self._changed:
            self._ended = True
            self._changed.notify_all()
        self._forget()

    def _connect(self) -> None:
        """Makes a connection.

        Raises:
            DeviceError: That is not possible.
        """
        try:
            connection = socket.create_connection(self._address, self._policy.connect_s)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except OSError as error:
            reason = "no answer" if isinstance(error, TimeoutError) else _reason(error)
            raise DeviceError(
                f"cannot connect to the tracker at {self._place}: {reason}\n"
                "hint: check that the OpenIGTLink server runs, and its host and port"
            ) from error
        with self._changed:
            self._socket = connection
            self._trouble = ""
            self._refused = False
            self._connections += 1
            self._before += self._counts
            self._counts = Counts()
            # What came over an earlier connection says nothing about this server.
            for samples in (self._poses, self._sensors, self._statuses):
                samples.clear()
        if self._policy.interval_ms is not None:
            request = StartTracking(self._policy.interval_ms, self._policy.frame)
            with contextlib.suppress(OSError):
                connection.sendall(Packet("", request).to_bytes())

    def _read(self, connection: socket.socket) -> None:
        """Reads until the connection ends."""
        connection.settimeout(None)
        decoder = Decoder(needs_checksum=self._policy.needs_checksum)
        try:
            while data := connection.recv(_PIECE_BYTES):
                packets = decoder.feed(data)
                received_s = time.monotonic()
                with self._changed:
                    for packet in packets:
                        self._take(packet, received_s)
                    self._counts = replace(decoder.counts)
                    self._changed.notify_all()
                if decoder.error is not None:
                    raise decoder.error
            trouble = f"the server at {self._place} has closed the connection"
        except ProtocolError as error:
            trouble = f"{self._place}: {error}"
        except OSError as error:
            trouble = f"the connection to {self._place} is lost: {_reason(error)}"
        with self._changed:
            self._trouble = self._earlier_trouble = trouble
            self._changed.notify_all()
        self._forget()

    def _take(self, packet: Packet, received_s: float) -> None:
        """Keeps what a message says; the lock is held."""

        def sample(device: str, content: Kind) -> Sample[Kind]:
            return Sample(device, content, received_s, packet.stamp_s, packet.metadata)

        match packet.content:
            case Transform() | Position() | Points() as content:
                self._keep_pose(sample(packet.device, content))
            case TrackingData(tools):
                for tool in tools:
                    self._keep_pose(sample(tool.name, tool))
            case Sensor() as content:
                _keep(self._sensors, sample(packet.device, content))
            case Status() as content:
                _keep(self._statuses, sample(packet.device, content))
            case TrackingReply(accepted):
                self._refused = not accepted

    def _keep_pose(self, sample: Sample[Pose]) -> None:
        before = self._poses.get(sample.device)
        if before and sample.stamp_s is not None and _same(before, sample):
            # A tracker that hangs, behind a server that does not.
            self._repeats[sample.device] = self._repeats.get(sample.device, 0) + 1
            return
        _keep(self._poses, sample)
        self._repeats.pop(sample.device, None)
        times = self._receipts.get(sample.device)
        if times is None:
            if len(self._receipts) < _NAMES:
                self._receipts[sample.device] = deque([sample.received_s], maxlen=_RATED)
            return
        if sample.received_s - times[-1] > self._policy.stale_s:
            self._gaps += 1
        times.append(sample.received_s)

    def _forget(self) -> None:
        with self._changed:
            connection, self._socket = self._socket, None
        if connection is not None:
            connection.close()


def _keep(samples: dict[str, Sample[Kind]], sample: Sample[Kind]) -> None:
    """Puts a sample in the place of the one before it."""
    if sample.device in samples or len(samples) < _NAMES:
        samples[sample.device] = sample


def _same(one: Sample[Pose], other: Sample[Pose]) -> bool:
    """Whether two samples say the same of the same moment."""
    return (one.stamp_s, one.content) == (other.stamp_s, other.content)


def _only(samples: Mapping[str, Sample[Kind]], place: str, what: str) -> Sample[Kind] | None:
    """The sample of the only device, if there is one.

    Raises:
        DeviceError: There are several.
    """
    if len(samples) > 1:
        seen = ", ".join(f"'{name}'" for name in sorted(samples))
        raise DeviceError(
            f"{place} sends a {what} of several devices: {seen}\nhint: say which one is meant"
        )
    return next(iter(samples.values()), None)


def _frames(device: str | None, samples: Mapping[str, object]) -> str:
    """A hint if the same tool comes in another frame; names are often `ToolToFrame`."""
    found = re.fullmatch(r"(.+)To(.+)", device or "")
    others = [re.fullmatch(r"(.+)To(.+)", name) for name in samples]
    same = [other[2] for other in others if found and other and other[1] == found[1]]
    if not found or not same:
        return "\nhint: give the name of the device as the server writes it"
    return (
        f"\nhint: '{found[1]}' comes in the frame '{same[0]}', not in '{found[2]}': "
        "a registration holds for one frame only"
    )


def _rate_hz(times: deque[float]) -> float:
    """The rate of events; 0 if there was only one."""
    return (len(times) - 1) / (times[-1] - times[0]) if times[-1] > times[0] else 0.0


def _reason(error: OSError) -> str:
    """The words of the operating system."""
    return (error.strerror or str(error) or type(error).__name__).lower()
