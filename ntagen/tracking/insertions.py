"""Reads insertions for the calibration of a needle: what was commanded, and where the tip was.

A table has a row for each measured position: ``depth_mm``, by which the needle was inserted then;
``roll_deg``, by which its base was turned then, from how it entered; and the position ``x_mm``,
``y_mm``, ``z_mm`` (or another unit, or with the name of its frame in front). With a column
``insertion``, a table has several insertions one after the other.

The log of a run is an insertion, too: up to the first pull, since nothing is told of the way back.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from ntagen.drive.reading import RunLog, read_log
from ntagen.drive.records import Command, Measured
from ntagen.errors import InputError
from ntagen.scene import Vector
from ntagen.tracking.frames import IDENTITY, Transform
from ntagen.tracking.playback import other_frame
from ntagen.tracking.points import axis_columns
from ntagen.tracking.tables import Row, Table, read_table, require_near, shown
from ntagen.units import MM_PER, RAD_PER

_MOST_ROWS: Final = 100_000
_BACK_MM: Final = 0.5
"""A stage may go back by so much when it stops; ours."""

_SMALL_RAD: Final = math.radians(0.5)
"""A base that is turned by less was not rolled; ours."""


@dataclass(frozen=True, slots=True)
class Turn:
    """A roll of the base: how deep the tip was, and the angle."""

    depth_mm: float
    angle_rad: float


@dataclass(slots=True)
class Insertion:
    """One insertion.

    Attributes:
        name: Where it comes from, for messages.
        turns: The rolls of the base, in order.
        depths_mm: How deep the tip was at each measured position; it never goes back.
        places_mm: The measured positions, in the frame of the scene.
        compensated_rad: The lag at 100 mm for which the rolls made up already.
    """

    name: str
    turns: list[Turn] = field(default_factory=list)
    depths_mm: list[float] = field(default_factory=list)
    places_mm: list[Vector] = field(default_factory=list)
    compensated_rad: float = 0.0

    @property
    def depth_mm(self) -> float:
        """How deep it ends."""
        return self.depths_mm[-1] if self.depths_mm else 0.0

    def measure(self, depth_mm: float, place_mm: Vector) -> None:
        """Adds a measured position."""
        self.depths_mm.append(depth_mm)
        self.places_mm.append(place_mm)


def read_insertions(path: Path, transform: Transform | None) -> list[Insertion]:
    """The insertions in a file.

    Args:
        path: A table, or the log of a run (``.mcap``).
        transform: The registration of the tracker; None if the positions are in the scene's frame.

    Raises:
        InputError: The file cannot be read, or has a mistake.
    """
    if path.suffix == ".mcap":
        if transform is not None:
            raise InputError(
                f"{path}: the positions in a log are in the scene's frame already\n"
                "hint: leave out --registration"
            )
        return [_of_log(read_log(path))]
    return list(_Columns(read_table(path), transform or IDENTITY).insertions())


class _Columns:
    """The columns of a table of insertions."""

    def __init__(self, table: Table, transform: Transform) -> None:
        self._table, self._transform = table, transform
        path, head = table.path, table.names
        if len(table.rows) > _MOST_ROWS:
            raise InputError(
                f"{path}: there are {len(table.rows):,} positions, and {_MOST_ROWS:,} are allowed\n"
                "hint: a position each 0.5 mm is enough"
            )
        frames = axis_columns(path, head)
        if len(frames) != 1:
            raise InputError(f"{path}:1: there are positions in {len(frames)} frames, not in one")
        (frame, self._axes), *_ = frames.items()
        expected = transform.source if transform != IDENTITY else ""
        if frame.lower() != expected.lower():
            raise InputError(other_frame(path, frame, expected))
        self._depth = self._quantity("depth", MM_PER)
        self._roll = self._quantity("roll", RAD_PER)
        self._named = head.index("insertion") if "insertion" in head else None

    def _quantity(self, name: str, units: dict[str, float]) -> tuple[int, float]:
        """The column of a quantity, and what its unit is."""
        head = self._table.names
        found = [
            (index, units[unit])
            for index, cell in enumerate(head)
            for stem, _, unit in [cell.lower().rpartition("_")]
            if stem == name and unit in units
        ]
        if len(found) == 1:
            return found[0]
        told = ", ".join(map(shown, head))
        count = "no" if not found else "more than one"
        wanted = "depth_mm" if name == "depth" else "roll_deg"
        raise InputError(
            f"{self._table.path}:1: there is {count} column {wanted}; the columns are {told}\n"
            "hint: a table of an insertion has the columns depth_mm, roll_deg, x_mm, y_mm, z_mm"
        )

    def insertions(self) -> Iterator[Insertion]:
        """The insertions, one after the other."""
        path, current, rolled_rad, label = self._table.path, None, 0.0, ""
        for row in self._table.rows:
            name = row.cells[self._named] if self._named is not None else ""
            if current is None or name != label:
                if current is not None:
                    yield current
                label, rolled_rad = name, 0.0
                current = Insertion(f"{path}, insertion {name}" if name else str(path))
            depth_mm, roll_rad = self._number(row, *self._depth), self._number(row, *self._roll)
            if depth_mm < current.depth_mm - _BACK_MM:
                raise InputError(
                    f"{row.place}: the needle was pulled back here, from {current.depth_mm:g} mm "
                    f"to {depth_mm:g} mm\nhint: give only what was measured on the way in; if "
                    "another insertion begins here, give each a number in a column insertion"
                )
            depth_mm = max(depth_mm, current.depth_mm, 0.0)
            if abs(roll_rad - rolled_rad) > _SMALL_RAD:
                current.turns.append(Turn(current.depth_mm, roll_rad - rolled_rad))
                rolled_rad = roll_rad
            current.measure(depth_mm, self._place(row))
        if current is None:
            raise InputError(f"{path}: there are no positions in this file")
        yield current

    def _place(self, row: Row) -> Vector:
        x, y, z = (self._number(row, column, factor) for column, factor in self._axes)
        require_near((x, y, z), row.place)
        return self._transform.point((x, y, z))

    def _number(self, row: Row, column: int, factor: float) -> float:
        number = self._table.number(row, column)
        if not math.isfinite(number):
            raise InputError(
                f"{row.place}: '{shown(row.cells[column])}' is not a number\n"
                "hint: delete lines in which the tracker did not see the needle"
            )
        return number * factor


def _of_log(log: RunLog) -> Insertion:
    """The insertion of a run: all of it up to the first pull.

    Raises:
        InputError: The needle spun in it.
    """
    found = Insertion(str(log.path), compensated_rad=log.settings.compensated_lag_rad)
    depth_mm = 0.0
    for record in log.records:
        match record:
            case Command(kind="pull"):
                break
            case Command(spin=spin) if spin:
                raise InputError(
                    f"{log.path}: the needle spun in this run, so it does not show how it bends\n"
                    "hint: give runs without `spin`"
                )
            case Command(kind="roll", value=angle_rad):
                found.turns.append(Turn(depth_mm, angle_rad))
            case Measured():
                depth_mm = max(depth_mm, record.depth_mm)
                found.measure(depth_mm, record.position_mm)
    return found
