"""Meshes from files: STL, OBJ and PLY, and what must be true of them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from ntagen.files import open_file
from ntagen.imaging.mistakes import ImageError, malformed
from ntagen.imaging.obj import read_obj
from ntagen.imaging.ply import read_ply
from ntagen.imaging.reading import bytes_of
from ntagen.imaging.space import Space
from ntagen.imaging.stl import is_text, read_stl
from ntagen.imaging.surface_files import refuse_many

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_Reader = Callable[[bytes, str], "tuple[NDArray[np.float64], NDArray[np.int64]]"]
_READERS: Final[dict[str, _Reader]] = {"stl": read_stl, "obj": read_obj, "ply": read_ply}
MOST_BYTES: Final = 256 * 2**20
_HEAD_BYTES: Final = 2**16
_LARGEST_BYTES: Final = 2**40
_FARTHEST: Final = 1e9
"""Nothing of a file is farther from its origin, in units of the file."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """A closed surface.

    Attributes:
        vertices: Its points, in units of the file, with the shape (n, 3).
        triangles: Three numbers of points each, counted from 0, anticlockwise seen from outside.
        space: The space that the file says, as files of Slicer do.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    space: Space | None = None

    @property
    def corners(self) -> NDArray[np.float64]:
        """The corners of the triangles, with the shape (n, 3, 3)."""
        import numpy as np

        return np.asarray(self.vertices[self.triangles])

    @property
    def volume(self) -> float:
        """The volume, in cubes of the unit; negative if the triangles are seen from inside."""
        import numpy as np

        a, b, c = np.moveaxis(self.corners - self.vertices.mean(axis=0), 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def read_mesh(path: str) -> Mesh:
    """The mesh of a file.

    Raises:
        ImageError: It cannot be read, is too large, or is no closed surface.
    """
    kind = path.rpartition(".")[2].lower()
    if kind not in _READERS:
        raise malformed(
            f"`{path}` is no mesh that can be read",
            "name a file that ends with .stl, .obj or .ply",
        )
    refuse_large(path)
    data = bytes_of(path, MOST_BYTES)
    vertices, triangles = _READERS[kind](data, path)
    return checked(vertices, triangles, path, _space_in(kind, data[:_HEAD_BYTES]))


def refuse_large(path: str) -> None:
    """Refuses a file that says at its beginning that it has too many triangles.

    Raises:
        ImageError: It says so.
    """
    refuse_many(path, _declared(path.rpartition(".")[2].lower(), _head(path)))


def checked(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], path: str, space: Space | None
) -> Mesh:
    """A mesh with equal points as one, if it is closed and seen from outside.

    Raises:
        ImageError: It is not.
    """
    import numpy as np

    if not len(triangles):
        raise malformed(f"`{path}` has no triangles", "export the surface, not its points")
    if not np.isfinite(vertices).all():
        raise malformed(
            f"`{path}` has points that are not finite numbers (NaN or infinite)",
            "export it once more",
        )
    if np.abs(vertices).max() > _FARTHEST:
        raise malformed(
            f"`{path}` has a point {np.abs(vertices).max():.3g} units away from its origin",
            "export it once more",
        )
    vertices, numbers = np.unique(vertices, axis=0, return_inverse=True)
    triangles = numbers.reshape(-1)[triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    _refuse_repeated(triangles, path)
    _require_closed(triangles, len(vertices), path)
    mesh = Mesh(vertices, triangles, space)
    size = float((vertices.max(axis=0) - vertices.min(axis=0)).max())
    if abs(mesh.volume) <= 1e-9 * size**3:
        raise ImageError(
            "mesh-not-closed", f"`{path}` encloses no volume", "export a closed surface"
        )
    if mesh.volume < 0.0:
        raise inverted(path)
    return mesh


def inverted(path: str) -> ImageError:
    """The error of a mesh whose triangles, or some of them, are turned the wrong way round."""
    return ImageError(
        "mesh-inverted",
        f"the normals of `{path}` point inwards",
        "turn them round in the program that made the file (flip or recalculate normals outside)",
    )


def _refuse_repeated(triangles: NDArray[np.int64], path: str) -> None:
    """No triangle may stand twice, seen from the same side.

    Raises:
        ImageError: One does.
    """
    import numpy as np

    first = triangles.argmin(axis=1)
    turned = np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)
    twice = len(turned) - len(np.unique(turned, axis=0))
    if twice:
        raise ImageError(
            "mesh-not-closed",
            f"`{path}` repeats {twice:,} of its triangles",
            "remove the copies in the program that made it (merge faces, remove doubles)",
        )


def _require_closed(triangles: NDArray[np.int64], count: int, path: str) -> None:
    """Each edge must be left as often as it is entered.

    Raises:
        ImageError: An edge has a triangle on one side only, or two that are turned differently.
    """
    import numpy as np

    starts = triangles.reshape(-1)
    ends = np.roll(triangles, -1, axis=1).reshape(-1)
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    edges, at = np.unique(low * count + high, return_inverse=True)
    at = at.reshape(-1)
    sums = np.bincount(at, weights=np.where(starts < ends, 1, -1), minlength=len(edges))
    uses = np.bincount(at, minlength=len(edges))
    is_open = uses % 2 == 1
    if is_open.any():
        raise ImageError(
            "mesh-not-closed",
            f"`{path}` is not closed: {int(is_open.sum()):,} edges have a triangle on one side"
            " only",
            "close its holes in the program that made it, or export the whole surface",
        )
    if (sums != 0).any():
        raise ImageError(
            "mesh-inverted",
            f"`{path}` has {int((sums != 0).sum()):,} edges between triangles that face"
            " different sides",
            "make its normals consistent in the program that made it",
        )


def _head(path: str) -> bytes:
    """The first bytes of a file; none if it cannot be read, which is reported later."""
    try:
        with open_file(path, _LARGEST_BYTES) as file:
            return file.read(_HEAD_BYTES)
    except (OSError, ValueError):
        return b""


def _declared(kind: str, head: bytes) -> int:
    """How many triangles the beginning of a file says that there are; 0 if it does not."""
    if kind == "stl" and len(head) >= 84 and not is_text(head):
        return int.from_bytes(head[80:84], "little")
    found = re.search(rb"element\s+face\s+(\d{1,18})\s", head) if kind == "ply" else None
    return int(found[1]) if found else 0


def _space_in(kind: str, head: bytes) -> Space | None:
    """The space in a comment, as Slicer writes it: ``SPACE=LPS``."""
    if kind == "ply":
        head = head.partition(b"end_header")[0]
    elif kind == "stl":
        head = head.partition(b"\n")[0] if is_text(head) else head[:80]
    found = re.search(rb"SPACE\s*=\s*(LPS|RAS)", head)
    return None if found is None else ("LPS" if found[1] == b"LPS" else "RAS")
