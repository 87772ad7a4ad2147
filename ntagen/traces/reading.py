"""Reads the positions of a tip from tables and logs.

A table is one of `ntagen.tracking.tables`. Its first line may name the columns. Three columns
without names are x, y and z. Else the columns are found by their names (``x_mm``; ``AuroraTip x``;
``Tx``), which may have a unit; if there are several triples, the caller says which.

A position is missing if one of its cells says so, if the tracker's state beside it is not ``OK``,
or if it has three zeros: trackers write so when they do not see the sensor. What is missing is
counted. Samples are in the order of time if there is a column of times.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from ntagen.bags import is_bag, positions_in
from ntagen.errors import InputError
from ntagen.files import open_file
from ntagen.traces.trace import Samples
from ntagen.tracking.tables import Row, Table, read_table, shown
from ntagen.units import MM_PER

_LARGEST_LOG_BYTES: Final = 2**33
_RECORDINGS: Final = (b"\x89MCAP", b"SQLite format 3\0", b"#ROSBAG")
"""What logs and bags begin with: of a bag, the reader of logs says what it is."""

_AXIS: Final = re.compile(
    r"(?:(?P<group>.*\S)[ _.\-/]+)?T?(?P<axis>[xyz])"
    r"(?:[ _,]*[(\[]?(?P<unit>um|µm|μm|mm|cm|m)[)\]]?)?",
    re.IGNORECASE,
)
_TIME: Final = re.compile(
    r"(?:t|(?i:time|time[ _]?stamp|stamp|frame))"
    r"(?:[ _,]*[(\[]?(?:min|m?s|[uµμn]s|sec)[)\]]?)?"
)
_PORT: Final = re.compile(r"port \d+", re.IGNORECASE)
_STRAY: Final = "stray markers"
_SEEN: Final = frozenset({"OK", ""})
"""The states of NDI's trackers that come with a position, and no state."""

_NO_POSITIONS: Final = {"heading", "bevel"}
"""Triples of the tables that `ntagen drive --tracker csv:FILE` reads that are no positions."""

_NAMES_SHOWN: Final = 12


@dataclass(frozen=True, slots=True)
class Columns:
    """Which columns are x, y and z.

    Attributes:
        wanted: Three names or numbers (from 1) with commas, or what the names of three columns
            begin with, or the topic of a bag; None for those that are found by their names.
        unit: The unit of positions whose column does not name one; None for mm, and for metres in
            a bag of ROS.
    """

    wanted: str | None = None
    unit: str | None = None


def read_samples(path: Path, columns: Columns | None = None) -> Samples:
    """The positions in a file: a table, the log of a run (MCAP), or a bag of ROS.

    Raises:
        InputError: The file cannot be read or has a mistake.
    """
    if is_bag(path):
        return _samples_of_bag(path, columns or Columns())
    if _is_log(path):
        return _samples_of_run(path)
    return _samples_of_table(read_table(path, comments="#%"), columns or Columns())


def _is_log(path: Path) -> bool:
    if path.suffix == ".mcap":
        return True
    if not path.is_file():
        return False
    with open_file(path, _LARGEST_LOG_BYTES) as file:
        return file.read(max(map(len, _RECORDINGS))).startswith(_RECORDINGS)


def _samples_of_run(path: Path) -> Samples:
    from ntagen.tracking.playback import samples_of_log

    found = samples_of_log(path)
    points = np.array([sample.position_mm for sample in found]).reshape(-1, 3)
    return Samples(str(path), points, tuple(range(1, len(found) + 1)), word="measurement")


def _samples_of_bag(path: Path, columns: Columns) -> Samples:
    """The positions on a topic of a bag, in metres unless another unit is given (REP 103)."""
    found = positions_in(path, columns.wanted)
    order = sorted(range(len(found.points)), key=found.times_s.__getitem__)
    points = np.array([found.points[index] for index in order]).reshape(-1, 3)
    factor = MM_PER[columns.unit or "m"]
    numbers = tuple(index + 1 for index in order)
    name = f"{path}, {found.topic}"
    return Samples(name, factor * points, numbers, found.missing, word="message")


