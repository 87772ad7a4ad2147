"""What a controller is: its firmware, its axes and its settings; asking moves nothing."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass
from typing import Final

from ntagen.errors import DeviceError
from ntagen.grbl.link import Link
from ntagen.grbl.protocol import Activity, Feedback, Setting, Status

_AXES: Final = "XYZABC"
_REPORTS_INCHES: Final = 13


@dataclass(frozen=True, slots=True)
class Identity:
    """A controller that has answered.

    Attributes:
        firmware: ``GRBL`` or the name that it gave.
        version: Its version.
        axes: The letters of its axes, in the order of positions.
        settings: Its settings by number; those that are no numbers are left out.
        status: What it did when it was asked.
    """

    firmware: str
    version: str
    axes: str
    settings: dict[int, float]
    status: Status

    def of_axis(self, first: int, letter: str) -> float | None:
        """A setting of an axis, for example its steps per mm with ``first`` 100."""
        return self.settings.get(first + self.axes.index(letter))


def position_of(status: Status) -> tuple[float, ...]:
    """The position in a report: of the machine, or of the work if the controller reports that."""
    position = status.machine or status.work
    assert position is not None  # noqa: S101  a report has one of them
    return position


def identify(link: Link) -> Identity:
    """Asks a controller that stands who it is.

    Raises:
        DeviceError: It is not ready, gives no answer, or its firmware is another one.
    """
    status = link.start()
    if status.is_old:
        raise _too_old(link, "0.9 or older")
    require_ready(link, status)
    # An empty line ends what grblHAL has left of an error.
    link.command("")
    facts = {reply.key: reply.text for reply in link.command("$I") if isinstance(reply, Feedback)}
    version = facts.get("VER", "").strip(":")
    if not version:
        raise link.fail(
            f"{link.name}: the controller does not tell its version as GRBL does\n"
            "hint: GRBL 1.1, grblHAL and FluidNC are known to work in the same way"
        )
    if version.startswith(("0.", "1.0")):
        raise _too_old(link, version)
    settings = {}
    for reply in link.command("$$"):
        if isinstance(reply, Setting):
            with contextlib.suppress(ValueError):
                value = float(reply.value)
                if math.isfinite(value):
                    settings[reply.number] = value
    if settings.get(_REPORTS_INCHES):
        raise link.fail(f"{link.name}: the controller reports inches\nhint: set $13=0")
    count = len(position_of(status))
    letters = facts.get("AXS", "").partition(":")[2] or _AXES[:count]
    return Identity(facts.get("FIRMWARE", "GRBL"), version, letters[:count], settings, status)


def require_ready(link: Link, status: Status) -> Status:
    """The status of a controller that stands and is free to move.

    Raises:
        DeviceError: It is locked, moves already, or waits for somebody.
    """
    match status.activity:
        case Activity.IDLE:
            return status
        case Activity.ALARM:
            raise link.fail(
                f"{link.name}: the controller is locked by an alarm\n"
                "hint: find the cause, measure where the needle is, then unlock the controller "
                "yourself with $X"
            )
        case Activity.RUN | Activity.JOG | Activity.HOME:
            raise link.fail(
                f"{link.name}: the machine is moving already\n"
                "hint: something else commands it; stop that first"
            )
        case _:
            raise link.fail(
                f"{link.name}: the controller is in the state {status}, not idle\n"
                "hint: end that by a reset of the controller, with the needle at rest"
            )


def _too_old(link: Link, version: str) -> DeviceError:
    """The error that the firmware cannot stop a jog at once."""
    return link.fail(
        f"{link.name}: the firmware is GRBL {version}, which has no real-time jog cancel\n"
        "hint: install GRBL 1.1 or grblHAL"
    )


def no_axis(link: Link, letter: str, axes: str) -> DeviceError:
    """The error that an axis is not there."""
    return link.fail(
        f"{link.name}: the controller has no axis {letter}; its axes are {', '.join(axes)}\n"
        "hint: GRBL 1.1 has X, Y and Z only: use one of them for the roll, in degrees"
    )
