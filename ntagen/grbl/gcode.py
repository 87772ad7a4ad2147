"""The G-code that the emulator reads: straight motions, dwells and modal words.

Arcs, probing, offsets (G10, G92) and stored positions (G28, G30) are not emulated; their words are
refused with ``error:20``, as words that a firmware does not know. The order of the checks is that
of GRBL 1.1 (its file ``gcode.c``), since a line may have several mistakes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import Final

MM_PER_INCH: Final = 25.4

_WORD: Final = re.compile(r"([A-Z])([+-]?[0-9]*\.?[0-9]*)")
_COMMENT: Final = re.compile(r"\([^)]*\)?|;.*|\s")

_GROUPS: Final[dict[str, str]] = {
    **dict.fromkeys(("G4", "G53"), "once"),
    **dict.fromkeys(("G0", "G1", "G80"), "motion"),
    **dict.fromkeys(("G17", "G18", "G19"), "plane"),
    **dict.fromkeys(("G20", "G21"), "units"),
    **dict.fromkeys(("G90", "G91"), "distance"),
    **dict.fromkeys(("G93", "G94"), "feed_mode"),
    **dict.fromkeys(("G54", "G55", "G56", "G57", "G58", "G59"), "system"),
    **dict.fromkeys(("G40",), "cutter"),
    **dict.fromkeys(("G49",), "tool_length"),
    **dict.fromkeys(("G61",), "control"),
    **dict.fromkeys(("M0", "M2", "M30"), "program"),
    **dict.fromkeys(("M3", "M4", "M5"), "spindle"),
    **dict.fromkeys(("M7", "M8", "M9"), "coolant"),
}
_IN_JOGS: Final = {"units", "distance", "once"}


class GcodeError(Exception):
    """A line is refused; `code` is the number after ``error:``."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


@dataclass(frozen=True, slots=True)
class Modal:
    """What stays in force from line to line; `feed` is in mm per minute."""

    motion: str = "G0"
    system: str = "G54"
    plane: str = "G17"
    units: str = "G21"
    distance: str = "G90"
    feed_mode: str = "G94"
    spindle: str = "M5"
    coolant: str = "M9"
    tool: int = 0
    feed: float = 0.0
    spindle_speed: float = 0.0


@dataclass(frozen=True, slots=True)
class Block:
    """What a line asks for.

    Attributes:
        modal: What is in force after it.
        axes: The axis words, in mm or degrees as the controller counts them.
        motion: ``G0`` or ``G1`` if the axes shall move.
        dwell_s: The time to wait, if the line asks for it.
        waits: Whether the line is done only when all motion is over.
    """

    modal: Modal
    axes: dict[str, float] = field(default_factory=dict)
    motion: str | None = None
    dwell_s: float | None = None
    waits: bool = False


@dataclass(slots=True)
class _Words:
    """The words of a line, by group and by letter."""

    groups: dict[str, str]
    values: dict[str, float]


def read(text: str, modal: Modal, axes: str) -> Block:
    """Reads a line of G-code.

    Args:
        text: The line, without its end.
        modal: What is in force.
        axes: The letters of the axes.

    Raises:
        GcodeError: The line is refused.
    """
    words = _words(text, axes)
    scale = MM_PER_INCH if words.groups.get("units", modal.units) == "G20" else 1.0
    positions = {axis: words.values[axis] * scale for axis in axes if axis in words.values}
    feed = words.values["F"] * scale if "F" in words.values else modal.feed
    motion = words.groups.get("motion", modal.motion)
    if words.groups.get("feed_mode") == "G93":
        raise GcodeError(20)
    dwell_s = _dwell(words)
    moves = _moves(words, motion, positions, feed)
    after = replace(
        modal,
        feed=feed,
        motion=motion,
        tool=int(words.values.get("T", modal.tool)),
        spindle_speed=words.values.get("S", modal.spindle_speed),
        **{
            name: words.groups[name]
            for name in ("system", "plane", "units", "distance", "spindle", "coolant")
            if name in words.groups
        },
    )
    if words.groups.get("program") in ("M2", "M30"):
        after = Modal(feed=feed, units=after.units, tool=after.tool)
    return Block(
        modal=after,
        axes=positions,
        motion=motion if moves else None,
        dwell_s=dwell_s,
        waits=dwell_s is not None or bool(words.groups.keys() & {"program", "spindle", "coolant"}),
    )


def read_jog(text: str, modal: Modal, axes: str) -> Block:
    """Reads what follows ``$J=``; it has a feed rate of its own and changes nothing that stays.

    Raises:
        GcodeError: The line is refused.
    """
    words = _words(text, axes)
    if "F" not in words.values:
        raise GcodeError(22)
    if words.groups.keys() - _IN_JOGS or words.groups.get("once") == "G4":
        raise GcodeError(16)
    if words.values.keys() - {*axes, "F", "N"}:
        raise GcodeError(16)
    scale = MM_PER_INCH if words.groups.get("units", modal.units) == "G20" else 1.0
    positions = {axis: words.values[axis] * scale for axis in axes if axis in words.values}
    if not positions:
        raise GcodeError(26)
    if words.values["F"] <= 0.0:
        raise GcodeError(22)
    jog = replace(
        modal,
        feed=words.values["F"] * scale,
        distance=words.groups.get("distance", modal.distance),
    )
    return Block(modal=jog, axes=positions, motion="G1")


def _words(text: str, axes: str) -> _Words:
    rest = _COMMENT.sub("", text).upper()
    words = _Words({}, {})
    while rest:
        if not ("A" <= rest[0] <= "Z"):
            raise GcodeError(1)
        found = _WORD.match(rest)
        if found is None or not any(c.isdigit() for c in found[2]):
            raise GcodeError(2)
        _note(words, found[1], float(found[2]), axes)
        rest = rest[found.end() :]
    return words


def _note(words: _Words, letter: str, value: float, axes: str) -> None:
    """Puts a word into its place, unless it is unknown, repeated or out of range."""
    if letter in "GM":
        name = f"{letter}{value:g}"
        if name not in _GROUPS:
            raise GcodeError(20 if value == int(value) or letter == "G" else 23)
        if _GROUPS[name] in words.groups:
            raise GcodeError(21)
        words.groups[_GROUPS[name]] = name
        return
    if letter not in f"{axes}FNPST":
        raise GcodeError(20)
    if letter in words.values:
        raise GcodeError(25)
    if letter in "FNPST" and value < 0.0:
        raise GcodeError(4)
    words.values[letter] = value


def _dwell(words: _Words) -> float | None:
    """The seconds of a dwell."""
    if words.groups.get("once") != "G4":
        return None
    if "P" not in words.values:
        raise GcodeError(28)
    return words.values["P"]


def _moves(words: _Words, motion: str, positions: dict[str, float], feed: float) -> bool:
    """Whether the line moves the axes; refuses words that do not fit together."""
    once = words.groups.get("once")
    if once == "G53" and motion not in ("G0", "G1"):
        raise GcodeError(30)
    if "P" in words.values and once != "G4":
        raise GcodeError(36)
    if positions and once == "G4":
        raise GcodeError(31)
    is_meant = "motion" in words.groups or bool(positions)
    if motion == "G1" and is_meant and feed <= 0.0:
        raise GcodeError(22)
    if motion == "G80" and positions:
        raise GcodeError(31)
    return bool(positions)
