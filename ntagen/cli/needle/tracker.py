"""The options of ``drive`` about trackers, and what measures the needle because of them."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from ntagen.cli.terminal import echo
from ntagen.errors import DeviceError, InputError

if TYPE_CHECKING:
    from ntagen.drive.device import Device, Sensor
    from ntagen.hardware import OpenIGTLinkTracker
    from ntagen.scene import Pose
    from ntagen.tracking.frames import Transform
    from ntagen.tracking.look import Found, Look
    from ntagen.tracking.spec import Tracker

SIMULATED: Final = "openigtlink+sim"
"""The tracker that measures a simulated needle through a server of ours on this machine."""

NO_REGISTRATION: Final = "none"

Sense = Callable[["Device"], "Sensor"]
"""Gives the sensor for a needle, whose clock it takes."""

tracker_option = click.option(
    "--tracker",
    metavar="TRACKER",
    help="What measures the needle, if not the needle itself: "
    "openigtlink:HOST:PORT[:DEVICE][,OPTION=VALUE]…, csv:FILE, shape:FILE, mcap:FILE, "
    "openigtlink+sim, or PLUGIN:ARGUMENT. docs/tracking.md has the options.",
)

registration_option = click.option(
    "--registration",
    metavar="FILE.json|none",
    help="Where the scene lies for the tracker: a file of `ntagen calibrate`, or none if the scene "
    "is written in the tracker's frame.",
)


@dataclass(frozen=True, slots=True)
class Tracking:
    """What measures the needle.

    Attributes:
        text: The words of the user; empty if the needle measures itself.
        tracker: What they mean; `None` for the needle itself and for `SIMULATED`.
        transform: The registration, if one was given.
    """

    text: str = ""
    tracker: Tracker | None = None
    transform: Transform | None = None


def tracking_of(
    tracker: str | None,
    registration: str | None,
    described: OpenIGTLinkTracker | None = None,
    *,
    is_real: bool = False,
) -> Tracking:
    """What the words of the options mean.

    Args:
        tracker: The words of --tracker.
        registration: Those of --registration.
        described: The tracker in the task. It counts for a real needle, or if a registration is
            given for it: a simulated needle needs none and measures itself.
        is_real: Whether the needle is a real one.

    Raises:
        InputError: They have a mistake, or the registration cannot be read.
    """
    if is_real and tracker == SIMULATED:
        raise InputError(
            f"{SIMULATED} measures simulated needles only\n"
            "hint: give --tracker openigtlink:HOST:PORT:DEVICE"
        )
    if tracker is None and described is not None and (is_real or registration is not None):
        tracker = _words_for(described)
    if is_real and tracker is None:
        raise InputError(
            "nothing measures the needle\n"
            "hint: give --tracker openigtlink:HOST:PORT:DEVICE, or let the task describe a tracker"
        )
    if tracker is None or tracker == SIMULATED:
        if registration is not None:
            raise InputError(
                "--registration is for a tracker, and there is none that needs it\n"
                "hint: give --tracker too, or leave it out"
            )
        return Tracking(tracker or "")
    from ntagen.tracking.frames import IDENTITY
    from ntagen.tracking.spec import parse_tracker
    from ntagen.tracking.transform_file import read_transform

    found = parse_tracker(tracker)
    if is_real:
        _require_live(tracker, found, registration)
    if registration is None:
        return Tracking(tracker, found)
    is_none = registration == NO_REGISTRATION
    return Tracking(tracker, found, IDENTITY if is_none else read_transform(Path(registration)))


def _require_live(text: str, tracker: Tracker, registration: str | None) -> None:
    """Refuses what cannot measure a real needle, before any device is opened.

    Raises:
        InputError: It is a recording, or there is no registration.
    """
    from ntagen.tracking.spec import Recording, no_registration

    if isinstance(tracker, Recording):
        raise InputError(
            f"{text} is a recording, and a real needle must be seen while it moves\n"
            "hint: give --tracker openigtlink:HOST:PORT:DEVICE"
        )
    if registration is None:
        raise no_registration()


def _words_for(described: OpenIGTLinkTracker) -> str:
    """The words of --tracker for the tracker in a task."""
    host = f"[{described.host}]" if ":" in described.host else described.host
    return f"openigtlink:{host}:{described.port}" + (f":{described.name}" if described.name else "")


@contextlib.contextmanager
def opened(tracking: Tracking, entry: Pose, *, watches_force: bool) -> Iterator[Sense | None]:
    """Connects to the tracker until the end of the block; `None` if the needle measures itself.

    Args:
        tracking: What measures the needle.
        entry: Where the needle is at the start.
        watches_force: Whether the driver relies on a force.

    Raises:
        InputError: The tracker cannot be used so.
        DeviceError: It cannot be reached.
    """
    if not tracking.text:
        yield None
        return
    with contextlib.ExitStack() as stack:
        if tracking.tracker is None:
            from ntagen.tracking.simulated import SimulatedTracker

            yield lambda needle: stack.enter_context(SimulatedTracker(needle, needle.now_s))
            return
        from ntagen.tracking.opening import require_force
        from ntagen.tracking.plausible import Plausible
        from ntagen.tracking.spec import open_tracker

        needles: list[Device] = []
        sensor = stack.enter_context(
            open_tracker(tracking.tracker, tracking.transform, lambda: needles[0].now_s())
        )
        require_force(tracking.text, sensor.measures_force, watches_force)

        def sense(needle: Device) -> Sensor:
            needles.append(needle)
            return Plausible(sensor, entry)

        yield sense


def look_at(text: str, seconds: float, *, as_json: bool) -> int:
    """Prints what an OpenIGTLink server sends; returns the exit code.

    Raises:
        InputError: The words have a mistake.
        DeviceError: There is no server, or nothing of use comes from it.
    """
    from ntagen.tracking.live import Source
    from ntagen.tracking.look import look
    from ntagen.tracking.spec import parse_tracker

    source = parse_tracker(text)
    if not isinstance(source, Source):
        raise InputError(f"{text} is a file\nhint: only openigtlink:HOST:PORT can be listened to")
    found = look(source, seconds)
    if as_json:
        echo(json.dumps(asdict(found)))
    else:
        _tell(text, seconds, found)
    problems = [one.problem for one in found.devices if one.problem]
    if problems:
        raise DeviceError("\n".join(problems))
    return 0


def _tell(text: str, seconds: float, found: Look) -> None:
    echo(f"{text}: {len(found.devices)} device(s) in {seconds:g} s")
    for one in found.devices:
        stamp = "" if one.has_stamp else ", without time stamps"
        echo(f"  {one.name}: {one.kind}, {_rate(one)}{stamp}; {_where(one)}")
    for name, words in found.sensors:
        echo(f"  sensor {name}: {words}")
    for name, words in found.statuses:
        echo(f"  status of {name or 'the server'}: {words}")
    if found.counts.skipped:
        echo(f"  skipped: {found.counts}")


def _rate(one: Found) -> str:
    if one.repeats and one.rate_hz == 0.0:
        return f"the same sample {one.repeats + 1} times"
    return f"{one.rate_hz:.1f} per s"


def _where(one: Found) -> str:
    if one.position_mm is None:
        return "not seen"
    return f"at ({', '.join(f'{number:.2f}' for number in one.position_mm)}) mm"