def _samples_of_table(table: Table, columns: Columns) -> Samples:
    names = _names(table)
    axes = _named(table, names, columns) if table.head else _numbered(table, columns)
    state = _state_beside(names, axes[0][0]) if table.head else None
    kept: list[tuple[Row, list[float]]] = []
    for row in table.rows:
        is_seen = state is None or row.cells[state].upper() in _SEEN
        if is_seen and not any(table.is_gap(row, index) for index, _ in axes):
            point = [_value(table, row, index) * factor for index, factor in axes]
            if any(point):
                kept.append((row, point))
    kept, warnings = _in_time(table, names, kept)
    return Samples(
        str(table.path),
        np.array([point for _, point in kept]).reshape(-1, 3),
        tuple(row.line for row, _ in kept),
        len(table.rows) - len(kept),
        warnings=warnings,
    )


def _value(table: Table, row: Row, index: int) -> float:
    number = table.number(row, index)
    if math.isfinite(number):
        return number
    column = f"`{shown(table.head.cells[index])}`" if table.head else f"column {index + 1}"
    if all(not math.isfinite(table.number(one, index)) for one in table.rows):
        raise InputError(
            f"{row.place}: {column} is '{shown(row.cells[index])}', and it has no numbers at all\n"
            "hint: say which columns are x, y and z, as in --columns 2,3,4"
        )
    raise InputError(
        f"{row.place}: {column} is '{shown(row.cells[index])}', which is not a number\n"
        "hint: leave the cell empty if the position is missing"
    )


def _in_time(
    table: Table, names: list[str], samples: list[tuple[Row, list[float]]]
) -> tuple[list[tuple[Row, list[float]]], tuple[str, ...]]:
    """The samples in the order of time, and a warning if that is not their order in the file.

    Raises:
        InputError: They are in another order, and some have no time.
    """
    column = next((index for index, name in enumerate(names) if _TIME.fullmatch(name)), None)
    if column is None:
        return samples, ()
    times = [table.number(row, column) for row, _ in samples]
    known = [(time, row) for time, (row, _) in zip(times, samples, strict=True) if time == time]
    back = [row for (before, _), (after, row) in pairwise(known) if after < before]
    if not back:
        return samples, ()
    if len(known) < len(samples):
        raise InputError(
            f"{back[0].place}: the time goes back here, and other samples have no time\n"
            "hint: put the lines into the order of time, and leave out those without one"
        )
    order = sorted(range(len(samples)), key=times.__getitem__)
    warning = (
        f"{back[0].place}: the time goes back here, the first of {len(back)} times; the samples "
        f"are put into the order of `{names[column]}`\n"
        "hint: are these several recordings? then match each of them alone"
    )
    return [samples[index] for index in order], (warning,)


# The columns.

Axes = list[tuple[int, float]]
"""Of x, y and z: the index of the column, and the mm in its unit."""


def _names(table: Table) -> list[str]:
    """The names of the columns; none without a head.

    In a table of NDI's trackers, the columns of a tool follow its ``Port N``, and those of stray
    markers come last: so the name of the port stands in front of the names of its columns.
    """
    names = table.head.cells if table.head else []
    if not any(_PORT.fullmatch(name) for name in names):
        return names
    found: list[str] = []
    port, taken = "", set[str]()
    for name in names:
        if _PORT.fullmatch(name):
            port, taken = name, set()
            found.append(name)
        elif name in taken or name.lower() == "markers":
            port, taken = _STRAY, set()
            found.append(f"{port} {name}")
        else:
            taken.add(name)
            found.append(f"{port} {name}" if port and not _TIME.fullmatch(name) else name)
    return found


def _state_beside(names: list[str], index: int) -> int | None:
    """The column that says whether the tool is seen; None if there is none."""
    group = _group_name(names[index])
    lower = [name.lower() for name in names]
    wanted = f"{group} state".strip().lower()
    return lower.index(wanted) if wanted in lower else None


