"""The clock of a node, simulated or not."""

from __future__ import annotations

import pytest

from ntagen.ros import clock
from ntagen.ros.clock import Clock


class Bench:
    """A clock whose two sources the test sets."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.machine_s, self.ros_s = 50.0, 1000.0
        self.told: list[str] = []
        monkeypatch.setattr(clock.time, "monotonic", lambda: self.machine_s)
        self.clock = Clock(lambda: self.ros_s, self.told.append)
        self.clock.begin()

    def pass_by(self, machine_s: float, ros_s: float) -> float:
        self.machine_s += machine_s
        self.ros_s += ros_s
        return self.clock.now_s()


def test_it_begins_at_zero_and_goes_on_as_the_ros_time(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    assert bench.pass_by(0.0, 0.0) == 0.0
    assert bench.pass_by(0.1, 0.5) == pytest.approx(0.5)
    assert bench.pass_by(0.1, 0.0) == pytest.approx(0.5)
    assert bench.told == []


@pytest.mark.parametrize(
    ("machine_s", "ros_s", "says"),
    [
        (0.1, -3.0, "went back by 3.00 s"),
        (0.1, 60.0, "went on by 60.0 s in 0.10 s"),
        (5.0, 0.0, "stands still for 5.0 s"),
    ],
)
def test_a_jump_is_told_and_not_shown(
    machine_s: float, ros_s: float, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(monkeypatch)
    before_s = bench.pass_by(0.0, 0.0)
    assert bench.pass_by(machine_s, ros_s) == before_s
    assert says in bench.told[0]
    assert "hint: arm again" in bench.told[0]


def test_the_first_time_is_no_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.ros_s = 0.0
    bench.clock.now_s()
    bench.ros_s = 1.7e9
    bench.clock.now_s()
    assert bench.told == []


def test_the_machines_clock_does_not_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    own = Clock(None, bench.told.append)
    bench.machine_s += 100.0
    assert own.now_s() == 100.0
    assert (own.is_simulated, bench.clock.is_simulated, bench.told) == (False, True, [])
