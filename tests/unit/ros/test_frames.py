"""The frames of stage and needle, and poses in them."""

from __future__ import annotations

import math

import pytest

from ntagen.errors import DeviceError
from ntagen.openigtlink.messages import Position, turned
from ntagen.openigtlink.messages import Transform as Matrix
from ntagen.ros.frames import NeedleFrame, axes_of, content_of, quaternion_of
from ntagen.scene import Pose

ENTRY = Pose((10.0, 20.0, 30.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
NEEDLE = NeedleFrame(ENTRY)


def test_z_is_the_direction_of_insertion_and_x_the_bevel() -> None:
    assert NEEDLE.to_stage((0.0, 0.0, 5.0)) == pytest.approx((10.0, 15.0, 30.0))
    assert NEEDLE.to_stage((2.0, 0.0, 0.0)) == pytest.approx((10.0, 20.0, 32.0))
    assert NEEDLE.to_needle((10.0, 15.0, 32.0)) == pytest.approx((2.0, 0.0, 5.0))


def test_a_quaternion_leads_to_the_axes() -> None:
    x, y, z, _ = turned(quaternion_of(axes_of(ENTRY)), (0.0, 0.0, 0.0))
    for found, wanted in zip((x, y, z), axes_of(ENTRY), strict=True):
        assert found == pytest.approx(wanted)


@pytest.mark.parametrize("roll_rad", [0.0, 0.5, math.pi / 2, -2.0, 3.0, 7.0, -20.0])
def test_what_the_stage_reports_is_depth_and_roll(roll_rad: float) -> None:
    position_mm, rotation = NEEDLE.at_guide(12.5, roll_rad)
    found = NEEDLE.of_guide(turned(rotation, position_mm), roll_rad + 0.3)
    assert found == pytest.approx((12.5, roll_rad))


def test_a_roll_is_right_handed_about_the_insertion() -> None:
    _, rotation = NeedleFrame(Pose((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))).at_guide(
        0.0, math.pi / 2
    )
    assert turned(rotation, (0.0, 0.0, 0.0))[0] == pytest.approx((0.0, 1.0, 0.0))


def test_a_shaft_that_points_elsewhere_is_refused() -> None:
    tilted = Pose((0.0, 0.0, 0.0), (0.0, -math.cos(0.2), math.sin(0.2)), (1.0, 0.0, 0.0))
    with pytest.raises(DeviceError, match="11 deg from the direction of insertion"):
        NEEDLE.of_guide(turned(quaternion_of(axes_of(tilted)), (0.0, 0.0, 0.0)), 0.0)
    with pytest.raises(DeviceError, match="not a number"):
        NEEDLE.of_guide(turned((0.0, 0.0, 0.0, 1.0), (math.nan, 0.0, 0.0)), 0.0)


def test_a_measured_pose_keeps_what_is_known() -> None:
    assert content_of((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 0.0), None) == Position((1.0, 2.0, 3.0))
    in_needle = content_of((0.0, 0.0, 5.0), (0.0, 0.0, 0.0, 0.0), NEEDLE)
    assert isinstance(in_needle, Position)
    assert in_needle.position_mm == pytest.approx((10.0, 15.0, 30.0))
    turned_too = content_of((0.0, 0.0, 5.0), (0.0, 0.0, 0.0, 1.0), NEEDLE)
    assert isinstance(turned_too, Matrix)
    assert turned_too.columns[2] == pytest.approx(ENTRY.heading)
    assert turned_too.columns[0] == pytest.approx(ENTRY.bevel)
