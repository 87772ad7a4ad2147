"""What shapes have told of the channels in which the shaft has lain.

Every shape tells again where the channels lie that it passes. What they tell of one millimetre is
kept as a sum, so that the time of an estimate does not grow with the number of shapes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.channels import Channel
from ntagen.needle.measurement import Measurement
from ntagen.needle.residuals import BIN_MM, Reading
from ntagen.scene import Vector
from ntagen.shapes import vector_of

_Array = NDArray[np.float64]


@dataclass(slots=True)
class _Sum:
    """The sums of offsets in the channel and of places, and how many there are."""

    count: int = 0
    offset_mm: float = 0.0
    position_mm: _Array = field(default_factory=lambda: np.zeros(3))


class Shaft:
    """The places of all shapes, by channel, stretch and millimetre of depth."""

    def __init__(self) -> None:
        self._sums: dict[tuple[int, int, int], _Sum] = {}

    def add(
        self, channels: list[Channel], channel: int, offset_mm: float, place_mm: Vector
    ) -> None:
        """Adds a place of a shape at a length from the beginning of a channel."""
        here = channels[channel]
        cell = int((here.depth_mm + offset_mm) // BIN_MM)
        found = self._sums.setdefault((channel, here.stretch_at(offset_mm), cell), _Sum())
        found.count += 1
        found.offset_mm += offset_mm
        found.position_mm += place_mm

    def readings(self, channels: list[Channel]) -> list[Reading]:
        """What they tell: one reading across each millimetre of each channel."""
        found = []
        for (channel, stretch, _), one in self._sums.items():
            here, offset_mm = channels[channel], one.offset_mm / one.count
            place_mm = vector_of(one.position_mm / one.count)
            along_mm = offset_mm - here.stretches[stretch].offset_mm
            found.append(
                Reading(
                    channel,
                    stretch,
                    along_mm,
                    here.depth_mm + offset_mm,
                    Measurement(0.0, place_mm, 0.0),
                    one.count,
                    is_across=True,
                )
            )
        return found
