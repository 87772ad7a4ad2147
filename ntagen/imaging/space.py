"""The spaces of imaging, and rigid motions between them and the frame of a scene.

DICOM, ITK and most files use LPS: x to the patient's left, y to the back (posterior), z to the head
(superior). Slicer and NIfTI use RAS: x to the right, y to the front (anterior), z to the head. The
two differ in the signs of x and y, a half turn about z, so both are right-handed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from ntagen.imaging.mistakes import ImageError
from ntagen.shapes import UPRIGHT, Axes, Vector, axes_of, vector_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Space = Literal["LPS", "RAS"]

RIGID_TOLERANCE: Final = 1e-4
"""How far the columns of a rigid matrix may be off length 1 and right angles: four digits."""


@dataclass(frozen=True, slots=True)
class Rigid:
    """A rigid motion: turned about the origin, so that x, y, z become `axes`, and then moved."""

    axes: Axes = UPRIGHT
    shift_mm: Vector = (0.0, 0.0, 0.0)

    def points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points with the shape (n, 3), moved."""
        import numpy as np

        return np.asarray(points @ np.array(self.axes) + np.array(self.shift_mm))

    def point(self, point: Vector) -> Vector:
        """One point, moved."""
        import numpy as np

        return vector_of(self.points(np.array([point]))[0])

    def after(self, first: Rigid) -> Rigid:
        """The motion `first`, and then this one."""
        import numpy as np

        axes = np.array(first.axes) @ np.array(self.axes)
        return Rigid(axes_of(axes), self.point(first.shift_mm))

    def inverse(self) -> Rigid:
        """The motion back."""
        import numpy as np

        matrix = np.array(self.axes)
        return Rigid(axes_of(matrix.T), vector_of(-(np.array(self.shift_mm) @ matrix.T)))


HALF_TURN: Final = Rigid(((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)))
"""From LPS to RAS, and back."""


def between(one: Space, two: Space) -> Rigid:
    """The motion from one space to another."""
    return Rigid() if one == two else HALF_TURN


def rigid(rows: Sequence[Sequence[float]], what: str) -> Rigid:
    """The motion of a matrix whose rows have four numbers: three of the turn, one of the shift.

    Small rounding errors of the turn are corrected: its columns are made unit vectors at right
    angles.

    Args:
        rows: Three rows, or four, the last of which is 0, 0, 0, 1.
        what: What the matrix is, for the message.

    Raises:
        ImageError: The matrix scales, mirrors or skews, or is not finite.
    """
    import numpy as np

    matrix = np.array([row[:3] for row in rows[:3]], dtype=float)
    shift = [float(row[3]) for row in rows[:3]]
    hint = "give a matrix that only turns and moves: columns of length 1 at right angles"
    if not np.isfinite(matrix).all() or not all(map(math.isfinite, shift)):
        raise ImageError("matrix-degenerate", f"{what} has numbers that are not finite", hint)
    if len(rows) == 4 and not np.allclose(rows[3], (0, 0, 0, 1), atol=RIGID_TOLERANCE):
        raise ImageError(
            "matrix-degenerate", f"the last row of {what} is not 0, 0, 0, 1", "write it so"
        )
    # Squares of very large and very small numbers do not fit.
    most = float(np.abs(matrix).max()) or 1.0
    seen = np.linalg.norm(matrix / most, axis=0)
    with np.errstate(all="ignore"):
        volume = abs(float(np.linalg.det(matrix / most)))
    if not volume >= RIGID_TOLERANCE * max(1e-300, seen.prod()):
        raise ImageError("matrix-degenerate", f"{what} makes space flat", hint)
    lengths = [most * float(length) for length in seen]
    if max(abs(length - 1.0) for length in lengths) > RIGID_TOLERANCE:
        shown = ", ".join(f"{length:.6g}" for length in lengths)
        raise ImageError(
            "matrix-degenerate", f"{what} scales: its columns have the lengths {shown}", hint
        )
    if np.abs(matrix.T @ matrix - np.eye(3)).max() > 2 * RIGID_TOLERANCE:
        raise ImageError("matrix-degenerate", f"{what} skews: its columns are not square", hint)
    if np.linalg.det(matrix) < 0.0:
        raise ImageError("matrix-degenerate", f"{what} mirrors: its determinant is -1", hint)
    left, _, right = np.linalg.svd(matrix)
    return Rigid(axes_of((left @ right).T), vector_of(shift))
