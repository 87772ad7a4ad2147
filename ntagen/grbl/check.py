"""Looks at a controller without moving anything."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ntagen.grbl.axes import Axes, motors
from ntagen.grbl.identity import Identity, identify, position_of
from ntagen.grbl.link import Link
from ntagen.grbl.port import Port

_WATCH_S: Final = 0.3
_HOLDS_ALWAYS: Final = 255.0
_IDLE_DELAY, _SOFT_LIMITS, _HARD_LIMITS, _HOMING = 1, 20, 21, 22
_STEPS, _SPEED, _ACCELERATION, _TRAVEL = 100, 110, 120, 130


@dataclass(frozen=True, slots=True)
class AxisFacts:
    """What the controller says about an axis: per mm or degree, per second."""

    letter: str
    position: float
    steps_per_unit: float
    speed: float
    acceleration: float
    travel: float


@dataclass(frozen=True, slots=True)
class Findings:
    """What was found out about a controller.

    Attributes:
        firmware: Its name.
        version: Its version.
        state: What it does, in its own word.
        stands: Whether its axes did not move while it was looked at.
        pins: The input pins that are active.
        axes: Its axes.
        soft_limits: Whether it refuses motions beyond the travel.
        hard_limits: Whether limit switches stop it.
        homing: Whether it can find its own zero.
        notes: What should be changed before a needle is driven.
    """

    firmware: str
    version: str
    state: str
    stands: bool
    pins: str
    axes: tuple[AxisFacts, ...]
    soft_limits: bool
    hard_limits: bool
    homing: bool
    notes: tuple[str, ...]


def inspect(port: Port, axes: Axes | None = None) -> Findings:
    """Asks a controller who it is and what it does; nothing is moved, and no setting changes.

    Args:
        port: The wire to it.
        axes: What its axes should be, if that is known.

    Raises:
        DeviceError: Nothing answers, what answers is no GRBL that is ready, or its axes are others.
    """
    link = Link(port)
    identity = identify(link)
    if axes is not None:
        motors(link, identity, axes)
    link.pause(_WATCH_S)
    status = link.status()
    stands = status.stands and position_of(status) == position_of(identity.status)
    settings = identity.settings
    return Findings(
        firmware=identity.firmware,
        version=identity.version,
        state=str(status),
        stands=stands,
        pins=status.pins,
        axes=tuple(_axis(identity, letter) for letter in identity.axes),
        soft_limits=bool(settings.get(_SOFT_LIMITS)),
        hard_limits=bool(settings.get(_HARD_LIMITS)),
        homing=bool(settings.get(_HOMING)),
        notes=_notes(identity, status.pins, stands=stands),
    )


def _axis(identity: Identity, letter: str) -> AxisFacts:
    def setting(first: int) -> float:
        return identity.of_axis(first, letter) or 0.0

    return AxisFacts(
        letter=letter,
        position=position_of(identity.status)[identity.axes.index(letter)],
        steps_per_unit=setting(_STEPS),
        speed=setting(_SPEED) / 60.0,
        acceleration=setting(_ACCELERATION),
        travel=setting(_TRAVEL),
    )


def _notes(identity: Identity, pins: str, *, stands: bool) -> tuple[str, ...]:
    """What a user should change or know."""
    notes = []
    delay_ms = identity.settings.get(_IDLE_DELAY)
    if delay_ms is not None and delay_ms < _HOLDS_ALWAYS:
        notes.append(
            f"the motors are switched off {delay_ms:g} ms after each motion, so the needle may "
            "slip: set $1=255"
        )
    if not identity.settings.get(_HARD_LIMITS):
        notes.append("no limit switch stops the machine: set $21=1 if it has such switches")
    if pins:
        notes.append(f"input pins are active: {pins}")
    if not stands:
        notes.append("the machine moved while it was looked at")
    return tuple(notes)
