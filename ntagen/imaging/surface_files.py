"""What the readers of STL, OBJ and PLY share: limits, faces as triangles, and one error."""

from __future__ import annotations

import io
import itertools
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from ntagen.imaging.mistakes import ImageError, malformed

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_TRIANGLES: Final = 1_000_000
MOST_POINTS: Final = 3 * MOST_TRIANGLES
_MOST_LINES: Final = 20 * MOST_TRIANGLES
_LINE_BYTES: Final = 2**20


def wrong_surface(path: str, why: str, hint: str = "export it once more") -> ImageError:
    """The error of a file that is not what its name says."""
    return malformed(f"`{path}` {why}", hint)


def refuse_many(path: str, triangles: int, points: int = 0) -> None:
    """Refuses a surface that is too large.

    Raises:
        ImageError: It is.
    """
    if triangles > MOST_TRIANGLES or points > MOST_POINTS:
        shown = f"{triangles:,} triangles, more than {MOST_TRIANGLES:,}"
        if triangles <= MOST_TRIANGLES:
            shown = f"{points:,} points, more than {MOST_POINTS:,}"
        raise ImageError(
            "image-too-large",
            f"`{path}` has {shown}",
            "reduce it (decimate), or cut away what the needle cannot reach",
        )


def lines_of(data: bytes, path: str, start: int = 0) -> Iterator[tuple[int, bytes]]:
    """The lines of a text from a place on, with their numbers from 1.

    Raises:
        ImageError: There are too many, or one is too long to be one of a mesh.
    """
    file = io.BytesIO(data)
    file.seek(start)
    number = 0
    while line := file.readline(_LINE_BYTES + 1):
        number += 1
        if len(line) > _LINE_BYTES or number > _MOST_LINES:
            long = "a line" if number <= _MOST_LINES else "lines"
            most = f"{_LINE_BYTES:,} bytes" if number <= _MOST_LINES else f"{_MOST_LINES:,}"
            raise ImageError(
                "image-too-large",
                f"`{path}` has {long} of more than {most}",
                "reduce it (decimate), or export it as a binary file",
            )
        yield number, line


@dataclass(slots=True)
class Surface:
    """Points and triangles while a file is read.

    Attributes:
        path: The file.
        points: The coordinates of all points, one after the other.
        corners: Three numbers of points for each triangle, counted from 0.
    """

    path: str
    points: array[float] = field(default_factory=lambda: array("d"))
    corners: array[int] = field(default_factory=lambda: array("q"))

    @property
    def count(self) -> int:
        """How many points there are."""
        return len(self.points) // 3

    def add_point(self, words: Sequence[bytes], line: int) -> None:
        """Adds a point.

        Raises:
            ImageError: Its words are not three numbers, or there are too many points.
        """
        try:
            x, y, z = map(float, words)
        except ValueError:
            shown = b" ".join(words).decode("utf-8", "replace")[:60]
            raise wrong_surface(self.path, f"has no point in line {line:,}: `{shown}`") from None
        self.points.extend((x, y, z))
        if self.count > MOST_POINTS:
            refuse_many(self.path, 0, self.count)

    def add_face(self, numbers: Sequence[int], where: str) -> None:
        """Adds a polygon as a fan of triangles about its first corner.

        Raises:
            ImageError: It has fewer than three corners, a point that is not there, or there are too
                many triangles.
        """
        if len(numbers) < 3:
            raise wrong_surface(self.path, f"has a face with {len(numbers)} corners {where}")
        strangers = [number for number in numbers if not 0 <= number < MOST_POINTS]
        if strangers:
            raise wrong_surface(
                self.path, f"has a face with point {str(strangers[0])[:40]} {where}"
            )
        for one, two in itertools.pairwise(numbers[1:]):
            self.corners.extend((numbers[0], one, two))
        if len(self.corners) > 3 * MOST_TRIANGLES:
            refuse_many(self.path, len(self.corners) // 3)

    def arrays(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """The points with the shape (n, 3), and the triangles with the shape (m, 3).

        Raises:
            ImageError: A triangle has a point that is not there.
        """
        import numpy as np

        triangles = np.frombuffer(self.corners, dtype=np.int64).reshape(-1, 3)
        refuse_strangers(self.path, triangles, self.count)
        return np.frombuffer(self.points, dtype=float).reshape(-1, 3), triangles


def refuse_strangers(path: str, triangles: NDArray[np.int64], count: int) -> None:
    """Refuses triangles with points that are not there.

    Raises:
        ImageError: There is such a triangle.
    """
    wrong = (triangles < 0) | (triangles >= count)
    if wrong.any():
        number = int(triangles[wrong][0])
        raise wrong_surface(
            path, f"has a face with point {number:,} (counted from 0), and {count:,} points"
        )
