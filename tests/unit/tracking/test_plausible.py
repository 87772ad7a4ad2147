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
    SAME_FORCES,
    STALE_S,
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
    require_start(seen((1.0, -0.9, 3.0)), ENTRY)
    require_start(seen((1.0, 11.0, 3.0)), ENTRY)
    turned = (math.sin(0.7), -math.cos(0.7), 0.0)
    require_start(seen(ENTRY.position_mm, turned, ENTRY.bevel), ENTRY)


@pytest.mark.parametrize(
    ("found", "match"),
    [
        (seen((1.0, 2.0, 13.1)), r"at \(1.0, 2.0, 13.1\) mm, 10.1 mm from the entry"),
        (seen((-1000.0, 2.0, 3.0)), "1001.0 mm from the entry"),
        (seen((math.nan, 2.0, 3.0)), "nan mm from the entry"),
        (seen((1.0, -2.0, 3.0)), r"4.0 mm beyond the entry, at \(1.0, -2.0, 3.0\) mm; 3 mm"),
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


class Repeats:
    """A sensor at the entry, whose forces come again and again."""

    def __init__(self, forces_n: list[float], time_s: float = 0.0) -> None:
        self._forces_n = forces_n
        self._time_s = time_s

    def measure(self) -> Measurement:
        self._forces_n.append(self._forces_n.pop(0))
        return Measurement(self._time_s, ENTRY.position_mm, self._forces_n[-1])


@pytest.mark.parametrize("force_n", [0.0, 50.0])
def test_a_force_that_has_no_noise_is_that_of_a_dead_sensor(force_n: float) -> None:
    dead = Plausible(Repeats([force_n]), ENTRY, force_varies=True)
    for _ in range(SAME_FORCES - 1):
        dead.measure()
    with pytest.raises(DeviceError, match=f"exactly {force_n:g} N in {SAME_FORCES} readings"):
        dead.measure()


def test_a_force_with_noise_is_alive_and_a_simulated_one_needs_none() -> None:
    alive = Plausible(Repeats([0.1] * (SAME_FORCES - 1) + [0.2]), ENTRY, force_varies=True)
    exact = Plausible(Repeats([0.0]), ENTRY)
    for _ in range(3 * SAME_FORCES):
        alive.measure()
        exact.measure()


def test_an_old_measurement_is_refused_where_there_is_a_clock() -> None:
    found = Repeats([0.0], time_s=2.0)
    Plausible(found, ENTRY, lambda: 2.0 + STALE_S).measure()
    Plausible(found, ENTRY).measure()
    with pytest.raises(DeviceError, match=r"is 0\.60 s old, and 0\.5 s is allowed\nhint:"):
        Plausible(found, ENTRY, lambda: 2.6).measure()


@pytest.mark.parametrize("place", ["position", "force", "time"])
def test_what_is_no_number_is_called_so(place: str) -> None:
    wrong = Measurement(
        math.nan if place == "time" else 0.0,
        (1.0, math.inf if place == "position" else 2.0, 3.0),
        math.nan if place == "force" else 0.0,
    )

    class Wrong:
        def measure(self) -> Measurement:
            return wrong

    with pytest.raises(DeviceError, match="not a number"):
        Plausible(Wrong(), ENTRY).measure()
