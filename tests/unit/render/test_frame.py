"""The rotation of a scene into the model's frame."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen.render.frame import Matrix, model_frame, turned
from ntagen.scene import Vector

IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
AXES: tuple[Vector, ...] = (
    (1.0, 0.0, 0.0),
    (-1.0, 0.0, 0.0),
    (0.0, 1.0, 0.0),
    (0.0, -1.0, 0.0),
    (0.0, 0.0, 1.0),
    (0.0, 0.0, -1.0),
)


def check_rotation(frame: Matrix, tolerance: float) -> None:
    """Rows are unit vectors at right angles, and the determinant is +1."""
    for i in range(3):
        for j in range(3):
            product = sum(frame[i][k] * frame[j][k] for k in range(3))
            assert abs(product - IDENTITY[i][j]) <= tolerance
    (a, b, c), (d, e, f), (g, h, i_) = frame
    determinant = a * (e * i_ - f * h) - b * (d * i_ - f * g) + c * (d * h - e * g)
    assert abs(determinant - 1.0) <= tolerance


def test_insertion_along_minus_y_turns_nothing() -> None:
    assert model_frame((0.0, -1.0, 0.0)) == IDENTITY


@pytest.mark.parametrize("axis", AXES)
def test_coordinate_directions_turn_exactly(axis: Vector) -> None:
    frame = model_frame(axis)
    assert turned(frame, axis) == (0.0, -1.0, 0.0)
    assert {entry for row in frame for entry in row} <= {-1.0, 0.0, 1.0}
    check_rotation(frame, 0.0)


@given(st.tuples(*(st.floats(-1.0, 1.0) for _ in range(3))).filter(lambda v: math.hypot(*v) > 1e-3))
def test_any_axis_becomes_minus_y(axis: Vector) -> None:
    frame = model_frame(axis)
    x, y, z = turned(frame, axis)
    assert math.hypot(x, z) <= 1e-15
    assert math.isclose(y, -math.hypot(*axis), rel_tol=1e-14)
    check_rotation(frame, 1e-14)


@given(st.floats(-1e-8, 1e-8), st.floats(-1e-8, 1e-8))
def test_axes_near_plus_y_are_no_trouble(x: float, z: float) -> None:
    check_rotation(model_frame((x, 1.0, z)), 1e-14)
