"""Reads the words of ``--tracker``, and opens what they mean.

::

    openigtlink:HOST:PORT[:DEVICE][,OPTION=VALUE]…
    csv:FILE
    shape:FILE
    mcap:FILE
    PLUGIN[:ARGUMENT]

An address of version 6 stands in brackets: ``[::1]``. `OPTIONS` has the options.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.extensions import TRACKERS, described, names
from ntagen.scene import Vector
from ntagen.tracking.frames import IDENTITY, Transform
from ntagen.tracking.live import N_PER, LiveTracker, Source
from ntagen.tracking.mount import AXES
from ntagen.tracking.playback import Playback, samples_of_log, samples_of_shapes, samples_of_table
from ntagen.tracking.plugin import PluginSource, PluginTracker, open_plugin
from ntagen.units import S_PER

OPTIONS: Final = {
    "axis": "the tool's axis in the direction of insertion: +x, -x, +y, -y, +z (if left out) or -z",
    "bevel": "the tool's axis in the bevel direction, if the tracker sees how the needle is rolled",
    "tip": "where the tip is in the tool's frame, as X/Y/Z in mm, for example tip=0/0/120",
    "force": "the device of SENSOR messages with the force at the tip",
    "force-index": "which of its numbers is the force, from 1",
    "force-unit": "N, mN or kN, if the messages do not name a unit",
    "stale": "a sample is waited for so long, for example 200ms; 0.5s if left out",
    "latency": "how long a sample is under way, for example 40ms",
    "tdata": "ask for TDATA with this interval, for example 50ms",
    "frame": "the frame in which TDATA is asked for",
    "checksum": "always, or optional if the server leaves it out, so that it is 0",
    "sends": "always, or changes if the server is silent while the tool rests, as Slicer is",
}
"""The options of ``openigtlink:``, with what they mean."""

_FORMS: Final = "openigtlink:HOST:PORT[:DEVICE], csv:FILE, shape:FILE or mcap:FILE"
_ADDRESS: Final = re.compile(
    r"(?:\[(?P<six>[^\]]*)\]|(?P<host>[^:,]*)):(?P<port>[^:,]*)(?::(?P<device>[^,]*))?(?P<rest>,.*)?"
)
_TIME: Final = re.compile(r"([0-9]*\.?[0-9]+)(ms|s|min)")


@dataclass(frozen=True, slots=True)
class Recording:
    """A recorded run.

    Attributes:
        kind: ``csv``, ``shape`` or ``mcap``.
        path: The file.
    """

    kind: str
    path: Path


Tracker = Source | Recording | PluginSource
"""What ``--tracker`` can name."""


def parse_tracker(text: str) -> Tracker:
    """What the words of ``--tracker`` mean.

    Raises:
        InputError: They have a mistake.
    """
    kind, colon, rest = text.partition(":")
    if kind == "openigtlink" and colon:
        return _source(text, rest)
    if kind in ("csv", "shape", "mcap") and colon:
        if not rest:
            raise InputError(f"--tracker {text}: the file is missing\nhint: write {kind}:FILE")
        return Recording(kind, Path(rest))
    if kind in names(TRACKERS):
        return PluginSource(kind, rest)
    raise InputError(
        f"there is no tracker '{text}'\n"
        f"hint: write {_FORMS}; installed plugins: {described(TRACKERS)}"
    )


@contextlib.contextmanager
def open_tracker(
    tracker: Tracker, transform: Transform | None, now_s: Callable[[], float]
) -> Iterator[LiveTracker | Playback | PluginTracker]:
    """The sensor behind a tracker, until the end of the block.

    Args:
        tracker: What the user named.
        transform: The registration, if there is one.
        now_s: The clock of the actuator.

    Raises:
        InputError: A file has mistakes, or the registration is missing or too much.
        DeviceError: A server cannot be reached.
    """
    match tracker:
        case Source() | PluginSource():
            if transform is None:
                raise no_registration()
            if isinstance(tracker, PluginSource):
                with open_plugin(tracker, transform, now_s) as plugin:
                    yield plugin
                return
            with LiveTracker(tracker, transform, now_s) as live:
                yield live
        case Recording("csv" | "shape" as kind, path):
            read = samples_of_table if kind == "csv" else samples_of_shapes
            samples, has_force = read(path, transform or IDENTITY)
            yield Playback(str(path), samples, now_s, measures_force=has_force)
        case Recording(_, path):
            if transform is not None and transform != IDENTITY:
                raise InputError(
                    f"{path}: the positions in a log are in the scene's frame already\n"
                    "hint: leave out --registration"
                )
            yield Playback(str(path), samples_of_log(path), now_s)


def no_registration() -> InputError:
    """The error about a tracker without a registration."""
    return InputError(
        "nothing says where the scene lies for this tracker\n"
        "hint: give --registration FILE, which `ntagen calibrate` makes; or "
        "--registration none if the scene is written in the tracker's frame"
    )


def _source(text: str, rest: str) -> Source:
    found = _ADDRESS.fullmatch(rest)
    host = (found["six"] or found["host"]) if found else ""
    if not found or not host:
        raise InputError(
            f"--tracker {text}: host and port are missing\n"
            "hint: write openigtlink:HOST:PORT, for example openigtlink:localhost:18944"
        )
    port = int(found["port"]) if re.fullmatch(r"[0-9]{1,5}", found["port"]) else 0
    if not 0 < port < 2**16:
        raise InputError(
            f"--tracker {text}: '{found['port']}' is not a port\n"
            "hint: a port is a number from 1 to 65535; OpenIGTLink servers often use 18944"
        )
    source = Source(host, port, found["device"] or None)
    for word in (found["rest"] or "").split(",")[1:]:
        name, _, value = word.partition("=")
        source = _with_option(source, name, value)
    mount = source.mount
    if mount.bevel is not None and mount.bevel[1] == mount.axis[1]:
        raise InputError(
            f"the axis {mount.axis} and the bevel {mount.bevel} are on one line\n"
            "hint: the bevel direction is at a right angle to the axis"
        )
    return source


def _with_option(source: Source, name: str, value: str) -> Source:
    """The source with one more option.

    Raises:
        InputError: There is no such option, or its value is wrong.
    """
    if name not in OPTIONS:
        raise InputError(
            f"a tracker has no option '{name}'\nhint: the options are {', '.join(OPTIONS)}"
        )
    changed = _changed(source, name, value) if value else None
    if changed is None:
        raise InputError(f"{name}={value} is wrong\nhint: {name} is {OPTIONS[name]}")
    return changed


def _changed(source: Source, name: str, value: str) -> Source | None:
    """The source with one more option; `None` if the value is wrong."""
    match name:
        case "axis" | "bevel":
            changes: dict[str, Any] = {name: value}
            known = value in AXES
            return replace(source, mount=replace(source.mount, **changes)) if known else None
        case "tip":
            tip_mm = _vector(value)
            return tip_mm and replace(source, mount=replace(source.mount, tip_mm=tip_mm))
        case "force":
            return replace(source, force=value)
        case "force-index":
            index = int(value) if value.isdecimal() else 0
            return replace(source, force_index=index - 1) if index else None
        case "force-unit":
            return replace(source, force_unit=value) if value in N_PER else None
        case "sends":
            repeats = value == "always"
            return replace(source, repeats=repeats) if repeats or value == "changes" else None
        case "checksum":
            needed = value == "always"
            policy = replace(source.policy, needs_checksum=needed)
            return replace(source, policy=policy) if needed or value == "optional" else None
        case "frame":
            return replace(source, policy=replace(source.policy, frame=value))
        case _:
            return _with_time(source, name, value)


def _with_time(source: Source, name: str, value: str) -> Source | None:
    found = _TIME.fullmatch(value)
    time_s = float(found[1]) * S_PER[found[2]] if found else math.nan
    if not 0.0 < time_s < 3600.0:
        return None
    if name == "latency":
        return replace(source, latency_s=time_s)
    policy = source.policy
    if name == "stale":
        return replace(source, policy=replace(policy, stale_s=time_s))
    return replace(source, policy=replace(policy, interval_ms=max(1, round(time_s * 1e3))))


def _vector(text: str) -> Vector | None:
    try:
        x, y, z = (float(part) for part in text.removesuffix("mm").split("/"))
    except ValueError:
        return None
    return (x, y, z) if all(map(math.isfinite, (x, y, z))) else None
