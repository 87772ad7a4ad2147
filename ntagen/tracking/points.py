"""Reads named points: markups of 3D Slicer (``.fcsv``, ``.mrk.json``) and CSV files.

Every set of points comes with its frame. Slicer's files name it (older ones by a number: 0 is RAS,
1 is LPS). In a CSV file the columns name it, ``tracker_x_mm``, or the caller does. A file that does
not say it is refused. Positions are returned in mm; units that a file names are converted.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.files import json_of
from ntagen.scene import Vector
from ntagen.shapes import vector_of
from ntagen.tracking.frames import LPS, RAS, flipped, frame_named
from ntagen.tracking.registration import Pairs
from ntagen.tracking.tables import csv_rows, read_table, require_near, shown, text_of
from ntagen.units import MM_PER

_FCSV_FRAMES: Final = {"0": RAS, "1": LPS, "RAS": RAS, "LPS": LPS}
_FCSV_COLUMNS: Final = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID"
_AXIS: Final = re.compile(r"(?:(?P<frame>.*)_)?(?P<axis>[xyz])_(?P<unit>um|mm|cm|m)", re.IGNORECASE)
_NAMES: Final = ("name", "label", "id")


@dataclass(frozen=True, slots=True)
class Points:
    """Named points in a frame.

    Attributes:
        frame: The frame.
        positions_mm: The positions by name, in the order of the file.
    """

    frame: str
    positions_mm: dict[str, Vector]

    def within(self, frame: str) -> Points:
        """The points in RAS instead of LPS, or the other way round.

        Raises:
            InputError: The frames are others; nothing says how they lie.
        """
        if frame == self.frame:
            return self
        if {frame, self.frame} != {RAS, LPS}:
            raise InputError(
                f"the points are in the frame {self.frame}, and nothing says how {frame} lies in "
                "it\nhint: only RAS and LPS can be turned into each other"
            )
        turned = {name: flipped(point) for name, point in self.positions_mm.items()}
        return Points(frame, turned)


def read_points(path: Path, frames: Iterator[str]) -> list[Points]:
    """The sets of points in a file; a CSV file may have several.

    Args:
        path: The file; its name ends in ``.fcsv``, ``.mrk.json``, ``.json`` or ``.csv``.
        frames: The frames of files that do not name theirs; the next is taken if it is needed.

    Raises:
        InputError: The file cannot be read, has a mistake, or nobody says its frame.
    """
    name = path.name.lower()
    if name.endswith(".fcsv"):
        return [_fcsv(path, text_of(path), frames)]
    if name.endswith(".json"):
        return [_markups(path, text_of(path), frames)]
    if name.endswith(".csv"):
        return _csv(path, frames)
    raise InputError(
        f"{path}: this is no file of points\n"
        "hint: give a file of Slicer (.fcsv, .mrk.json) or a .csv file"
    )


def pair(source: Points, target: Points, *, by_order: bool = False) -> Pairs:
    """The pairs of two sets: the points with the same names.

    Args:
        source: The points in the tracker's frame.
        target: The same points in the scene's frame.
        by_order: Whether the order counts instead of the names.

    Raises:
        InputError: A point has no partner.
    """
    names = list(source.positions_mm)
    partners = list(target.positions_mm) if by_order else names
    if by_order and len(names) != len(partners):
        raise InputError(
            f"there are {len(names)} points in the frame {source.frame}, but {len(partners)} in "
            f"{target.frame}"
        )
    alone = set(names) ^ set(target.positions_mm)
    if alone and not by_order:
        raise InputError(
            f"these points are in one of the sets only: {', '.join(sorted(alone))}\n"
            "hint: give each point the same name in both, or pair them by --by-order"
        )
    return Pairs(
        names=tuple(names),
        source=source.frame,
        target=target.frame,
        source_mm=tuple(source.positions_mm[name] for name in names),
        target_mm=tuple(target.positions_mm[name] for name in partners),
    )


def axis_columns(path: Path, head: Sequence[str]) -> dict[str, list[tuple[int, float]]]:
    """By frame, the columns of x, y and z, with the millimetres in their units.

    Raises:
        InputError: There are none, or one of three is missing.
    """
    axes: dict[str, dict[str, tuple[int, float]]] = {}
    for index, cell in enumerate(head):
        match = _AXIS.fullmatch(cell)
        if match:
            of_frame = axes.setdefault(match["frame"] or "", {})
            if match["axis"].lower() in of_frame:
                raise InputError(
                    f"{path}:1: there is a column {shown(cell)} before\nhint: names must differ"
                )
            of_frame[match["axis"].lower()] = (index, MM_PER[match["unit"].lower()])
    if not axes or any(set(one) != set("xyz") for one in axes.values()):
        told = (
            f"the columns are {', '.join(map(shown, head))}"
            if head
            else "the columns have no names"
        )
        raise InputError(
            f"{path}:1: {told}\n"
            "hint: name them x_mm, y_mm, z_mm, or with frames: tracker_x_mm, …, scene_x_mm, …; "
            "units are mm, cm, m, um; names of points are in the column name"
        )
    return {frame: [one[axis] for axis in "xyz"] for frame, one in axes.items()}


# Slicer.


def _fcsv(path: Path, text: str, frames: Iterator[str]) -> Points:
    told: str | None = None
    columns = _FCSV_COLUMNS
    lines = text.splitlines()
    for number, line in enumerate(lines, start=1):
        found = re.match(r"#\s*(CoordinateSystem|columns)\s*=\s*(.*\S)", line)
        if found and found[1] == "columns":
            columns = found[2]
        elif found:
            told = _FCSV_FRAMES.get(found[2].upper())
            if told is None:
                raise InputError(
                    f"{path}:{number}: the coordinate system {shown(found[2])} is neither RAS nor "
                    "LPS\nhint: save the points in RAS or LPS"
                )
    names = [column.strip() for column in columns.split(",")]
    positions: dict[str, Vector] = {}
    for row in csv_rows(path, ["" if line.startswith("#") else line for line in lines], ","):
        cells = dict(zip(names, row.cells, strict=False))
        numbers = [_number(cells.get(axis, ""), row.place, axis) for axis in "xyz"]
        name = cells.get("label") or cells.get("id") or ""
        _add(positions, name, vector_of(numbers), row.place)
    return Points(_frame(path, told, frames), positions)


def _markups(path: Path, text: str, frames: Iterator[str]) -> Points:
    """The points of a ``.mrk.json`` file."""
    try:
        document = json_of(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: this is not JSON: {error}") from None
    lists = document.get("markups") if isinstance(document, dict) else None
    if not isinstance(lists, list) or len(lists) != 1 or not isinstance(lists[0], dict):
        raise InputError(
            f"{path}: this is not one list of points of Slicer\n"
            "hint: save each list of points in a file of its own"
        )
    told, points = lists[0].get("coordinateSystem"), lists[0].get("controlPoints")
    if told is not None and told not in (RAS, LPS):
        raise InputError(f"{path}: the coordinate system {shown(told)} is neither RAS nor LPS")
    factor = _unit_of(path, lists[0].get("coordinateUnits", "mm"))
    positions: dict[str, Vector] = {}
    for index, point in enumerate(points if isinstance(points, list) else []):
        place = f"{path}: point {index + 1}"
        if not isinstance(point, dict):
            raise InputError(f"{place} is not an object")
        label, values = point.get("label") or point.get("id"), point.get("position")
        if point.get("positionStatus", "defined") != "defined" or not isinstance(values, list):
            raise InputError(
                f"{place}, {shown(label)}, has no position\nhint: place it, or delete it"
            )
        if len(values) != 3:
            raise InputError(f"{place}, {shown(label)}, has {len(values)} coordinates")
        numbers = [_number(value, place, "a coordinate") * factor for value in values]
        _add(positions, str(label or ""), vector_of(numbers), place)
    return Points(_frame(path, told, frames), positions)


def _unit_of(path: Path, units: object) -> float:
    """Millimetres in the unit of a list of points; one unit, or the same for each axis."""
    words = {str(word) for word in units} if isinstance(units, list) else {str(units)}
    factors = {MM_PER.get(word) for word in words}
    factor = factors.pop() if len(factors) == 1 else None
    if factor is None:
        raise InputError(f"{path}: positions in {shown(', '.join(sorted(words)))} cannot be read")
    return factor


# CSV.


def _csv(path: Path, frames: Iterator[str]) -> list[Points]:
    table = read_table(path)
    head = table.names
    sets = axis_columns(path, head)
    named = next((head.index(word) for word in _NAMES if word in head), None)
    found: dict[str, dict[str, Vector]] = {prefix: {} for prefix in sets}
    for count, row in enumerate(table.rows, start=1):
        name = row.cells[named] if named is not None else str(count)
        for prefix, axes in sets.items():
            numbers = []
            for column, factor in axes:
                number = table.number(row, column) * factor
                if not math.isfinite(number):
                    raise _no_number(row.place, head[column], row.cells[column])
                numbers.append(number)
            _add(found[prefix], name, vector_of(numbers), row.place)
    return [Points(_frame(path, prefix or None, frames), found[prefix]) for prefix in sets]


# Parts.


def _frame(path: Path, told: str | None, frames: Iterator[str]) -> str:
    """The frame that a file names, or else the next one that the caller names.

    Raises:
        InputError: Nobody names it.
    """
    frame = told or next(frames, None)
    if frame is None:
        raise InputError(
            f"{path}: this file does not say in which frame its points are\n"
            "hint: give --frame RAS, --frame LPS, or a name of your own such as --frame tracker"
        )
    return frame_named(frame)


def _number(value: Any, place: str, what: str) -> float:  # noqa: ANN401  from JSON or CSV
    try:
        number = float(value) if not isinstance(value, bool) else math.nan
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise _no_number(place, what, value)
    return number


def _no_number(place: str, what: str, value: object) -> InputError:
    return InputError(f"{place}: {what} is '{shown(value)}', which is not a number")


def _add(positions: dict[str, Vector], name: str, position_mm: Vector, place: str) -> None:
    if not name:
        raise InputError(f"{place}: this point has no name")
    if name in positions:
        raise InputError(f"{place}: there is a point {shown(name)} before\nhint: names must differ")
    require_near(position_mm, place)
    positions[name] = position_mm
