"""Whether a tracker and a scene belong together."""

from __future__ import annotations

import math

import pytest

from ntagen.errors import DeviceError
from ntagen.needle.measurement import Measurement
from ntagen.scene import Pose, Vector
from ntagen.tracking.start import StartChecked, require_start

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


def test_only_the_first_measurement_is_checked() -> None:
    class Moving:
        place = ENTRY.position_mm

        def measure(self) -> Measurement:
            return seen(self.place)

    sensor = Moving()
    checked = StartChecked(sensor, ENTRY)
    checked.measure()
    sensor.place = (0.0, -50.0, 0.0)
    assert checked.measure().position_mm == sensor.place
    with pytest.raises(DeviceError):
        StartChecked(sensor, ENTRY).measure()
