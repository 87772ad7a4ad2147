"""What a file says about real devices: a needle's steppers and a tracker, as plain values.

The rooms of the devices make the connections; here are only the descriptions.
"""

from __future__ import annotations

import re

from ntagen.errors import InputError
from ntagen.rules import Breach
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis of a controller.

    Attributes:
        letter: Its letter in the controller's language, for example ``X``.
        steps_per_unit: Steps for one mm of insertion, or for one degree of a roll; negative if
            the axis turns the other way round.
    """

    letter: str
    steps_per_unit: float


@dataclass(frozen=True, slots=True)
class GrblDevice:
    """A needle that a GRBL controller moves.

    Attributes:
        port: The serial port, for example ``/dev/ttyACM0``.
        insert: The axis that pushes and pulls; its steps are per mm.
        roll: The axis that rolls; its steps are per degree.
    """

    port: str
    insert: Axis
    roll: Axis

    def __str__(self) -> str:
        return (
            f"device grbl at {self.port}: inserts by {self.insert.letter} with "
            f"{self.insert.steps_per_unit:g} steps/mm, rolls by {self.roll.letter} with "
            f"{self.roll.steps_per_unit:g} steps/deg"
        )


@dataclass(frozen=True, slots=True)
class OpenIGTLinkTracker:
    """A tracker that sends the tip over the network in the protocol OpenIGTLink.

    Attributes:
        host: The name or address of the server.
        port: The server's port.
        name: The name of the device whose transforms are read; empty for the first one.
    """

    host: str
    port: int
    name: str = ""

    def __str__(self) -> str:
        return f"tracker openigtlink at {self.host}:{self.port}: {self.name or 'the first device'}"


AXIS_LETTERS = "ABCXYZ"
"""The letters of GRBL's axes."""


def axis_letter(letter: str) -> Breach | None:
    """An axis has one of the letters of GRBL."""
    if len(letter) == 1 and letter in AXIS_LETTERS:
        return None
    return Breach(
        "axis-malformed",
        f"there is no axis `{letter}`",
        f"write one of the letters {', '.join(AXIS_LETTERS)}",
    )


def axis_steps(steps: float) -> Breach | None:
    """A number of steps is not 0."""
    if steps != 0.0:
        return None
    return Breach("axis-malformed", "with 0 steps the axis does not move", "write the true number")


def address(text: str) -> Breach | None:
    """An address is a host and a port between 1 and 65535."""
    match = re.fullmatch(r"(\[[^\[\]\s]+\]|[^\s:\[\]]+):([0-9]{1,5})", text)
    if match and 1 <= int(match[2]) <= 65535:
        return None
    return Breach(
        "address-malformed",
        f"`{text}` is not a host and a port",
        'write for example "localhost:18944"',
    )


def host_and_port(text: str) -> tuple[str, int]:
    """The host and the port of an address, ``localhost:18944`` or ``[::1]:18944``.

    Raises:
        InputError: It is not an address.
    """
    breach = address(text)
    if breach is not None:
        raise InputError(f"{breach.message}\nhint: {breach.hint}")
    host, _, port = text.rpartition(":")
    return host.strip("[]"), int(port)
