"""Reads poses from tables: where a tool or a stage was, and how it was turned.

The first line names the columns: ``x_mm``, ``y_mm``, ``z_mm`` (or another unit, or with the name of
their frame in front, ``bench_x_mm``) and a quaternion ``qx``, ``qy``, ``qz``, ``qw``, with or
without the frame. A column ``name`` or ``row`` names the poses; without it they have the numbers of
their lines. All other columns, such as a time, are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from ntagen.errors import InputError
from ntagen.openigtlink.messages import turned
from ntagen.tracking.points import axis_columns
from ntagen.tracking.tables import Row, Table, read_table, require_near, shown

_Array = npt.NDArray[np.float64]

_NAMES: Final = ("name", "row")
_QUATERNION: Final = ("qx", "qy", "qz", "qw")
_TOLERANCE: Final = 0.01
"""Lengths of quaternions may differ from 1 by this: tables have few digits."""

_SHOWN: Final = 10


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses of a body, one after the other.

    Attributes:
        path: The file they are from, for messages.
        frame: The frame of the poses; empty if the file does not name it.
        names: The names of the poses. They differ.
        is_named: Whether the file names them; else they are called by their lines.
        rotations: What turns the body's own axes into those of the frame, an array (poses, 3, 3).
        positions_mm: Where the body's origin is in the frame, an array (poses, 3).
    """

    path: Path
    frame: str
    names: tuple[str, ...]
    is_named: bool
    rotations: _Array
    positions_mm: _Array

    def __len__(self) -> int:
        return len(self.names)

    def chosen(self, indices: Sequence[int]) -> Poses:
        """Some of the poses, in the order of the indices."""
        at = list(indices)
        names = tuple(self.names[index] for index in at)
        return Poses(
            self.path, self.frame, names, self.is_named, self.rotations[at], self.positions_mm[at]
        )


def read_poses(path: Path, most: int) -> Poses:
    """The poses in a file.

    Args:
        path: The file; `ntagen.tracking.tables` says what tables are read.
        most: So many poses are allowed.

    Raises:
        InputError: The file cannot be read, has a mistake, or has more poses.
    """
    table = read_table(path)
    if len(table.rows) > most:
        raise InputError(
            f"{path}: there are {len(table.rows):,} poses, and {most:,} are allowed\n"
            "hint: keep every second line, or fewer"
        )
    return _Reader(table).poses()


class _Reader:
    """The columns of a table of poses."""

    def __init__(self, table: Table) -> None:
        self._table = table
        path, self._head = table.path, table.names
        frames = axis_columns(path, self._head)
        if len(frames) != 1:
            raise InputError(
                f"{path}:1: there are positions in {len(frames)} frames: "
                f"{', '.join(map(shown, frames))}\n"
                "hint: write the poses of each body to a file of its own"
            )
        (self._frame, self._axes), *_ = frames.items()
        lower = [name.lower() for name in self._head]
        self._turn = [self._column(lower, word) for word in _QUATERNION]
        self._named = next((lower.index(word) for word in _NAMES if word in lower), None)

    def poses(self) -> Poses:
        """All poses."""
        rows = self._table.rows
        read = [self._pose(row) for row in rows]
        return Poses(
            self._table.path,
            self._frame,
            self._names(rows),
            self._named is not None,
            np.array([rotation for rotation, _ in read]).reshape(-1, 3, 3),
            np.array([position for _, position in read]).reshape(-1, 3),
        )

    def _column(self, lower: list[str], word: str) -> int:
        """The column of one part of the quaternion."""
        wanted = {word, f"{self._frame.lower()}_{word}"}
        found = [index for index, name in enumerate(lower) if name in wanted]
        if len(found) == 1:
            return found[0]
        told = ", ".join(map(shown, self._head))
        count = "no column" if not found else "more than one column"
        raise InputError(
            f"{self._table.path}:1: there is {count} {word}; the columns are {told}\n"
            "hint: name the parts of the quaternion qx, qy, qz, qw; qw is the cosine of half the "
            "angle"
        )

    def _names(self, rows: list[Row]) -> tuple[str, ...]:
        if self._named is None:
            return tuple(f"line {row.line}" for row in rows)
        known: dict[str, int] = {}
        for row in rows:
            name = row.cells[self._named]
            if not name:
                raise InputError(f"{row.place}: this pose has no name\nhint: give it one")
            if name in known:
                raise InputError(
                    f"{row.place}: the pose {shown(name)} is in line {known[name]}, too\n"
                    "hint: names must differ; leave out the column if the order is enough"
                )
            known[name] = row.line
        return tuple(known)

    def _pose(self, row: Row) -> tuple[_Array, _Array]:
        """Rotation and position in mm of a row."""
        x, y, z = (self._number(row, column) * factor for column, factor in self._axes)
        require_near((x, y, z), row.place)
        qx, qy, qz, qw = (self._number(row, column) for column in self._turn)
        length = math.hypot(qx, qy, qz, qw)
        if length == 0.0:
            raise InputError(
                f"{row.place}: the quaternion has the length 0, so it is no rotation\n"
                "hint: did the tracker see the tool? delete this line"
            )
        if abs(length - 1.0) > _TOLERANCE:
            raise InputError(
                f"{row.place}: the quaternion has the length {length:.4g}, not 1\n"
                "hint: are these the columns qx, qy, qz, qw, with four digits or more?"
            )
        unit = (qx / length, qy / length, qz / length, qw / length)
        columns = turned(unit, (x, y, z))
        return np.array(columns[:3]).T, np.array(columns[3])

    def _number(self, row: Row, column: int) -> float:
        number = self._table.number(row, column)
        if self._table.is_gap(row, column):
            raise InputError(
                f"{row.place}: {shown(self._head[column])} is missing\n"
                "hint: delete lines in which the tracker did not see the tool"
            )
        if not math.isfinite(number):
            cell = shown(row.cells[column])
            raise InputError(
                f"{row.place}: {shown(self._head[column])} is '{cell}', which is not a number\n"
                "hint: correct it, or delete this line"
            )
        return number


def pair_poses(first: Poses, second: Poses) -> tuple[Poses, Poses]:
    """The same poses of two files: those with the same names, or without names in their order.

    Raises:
        InputError: A pose has no partner.
    """
    if first.is_named != second.is_named:
        has, lacks = (first, second) if first.is_named else (second, first)
        raise InputError(
            f"{has.path} names its poses, and {lacks.path} does not\n"
            "hint: give both files a column name with the same names, or none of them"
        )
    if not first.is_named:
        if len(first) == len(second):
            return first, second
        raise InputError(
            f"{first.path} has {len(first)} poses, and {second.path} has {len(second)}\n"
            "hint: without names, line by line belongs together; give each pose the same name in "
            "both files, in a column name"
        )
    alone = [
        f"{listed(names)} in {one.path} only"
        for one, other in ((first, second), (second, first))
        if (names := [name for name in one.names if name not in set(other.names)])
    ]
    if alone:
        raise InputError(
            f"these poses have no partner: {'; '.join(alone)}\n"
            "hint: give each pose the same name in both files, or delete those without a partner"
        )
    index = {name: at for at, name in enumerate(second.names)}
    return first, second.chosen([index[name] for name in first.names])


def listed(words: Iterable[str]) -> str:
    """Words with commas between them; of many, the first ones and how many more there are."""
    found = [shown(word) for word in words]
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return ", ".join(found[:_SHOWN]) + more
