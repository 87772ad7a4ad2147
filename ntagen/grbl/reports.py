"""The texts that the emulated firmwares print about themselves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ntagen.grbl.dialects import Dialect
from ntagen.grbl.gcode import Modal
from ntagen.grbl.planner import Position

_BUSY: Final = frozenset({"Run", "Jog", "Hold", "Door", "Home"})
_POSITION_IS_MACHINE: Final = 1
_SHOWS_BUFFER: Final = 2


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What a status report is about."""

    state: str
    sub: int | None
    position: Position
    speed_per_min: float
    blocks_free: int
    bytes_free: int
    pins: str
    mask: int


class StatusWriter:
    """Writes status reports: some fields are only in every so many of them.

    The offsets and overrides come at the first and second report after a reset and then after 10
    reports at rest or 20 (30) in motion, as in GRBL 1.1's ``report.c``.
    """

    def __init__(self, dialect: Dialect) -> None:
        self._dialect = dialect
        self._is_first = True
        self.reset()

    def reset(self) -> None:
        """Starts again, as after a reset."""
        self._until_offset = 1 if self._dialect.is_hal else 0
        self._until_overrides = 0
        self._after_reset = True
        self._accessories = False

    def accessories_changed(self) -> None:
        """Spindle or coolant were set: the next report says so."""
        if self._dialect.is_hal:
            self._accessories = True
            self._until_offset = 0
        else:
            self._until_overrides = 0

    def write(self, now: Snapshot) -> str:
        """A status report, with its brackets."""
        state = now.state if now.sub is None else f"{now.state}:{now.sub}"
        is_machine = now.mask & _POSITION_IS_MACHINE
        fields = [state, f"{'MPos' if is_machine else 'WPos'}:{numbers(now.position)}"]
        if now.mask & _SHOWS_BUFFER:
            fields.append(f"Bf:{now.blocks_free},{now.bytes_free}")
        fields.append(f"FS:{now.speed_per_min:.0f},0")
        if now.pins:
            fields.append(f"Pn:{now.pins}")
        fields += self._rare(now)
        return f"<{'|'.join(fields)}>"

    def _rare(self, now: Snapshot) -> list[str]:
        """The fields that are not in every report."""
        fields = []
        is_busy = now.state in _BUSY
        if self._until_offset > 0:
            self._until_offset -= 1
        else:
            self._until_offset = 29 if is_busy and not self._dialect.is_hal else 9
            if self._until_overrides == 0:
                self._until_overrides = 1
            fields.append(f"WCO:{numbers((0.0,) * len(now.position))}")
        if self._until_overrides > 0:
            self._until_overrides -= 1
        else:
            self._until_overrides = 19 if is_busy and not self._dialect.is_hal else 9
            fields.append("Ov:100,100,100")
        if self._dialect.is_hal:
            fields += self._news()
        self._after_reset = self._accessories = self._is_first = False
        return fields

    def _news(self) -> list[str]:
        """The fields in which grblHAL tells of changes."""
        fields = []
        if self._after_reset or self._accessories:
            fields.append("A:")
        if self._is_first:
            fields.append("H:0")
        if self._after_reset:
            fields.append("TLR:0")
        return fields


def numbers(values: Position) -> str:
    """Positions as the firmwares print them."""
    return ",".join(f"{value + 0.0:.3f}" for value in values)


def modal_report(dialect: Dialect, modal: Modal) -> str:
    """The answer to ``$G``."""
    words = " ".join(
        (modal.motion, modal.system, modal.plane, modal.units, modal.distance, modal.feed_mode)
    )
    rest = f"{modal.spindle} {modal.coolant} T{modal.tool} F{modal.feed:.0f}"
    speed = f"S{modal.spindle_speed:.0f}{dialect.speed_end}"
    return f"[GC:{words}{dialect.modal_tail} {rest} {speed}]"


def offsets_report(dialect: Dialect) -> list[str]:
    """The answer to ``$#``: there are no offsets."""
    zeros = numbers((0.0,) * len(dialect.axes))
    tool = zeros if dialect.is_hal else "0.000"
    return [
        *(f"[{name}:{zeros}]" for name in dialect.systems),
        f"[TLO:{tool}]",
        f"[PRB:{zeros}:0]",
    ]
