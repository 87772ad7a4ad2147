"""Reads the positions of a tip from tables and logs.

A table is CSV, or columns with blanks, tabs or semicolons between them. Its first line may name the
columns. Three columns without names are x, y and z. Else the columns are found by their names
(``x_mm``; ``AuroraTip x``), which may have a unit; if there are several triples, the caller says
which. A position with three zeros is missing: trackers write so when they do not see the sensor.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from ntagen.errors import InputError
from ntagen.files import open_file
from ntagen.traces.trace import Samples
from ntagen.tracking.points import text_of
from ntagen.units import MM_PER

_LARGEST_LOG_BYTES: Final = 2**33
_MCAP_MAGIC: Final = b"\x89MCAP"
_AXIS: Final = re.compile(
    r"(?:(?P<group>.*\S)[ _.\-/]+)?(?P<axis>[xyz])(?:[ _]*[(\[]?(?P<unit>um|mm|cm|m)[)\]]?)?",
    re.IGNORECASE,
)
_DIRECTIONS: Final = {"heading", "bevel"}
"""Triples of the tables that `ntagen drive --tracker csv:FILE` reads that are no positions."""

_NAMES_SHOWN: Final = 12


@dataclass(frozen=True, slots=True)
class Columns:
    """Which columns are x, y and z.

    Attributes:
        wanted: Three names or numbers (from 1) with commas, or what the names of three columns
            begin with; None for those that are found by their names.
        unit: The unit of positions whose column does not name one.
    """

    wanted: str | None = None
    unit: str = "mm"


def read_samples(path: Path, columns: Columns | None = None) -> Samples:
    """The positions in a file: a table, or the log of a run (MCAP).

    Raises:
        InputError: The file cannot be read or has a mistake.
    """
    if _is_log(path):
        return _samples_of_run(path)
    return _samples_of_text(path, text_of(path), columns or Columns())


def _is_log(path: Path) -> bool:
    if path.suffix == ".mcap":
        return True
    if not path.is_file():
        return False
    with open_file(path, _LARGEST_LOG_BYTES) as file:
        return file.read(len(_MCAP_MAGIC)) == _MCAP_MAGIC


def _samples_of_run(path: Path) -> Samples:
    from ntagen.tracking.playback import samples_of_log

    found = samples_of_log(path)
    points = np.array([sample.position_mm for sample in found]).reshape(-1, 3)
    return Samples(str(path), points, tuple(range(1, len(found) + 1)), word="measurement")


def _samples_of_text(path: Path, text: str, columns: Columns) -> Samples:
    lines = [
        (number, line.strip())
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and line.strip()[0] not in "#%"
    ]
    if not lines:
        raise InputError(f"{path}: this file is empty")
    separator = next((sign for sign in (",", ";", "\t") if sign in lines[0][1]), None)
    rows = [(number, _cells(line, separator)) for number, line in lines]
    head = None if all(map(_is_number, rows[0][1])) else rows[0][1]
    width = len(rows[0][1])
    if head is None:
        axes = _numbered(path, width, columns)
    else:
        axes = _named(path, rows[0][0], head, columns)
        rows = rows[1:]
    points, kept, missing = [], [], 0
    for number, cells in rows:
        place = f"{path}:{number}"
        if len(cells) != width:
            raise InputError(
                f"{place}: there are {len(cells)} columns, but {width} in the line at the top\n"
                "hint: was the file cut off? delete lines that are not whole"
            )
        point = [_value(cells[index], place, head, index) * factor for index, factor in axes]
        if any(point):
            points.append(point)
            kept.append(number)
        else:
            missing += 1
    return Samples(str(path), np.array(points).reshape(-1, 3), tuple(kept), missing)


def _cells(line: str, separator: str | None) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(separator)]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _value(cell: str, place: str, head: list[str] | None, index: int) -> float:
    number = float(cell) if _is_number(cell) else math.nan
    if not math.isfinite(number):
        column = f"column {index + 1}" if head is None else f"`{head[index]}`"
        raise InputError(
            f"{place}: {column} is '{cell}', which is not a number\n"
            "hint: delete the line, or write 0, 0, 0 for a position that is missing"
        )
    return number


# The columns.

Axes = list[tuple[int, float]]
"""Of x, y and z: the index of the column, and the mm in its unit."""


def _numbered(path: Path, width: int, columns: Columns) -> Axes:
    """The columns of a table without names."""
    factor = MM_PER[columns.unit]
    if columns.wanted is None:
        if width != 3:
            raise InputError(
                f"{path}: there are {width} columns without names\n"
                "hint: say which are x, y and z, as in --columns 2,3,4"
            )
        return [(index, factor) for index in range(3)]
    numbers = [part.strip() for part in columns.wanted.split(",")]
    if len(numbers) != 3 or not all(one.isdecimal() and 1 <= int(one) <= width for one in numbers):
        raise InputError(
            f"{path}: there are no columns {columns.wanted}; there are {width} columns without "
            "names\nhint: write three numbers from 1 on, as in --columns 1,2,3"
        )
    return [(int(one) - 1, factor) for one in numbers]


def _named(path: Path, line: int, head: list[str], columns: Columns) -> Axes:
    """The columns of a table with names."""
    if columns.wanted is not None and "," in columns.wanted:
        names = [part.strip() for part in columns.wanted.split(",")]
        indices = [_index(head, name) for name in names]
        if len(names) != 3 or None in indices:
            raise _not_found(path, line, head, columns.wanted)
        return [(index, _unit_mm(head[index], columns)) for index in indices if index is not None]
    triples = _triples(head)
    if columns.wanted is not None:
        wanted = columns.wanted.strip().lower()
        if wanted not in triples:
            raise _not_found(path, line, head, columns.wanted)
        return [(index, _unit_mm(head[index], columns)) for index in triples[wanted]]
    found = [group for group in triples if group not in _DIRECTIONS]
    if not found:
        raise _not_found(path, line, head, "x, y, z")
    if len(found) > 1:
        groups = [_group_name(head[triples[group][0]]) or "x" for group in found]
        likely = next((name for name in groups if "tip" in name.lower()), groups[0])
        raise InputError(
            f"{path}:{line}: there are several positions: {', '.join(groups)}\n"
            f"hint: say which one is the tip's, as in --columns '{likely}'"
        )
    return [(index, _unit_mm(head[index], columns)) for index in triples[found[0]]]


def _triples(head: Sequence[str]) -> dict[str, list[int]]:
    """By what their names begin with, the three columns of a position."""
    found: dict[str, dict[str, int]] = {}
    for index, cell in enumerate(head):
        match = _AXIS.fullmatch(cell)
        if match:
            axes = found.setdefault((match["group"] or "").lower(), {})
            axes.setdefault(match["axis"].lower(), index)
    return {
        group: [axes[axis] for axis in "xyz"] for group, axes in found.items() if len(axes) == 3
    }


def _group_name(cell: str) -> str:
    match = _AXIS.fullmatch(cell)
    return (match and match["group"]) or ""


def _index(head: list[str], name: str) -> int | None:
    """The column with a name or a number."""
    lower = [cell.lower() for cell in head]
    if name.lower() in lower:
        return lower.index(name.lower())
    return int(name) - 1 if name.isdecimal() and 1 <= int(name) <= len(head) else None


def _unit_mm(cell: str, columns: Columns) -> float:
    """The mm in the unit of a column."""
    match = _AXIS.fullmatch(cell)
    return MM_PER[((match and match["unit"]) or columns.unit).lower()]


def _not_found(path: Path, line: int, head: list[str], wanted: str) -> InputError:
    names = ", ".join(head[:_NAMES_SHOWN])
    more = f", … ({len(head)} in all)" if len(head) > _NAMES_SHOWN else ""
    return InputError(
        f"{path}:{line}: there are no columns {wanted}; there are {names}{more}\n"
        "hint: give three of these by --columns NAME,NAME,NAME, or name them x_mm, y_mm, z_mm"
    )
