"""Numbers with a unit on the command line: sizes, times and lengths."""

from __future__ import annotations

import math
import re
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
_SECONDS_PER: Final = {"": 1.0, "ms": 1e-3, "s": 1.0, "min": 60.0, "m": 60.0, "h": 3600.0}


class _Quantity(click.ParamType[float]):
    """A number with a unit, such as ``4GiB`` or ``60s``."""

    def __init__(self, name: str, units: dict[str, float] | dict[str, int]) -> None:
        self.name = name
        self._units = units

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        match = re.fullmatch(r"\s*([0-9]*\.?[0-9]+)\s*([A-Za-z]*)\s*", str(value))
        units = {unit.lower(): size for unit, size in self._units.items()}
        if not match or match[2].lower() not in units:
            known = ", ".join(unit for unit in self._units if unit)
            self.fail(
                f"{value!r} is not a {self.name}; write a number and one of {known}", param, ctx
            )
        return float(match[1]) * units[match[2].lower()]


LEAST_BYTES: Final = 2**16
"""No search fits into less: who writes such a number has left out the unit."""


class _Size(_Quantity):
    """A size; a small number needs its unit."""

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        size = super().convert(value, param, ctx)
        if size < LEAST_BYTES:
            number = re.match(r"[\s0-9.]*", str(value))
            meant = number[0].strip() if number else ""
            self.fail(
                f"{value!r} is less than any search needs; did you mean {meant}GiB or {meant}MiB?",
                param,
                ctx,
            )
        return size


class _Count(click.ParamType[int]):
    """A whole number from 1, also with a multiple: ``10k``, ``2M``, ``1e6`` or ``1_000_000``."""

    name = "number"
    _multiples: Final = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9}

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> int:
        text = str(value).strip().lower().replace("_", "")
        match = re.fullmatch(r"([0-9]{1,15}(?:\.[0-9]{1,9})?)(?:e([0-9]{1,2}))?([kmg]?)", text)
        if match:
            factor = 10 ** int(match[2] or 0) * self._multiples[match[3]]
            number = Fraction(match[1]) * factor
            if number.denominator == 1 and 1 <= number < 2**63:
                return int(number)
        self.fail(
            f"{value!r} is not a whole number from 1; write for example 5000, 10k or 2M", param, ctx
        )


class Number(click.ParamType[float]):
    """A number between two others, which are not included."""

    name = "number"

    def __init__(self, low: float, high: float) -> None:
        self._low = low
        self._high = high

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """The number."""
        try:
            number = float(str(value))
        except ValueError:
            number = math.nan
        if not self._low < number < self._high:
            wanted = (
                f"a number between {self._low:g} and {self._high:g}"
                if self._high < math.inf
                else f"a number greater than {self._low:g}"
            )
            self.fail(f"{value!r} is not {wanted}", param, ctx)
        return number


class Pair(click.ParamType[tuple[float, float]]):
    """Two numbers with a comma between them, the lesser one first; or one number for both."""

    name = "pair"

    def __init__(self, low: float, high: float, *, one_is_enough: bool = False) -> None:
        self._number = Number(low, high)
        self._one_is_enough = one_is_enough

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        """The numbers, in their order."""
        words = str(value).split(",")
        if len(words) == 1 and self._one_is_enough:
            words *= 2
        if len(words) != 2:
            self.fail(f"{value!r} is not a pair of numbers; write LOW,HIGH", param, ctx)
        first, second = (self._number.convert(word.strip(), param, ctx) for word in words)
        if not self._one_is_enough and not first < second:
            self.fail(f"{value!r}: the first number must be less than the second", param, ctx)
        return first, second


SIZE: Final = _Size("size", _BYTES_PER)
"""Such as ``4GiB``; in bytes."""

TIME: Final = _Quantity("time", _SECONDS_PER)
"""Such as ``60s``; in seconds."""

LENGTH: Final = _Quantity("length", {"": 1.0, **MM_PER})
"""Such as ``30mm``; in mm."""

COUNT: Final = _Count()
"""Such as ``10k``."""
