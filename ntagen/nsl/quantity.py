"""Values with a dimension: numbers, lengths, angles, times, speeds, forces, and vectors of them.

Everything is stored in mm, rad, s, N and bytes. An angle is a dimension of its own here, although
it is a plain number in physics: this finds a missing ``deg``.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import astuple
from typing import Final

from ntagen.units import BYTES_PER, MM_PER, N_PER, RAD_PER, S_PER
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Dimension:
    """Exponents of length, angle, time, force, size of data, and steps of a motor."""

    length: int = 0
    angle: int = 0
    time: int = 0
    force: int = 0
    data: int = 0
    steps: int = 0

    def __mul__(self, other: Dimension) -> Dimension:
        return Dimension(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    def __truediv__(self, other: Dimension) -> Dimension:
        return Dimension(*(a - b for a, b in zip(astuple(self), astuple(other), strict=True)))

    def root(self) -> Dimension | None:
        """The dimension of the square root; None if it has none."""
        if any(exponent % 2 for exponent in astuple(self)):
            return None
        return Dimension(*(exponent // 2 for exponent in astuple(self)))

    def __str__(self) -> str:
        """The dimension as it is named in a message, with its article."""
        return _DIMENSION_NAMES.get(self) or f"a value in {self._formula()}"

    def _formula(self) -> str:
        """The dimension as a product of units: ``mm^2/s``."""
        units = tuple(zip(("mm", "rad", "s", "N", "B", "steps"), astuple(self), strict=True))
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
FORCE: Final = Dimension(force=1)
DATA: Final = Dimension(data=1)
STEPS: Final = Dimension(steps=1)
FORCE_PER_LENGTH: Final = FORCE / LENGTH
TURNING: Final = ANGLE / TIME
STEPS_PER_LENGTH: Final = STEPS / LENGTH
STEPS_PER_ANGLE: Final = STEPS / ANGLE

_DIMENSION_NAMES: Final = {
    NUMBER: "a plain number",
    LENGTH: "a length",
    ANGLE: "an angle",
    TIME: "a time",
    SPEED: "a speed",
    FORCE: "a force",
    DATA: "a size",
    STEPS: "a number of steps",
    STEPS_PER_LENGTH: "a number of steps per length",
    STEPS_PER_ANGLE: "a number of steps per angle",
    Dimension(length=2): "an area",
    Dimension(length=3): "a volume",
    Dimension(length=1, time=-2): "an acceleration",
    TURNING: "an angular speed",
    FORCE_PER_LENGTH: "a force per length",
}

USUAL_UNIT: Final = {
    LENGTH: "mm",
    ANGLE: "deg",
    TIME: "s",
    SPEED: "mm/s",
    FORCE: "N",
    DATA: "MiB",
    FORCE_PER_LENGTH: "N/mm",
    TURNING: "deg/s",
    STEPS_PER_LENGTH: "steps/mm",
    STEPS_PER_ANGLE: "steps/deg",
}
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
    **{name: (factor, FORCE) for name, factor in N_PER.items()},
    **{name: (factor, DATA) for name, factor in BYTES_PER.items()},
    "steps": (1.0, STEPS),
    "%": (0.01, NUMBER),
}
"""Units by name: how many mm, rad, s, N, bytes or steps they are, and their dimension."""

_RESERVED: Final = frozenset({*MM_PER, *RAD_PER, *S_PER})
"""The units that cannot be names. Others can: a unit stands behind a value, where no name can."""


def is_unit(name: str) -> bool:
    """Whether a name is reserved because it is a unit."""
    return name in _RESERVED


@functools.lru_cache(maxsize=256)
def quotient(units: tuple[str, ...]) -> tuple[float, Dimension]:
    """The factor to mm, rad, s and so on of the first unit divided by the others: mm/s.

    A description with thousands of regions asks for the same few quotients again and again.
    """
    factor, dimension = UNITS[units[0]]
    for name in units[1:]:
        one, its = UNITS[name]
        factor, dimension = factor / one, dimension / its
    return factor, dimension


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
