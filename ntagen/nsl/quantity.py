"""Values with a dimension: numbers, lengths, angles, times, speeds, and vectors of them.

Everything is stored in mm, rad and s. An angle is a dimension of its own here, although it is a
plain number in physics: this finds a missing ``deg``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from ntagen.units import MM_PER, RAD_PER, S_PER


@dataclass(frozen=True, slots=True)
class Dimension:
    """Exponents of length, angle and time."""

    length: int = 0
    angle: int = 0
    time: int = 0

    def __mul__(self, other: Dimension) -> Dimension:
        return Dimension(
            self.length + other.length, self.angle + other.angle, self.time + other.time
        )

    def __truediv__(self, other: Dimension) -> Dimension:
        return Dimension(
            self.length - other.length, self.angle - other.angle, self.time - other.time
        )

    def root(self) -> Dimension | None:
        """The dimension of the square root; None if it has none."""
        if self.length % 2 or self.angle % 2 or self.time % 2:
            return None
        return Dimension(self.length // 2, self.angle // 2, self.time // 2)

    def __str__(self) -> str:
        """The dimension as it is named in a message, with its article."""
        return _DIMENSION_NAMES.get(self) or f"a value in {self._formula()}"

    def _formula(self) -> str:
        """The dimension as a product of units: ``mm^2/s``."""
        units = (("mm", self.length), ("rad", self.angle), ("s", self.time))
        above = [_power(unit, exponent) for unit, exponent in units if exponent > 0]
        below = [_power(unit, -exponent) for unit, exponent in units if exponent < 0]
        return "/".join(["*".join(above) or "1", *below])


def _power(unit: str, exponent: int) -> str:
    """A unit with its exponent."""
    return unit if exponent == 1 else f"{unit}^{exponent}"


NUMBER: Final = Dimension()
LENGTH: Final = Dimension(length=1)
ANGLE: Final = Dimension(angle=1)
TIME: Final = Dimension(time=1)
SPEED: Final = LENGTH / TIME

_DIMENSION_NAMES: Final = {
    NUMBER: "a plain number",
    LENGTH: "a length",
    ANGLE: "an angle",
    TIME: "a time",
    SPEED: "a speed",
    Dimension(length=2): "an area",
    Dimension(length=3): "a volume",
    Dimension(length=1, time=-2): "an acceleration",
    Dimension(angle=1, time=-1): "an angular speed",
}

USUAL_UNIT: Final = {LENGTH: "mm", ANGLE: "deg", TIME: "s", SPEED: "mm/s"}
"""The unit that a hint proposes for a dimension."""

ALIASES: Final = {
    "millimeter": "mm",
    "millimetre": "mm",
    "millimeters": "mm",
    "millimetres": "mm",
    "centimeter": "cm",
    "centimetre": "cm",
    "meter": "m",
    "metre": "m",
    "micron": "um",
    "microns": "um",
    "micrometer": "um",
    "degree": "deg",
    "degrees": "deg",
    "radian": "rad",
    "radians": "rad",
    "sec": "s",
    "second": "s",
    "seconds": "s",
    "minute": "min",
    "minutes": "min",
    "msec": "ms",
}
"""Other words that people write for a unit, and the unit."""

UNITS: Final[dict[str, tuple[float, Dimension]]] = {
    **{name: (factor, LENGTH) for name, factor in MM_PER.items()},
    **{name: (factor, ANGLE) for name, factor in RAD_PER.items()},
    **{name: (factor, TIME) for name, factor in S_PER.items()},
}
"""Units by name: how many mm, rad or s they are, and their dimension."""


def is_unit(name: str) -> bool:
    """Whether a name is reserved because it is a unit."""
    return name in UNITS


@dataclass(frozen=True, slots=True)
class Quantity:
    """A value: one number or three, in mm, rad and s, with its dimension."""

    numbers: tuple[float, ...]
    dimension: Dimension

    @property
    def is_vector(self) -> bool:
        """Whether it has components."""
        return len(self.numbers) > 1

    @property
    def number(self) -> float:
        """The number of a value that is not a vector."""
        (number,) = self.numbers
        return number

    @property
    def is_finite(self) -> bool:
        """Whether no computation on the way here has overflowed."""
        return all(map(math.isfinite, self.numbers))

    def map(self, function: Callable[[float], float], dimension: Dimension) -> Quantity:
        """The function applied to each component."""
        return Quantity(tuple(map(function, self.numbers)), dimension)


def scalar(number: float, dimension: Dimension = NUMBER) -> Quantity:
    """A value that is not a vector."""
    return Quantity((number,), dimension)