def _numbered(table: Table, columns: Columns) -> Axes:
    """The columns of a table without names."""
    path, width = table.path, len(table.rows[0].cells)
    factor = MM_PER[columns.unit or "mm"]
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


def _named(table: Table, names: list[str], columns: Columns) -> Axes:
    """The columns of a table with names."""
    if columns.wanted is not None and "," in columns.wanted:
        wanted = [part.strip() for part in columns.wanted.split(",")]
        indices = [_index(table, names, name) for name in wanted]
        found = [index for index in indices if index is not None]
        if not len(wanted) == len(found) == 3:
            raise _not_found(table, columns.wanted)
        return _with_units(table, names, found, columns)
    triples = _triples(table, names)
    if columns.wanted is not None:
        group = columns.wanted.strip().lower()
        if group not in triples:
            raise _not_found(table, columns.wanted)
        return _with_units(table, names, triples[group], columns)
    groups = [group for group in triples if group not in _NO_POSITIONS]
    if not groups:
        raise _not_found(table, "x, y, z")
    if len(groups) > 1:
        told = [_group_name(names[triples[group][0]]) or "x" for group in groups]
        likely = next((name for name in told if "tip" in name.lower()), told[0])
        raise InputError(
            f"{_place(table)}: there are several positions: {', '.join(map(shown, told))}\n"
            f"hint: say which one is the tip's, as in --columns '{likely}'"
        )
    return _with_units(table, names, triples[groups[0]], columns)


def _triples(table: Table, names: Sequence[str]) -> dict[str, list[int]]:
    """By what their names begin with, the three columns of a position.

    Raises:
        InputError: One of them is there twice.
    """
    found: dict[str, dict[str, int]] = {}
    for index, name in enumerate(names):
        match = _AXIS.fullmatch(name)
        if match and not name.startswith(_STRAY):
            axes = found.setdefault((match["group"] or "").lower(), {})
            axis = match["axis"].lower()
            if axis in axes:
                raise InputError(
                    f"{_place(table)}: there are two columns {shown(name)}, {axes[axis] + 1} and "
                    f"{index + 1}\nhint: give each another name, or choose by numbers, as in "
                    "--columns 2,3,4"
                )
            axes[axis] = index
    return {
        group: [axes[axis] for axis in "xyz"] for group, axes in found.items() if len(axes) == 3
    }


def _group_name(name: str) -> str:
    match = _AXIS.fullmatch(name)
    return (match and match["group"]) or ""


def _index(table: Table, names: list[str], name: str) -> int | None:
    """The column with a name or a number."""
    written = table.head.cells if table.head else []
    for known in (written, names):
        lower = [cell.lower() for cell in known]
        if name.lower() in lower:
            return lower.index(name.lower())
    return int(name) - 1 if name.isdecimal() and 1 <= int(name) <= len(names) else None


def _with_units(table: Table, names: list[str], indices: list[int], columns: Columns) -> Axes:
    """The columns with the mm in their units.

    Raises:
        InputError: The row of units tells one that is no length.
    """
    axes = []
    for index in indices:
        told, match = table.units[index], _AXIS.fullmatch(names[index])
        unit = ((match and match["unit"]) or told or columns.unit or "mm").lower()
        unit = "um" if unit in ("µm", "μm") else unit
        if unit not in MM_PER:
            raise InputError(
                f"{_place(table)}: the unit of `{shown(names[index])}` is '{unit}', which is no "
                f"length that is known\nhint: the units are {', '.join(MM_PER)}"
            )
        axes.append((index, MM_PER[unit]))
    return axes


def _place(table: Table) -> str:
    return table.head.place if table.head else str(table.path)


def _not_found(table: Table, wanted: str) -> InputError:
    head = table.head.cells if table.head else []
    names = ", ".join(map(shown, head[:_NAMES_SHOWN]))
    more = f", … ({len(head)} in all)" if len(head) > _NAMES_SHOWN else ""
    return InputError(
        f"{_place(table)}: there are no columns {wanted}; there are {names}{more}\n"
        "hint: give three of these by --columns NAME,NAME,NAME, or name them x_mm, y_mm, z_mm"
    )
