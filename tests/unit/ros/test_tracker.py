"""Units of the tip, and the driver's rules for a tip that comes from topics."""

from __future__ import annotations

import math

import pytest

from ntagen.errors import DeviceError
from ntagen.openigtlink.messages import NEWTON, Sensor
from ntagen.ros.frames import NeedleFrame, axes_of, content_of, quaternion_of, shape_of
from ntagen.ros.inbox import Inbox, Wanted
from ntagen.ros.topics import Topics
from ntagen.ros.tracker import tracker_of, unit_error
from ntagen.scene import Pose, Vector
from ntagen.tracking.frames import IDENTITY

ENTRY = Pose((40.0, 20.0, 30.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("found_mm", "entry_mm", "inserted_mm", "unit", "is_error"),
    [
        ((40.0, 20.0, 30.0), ENTRY.position_mm, 0.0, "m", False),
        ((40_000.0, 20_000.0, 30_000.0), ENTRY.position_mm, 0.0, "m", True),
        ((0.04, 0.02, 0.03), ENTRY.position_mm, 0.0, "mm", True),
        ((20_000.0, 0.0, 0.0), ORIGIN, 0.0, "m", True),
        ((0.0, -0.02, 0.0), ORIGIN, 20.0, "mm", True),
        ((0.0, -20_000.0, 0.0), ORIGIN, 20.0, "m", True),
        ((0.0, -20.0, 0.0), ORIGIN, 20.0, "m", False),
        # Far away, but in no other unit right: a jump, or another registration.
        ((60.0, 0.0, 0.0), ORIGIN, 20.0, "m", False),
        ((60.0, 0.0, 0.0), ORIGIN, 0.0, "m", False),
        # It hangs at the entry.
        (ORIGIN, ORIGIN, 20.0, "m", False),
    ],
)
def test_a_unit_error_is_told(
    found_mm: Vector, entry_mm: Vector, inserted_mm: float, unit: str, is_error: bool
) -> None:
    said = unit_error(found_mm, entry_mm, inserted_mm, "/sensor/tip", unit)
    assert bool(said) is is_error
    if is_error:
        other = "mm" if unit == "m" else "m"
        assert "this is a unit error" in said
        assert f"sensor_units:={other}" in said


class Bench:
    """A tracker behind an inbox."""

    def __init__(self, topics: Topics | None = None) -> None:
        self.now_s = 10.0
        tip, force = Wanted("/sensor/tip", "", False), Wanted("/sensor/force", "", False)
        self.inbox = Inbox(tip, force, 0.5, lambda: self.now_s, lambda _: ())
        self.sensor = tracker_of(
            self.inbox,
            topics or Topics(bevel="+x"),
            IDENTITY,
            ENTRY,
            lambda: self.now_s,
            lambda: 0.0,
            watches_force=True,
            force_varies=True,
        )

    def see(self, position_mm: Vector, pose: Pose = ENTRY) -> None:
        """A sample of both sensors comes."""
        rotation = quaternion_of(axes_of(pose))
        self.inbox.take_force(Sensor((0.25,), NEWTON), None)
        self.inbox.take_pose(content_of(position_mm, rotation, None), None)


def test_a_pose_on_a_topic_is_a_measurement() -> None:
    bench = Bench()
    bench.see(ENTRY.position_mm)
    found = bench.sensor.newest()
    assert found.position_mm == pytest.approx(ENTRY.position_mm)
    assert found.heading == pytest.approx(ENTRY.heading)
    assert found.bevel == pytest.approx(ENTRY.bevel)
    assert (found.force_n, found.time_s) == (0.25, 10.0)


@pytest.mark.parametrize(
    ("position_mm", "pose", "says"),
    [
        ((math.nan, 0.0, 0.0), ENTRY, "not a number"),
        ((60.0, 20.0, 30.0), ENTRY, "mm from the entry"),
        ((40.0, 15.0, 30.0), ENTRY, "5.0 mm beyond the entry"),
        ((40e3, 20e3, 30e3), ENTRY, "unit error"),
        (
            ENTRY.position_mm,
            Pose(ENTRY.position_mm, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
            "heading that is 90 deg",
        ),
    ],
)
def test_the_rules_of_the_driver_hold(position_mm: Vector, pose: Pose, says: str) -> None:
    bench = Bench()
    bench.see(position_mm, pose)
    with pytest.raises(DeviceError, match=says):
        bench.sensor.newest()


def test_a_jump_and_a_stale_sample_are_faults() -> None:
    bench = Bench()
    bench.see(ENTRY.position_mm)
    bench.sensor.newest()
    bench.see((40.0, 20.0, 60.0))
    with pytest.raises(DeviceError, match="jumped by 30"):
        bench.sensor.newest()
    bench.now_s += 1.0
    with pytest.raises(DeviceError, match="stale"):
        bench.sensor.newest()


@pytest.mark.parametrize("is_needles", [False, True])
def test_poses_along_the_needle_are_a_shape(is_needles: bool) -> None:
    bench, needle = Bench(Topics(tip_from="shape")), NeedleFrame(ENTRY)
    # Of a straight needle whose tip is at the entry.
    own = [(0.0, 0.0, -20.0 + 1.0 * number) for number in range(21)]
    in_stage = [needle.to_stage(place) for place in own]
    shape = shape_of(own, needle) if is_needles else shape_of(in_stage, None)
    bench.inbox.take_force(Sensor((0.25,), NEWTON), None)
    bench.inbox.take_pose(shape, None)
    found = bench.sensor.newest()
    assert found.position_mm == pytest.approx(ENTRY.position_mm)
    assert len(found.shape) == 21
    assert found.shape[0] == pytest.approx((40.0, 40.0, 30.0))
    assert found.shape[15] == pytest.approx((40.0, 25.0, 30.0))


def test_what_is_no_shape_of_a_needle_is_refused() -> None:
    bench = Bench(Topics(tip_from="shape"))
    bench.inbox.take_force(Sensor((0.25,), NEWTON), None)
    bench.inbox.take_pose(
        shape_of([(40.0, 20.0, 30.0 + 40.0 * one) for one in range(3)], None), None
    )
    with pytest.raises(DeviceError, match="the shape jumps by 40"):
        bench.sensor.newest()
