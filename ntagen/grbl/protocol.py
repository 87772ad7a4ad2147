"""What a GRBL controller says: each line as a value.

The grammar is that of the interface documents of GRBL 1.1 and grblHAL: `ok`, `error:n`, `ALARM:n`,
status reports ``<State|Key:values|…>``, feedback ``[KEY:values]``, settings ``$n=v`` and the banner
after a reset. Keys of status reports that are not known here are ignored, since firmwares add
their own. Positions are in the controller's unit of each axis: mm, and degrees on a rotary axis.

All of that is ASCII, but a message for people, ``[MSG:…]``, which may have the name of a network.
The status reports of GRBL 0.9, with commas between their parts, are read to tell which firmware it
is: nothing can be moved by it.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from enum import Enum
from typing import Final

from ntagen.errors import DeviceError
from ntagen.grbl.names import alarm_text, error_text

BAUD_RATE: Final = 115_200
MAX_LINE_BYTES: Final = 80
"""The longest line that GRBL 1.1 takes, with its end."""

MAX_REPLY_BYTES: Final = 512
"""No reply of a controller is as long as this; longer ones are noise."""

STATUS: Final = b"?"
HOLD: Final = b"!"
RESET: Final = b"\x18"
DOOR: Final = b"\x84"
JOG_CANCEL: Final = b"\x85"


class ProtocolError(DeviceError):
    """The controller said something that is no line of the protocol."""


class Activity(Enum):
    """What the controller does, by its own word."""

    IDLE = "Idle"
    RUN = "Run"
    HOLD = "Hold"
    JOG = "Jog"
    ALARM = "Alarm"
    DOOR = "Door"
    CHECK = "Check"
    HOME = "Home"
    SLEEP = "Sleep"
    TOOL = "Tool"
    CRITICAL = "Critical"
    """FluidNC has met an error that needs a restart."""
    CONFIG_ALARM = "ConfigAlarm"
    """FluidNC cannot read its configuration."""


@dataclass(frozen=True, slots=True)
class Ok:
    """The last line was accepted."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """The last line was refused: ``error:n``."""

    code: int

    def __str__(self) -> str:
        return error_text(self.code)


@dataclass(frozen=True, slots=True)
class Alarm:
    """The controller stopped by itself, and is locked: ``ALARM:n``."""

    code: int

    def __str__(self) -> str:
        return alarm_text(self.code)


@dataclass(frozen=True, slots=True)
class Banner:
    """The controller has started or was reset.

    Attributes:
        firmware: Its name: ``Grbl`` or ``GrblHAL``.
        version: Its version, for example ``1.1h``.
    """

    firmware: str
    version: str


@dataclass(frozen=True, slots=True)
class Setting:
    """A stored setting: ``$n=value``. The value is as it stands, without a comment."""

    number: int
    value: str


@dataclass(frozen=True, slots=True)
class Feedback:
    """Information in brackets: ``[key:text]``."""

    key: str
    text: str


@dataclass(frozen=True, slots=True)
class Status:
    """A status report.

    Attributes:
        activity: What the controller does.
        sub: The number after the state. Of ``Hold`` and ``Door``, 0 says that the axes stand; so
            does 1 of ``Door``: it is still open.
        machine: The machine position, unless the controller reports work positions.
        work: The work position, unless the controller reports machine positions.
        offset: The work offset: machine position minus work position. Few reports have it.
        feed: The speed, in units per minute.
        pins: The input pins that are active, for example ``XZ``.
        is_old: Whether it is a report of GRBL 0.9 or older.
    """

    activity: Activity
    sub: int | None = None
    machine: tuple[float, ...] | None = None
    work: tuple[float, ...] | None = None
    offset: tuple[float, ...] | None = None
    feed: float | None = None
    pins: str = ""
    is_old: bool = False

    @property
    def form(self) -> tuple[bool, int, bool]:
        """What all reports of a controller have in common: which position, and of how many axes."""
        position = self.machine or self.work or ()
        return self.machine is not None, len(position), self.is_old

    @property
    def stands(self) -> bool:
        """Whether the axes do not move, and do not start by themselves."""
        if self.activity is Activity.HOLD:
            return self.sub == 0
        if self.activity is Activity.DOOR:
            return self.sub in (0, 1)
        return self.activity in (Activity.IDLE, Activity.ALARM, Activity.SLEEP, Activity.CHECK)

    def __str__(self) -> str:
        return self.activity.value + ("" if self.sub is None else f":{self.sub}")


Reply = Ok | Refusal | Alarm | Banner | Setting | Feedback | Status
"""One line of a controller."""

_BANNER: Final = re.compile(r"(Grbl\w*) ([0-9][\w.]*) \[.*\]", re.IGNORECASE)
_NUMBERED: Final = re.compile(r"(error|ALARM):([0-9]{1,4})")
_SETTING: Final = re.compile(r"\$([0-9]{1,4})=([^()]*?)\s*(\(.*\))?")
_FEEDBACK: Final = re.compile(r"\[([A-Za-z0-9. ]+):?(.*)\]", re.DOTALL)
_STATUS: Final = re.compile(r"<([A-Za-z]+)(?::([0-9]{1,3}))?((?:\|[^|<>]*)*)>")
_OLD_STATUS: Final = re.compile(r"<([A-Za-z]+),MPos:([-+.,0-9]+),WPos:[-+.,0-9]+[^<>]*>")
"""A report of GRBL 0.9."""

_MESSAGE: Final = re.compile(r"\[MSG:.*\]", re.DOTALL)
_NUMBER: Final = re.compile(r"[+-]?[0-9]{1,12}(\.[0-9]{0,9})?")
_MAX_AXES: Final = 9


def parse(line: bytes) -> Reply | None:
    """Reads one line of a controller, without its end.

    Returns:
        The reply; nothing for an empty line, which comes before each banner.

    Raises:
        ProtocolError: The bytes are no line of the protocol.
    """
    if len(line) > MAX_REPLY_BYTES:
        raise nonsense(line)
    try:
        text = line.decode().strip()
    except UnicodeDecodeError:
        raise nonsense(line) from None
    if not text:
        return None
    if not (text.isascii() and text.isprintable()) and not _MESSAGE.fullmatch(text):
        raise nonsense(line)
    reply = _reply(text)
    if reply is None:
        raise nonsense(line)
    return reply


def _reply(text: str) -> Reply | None:
    """The value of a line; nothing if it is none of the known kinds."""
    if text == "ok":
        return Ok()
    if found := _NUMBERED.fullmatch(text):
        code = int(found[2])
        return Refusal(code) if found[1] == "error" else Alarm(code)
    if found := _STATUS.fullmatch(text):
        return _status(found[1], found[2], found[3])
    if found := _OLD_STATUS.fullmatch(text):
        return _status(found[1], None, f"|MPos:{found[2]}", is_old=True)
    if found := _SETTING.fullmatch(text):
        return Setting(int(found[1]), found[2])
    if found := _FEEDBACK.fullmatch(text):
        return Feedback(found[1], found[2])
    if found := _BANNER.fullmatch(text):
        return Banner(found[1], found[2])
    return None


def _status(state: str, sub: str | None, rest: str, *, is_old: bool = False) -> Status | None:
    """A status report; nothing if its state or the position is wrong."""
    try:
        activity = Activity(state)
    except ValueError:
        return None
    fields = dict(part.partition(":")[::2] for part in rest.split("|")[1:])
    machine, work = _numbers(fields.get("MPos")), _numbers(fields.get("WPos"))
    if machine is None and work is None:
        return None
    feed = _numbers(fields.get("FS", fields.get("F")))
    return Status(
        activity=activity,
        sub=None if sub is None else int(sub),
        machine=machine,
        work=work,
        offset=_numbers(fields.get("WCO")),
        feed=None if feed is None else feed[0],
        pins=fields.get("Pn", ""),
        is_old=is_old,
    )


def _numbers(text: str | None) -> tuple[float, ...] | None:
    """Numbers between commas; nothing if there are none, too many, or one is malformed."""
    if text is None:
        return None
    parts = text.split(",")
    if len(parts) > _MAX_AXES or not all(_NUMBER.fullmatch(part) for part in parts):
        return None
    numbers = tuple(float(part) for part in parts)
    return numbers if all(map(math.isfinite, numbers)) else None


def nonsense(line: bytes) -> ProtocolError:
    """The error about bytes that are no line of the protocol."""
    shown = repr(line[:40])[1:]
    return ProtocolError(
        f"the controller sent {shown}{'…' if len(line) > 40 else ''}, which is no reply of GRBL\n"
        f"hint: check the baud rate ({BAUD_RATE}), the firmware (GRBL 1.1 or grblHAL), the cable "
        "and its shielding"
    )
