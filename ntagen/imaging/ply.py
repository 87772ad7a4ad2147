"""Reads the points and faces of PLY files, in text and binary in both byte orders.

The header names elements, how many there are of each, and their properties, each a number or a list
with its length before it. It may claim any number: what cannot be in the file is refused before
anything is made of it.
"""

from __future__ import annotations

import io
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from ntagen.imaging.mistakes import ImageError
from ntagen.imaging.surface_files import Surface, lines_of, refuse_many, wrong_surface

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_HEAD_BYTES: Final = 2**20
_TYPES: Final = {
    **dict.fromkeys(("char", "int8"), "b"),
    **dict.fromkeys(("uchar", "uint8"), "B"),
    **dict.fromkeys(("short", "int16"), "h"),
    **dict.fromkeys(("ushort", "uint16"), "H"),
    **dict.fromkeys(("int", "int32"), "i"),
    **dict.fromkeys(("uint", "uint32"), "I"),
    **dict.fromkeys(("float", "float32"), "f"),
    **dict.fromkeys(("double", "float64"), "d"),
}
_FORMATS: Final = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS: Final = ("vertex_indices", "vertex_index")


@dataclass(frozen=True, slots=True)
class _Property:
    """A property: its name, the code of `struct` for its numbers, and that of a list's length."""

    name: str
    code: str
    length: str | None = None


@dataclass(frozen=True, slots=True)
class _Element:
    """Elements of one kind, and how many there are."""

    name: str
    count: int
    properties: list[_Property]

    @property
    def least_bytes(self) -> int:
        """How many bytes one of them takes at least in a binary file."""
        return sum(struct.calcsize("<" + (p.length or p.code)) for p in self.properties)


