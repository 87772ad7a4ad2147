"""Reads tables of numbers as trackers, spreadsheets and scripts write them.

Cells have semicolons, tabs, commas or blanks between them, and may stand in quotes. Numbers have a
decimal point, or all of them a decimal comma. A second line may name the units of the columns. What
could be read in two ways is refused: nothing here is guessed.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ntagen.errors import InputError
from ntagen.files import read_file
from ntagen.units import MM_PER, N_PER, RAD_PER, S_PER

LARGEST_BYTES: Final = 16 * 2**20

FARTHEST_MM: Final = 1e6
"""A coordinate is at most 1 km: more is a mistake in the unit or in the number."""

_SHOWN: Final = 40

_MOST_CELLS: Final = 4_000_000
_CELLS_OF_A_ROW: Final = 4
"""A row takes the memory of so many cells, besides its own."""

_LINE: Final = re.compile(r"([^\r\n]*)(?:\r\n|\r|\n|(?<=[^\r\n])$)")
_POINT: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
_COMMA: Final = re.compile(r"[+-]?(\d+,\d*|,\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
_THOUSANDS: Final = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
"""With a comma between cells, such a number in quotes may have a comma after its thousands."""

_GAPS: Final = frozenset({"", "-", "nan", "+nan", "-nan", "na", "n/a", "null", "none", "missing"})
_BAD_FLOAT: Final = 1e28
"""Trackers of NDI write -3.697314e28 for a number that they do not have."""

_OTHER_UNITS: Final = frozenset({"us", "ns", "µs", "°", "degree", "degrees", "sec", "-", "1"})
_UNITS: Final = frozenset({*MM_PER, *RAD_PER, *S_PER, *N_PER, "µm", "μm"} | _OTHER_UNITS)
_FOLDED: Final = frozenset({*MM_PER, *RAD_PER, *S_PER, *N_PER})
_BRACKETS: Final = re.compile(r"[(\[<](.*)[)\]>]")
_UNIT_AT_END: Final = re.compile(r".*?(?:[ _,]+|[ _,]*[(\[])(?P<unit>[^\s_,()\[\]]+)[)\]]?")
_SEPARATOR_TOLD: Final = re.compile(r"sep=([,;|])", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Row:
    """A line of a table: its file, its number, and its cells."""

    path: Path
    line: int
    cells: list[str]

    @property
    def place(self) -> str:
        """Where it is, for messages."""
        return f"{self.path}:{self.line}"


@dataclass(frozen=True, slots=True)
class Table:
    """A table.

    Attributes:
        path: The file.
        head: The first row, if its cells are no numbers: the names of the columns.
        units: The unit of each column, from the row of units; empty where it tells none.
        rows: The other rows; each has as many cells as the first one.
        mixed: Why a comma in a number cannot be read; empty if it is a decimal comma.
    """

    path: Path
    head: Row | None
    units: list[str]
    rows: list[Row]
    mixed: str

    @property
    def names(self) -> list[str]:
        """The names of the columns, each with its unit if the row of units has one: ``x_mm``."""
        if self.head is None:
            return []
        pairs = zip(self.head.cells, self.units, strict=True)
        return [
            f"{cell}_{unit}" if unit in _FOLDED and not unit_of(cell) else cell
            for cell, unit in pairs
        ]

    def number(self, row: Row, index: int) -> float:
        """The number in a cell; not finite (nan) if there is none, as in a gap.

        Raises:
            InputError: It has a comma that can be read in two ways.
        """
        cell = row.cells[index]
        if _POINT.fullmatch(cell):
            return _finite(float(cell))
        if not _COMMA.fullmatch(cell):
            return math.nan
        if self.mixed:
            raise InputError(
                f"{row.place}: the comma in '{shown(cell)}' can be read in two ways: {self.mixed}"
            )
        return _finite(float(cell.replace(",", ".")))

    def is_gap(self, row: Row, index: int) -> bool:
        """Whether a cell says that a number is missing."""
        cell = row.cells[index]
        return cell.lower() in _GAPS or abs(self.number(row, index)) >= _BAD_FLOAT


def read_table(path: Path, comments: str = "#") -> Table:
    """The table in a file. Empty lines are left out, and those that begin with a comment's sign.

    Raises:
        InputError: The file cannot be read, is no such table, or is empty.
    """
    text = text_of(path)
    numbered = enumerate(_lines(text, comments))
    begin, first = next(((at, line) for at, line in numbered if line.strip()), (0, ""))
    if not first:
        raise InputError(f"{path}: this file is empty")
    told = _SEPARATOR_TOLD.fullmatch(first.strip())
    separator = told[1] if told else _separator(first)
    lines = _lines(text, comments)
    if told:
        # A spreadsheet begins a file so.
        lines = ("" if at == begin else line for at, line in enumerate(lines))
    rows = list(_limited(path, _rows(path, lines, separator)))
    if not rows:
        raise InputError(f"{path}: this file is empty")
    head = None if any(map(_is_number, rows[0].cells)) else rows.pop(0)
    units = _units(head, rows)
    _require_widths(len(head.cells if head else rows[0].cells), rows, separator)
    return Table(path, head, units, rows, _mixed(rows, separator))


def require_near(position_mm: Sequence[float], place: str) -> None:
    """Refuses a position that cannot be that of a needle or a marker.

    Raises:
        InputError: It is so.
    """
    largest_mm = max(map(abs, position_mm))
    if largest_mm > FARTHEST_MM:
        raise InputError(
            f"{place}: the position is {largest_mm:.3g} mm away, and {FARTHEST_MM:g} mm is "
            "allowed\n"
            "hint: is the unit right, and is the number whole?"
        )


def shown(text: object) -> str:
    """A text of a file for a message; a long one is cut off."""
    words = str(text)
    return words if len(words) <= _SHOWN else f"{words[:_SHOWN]}…"


def unit_of(name: str) -> str:
    """The unit at the end of the name of a column, such as ``mm`` in ``x [mm]``; empty if none."""
    found = _UNIT_AT_END.fullmatch(name)
    unit = found["unit"] if found else ""
    return unit if _plain(unit) in _UNITS else ""


def csv_rows(path: Path, lines: Iterable[str], separator: str) -> Iterator[Row]:
    """The lines of a table with separators between its cells; empty ones are left out.

    Raises:
        InputError: It is no such table.
    """
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True, strict=True)
    try:
        for cells in reader:
            if len(cells) > 1 or any(map(str.strip, cells)):
                yield Row(path, reader.line_num, [cell.strip() for cell in cells])
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}: this is no CSV: {error}") from None


def text_of(path: Path) -> str:
    """The text of a file.

    Raises:
        InputError: It cannot be read, or is no text.
    """
    try:
        return read_file(path, LARGEST_BYTES).decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot read {path}: {(error.strerror or str(error)).lower()}") from error
    except UnicodeDecodeError:
        raise InputError(f"{path}: this is not text in UTF-8") from None


def _separator(line: str) -> str | None:
    """What stands between the cells of a line; None for blanks."""
    outside = re.sub(r'"[^"]*"', '""', line)
    for sign in (";", "\t"):
        if sign in outside:
            return sign
    parts = outside.split()
    if len(parts) > 1 and all(map(_is_number, parts)):
        # Blanks between numbers, perhaps with decimal commas.
        return None
    return "," if "," in outside else None


def _lines(text: str, comments: str) -> Iterator[str]:
    """The lines of a text, one after the other; comments are empty. It makes no list of them."""
    for found in _LINE.finditer(text):
        line = found[1]
        yield "" if line.lstrip()[:1] in comments and line.strip() else line


def _rows(path: Path, lines: Iterable[str], separator: str | None) -> Iterator[Row]:
    if separator is not None:
        yield from csv_rows(path, lines, separator)
        return
    for line, text in enumerate(lines, start=1):
        if text.strip():
            yield Row(path, line, [cell.strip('"') for cell in text.split()])


def _limited(path: Path, rows: Iterable[Row]) -> Iterator[Row]:
    """The rows, as long as they do not take too much memory.

    Raises:
        InputError: They do.
    """
    left = _MOST_CELLS
    for row in rows:
        left -= len(row.cells) + _CELLS_OF_A_ROW
        if left < 0:
            raise InputError(
                f"{row.place}: this table is too large: {row.line:,} lines with "
                f"{len(row.cells):,} columns and more\nhint: give a part of it"
            )
        yield row


def _require_widths(width: int, rows: list[Row], separator: str | None) -> None:
    """Refuses rows that are longer or shorter than the first one.

    Empty cells at the end of a row do not count.

    Raises:
        InputError: There is such a row.
    """
    for row in rows:
        while len(row.cells) > width and not row.cells[-1]:
            row.cells.pop()
    wrong = [row for row in rows if len(row.cells) != width]
    if not wrong:
        return
    count = len(wrong[0].cells)
    found = f"{wrong[0].place}: there are {count} columns, but {width} in the line at the top"
    if len(wrong) <= len(rows) / 2.0:
        raise InputError(f"{found}\nhint: was the file cut off? delete lines that are not whole")
    hint = "give each column a name, and no other line before the names"
    if separator == "," and count > width:
        hint = (
            "numbers with decimal commas need semicolons between the columns, or stand in quotes; "
            "else give each column a name"
        )
    raise InputError(f"{found}; {len(wrong)} of {len(rows)} lines are so\nhint: {hint}")


def _is_number(cell: str) -> bool:
    return bool(_POINT.fullmatch(cell) or _COMMA.fullmatch(cell))


def _finite(number: float) -> float:
    return number if math.isfinite(number) else math.nan


def _units(head: Row | None, rows: list[Row]) -> list[str]:
    """The unit of each column; the row of units is taken from the rows.

    Raises:
        InputError: It tells another unit than the name of a column.
    """
    if head is None:
        return []
    none = [""] * len(head.cells)
    if not rows or len(rows[0].cells) != len(none):
        return none
    units = [_plain(cell) for cell in rows[0].cells]
    if not any(units) or not all(unit in _UNITS for unit in units if unit):
        return none
    if all(unit in _GAPS | {"1"} for unit in units):
        # A first sample that is missing.
        return none
    row = rows.pop(0)
    for name, unit in zip(head.cells, units, strict=True):
        told = _plain(unit_of(name))
        if told and unit and told != unit:
            raise InputError(
                f"{row.place}: the unit of `{shown(name)}` is '{unit}' here\n"
                "hint: let the name of the column and the line of units tell the same unit"
            )
    return units


def _plain(unit: str) -> str:
    """A unit without brackets, in the letters of `ntagen.units`."""
    found = _BRACKETS.fullmatch(unit)
    text = (found[1] if found else unit).strip()
    text = text if text in _UNITS else text.lower()
    return "um" if text in ("µm", "μm") else text


def _mixed(rows: list[Row], separator: str | None) -> str:
    """Why a comma in a number cannot be read (`Table.mixed`)."""
    commas = [cell for row in rows for cell in row.cells if "," in cell and _COMMA.fullmatch(cell)]
    if not commas:
        return ""
    for row in rows:
        for cell in row.cells:
            if "." in cell and _POINT.fullmatch(cell):
                return (
                    f"'{shown(cell)}' in line {row.line} has a decimal point\n"
                    "hint: write all numbers with the same decimal mark, and none between thousands"
                )
    if separator == "," and all(map(_THOUSANDS.fullmatch, commas)):
        return (
            "it may stand after thousands\n"
            "hint: write decimal points, or semicolons between the columns"
        )
    return ""
