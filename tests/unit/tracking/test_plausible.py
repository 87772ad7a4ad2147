"""Whether a measurement can be true."""

from __future__ import annotations

import math

import pytest

from ntagen.errors import DeviceError
from ntagen.needle.measurement import Measurement
from ntagen.scene import Pose, Vector
from ntagen.tracking.plausible import (
    FASTEST_MM_PER_S,
    JUMP_MM,
    Plausible,
    require_near,
    require_start,
)

ENTRY = Pose((1.0, 2.0, 3.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))


def seen(
    position: Vector, heading: Vector | None = None, bevel: Vector | None = None
) -> Measurement:
    return Measurement(0.0, position, 0.0, heading, bevel)


def test_a_needle_at_the_entry_is_accepted() -> None:
    require_start(seen((1.0, 2.0, 12.0)), ENTRY)
    turned = (math.sin(0.7), -math.cos(0.7), 0.0)
    require_start(seen(ENTRY.position_mm, turned, ENTRY.bevel), ENTRY)


@pytest.mark.parametrize(
    ("found", "match"),
    [
        (seen((1.0, 2.0, 13.1)), r"at \(1.0, 2.0, 13.1\) mm, 10.1 mm from the entry"),
        (seen((-1000.0, 2.0, 3.0)), "1001.0 mm from the entry"),
        (seen((math.nan, 2.0, 3.0)), "nan mm from the entry"),
        (seen(ENTRY.position_mm, (0.0, 1.0, 0.0)), "heading that is 180 deg"),
        (seen(ENTRY.position_mm, (0.0, 0.0, 1.0)), "heading that is 90 deg"),
        (seen(ENTRY.position_mm, ENTRY.heading, (1.0, 0.0, 0.0)), "bevel direction that is 90 deg"),
    ],
)
def test_another_place_or_direction_is_refused(found: Measurement, match: str) -> None:
    with pytest.raises(DeviceError, match=match) as caught:
        require_start(found, ENTRY)
    assert "hint:" in str(caught.value)


def later(time_s: float, x_mm: float) -> Measurement:
    return Measurement(time_s, (x_mm, 0.0, 0.0), 0.0)


def test_a_position_may_move_as_fast_as_a_needle() -> None:
    require_near(later(5.0, JUMP_MM), later(5.0, 0.0))
    require_near(later(6.0, JUMP_MM + FASTEST_MM_PER_S), later(5.0, 0.0))
    # A clock that goes back allows no more than one that stands still.
    require_near(later(4.0, JUMP_MM), later(5.0, 0.0))


@pytest.mark.parametrize(
    ("found", "match"),
    [
        (later(5.0, JUMP_MM + 0.1), "jumped by 20.1 mm in 0.00 s"),
        (later(5.5, 200.0), r"jumped by 200.0 mm in 0.50 s, to \(200.0, 0.0, 0.0\) mm; 45.0 mm is"),
        (later(4.0, 21.0), "jumped by 21.0 mm in 0.00 s"),
        (later(5.0, math.nan), "jumped by nan mm"),
    ],
)
def test_a_jump_is_refused(found: Measurement, match: str) -> None:
    with pytest.raises(DeviceError, match=match):
        require_near(found, later(5.0, 0.0))


def test_the_first_measurement_is_compared_with_the_entry_and_others_with_the_last() -> None:
    class Moving:
        time_s, x_mm = 0.0, ENTRY.position_mm[0]

        def measure(self) -> Measurement:
            _, y, z = ENTRY.position_mm
            return Measurement(self.time_s, (self.x_mm, y, z), 0.0)

    sensor = Moving()
    plausible = Plausible(sensor, ENTRY)
    for _ in range(10):
        assert plausible.measure().position_mm[0] == sensor.x_mm
        sensor.time_s, sensor.x_mm = sensor.time_s + 1.0, sensor.x_mm + 60.0
    sensor.x_mm += 60.0
    with pytest.raises(DeviceError, match=r"jumped by 120.0 mm"):
        plausible.measure()
    with pytest.raises(DeviceError, match="mm from the entry"):
        Plausible(sensor, ENTRY).measure()
