"""A stage that is told where to be: motions, stops and faults, without ROS and real time."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable

import pytest

from ntagen.drive.plugin import Speeds
from ntagen.errors import DeviceError, Halted
from ntagen.ros import stage
from ntagen.ros.stage import Place, StageActuator

SPEEDS = Speeds(push_mm_per_s=5.0, pull_mm_per_s=25.0, roll_rad_per_s=math.pi)


class Wire:
    """A stage that is where it was told, after `behind` tells."""

    def __init__(self) -> None:
        self.time_s = 0.0
        self.told: list[Place] = []
        self.at = Place(2.0, 0.0)
        self.is_blocked = self.is_silent = False
        self.drift_mm = 0.0

    def now_s(self) -> float:
        return self.time_s

    def sleep(self, seconds: float) -> None:
        self.time_s += seconds
        self.at = Place(self.at.depth_mm + self.drift_mm, self.at.roll_rad)

    def tell(self, place: Place) -> None:
        self.told.append(place)
        if not self.is_blocked:
            self.at = place

    def where(self) -> Place:
        if self.is_silent:
            raise DeviceError("the stage is silent")
        return self.at


@pytest.fixture
def wire(monkeypatch: pytest.MonkeyPatch) -> Wire:
    made = Wire()
    monkeypatch.setattr(stage.time, "sleep", made.sleep)
    monkeypatch.setattr(stage.time, "monotonic", made.now_s)
    return made


def actuator(wire: Wire) -> StageActuator:
    return StageActuator(wire, SPEEDS, 0.05, 10.0)


def test_motions_are_rows_of_places_at_the_speed(wire: Wire) -> None:
    moved = actuator(wire)
    began_s = wire.now_s()
    moved.push(4.0)
    assert wire.at.depth_mm == pytest.approx(6.0)
    assert wire.now_s() - began_s == pytest.approx(0.8, abs=0.02)
    steps = [b.depth_mm - a.depth_mm for a, b in zip(wire.told, wire.told[1:], strict=False)]
    assert max(steps) <= 5.0 * 0.0101
    moved.roll(-1.0)
    moved.pull(1.5)
    moved.screw(0.5, 2.0)
    assert wire.at.is_near(Place(5.0, 1.0), 1e-9, 1e-9)
    assert moved.moved_mm == pytest.approx(3.0)


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_impossible_commands_move_nothing(wire: Wire, value: float) -> None:
    moved = actuator(wire)
    for command in (moved.push, moved.pull):
        with pytest.raises(DeviceError, match="refuses"):
            command(value)
    assert wire.told == []


def breaking(wire: Wire, at_mm: float, error: BaseException) -> Callable[[], None]:
    def watch() -> None:
        if wire.at.depth_mm >= at_mm:
            raise error

    return watch


def test_what_the_watch_raises_stops_the_stage_and_says_how_far_it_got(wire: Wire) -> None:
    moved = actuator(wire)
    moved.watch = breaking(wire, 3.0, Halted("enough"))
    with pytest.raises(Halted) as caught:
        moved.push(4.0)
    assert caught.value.part == pytest.approx(0.25, abs=0.02)
    assert wire.told[-1] == wire.at
    moved.watch = lambda: None
    moved.push(1.0)
    assert wire.at.depth_mm == pytest.approx(4.0, abs=0.06)


def test_a_stop_from_another_thread_ends_the_motion(wire: Wire) -> None:
    moved = actuator(wire)
    stopped: list[float] = []

    def watch() -> None:
        if wire.at.depth_mm > 3.0 and not stopped:
            stopped.append(wire.at.depth_mm)
            thread = threading.Thread(target=moved.stop)
            thread.start()
            thread.join()

    moved.watch = watch
    with pytest.raises(DeviceError, match="the motion was stopped"):
        moved.push(4.0)
    # Nothing of the motion was told after the stop.
    assert wire.at.depth_mm == stopped[0]


def test_who_holds_the_stage_may_say_why(wire: Wire) -> None:
    moved = actuator(wire)
    held: list[bool] = []

    def watch() -> None:
        if held:
            raise KeyboardInterrupt("the service stop was called")
        if wire.at.depth_mm > 3.0:
            held.append(True)
            moved.hold()

    moved.watch = watch
    with pytest.raises(KeyboardInterrupt, match="the service stop"):
        moved.push(4.0)


def test_a_stage_that_does_not_follow_is_a_fault(wire: Wire) -> None:
    moved = actuator(wire)
    wire.is_blocked = True
    with pytest.raises(DeviceError, match=r"does not follow: it is at 2\.00 mm"):
        moved.push(10.0)
    with pytest.raises(DeviceError, match="does not arrive"):
        moved.push(1.0)
    # The last word was that it stays where it is.
    assert wire.told[-1] == wire.at


def test_a_stage_that_is_silent_or_was_moved_is_a_fault(wire: Wire) -> None:
    moved = actuator(wire)
    wire.at = Place(9.0, 0.0)
    with pytest.raises(DeviceError, match=r"at 9\.00 mm, 0\.0 deg, but was left at 2\.00 mm"):
        moved.push(1.0)
    wire.is_silent = True
    with pytest.raises(DeviceError, match="silent"):
        moved.push(1.0)


def test_a_stage_that_moves_by_itself_is_refused(wire: Wire) -> None:
    wire.drift_mm = 0.1
    with pytest.raises(DeviceError, match="moves although nothing commands it"):
        actuator(wire)
