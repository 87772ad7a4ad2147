"""Fixed-point numbers of the model: the only module where millimetres become integer units.

A value ``v`` becomes the integer nearest to ``v * resolution`` (ties go to the even number). The
computation is exact: for every ``v`` the absolute value of ``v - units / resolution`` is at most
``0.5 / resolution``.

Only absurdly large values are refused (`ntagen.rules.LARGEST_UNITS`).
"""

from __future__ import annotations

import math

from ntagen.errors import InputError
from ntagen.rules import LARGEST_UNITS, units_of


def fixed_point(value: float, resolution: int, what: str) -> int:
    """The number of units nearest to a value.

    Args:
        value: A length in mm (or a component of a direction).
        resolution: The number of units in 1 mm (or in 1).
        what: The value's name in the message if it does not fit.

    Returns:
        The units; they are off by at most 0.5, that is by ``0.5 / resolution`` in the value.

    Raises:
        InputError: The value is not finite, or does not fit into the model's numbers.
    """
    if not math.isfinite(value):
        raise InputError(f"{what} is {value}, which is not a number")
    units = units_of(value, resolution)
    if abs(units) > LARGEST_UNITS:
        largest = LARGEST_UNITS / resolution
        raise InputError(
            f"{what} is {value:g}, too large for a model with {resolution} units per mm\n"
            f"hint: lower the resolution, or keep values within {largest:g}"
        )
    return units


def c_literal(units: int, resolution: int) -> str:
    """A number of units as the declaration writes it: ``-25*_SI_`` if whole, else the units."""
    if units == 0:
        return "0"
    whole, rest = divmod(units, resolution)
    return str(units) if rest else f"{whole}*_SI_"
