"""A measurement of the needle, as a value."""

from __future__ import annotations

from dataclasses import dataclass

from ntagen.scene import Vector


@dataclass(frozen=True, slots=True)
class Measurement:
    """One reading.

    Attributes:
        time_s: The time of the measurement, on the device's clock.
        position_mm: The measured position of the tip.
        force_n: The force at the tip, minus that of plain insertion.
        heading: The measured direction of travel, if the sensor reports it.
        bevel: The measured bevel direction, if the sensor reports it.
    """

    time_s: float
    position_mm: Vector
    force_n: float
    heading: Vector | None = None
    bevel: Vector | None = None
