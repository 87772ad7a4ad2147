"""From the pose of a tool to that of the needle's tip."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ntagen.errors import DeviceError
from ntagen.needle.vectors import scale
from ntagen.openigtlink.messages import Columns, Freedom, Position, Tool, Transform
from ntagen.scene import Vector
from ntagen.tracking.mount import AXES, Mount, Tip, tip_of

SHIFT = (10.0, 20.0, 30.0)
ROTATION = Rotation.from_euler("xyz", [0.3, -0.8, 2.0])


def columns_of(rotation: Rotation, shift: Vector = SHIFT) -> Columns:
    matrix = rotation.as_matrix()
    x, y, z = (tuple(float(v) for v in matrix[:, i]) for i in range(3))
    return (x, y, z, shift)  # type: ignore[return-value]


PLAIN: Columns = columns_of(Rotation.identity())


def near(tip: Tip, position: object, heading: object, bevel: object) -> None:
    assert tip.position_mm == pytest.approx(position)
    assert tip.heading == (None if heading is None else pytest.approx(heading))
    assert tip.bevel == (None if bevel is None else pytest.approx(bevel))


@given(st.sampled_from(AXES), st.sampled_from(AXES), st.integers(0, 1000))
def test_axes_and_tip_turn_with_the_tool(axis: str, bevel: str, seed: int) -> None:
    if axis[1] == bevel[1]:
        return
    rotation = Rotation.random(random_state=seed)
    directions = {
        sign + name: (1.0 if sign == "+" else -1.0) * np.eye(3)["xyz".index(name)]
        for sign in "+-"
        for name in "xyz"
    }
    mount = Mount(axis, bevel, (1.0, 2.0, 3.0))
    tip = tip_of(Transform(columns_of(rotation)), mount, "N")
    near(
        tip,
        rotation.apply([1.0, 2.0, 3.0]) + SHIFT,
        rotation.apply(directions[axis]),
        rotation.apply(directions[bevel]),
    )


def test_a_quaternion_is_the_same_rotation() -> None:
    x, y, z, w = (float(v) for v in ROTATION.as_quat())
    mount = Mount("-y", "+x", (0.0, 0.0, 9.0))
    by_matrix = tip_of(Transform(columns_of(ROTATION)), mount, "N")
    by_quaternion = tip_of(Position(SHIFT, (x, y, z, w)), mount, "N")
    near(by_quaternion, by_matrix.position_mm, by_matrix.heading, by_matrix.bevel)


def test_a_position_alone_has_no_direction() -> None:
    near(tip_of(Position(SHIFT), Mount(), "N"), SHIFT, None, None)
    # The matrix of such a tool means nothing beside its last column.
    broken: Columns = ((math.nan,) * 3, (0.0,) * 3, (9.0,) * 3, SHIFT)  # type: ignore[assignment]
    near(tip_of(Tool("N", Freedom.POSITION, broken), Mount(), "N"), SHIFT, None, None)
    with pytest.raises(DeviceError, match="no orientation of 'N'"):
        tip_of(Position(SHIFT), Mount(tip_mm=(0.0, 0.0, 1.0)), "N")
    with pytest.raises(DeviceError, match="no orientation of 'N'"):
        tip_of(Position(SHIFT), Mount(bevel="+x"), "N")


def test_a_tracker_of_five_degrees_gives_the_heading_only() -> None:
    tool = Tool("N", Freedom.HEADING, columns_of(ROTATION))
    tip = tip_of(tool, Mount("-z", tip_mm=(0.0, 0.0, -100.0)), "N")
    near(tip, ROTATION.apply([0, 0, -100.0]) + SHIFT, ROTATION.apply([0, 0, -1.0]), None)


@given(st.floats(-math.pi, math.pi))
def test_the_unknown_roll_of_such_a_tracker_makes_no_difference(roll_rad: float) -> None:
    turned = ROTATION * Rotation.from_rotvec([0.0, 0.0, roll_rad])
    mount = Mount("+z", tip_mm=(0.0, 0.0, 50.0))
    one, other = (
        tip_of(Tool("N", Freedom.HEADING, columns_of(rotation)), mount, "N")
        for rotation in (ROTATION, turned)
    )
    near(other, one.position_mm, one.heading, None)


@pytest.mark.parametrize(
    "mount", [Mount("+x"), Mount("+z", "+x"), Mount("+z", tip_mm=(0.0, 1.0, 5.0))]
)
def test_five_degrees_are_too_few_for_some_mounts(mount: Mount) -> None:
    with pytest.raises(DeviceError, match="five degrees of freedom of 'N'"):
        tip_of(Tool("N", Freedom.HEADING, PLAIN), mount, "N")


def scaled(factor: float) -> Columns:
    x, y, z, shift = PLAIN
    return (scale(factor, x), scale(factor, y), scale(factor, z), shift)


@pytest.mark.parametrize(
    ("columns", "match"),
    [
        (scaled(1000.0), "lengths 1000, 1000, 1000\nhint:.*metres"),
        (scaled(1.01), "lengths 1.01"),
        (scaled(0.0), "lengths 0"),
        (((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), SHIFT), "it mirrors"),
        (((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), SHIFT), "it mirrors"),
        (((1.0, 0.0, 0.0), (0.6, 0.8, 0.0), (0.0, 0.0, 1.0), SHIFT), "not at right angles"),
        (((math.nan, 0.0, 0.0), *PLAIN[1:]), "not a number"),
        ((*PLAIN[:3], (0.0, math.inf, 0.0)), "not a number"),
    ],
)
def test_impossible_matrices_are_refused(columns: Columns, match: str) -> None:
    with pytest.raises(DeviceError, match=match):
        tip_of(Transform(columns), Mount(), "N")


@pytest.mark.parametrize(
    ("quaternion", "match"),
    [((0.0, 0.0, 0.0, 0.0), "length 0"), ((0.0, 0.0, math.nan, 1.0), "not a number")],
)
def test_impossible_quaternions_are_refused(
    quaternion: tuple[float, float, float, float], match: str
) -> None:
    with pytest.raises(DeviceError, match=match):
        tip_of(Position(SHIFT, quaternion), Mount(), "N")