def read_ply(data: bytes, path: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The points and the triangles of a file.

    Raises:
        ImageError: It is no PLY file, or too large.
    """
    order, elements, start = _header(data, path)
    for element in elements:
        if element.name == "tristrips":
            raise wrong_surface(path, "has strips of triangles (`tristrips`)", "export triangles")
        is_face = element.name == "face"
        refuse_many(path, element.count if is_face else 0, element.count)
        least = element.least_bytes if order else 2 * len(element.properties)
        if element.count * max(1, least) > len(data) - start + 1:
            why = f"says that it has {element.count:,} of `{element.name}`, and is too short for it"
            raise wrong_surface(path, why, "was the file cut off? export it once more")
    surface = Surface(path)
    body = _Binary(data, path, order, start) if order else _Text(data, path, start)
    for element in elements:
        if element.name == "vertex":
            body.points(element, surface)
        elif element.name == "face":
            place = _place(element, _CORNERS, path, is_list=True)
            for number in range(element.count):
                corners = body.row(element)[place]
                surface.add_face([int(corner) for corner in corners], f"(face {number + 1:,})")
        else:
            body.skip(element)
    body.end()
    return surface.arrays()


def _place(element: _Element, names: Sequence[str], path: str, *, is_list: bool) -> int:
    """Which property of an element has one of some names.

    Raises:
        ImageError: None has, or several, or it is no list, or one where a number must be.
    """
    found = [i for i, one in enumerate(element.properties) if one.name in names]
    if len(found) != 1 or (element.properties[found[0]].length is not None) != is_list:
        kind = "list" if is_list else "number"
        raise wrong_surface(path, f"needs one {kind} `{names[0]}` for each `{element.name}`")
    if is_list and element.properties[found[0]].code in "fd":
        raise wrong_surface(path, f"counts the points in `{names[0]}` with fractions")
    return found[0]


class _Text:
    """The elements of a text: one in each line."""

    def __init__(self, data: bytes, path: str, start: int) -> None:
        self._path = path
        self._lines = lines_of(data, path, start)
        self._number = 0

    def _words(self) -> list[bytes]:
        for number, line in self._lines:
            self._number = number
            if words := line.split():
                return words
        return []

    def row(self, element: _Element) -> list[tuple[float, ...]]:
        """The values of the next element, by property; a number alone is a list of one.

        Raises:
            ImageError: The line has no such values.
        """
        words = self._words()
        row: list[tuple[float, ...]] = []
        at = 0
        try:
            for one in element.properties:
                count = 1
                if one.length is not None:
                    count, at = int(words[at]), at + 1
                read = float if one.code in "fd" else int
                if not 0 <= count <= len(words) - at:
                    raise ValueError(count)
                row.append(tuple(map(read, words[at : at + count])))
                at += count
            if at != len(words):
                raise ValueError(at)
        except (ValueError, IndexError):
            why = f"has no `{element.name}` in line {self._number:,} behind the header"
            raise wrong_surface(self._path, why) from None
        return row

    def points(self, element: _Element, surface: Surface) -> None:
        """Adds the points of all elements."""
        places = [_place(element, (name,), self._path, is_list=False) for name in "xyz"]
        if any(one.length is not None for one in element.properties):
            raise wrong_surface(self._path, "has lists at its points", "export the surface alone")
        for _ in range(element.count):
            words = self._words()
            if len(words) != len(element.properties):
                why = f"has no `vertex` in line {self._number:,} behind the header"
                raise wrong_surface(self._path, why)
            surface.add_point([words[place] for place in places], self._number)

    def skip(self, element: _Element) -> None:
        """Leaves out all elements."""
        for _ in range(element.count):
            self._words()

    def end(self) -> None:
        """Refuses what follows.

        Raises:
            ImageError: Something does.
        """
        if self._words():
            raise wrong_surface(
                self._path, f"has more lines than its header says ({self._number:,})"
            )


class _Binary:
    """The elements of a binary file, one behind the other."""

    def __init__(self, data: bytes, path: str, order: str, start: int) -> None:
        self._data, self._path, self._order, self._at = data, path, order, start

    def _cut(self) -> ImageError:
        return wrong_surface(
            self._path, "is too short", "was the file cut off? export it once more"
        )

    def _take(self, code: str, count: int) -> tuple[float, ...]:
        size = count * struct.calcsize("<" + code)
        if size > len(self._data) - self._at:
            raise self._cut()
        values = struct.unpack_from(f"{self._order}{count}{code}", self._data, self._at)
        self._at += size
        return values

    def row(self, element: _Element) -> list[tuple[float, ...]]:
        """The values of the next element, by property; a number alone is a list of one.

        Raises:
            ImageError: The file ends before.
        """
        row = []
        for one in element.properties:
            count = 1 if one.length is None else int(self._take(one.length, 1)[0])
            if count < 0:
                raise wrong_surface(self._path, f"has a list of {count} values")
            row.append(self._take(one.code, count))
        return row

    def points(self, element: _Element, surface: Surface) -> None:
        """Adds the points of all elements.

        Raises:
            ImageError: They are not numbers, or the file ends before.
        """
        import numpy as np

        places = [_place(element, (name,), self._path, is_list=False) for name in "xyz"]
        if any(one.length is not None for one in element.properties):
            raise wrong_surface(self._path, "has lists at its points", "export the surface alone")
        codes = [self._order + one.code for one in element.properties]
        kind = np.dtype([(f"p{i}", code) for i, code in enumerate(codes)])
        if element.count * kind.itemsize > len(self._data) - self._at:
            raise self._cut()
        rows = np.frombuffer(self._data, dtype=kind, count=element.count, offset=self._at)
        self._at += element.count * kind.itemsize
        with np.errstate(invalid="ignore"):  # A NaN that signals is one as well.
            columns = [rows[f"p{place}"].astype(float) for place in places]
        surface.points.frombytes(np.stack(columns, axis=1).tobytes())

    def skip(self, element: _Element) -> None:
        """Leaves out all elements."""
        if all(one.length is None for one in element.properties):
            self._at += element.count * element.least_bytes
            return
        for _ in range(element.count):
            self.row(element)

    def end(self) -> None:
        """Refuses what follows.

        Raises:
            ImageError: Something does.
        """
        if self._at > len(self._data):
            raise self._cut()
        if behind := len(self._data) - self._at:
            raise wrong_surface(self._path, f"has {behind:,} bytes behind its last element")


def _header(data: bytes, path: str) -> tuple[str, list[_Element], int]:
    """The byte order, empty for text, the elements, and where the first one begins.

    Raises:
        ImageError: This is no header.
    """
    order: str | None = None
    elements: list[_Element] = []
    at = 0
    for line in io.BytesIO(data[:_HEAD_BYTES]):
        at += len(line)
        words = line.decode("ascii", "replace").split()
        if at == len(line):
            if words != ["ply"]:
                raise wrong_surface(path, "is no PLY file: it does not begin with `ply`")
            continue
        match words:
            case ["comment" | "obj_info", *_] | []:
                continue
            case ["format", kind, "1.0"] if kind in _FORMATS and order is None:
                order = _FORMATS[kind]
            case ["element", name, count] if re.fullmatch("[0-9]{1,18}", count):
                if any(one.name == name for one in elements):
                    raise wrong_surface(path, f"has the element `{name[:40]}` twice")
                elements.append(_Element(name, int(count), []))
            case ["property", "list", length, code, name] if (
                elements and code in _TYPES and _TYPES.get(length, "f") not in "fd"
            ):
                elements[-1].properties.append(_Property(name, _TYPES[code], _TYPES[length]))
            case ["property", code, name] if elements and code in _TYPES:
                elements[-1].properties.append(_Property(name, _TYPES[code]))
            case ["end_header"] if order is not None:
                return order, elements, at
            case _:
                shown = " ".join(words)[:60]
                raise wrong_surface(path, f"has a header that cannot be read, at `{shown}`")
    raise wrong_surface(path, "has a header without an end")
