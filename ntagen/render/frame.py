"""The model's frame: insertion along -y, whatever direction it has in the scene.

The model's tests (`check_path_valid`, `check_TR_reachable`) use the y-axis, as in the paper. A
scene with another direction of insertion is rotated as a whole about the origin first.

The turn is the shortest one from the axis to -y (formula of Rodrigues, without the trigonometric
functions): ``R = I + K + K^2 / (1 + c)`` with ``K`` the cross-product matrix of ``axis x (-y)`` and
``c = axis . (-y)``. For axes in the upper half it would become ill-conditioned near +y; these are
first turned by half a turn about z. For the six directions along the coordinate axes all terms are
0 or +-1 and the result is exact: the identity for -y, a signed permutation matrix for the others.
"""

from __future__ import annotations

import math

from ntagen.scene import Vector
from ntagen.shapes import vector_of

Matrix = tuple[Vector, Vector, Vector]
"""Three rows of a 3x3 matrix."""


def cross(a: Vector, b: Vector) -> Vector:
    """The cross product a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def turned(matrix: Matrix, vector: Vector) -> Vector:
    """The product of a matrix and a vector."""
    return vector_of(row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2] for row in matrix)


def model_frame(axis: Vector) -> Matrix:
    """The rotation from the scene's frame to the model's: it turns `axis` to -y.

    Args:
        axis: The direction of insertion, not zero; it need not have length 1.

    Returns:
        A rotation matrix; its transpose rotates from the model back to the scene.
    """
    length = math.hypot(*axis)
    x, y, z = axis[0] / length, axis[1] / length, axis[2] / length
    if y > 0.0:
        rows = model_frame((-x, -y, z))
        flipped = [(-row[0], -row[1], row[2]) for row in rows]
        return (flipped[0], flipped[1], flipped[2])
    # The axis of the turn is (x, y, z) x (0, -1, 0) = (z, 0, -x), so K = [[0, x, 0], [-x, 0, -z],
    # [0, z, 0]].
    share = 1.0 / (1.0 - y)
    return (
        (1.0 - x * x * share, x, -x * z * share),
        (-x, 1.0 - (x * x + z * z) * share, -z),
        (-x * z * share, z, 1.0 - z * z * share),
    )
