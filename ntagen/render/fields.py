"""The table of the fields: distances at the points of grids, as integers that are never too great.

All fields share one table of samples; two shapes of the same samples, such as a vessel and the
margin around it, have them only once.

A sample is taken down by what it may be off, rounded down, and taken down by two units more: in the
model, the points of a grid are off by less than that. A corner and an extent lose at most half of a
unit in each coordinate, so a place is off by at most the square root of 3, and the directions of
the axes lose 2e-9 of a length. For a target the samples are depths, which are also never too great.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Final

from ntagen.render.fixed_point import fixed_point
from ntagen.rules import LARGEST_UNITS, table_fits
from ntagen.scene import Region, require
from ntagen.shapes import SAMPLES_PER_MM, Field
from ntagen.values import dataclass

_PLACE_UNITS: Final = 2
_IN_A_LINE: Final = 24


@dataclass(frozen=True, slots=True)
class FieldRow:
    """A field as the model has it.

    Attributes:
        region: Its region.
        field: The field in the model's frame.
        first: Where its samples begin in the table.
        low: The least coordinates of the solid from the first point, rounded down.
        high: The greatest ones, rounded up.
        rounding: The rounding, rounded to the safe side.
    """

    region: Region
    field: Field
    first: int
    low: tuple[int, int, int]
    high: tuple[int, int, int]
    rounding: int


@dataclass(frozen=True, slots=True)
class Samples:
    """The table of samples.

    Attributes:
        count: How many there are.
        parts: By part of the table: its lines, and what it is.
        notes: What to know of each field: how far distances may be too small.
    """

    count: int
    parts: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]


def field_rows(
    fields: Sequence[tuple[Region, Field]], scale: int
) -> tuple[list[FieldRow], Samples]:
    """The rows and the samples of fields in the model's frame.

    Raises:
        InputError: A length or the table is too large for the model.
    """
    starts: dict[tuple[bytes, bool, float], int] = {}
    names: dict[tuple[bytes, bool, float], list[str]] = {}
    shapes: dict[tuple[bytes, bool, float], Field] = {}
    rows, count = [], 0
    for region, field in fields:
        key = (field.samples, field.is_inner, field.doubt_mm)
        if key not in starts:
            starts[key], shapes[key], names[key] = count, field, []
            count += math.prod(field.counts)
        names[key].append(" ".join(region.name.split()))
        rows.append(_row(region, field, starts[key], scale))
    require(table_fits(count))
    parts = tuple(
        (_lines(field.samples, field.is_inner, field.sample_doubt_mm, scale), ", ".join(names[key]))
        for key, field in shapes.items()
    )
    notes = tuple(
        f"{', '.join(names[key])}: {_size(field)} points, a distance is at most"
        f" {field.error_mm + (_PLACE_UNITS + 1) / scale:.3f} mm too"
        f" {'great' if field.is_inner else 'small'}"
        for key, field in shapes.items()
    )
    return rows, Samples(count, parts, notes)


def _row(region: Region, field: Field, first: int, scale: int) -> FieldRow:
    what = f"the size of {region.name}"
    low = [fixed_point(value, scale, what) - _PLACE_UNITS for value in field.low_mm]
    high = [fixed_point(value, scale, what) + _PLACE_UNITS for value in field.high_mm]
    rounding = field.rounding_mm * scale
    return FieldRow(
        region,
        field,
        first,
        (low[0], low[1], low[2]),
        (high[0], high[1], high[2]),
        math.floor(rounding) if field.is_inner else math.ceil(rounding),
    )


@functools.lru_cache(maxsize=32)
def _lines(samples: bytes, is_inner: bool, doubt_mm: float, scale: int) -> str:
    """The samples in units: lower bounds on distances, or on depths for a target.

    A driver makes many models with the same samples, so their text is made only once.
    """
    import numpy as np

    values = np.frombuffer(samples, dtype="<i4") / SAMPLES_PER_MM
    units = np.floor(((-values if is_inner else values) - doubt_mm) * scale) - _PLACE_UNITS
    # A lower bound stays one if it is made smaller.
    texts = list(map(str, np.clip(units, -LARGEST_UNITS, LARGEST_UNITS).astype(int).tolist()))
    lines = (",".join(texts[i : i + _IN_A_LINE]) for i in range(0, len(texts), _IN_A_LINE))
    return ",\n    ".join(lines)


def _size(field: Field) -> str:
    return " x ".join(map(str, field.counts))
