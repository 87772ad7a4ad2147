"""A measurement of the needle, as a value."""

from __future__ import annotations

from dataclasses import dataclass

from ntagen.scene import Vector


@dataclass(frozen=True, slots=True)
class Measurement:
    """One reading.

    Attributes:
        time_s: The time for which the values hold, on the device's clock; a tracker's values may be
            older than the moment at which they are read.
        position_mm: The measured position of the tip.
        force_n: The axial force. A sensor at the base measures all of it: friction along the shaft,
            cutting, and what is near the tip. The virtual needle has the last part only.
        heading: The measured direction of travel, if the sensor reports it.
        bevel: The measured bevel direction, if the sensor reports it.
        shape: Measured places along the needle from its base to its tip, the tip included, if the
            sensor reports them (`ntagen.needle.shape`).
    """

    time_s: float
    position_mm: Vector
    force_n: float
    heading: Vector | None = None
    bevel: Vector | None = None
    shape: tuple[Vector, ...] = ()


def squared_length_bound(probability: float, freedom: float = 3.0) -> float:
    """The squared length that a noise vector passes with this probability.

    The vector has independent coordinates with mean 0 and standard deviation 1, so that its squared
    length has a chi-square distribution. Its degrees of freedom are their number, three by default.
    """
    # scipy.stats has it under its name, and takes half a second to import.
    from scipy.special import chdtri  # type: ignore[import-untyped]

    return float(chdtri(freedom, probability))
