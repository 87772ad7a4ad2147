"""Values on the command line: sizes, times and lengths with their units, counts, pairs.

Each function reads a text; click takes it as the type of an option, and adds the option's name to
the message about a wrong value.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Final

import click

from ntagen.units import MM_PER

_BYTES_PER: Final = {
    "": 1,
    "B": 1,
    "KB": 10**3,
    "MB": 10**6,
    "GB": 10**9,
    "KIB": 2**10,
    "MIB": 2**20,
    "GIB": 2**30,
    "TIB": 2**40,
}


def _quantity(name: str, units: Mapping[str, float]) -> Callable[[object], float]:
    """Reads a number with a unit, such as ``4GiB`` or ``60s``."""
    sizes = {unit.lower(): size for unit, size in units.items()}

    def read(value: object) -> float:
        match = re.fullmatch(r"\s*([0-9]*\.?[0-9]+)\s*([A-Za-z]*)\s*", str(value))
        if not match or match[2].lower() not in sizes:
            known = ", ".join(unit for unit in units if unit)
            raise click.BadParameter(
                f"{value!r} is not a {name}; write a number and one of {known}"
            )
        return float(match[1]) * sizes[match[2].lower()]

    return read


_LEAST_BYTES: Final = 2**16
"""No search fits into less: who writes such a number has left out the unit."""

_MULTIPLES: Final = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9}

_bytes = _quantity("size", _BYTES_PER)

duration = _quantity("time", {"": 1.0, "ms": 1e-3, "s": 1.0, "min": 60.0, "m": 60.0, "h": 3600.0})
"""Such as ``60s``; in seconds."""

length = _quantity("length", {"": 1.0, **MM_PER})
"""Such as ``30mm``; in mm."""


def size(value: object) -> int:
    """Such as ``4GiB``; in bytes. A small number needs its unit."""
    found = _bytes(value)
    if found < _LEAST_BYTES:
        number = re.match(r"[\s0-9.]*", str(value))
        meant = number[0].strip() if number else ""
        raise click.BadParameter(
            f"{value!r} is less than any search needs; did you mean {meant}GiB or {meant}MiB?"
        )
    return int(found)


def count(value: object) -> int:
    """A whole number from 1, also with a multiple: ``10k``, ``2M``, ``1e6`` or ``1_000_000``."""
    text = str(value).strip().lower().replace("_", "")
    match = re.fullmatch(r"([0-9]{1,15}(?:\.[0-9]{1,9})?)(?:e([0-9]{1,2}))?([kmg]?)", text)
    if match:
        found = Fraction(match[1]) * 10 ** int(match[2] or 0) * _MULTIPLES[match[3]]
        if found.denominator == 1 and 1 <= found < 2**63:
            return int(found)
    raise click.BadParameter(
        f"{value!r} is not a whole number from 1; write for example 5000, 10k or 2M"
    )


def number(low: float, high: float) -> Callable[[object], float]:
    """Reads a number between two others, which are not included."""

    def read(value: object) -> float:
        try:
            found = float(str(value))
        except ValueError:
            found = math.nan
        if not low < found < high:
            where = f"between {low:g} and {high:g}" if high < math.inf else f"greater than {low:g}"
            raise click.BadParameter(f"{value!r} is not a number {where}")
        return found

    return read


def pair(
    low: float, high: float, *, one_is_enough: bool = False
) -> Callable[[object], tuple[float, float]]:
    """Reads two numbers with a comma between them, the lesser one first; or one for both."""
    part = number(low, high)

    def read(value: object) -> tuple[float, float]:
        words = str(value).split(",")
        if len(words) == 1 and one_is_enough:
            words *= 2
        if len(words) != 2:
            raise click.BadParameter(f"{value!r} is not a pair of numbers; write LOW,HIGH")
        first, second = (part(word.strip()) for word in words)
        if not one_is_enough and not first < second:
            raise click.BadParameter(f"{value!r}: the first number must be less than the second")
        return first, second

    return read
