"""The stored settings of an emulated controller (its EEPROM)."""

from __future__ import annotations

import re
from typing import Final

from ntagen.grbl.dialects import Dialect
from ntagen.grbl.planner import Limits, Position

_NUMBER: Final = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)")
_SHORTEST_PULSE_US: Final = 3.0


class Memory:
    """Settings by number, as the texts that are printed.

    Args:
        dialect: The firmware, which has the defaults.
        changes: Settings that differ from them.
        is_blank: Whether nothing was ever stored: the first start says ``error:7``.
    """

    def __init__(
        self, dialect: Dialect, changes: dict[int, float] | None = None, *, is_blank: bool = False
    ) -> None:
        self.is_blank = is_blank
        self._axes = len(dialect.axes)
        self._values = dict(dialect.settings)
        for number, value in (changes or {}).items():
            self._put(number, value)

    def number(self, setting: int) -> float:
        """The value of a setting; 0 for one that the firmware does not have."""
        return float(self._values.get(setting, 0.0))

    def lines(self) -> list[str]:
        """The answer to ``$$``."""
        return [f"${number}={value}" for number, value in self._values.items()]

    def store(self, setting: int, text: str) -> int:
        """Stores a setting; returns the number of the error, 0 for none."""
        if not _NUMBER.fullmatch(text):
            return 2
        value = float(text)
        if setting not in self._values:
            return 3
        if value < 0.0 and float(self._values[setting]) >= 0.0:
            return 4
        if setting == 0 and value < _SHORTEST_PULSE_US:
            return 6
        if setting == 20 and value and not self.number(22):
            return 10
        self._put(setting, value)
        if setting == 22 and not value:
            self._put(20, 0.0)
        return 0

    def limits(self) -> Limits:
        """What the axes can do, per second."""
        return Limits(
            speeds=tuple(v / 60.0 for v in self._of_axes(110)),
            accelerations=self._of_axes(120),
            junction_deviation=self.number(11),
        )

    def travel(self) -> Position:
        """The length of each axis."""
        return self._of_axes(130)

    def rounded(self, position: Position) -> Position:
        """The nearest position that whole steps reach."""
        return tuple(
            round(p * steps) / steps for p, steps in zip(position, self._of_axes(100), strict=True)
        )

    def _of_axes(self, first: int) -> Position:
        return tuple(self.number(first + axis) for axis in range(self._axes))

    def _put(self, setting: int, value: float) -> None:
        """Stores a value with the number of decimals that the firmware prints."""
        decimals = len(self._values[setting].partition(".")[2])
        self._values[setting] = f"{value:.{decimals}f}"
