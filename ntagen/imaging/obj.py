"""Reads the points and faces of OBJ files.

Of a point, only its place is read, and of a face only its points; they are counted from 1, or from
the last one back. Polygons become fans of triangles. Curved surfaces are refused.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ntagen.imaging.surface_files import Surface, lines_of, wrong_surface

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_WITHOUT_SHAPE: Final = frozenset(
    b"vt vn vp g o s mg usemtl mtllib usemap maplib l p bevel c_interp d_interp lod "
    b"shadow_obj trace_obj".split()
)
"""The first words of lines that say nothing of where a surface is."""


_LONGEST: Final = 2**20
"""Lines are not continued farther than this."""


def read_obj(data: bytes, path: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The points and the triangles of a file.

    Raises:
        ImageError: It is no OBJ file, or too large.
    """
    surface = Surface(path)
    before = b""
    for number, text in lines_of(data, path):
        line = before + text.partition(b"#")[0].rstrip()
        before = b""
        if line.endswith(b"\\") and len(line) < _LONGEST:
            before = line[:-1] + b" "
            continue
        words = line.split()
        if not words or words[0] in _WITHOUT_SHAPE:
            continue
        if words[0] == b"v":
            _add_point(surface, words[1:], number)
        elif words[0] in (b"f", b"fo"):
            surface.add_face(_corners(surface, words[1:], number), f"in line {number:,}")
        else:
            shown = line.decode("utf-8", "replace")[:60]
            raise wrong_surface(
                path, f"has no line of a mesh of triangles in line {number:,}: `{shown}`"
            )
    return surface.arrays()


def _add_point(surface: Surface, words: list[bytes], line: int) -> None:
    """Adds a point: three numbers, perhaps with a weight of 1, or with a colour."""
    if len(words) == 4 and words[3] not in (b"1", b"1.0"):
        try:
            is_one = float(words[3]) == 1.0
        except ValueError:
            is_one = False
        if not is_one:
            raise wrong_surface(surface.path, f"has a point with a weight in line {line:,}")
    surface.add_point(words if len(words) not in (4, 6, 7) else words[:3], line)


def _corners(surface: Surface, words: list[bytes], line: int) -> list[int]:
    """The points of a face, counted from 0."""
    corners = []
    for word in words:
        try:
            number = int(word.partition(b"/")[0])
        except ValueError:
            number = 0
        if not 0 < abs(number) <= max(surface.count, number):
            shown = word.decode("utf-8", "replace")[:40]
            raise wrong_surface(
                surface.path,
                f"has a face with the point `{shown}` in line {line:,}, and {surface.count:,} "
                "points before it",
            )
        corners.append(number - 1 if number > 0 else surface.count + number)
    return corners
