"""Reads STL files, binary ones and text.

A binary file has 80 bytes for a comment, which may begin with `solid` as well, the number of
triangles in four bytes, and 50 bytes for each. So its length says for sure what it is. Text is read
in lines, in any case: `facet`, `outer loop`, three times `vertex`, `endloop`, `endfacet`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ntagen.imaging.surface_files import Surface, lines_of, refuse_many, wrong_surface

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_HEAD_BYTES: Final = 84
_TRIANGLE_BYTES: Final = 50


def is_text(head: bytes) -> bool:
    """Whether a file that begins so is text, or else binary."""
    start = head.lstrip()[:5].lower()
    return start == b"solid" and (len(head) < _HEAD_BYTES or b"facet" in head.lower())


def read_stl(data: bytes, path: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The points and the triangles of a file; each triangle has its own three points.

    Raises:
        ImageError: It is no STL file, or too large.
    """
    import numpy as np

    count = int.from_bytes(data[80:84], "little")
    behind = len(data) - _HEAD_BYTES - _TRIANGLE_BYTES * count
    if is_text(data[:4096]) and behind:
        return _text(data, path)
    if len(data) < _HEAD_BYTES:
        raise wrong_surface(path, f"is no STL file: it has {len(data)} bytes and no word `solid`")
    refuse_many(path, count)
    if behind < 0:
        whole = (len(data) - _HEAD_BYTES) // _TRIANGLE_BYTES
        why = f"says that it has {count:,} triangles, and has bytes for {whole:,}"
        raise wrong_surface(path, why, "was the file cut off? export it once more")
    if behind > 0:
        why = f"has {behind:,} bytes behind the last of its {count:,} triangles"
        raise wrong_surface(path, why, "was it written over a longer file? export it once more")
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    triangles = np.frombuffer(data, dtype=kind, count=count, offset=_HEAD_BYTES)
    with np.errstate(invalid="ignore"):  # A NaN that signals is one as well.
        points = triangles["corners"].reshape(-1, 3).astype(float)
    return points, np.arange(3 * count, dtype=np.int64).reshape(-1, 3)


_LINES: Final = {
    b"solid": ("outside", "outside"),
    b"facet": ("outside", "facet"),
    b"outer": ("facet", "loop"),
    b"vertex": ("loop", "loop"),
    b"endloop": ("loop", "end of loop"),
    b"endfacet": ("end of loop", "outside"),
    b"endsolid": ("outside", "outside"),
}
"""By the first word of a line: where it may stand, and where the next line stands."""


def _text(data: bytes, path: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    surface = Surface(path)
    place = "outside"
    start = number = 0
    for number, line in lines_of(data, path):
        words = line.lower().split()
        if not words:
            continue
        expected, then = _LINES.get(words[0], (None, place))
        if expected != place:
            shown = line.decode("utf-8", "replace").strip()[:60]
            raise wrong_surface(path, f"is no STL file: `{shown}` cannot stand in line {number:,}")
        place = then
        if words[0] == b"vertex":
            surface.add_point(words[1:], number)
        elif words[0] == b"outer":
            start = surface.count
        elif words[0] == b"endloop":
            if surface.count - start != 3:
                why = f"has a facet with {surface.count - start} corners in line {number:,}"
                raise wrong_surface(path, why)
            surface.add_face((start, start + 1, start + 2), "")
    if place != "outside":
        hint = "was the file cut off? export it once more"
        raise wrong_surface(path, f"ends in a facet, in line {number:,}", hint)
    return surface.arrays()
