"""Fixed-point numbers of the model: the one place where millimetres become integer units.

A value ``v`` becomes the integer nearest to ``v * resolution`` (ties to the even one), computed
exactly: the difference ``v - units / resolution`` is at most ``0.5 / resolution`` in magnitude,
whatever ``v``.

The model adds and subtracts such numbers (a centre is a tip minus a radius, a distance is a
difference) in 32 bits. `LARGEST_UNITS` leaves three bits of head room for that, so that only values
of absurd size are refused.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Final

from ntagen.errors import InputError

LARGEST_UNITS: Final = 2**28
"""The largest magnitude of a number that the scene may put into the model, in units."""


def fixed_point(value: float, resolution: int, what: str) -> int:
    """The number of units, `resolution` of which make 1, that is nearest to a value.

    Args:
        value: A length in mm (or a component of a direction).
        resolution: Units in 1 mm (or in 1).
        what: The value's name in the message if it does not fit.

    Returns:
        The units; they are off by at most 0.5, that is by ``0.5 / resolution`` in the value.

    Raises:
        InputError: The value is not finite, or does not fit into the model's numbers.
    """
    if not math.isfinite(value):
        raise InputError(f"{what} is {value}, which is not a number")
    units = round(Fraction(value) * resolution)
    if abs(units) > LARGEST_UNITS:
        largest = LARGEST_UNITS / resolution
        raise InputError(
            f"{what} is {value:g}, too large for a model with {resolution} units per mm\n"
            f"hint: lower the resolution, or keep values within {largest:g}"
        )
    return units


def c_literal(units: int, resolution: int) -> str:
    """A number of units as the declaration writes it: ``-25*_SI_`` when whole, else the units."""
    if units == 0:
        return "0"
    whole, rest = divmod(units, resolution)
    return str(units) if rest else f"{whole}*_SI_"
