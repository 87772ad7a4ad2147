"""The driver of a GRBL controller against the emulator, on a simulated clock."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace

import pytest

from ntagen.errors import DeviceError, Halted
from ntagen.grbl.actuator import STOP_BYTES, GrblActuator, StoppedError
from ntagen.grbl.axes import Axes, Axis
from ntagen.grbl.dialects import GRBL_11H, GRBLHAL, Dialect
from ntagen.grbl.emulator import Emulator, SimulatedPort
from ntagen.grbl.memory import Memory
from tests.faults.connections import pull_cable

AXES = {
    GRBL_11H.name: Axes(insert=Axis("X"), roll=Axis("Y", sign=-1), roll_deg_per_s=90.0),
    GRBLHAL.name: Axes(insert=Axis("X"), roll=Axis("A", sign=-1), roll_deg_per_s=90.0),
}
SETTINGS = {
    **dict.fromkeys((110, 111, 112, 113), 6000.0),
    **dict.fromkeys((120, 121, 122, 123), 200.0),
}
BOTH = pytest.mark.parametrize("dialect", [GRBL_11H, GRBLHAL], ids=lambda d: d.name)


class Sum:
    """A plant that adds up what it is told."""

    def __init__(self) -> None:
        self.sums: dict[str, float] = {}

    def move(self, steps: Mapping[str, float], seconds: float) -> None:
        for axis, step in steps.items():
            self.sums[axis] = self.sums.get(axis, 0.0) + step


class Bench:
    """A driver and the controller that it drives."""

    def __init__(self, dialect: Dialect, axes: Axes | None = None, **settings: float) -> None:
        changes = SETTINGS | {int(name[1:]): value for name, value in settings.items()}
        changes = {n: v for n, v in changes.items() if n in dialect.settings}
        self.plant = Sum()
        self.emulator = Emulator(dialect, self.plant, Memory(dialect, changes))
        self.emulator.power_on()
        self.port = SimulatedPort(self.emulator)
        self.axes = axes or AXES[dialect.name]

    def connect(self, watch: Callable[[], None] = lambda: None) -> GrblActuator:
        return GrblActuator(self.port, self.axes, watch)

    def let_go(self, line: str, seconds: float) -> None:
        self.emulator.feed(line.encode("latin-1"))
        self.emulator.advance(self.emulator.now_s + seconds)


class At:
    """A watch that does something once, after some time."""

    def __init__(self, bench: Bench, seconds: float, action: Callable[[], None]) -> None:
        self._bench = bench
        self._due_s = bench.emulator.now_s + seconds
        self._action: Callable[[], None] | None = action

    def __call__(self) -> None:
        if self._action is not None and self._bench.emulator.now_s >= self._due_s:
            action, self._action = self._action, None
            action()


@BOTH
def test_the_needle_is_pushed_rolled_and_pulled(dialect: Dialect) -> None:
    bench = Bench(dialect)
    actuator = bench.connect()
    start_s = actuator.now_s()
    actuator.push(2.0)
    assert actuator.now_s() - start_s == pytest.approx(2.0, abs=0.2)
    actuator.roll(math.pi)
    actuator.push(12.3456)
    actuator.pull(4.0)
    actuator.push(0.0)
    roll = AXES[dialect.name].roll.letter
    assert bench.plant.sums == {"X": pytest.approx(10.3456, abs=0.005), roll: pytest.approx(-180.0)}


@BOTH
def test_rounded_steps_do_not_add_up(dialect: Dialect) -> None:
    bench = Bench(dialect, _100=7.0)
    actuator = bench.connect()
    for _ in range(50):
        actuator.push(0.5)
    assert bench.plant.sums["X"] == pytest.approx(25.0, abs=1.0 / 7.0)


@BOTH
def test_a_stop_ends_the_motion_and_another_motion_may_follow(dialect: Dialect) -> None:
    bench = Bench(dialect)
    actuator = bench.connect()
    actuator.watch = At(bench, 1.0, actuator.stop)
    with pytest.raises(StoppedError):
        actuator.push(5.0)
    overrun_mm = 1.0 * dialect.lead_s + 1.0 / (2 * 200.0)
    assert bench.plant.sums["X"] == pytest.approx(1.0 + overrun_mm, abs=0.03)
    actuator.stop()
    actuator.stop()
    stopped_mm = bench.plant.sums["X"]
    actuator.push(1.0)
    assert bench.plant.sums["X"] == pytest.approx(stopped_mm + 1.0, abs=0.005)


@BOTH
@pytest.mark.parametrize("seconds", [0.0, 0.001, 0.003, 0.006, 0.01, 0.05, 2.0, 3.99, 4.05])
def test_a_stop_at_any_moment_is_no_fault(dialect: Dialect, seconds: float) -> None:
    bench = Bench(dialect, replace(AXES[dialect.name], max_mm=2.0))
    actuator = bench.connect()
    actuator.watch = At(bench, seconds, actuator.stop)
    with pytest.raises(StoppedError):
        actuator.push(6.0)
    stopped_mm = bench.plant.sums.get("X", 0.0)
    actuator.push(1.0)
    assert bench.plant.sums["X"] == pytest.approx(stopped_mm + 1.0, abs=0.005)


class Interrupted(SimulatedPort):
    """A port at which another thread's stop comes just before a chosen read."""

    def __init__(self, emulator: Emulator) -> None:
        super().__init__(emulator)
        self._emulator = emulator
        self.actuator: GrblActuator | None = None
        self.reads_left = 0

    def read(self, timeout_s: float) -> bytes:
        self.reads_left -= 1
        if self.reads_left == 0 and self.actuator is not None:
            # What `stop` does until it waits for its turn to talk.
            self.actuator._stops += 1
            self._emulator.feed(STOP_BYTES)
        return super().read(timeout_s)


@BOTH
@pytest.mark.parametrize("count", [*range(1, 12), 20, 50, 200])
def test_a_stop_of_another_thread_before_any_read_is_no_fault(dialect: Dialect, count: int) -> None:
    bench = Bench(dialect)
    port = Interrupted(bench.emulator)
    actuator = port.actuator = GrblActuator(port, bench.axes)
    port.reads_left = count
    with pytest.raises(StoppedError):
        actuator.push(5.0)
    actuator.stop()
    stopped_mm = bench.plant.sums.get("X", 0.0)
    actuator.push(1.0)
    assert bench.plant.sums["X"] == pytest.approx(stopped_mm + 1.0, abs=0.005)


@BOTH
def test_what_the_watch_raises_stops_the_needle_first(dialect: Dialect) -> None:
    bench = Bench(dialect)
    actuator = bench.connect()

    def interrupt() -> None:
        raise KeyboardInterrupt("the operator")

    actuator.watch = At(bench, 1.0, interrupt)
    with pytest.raises(KeyboardInterrupt, match="the operator"):
        actuator.push(5.0)
    stopped_mm = bench.plant.sums["X"]
    assert stopped_mm == pytest.approx(1.06, abs=0.03)
    bench.emulator.advance(bench.emulator.now_s + 10.0)
    assert bench.plant.sums["X"] == stopped_mm


class BusyPort(SimulatedPort):
    """A port of a computer that is busy once, between a report about a motion and its reader."""

    def __init__(self, emulator: Emulator, seconds: float) -> None:
        super().__init__(emulator)
        self._its = emulator
        self.seconds = seconds

    def read(self, timeout_s: float) -> bytes:
        data = super().read(timeout_s)
        if b"<Jog" in data:
            seconds, self.seconds = self.seconds, 0.0
            self._its.advance(self._its.now_s + seconds)
        return data


@BOTH
def test_a_report_that_is_read_late_is_no_fault_of_the_axis(dialect: Dialect) -> None:
    bench = Bench(dialect)
    port = BusyPort(bench.emulator, 10.0)
    actuator = GrblActuator(port, bench.axes)
    actuator.push(2.0)
    assert port.seconds == 0.0
    assert bench.plant.sums["X"] == pytest.approx(2.0)


def freeze(bench: Bench) -> None:
    bench.emulator.faults.pace = 0.0


def slow_down(bench: Bench) -> None:
    bench.emulator.faults.pace = 0.3


def be_silent(bench: Bench) -> None:
    bench.emulator.faults.is_silent = True


def make_noise(bench: Bench) -> None:
    bench.emulator.send(b"\xff\x00\x91~|\n")


def send_endless_noise(bench: Bench) -> None:
    bench.emulator.send(b"U" * 2000)


FAULTS: dict[str, tuple[Callable[[Bench], None], str]] = {
    "frozen": (freeze, "is stuck"),
    "slow": (slow_down, "is too slow"),
    "silent": (be_silent, "no status report"),
    "noise": (make_noise, "no reply of GRBL"),
    "endless noise": (send_endless_noise, "no reply of GRBL"),
    "alarm": (lambda b: b.emulator.raise_alarm(1), r"ALARM:1 \(a limit switch was hit\)"),
    "reset": (lambda b: b.let_go("\x18", 0.0), r"ALARM:3|was reset"),
    "power cut": (lambda b: b.emulator.power_on(), "the controller was reset"),
    "cable pulled": (lambda b: pull_cable(b.port), "connection to the controller is broken"),
    "door": (lambda b: b.let_go("\x84", 0.0), "was interrupted|not idle|is stuck"),
}


@BOTH
@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("seconds", [0.0, 0.013, 1.0])
def test_after_a_fault_nothing_moves_any_more(dialect: Dialect, name: str, seconds: float) -> None:
    fault, words = FAULTS[name]
    bench = Bench(dialect)
    actuator = bench.connect()
    actuator.push(1.0)
    actuator.watch = At(bench, seconds, lambda: fault(bench))
    with pytest.raises(DeviceError, match=words) as raised:
        actuator.push(5.0)
    assert "hint:" in str(raised.value)
    bench.emulator.faults.is_silent = False
    bench.emulator.faults.pace = 1.0
    bench.emulator.advance(bench.emulator.now_s + 10.0)
    moved_mm = bench.plant.sums["X"]
    assert moved_mm < 6.0 if name != "cable pulled" else moved_mm <= 6.001
    for move in (actuator.push, actuator.pull, actuator.roll):
        with pytest.raises(DeviceError):
            move(1.0)
    bench.let_go("~", 10.0)
    assert bench.plant.sums["X"] == moved_mm


@BOTH
def test_a_limit_switch_stops_the_needle_and_the_driver_learns_where(dialect: Dialect) -> None:
    bench = Bench(dialect)
    actuator = bench.connect()
    actuator.watch = At(bench, 1.0, lambda: bench.emulator.raise_alarm(1))
    with pytest.raises(DeviceError) as raised:
        actuator.push(5.0)
    assert "ALARM:1" in str(raised.value)
    assert "does not confirm" not in str(raised.value)
    assert actuator.position[0] == pytest.approx(bench.plant.sums["X"], abs=0.01)
    assert 0.5 < actuator.position[0] < 2.0


def test_an_open_door_stops_the_needle_and_the_driver_learns_where() -> None:
    bench = Bench(GRBL_11H)
    actuator = bench.connect()
    actuator.watch = At(bench, 1.0, lambda: bench.emulator.press("D"))
    with pytest.raises(DeviceError, match=r"was interrupted.*state Door") as raised:
        actuator.push(5.0)
    assert "does not confirm" not in str(raised.value)
    assert actuator.position[0] == pytest.approx(bench.plant.sums["X"], abs=0.01)
    bench.emulator.press("")
    bench.let_go("~", 10.0)
    assert actuator.position[0] == pytest.approx(bench.plant.sums["X"], abs=0.01)


def test_a_hold_button_ends_a_push() -> None:
    bench = Bench(GRBL_11H)
    actuator = bench.connect()
    actuator.watch = At(bench, 1.0, lambda: bench.let_go("!", 0.0))
    with pytest.raises(DeviceError, match="ended too early"):
        actuator.push(5.0)
    assert bench.plant.sums["X"] < 5.0


def test_a_hold_button_of_grblhal_ends_no_push_but_the_next_one_does_not_begin() -> None:
    bench = Bench(GRBLHAL)
    actuator = bench.connect()
    actuator.watch = At(bench, 1.0, lambda: bench.let_go("!", 0.0))
    actuator.push(5.0)
    actuator.watch = lambda: None
    bench.let_go("!", 0.0)
    with pytest.raises(DeviceError, match="in the state Hold:0, not idle"):
        actuator.push(1.0)
    assert bench.plant.sums["X"] == pytest.approx(5.0)


def test_a_door_of_grblhal_ends_a_push_and_its_resume_button_does_not_go_on_with_it() -> None:
    bench = Bench(GRBLHAL)
    actuator = bench.connect()
    actuator.watch = At(bench, 1.0, lambda: bench.let_go("\x84", 0.0))
    with pytest.raises(DeviceError, match=r"is stuck(.|\n)*its state is Jog"):
        actuator.push(5.0)
    there_mm = bench.plant.sums["X"]
    assert 0.5 < there_mm < 2.0
    bench.let_go("~", 10.0)
    assert bench.plant.sums["X"] == there_mm


@BOTH
def test_an_axis_that_was_moved_by_something_else_is_noticed(dialect: Dialect) -> None:
    bench = Bench(dialect)
    actuator = bench.connect()
    bench.let_go("$J=G91X1F600\n", 2.0)
    with pytest.raises(DeviceError, match=r"was left at 0\.000"):
        actuator.push(1.0)


@BOTH
def test_a_restart_finds_a_machine_that_is_not_ready(dialect: Dialect) -> None:
    for line, words in (
        ("$J=G91X20F60\n", "moving already"),
        ("!", "in the state Hold:0"),
        ("G1X20F60\n", "moving already"),
    ):
        bench = Bench(dialect)
        bench.let_go(line, 1.0)
        with pytest.raises(DeviceError, match=words):
            bench.connect()
    bench = Bench(dialect)
    bench.emulator.raise_alarm(3)
    with pytest.raises(DeviceError, match=r"locked by an alarm(.|\n)*\$X"):
        bench.connect()


@BOTH
def test_a_restart_after_an_unfinished_error_works(dialect: Dialect) -> None:
    bench = Bench(dialect)
    bench.let_go("G99\nG1X", 1.0)
    bench.let_go("\n", 1.0)
    bench.connect().push(1.0)
    assert bench.plant.sums["X"] == pytest.approx(1.0)


@BOTH
def test_noise_while_a_controller_starts_is_no_fault(dialect: Dialect) -> None:
    bench = Bench(dialect)
    bench.emulator.send(b"\xfe\x00os:0.000|FS:0,0>\r\n")
    bench.connect().push(1.0)
    assert bench.plant.sums["X"] == pytest.approx(1.0)


@BOTH
def test_late_reports_are_not_taken_for_new_ones(dialect: Dialect) -> None:
    bench = Bench(dialect)
    actuator = bench.connect()
    for _ in range(3):
        bench.let_go("???", 0.01)
        actuator.push(0.5)
    actuator.watch = At(bench, 0.7, lambda: bench.let_go("?????", 0.0))
    actuator.push(2.0)
    assert bench.plant.sums["X"] == pytest.approx(3.5)


@BOTH
@pytest.mark.parametrize(
    ("axes", "settings", "words"),
    [
        (Axes(roll=Axis("C")), {}, "no axis C"),
        (Axes(insert=Axis("X", steps_per_unit=80.0), roll=Axis("Y")), {}, "makes 250 steps per mm"),
        (Axes(roll=Axis("Y"), roll_deg_per_s=120.0), {}, "100 deg/s at most"),
        (Axes(roll=Axis("Y")), {"_13": 1.0}, "reports inches"),
    ],
)
def test_a_device_that_is_not_as_described_is_refused(
    dialect: Dialect, axes: Axes, settings: dict[str, float], words: str
) -> None:
    with pytest.raises(DeviceError, match=words):
        Bench(dialect, axes, **settings).connect()


def test_the_travel_is_kept() -> None:
    bench = Bench(GRBLHAL, Axes(insert=Axis("X", low=-1.0, high=10.0)))
    actuator = bench.connect()
    actuator.push(9.0)
    with pytest.raises(DeviceError, match="outside of the travel"):
        actuator.push(2.0)
    actuator.pull(10.0)
    assert bench.plant.sums["X"] == pytest.approx(-1.0)


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_impossible_motions_are_refused(value: float) -> None:
    bench = Bench(GRBLHAL)
    actuator = bench.connect()
    with pytest.raises(DeviceError, match="refuses to push"):
        actuator.push(value)
    with pytest.raises(DeviceError, match="refuses to pull"):
        actuator.pull(value)
    assert bench.plant.sums == {}


def test_a_refused_line_leaves_the_link_whole() -> None:
    bench = Bench(GRBLHAL, _22=1.0, _20=1.0, _130=50.0)
    bench.let_go("$X\n", 0.1)
    actuator = bench.connect()
    with pytest.raises(DeviceError, match=r"error:15 \(the jog would leave the travel"):
        actuator.push(1.0)
    actuator.pull(1.0)
    assert bench.plant.sums["X"] == pytest.approx(-1.0)


class Cutting(SimulatedPort):
    """A port at which a report in motion loses its first positions on the wire, once or always."""

    def __init__(self, emulator: Emulator, *, once: bool) -> None:
        super().__init__(emulator)
        self._once = once
        self.is_cut = False

    def read(self, timeout_s: float) -> bytes:
        data = super().read(timeout_s)
        if b"<Jog|" not in data or (self._once and self.is_cut):
            return data
        self.is_cut = True
        return re.sub(rb"MPos:[-\d.]+,[-\d.]+,", b"MPos:", data)


@BOTH
@pytest.mark.parametrize("once", [True, False])
def test_a_report_that_lost_positions_is_noise_and_stops_the_needle(
    dialect: Dialect, once: bool
) -> None:
    bench = Bench(dialect)
    port = Cutting(bench.emulator, once=once)
    actuator = GrblActuator(port, bench.axes)
    with pytest.raises(DeviceError, match="no reply of GRBL"):
        actuator.push(5.0)
    assert port.is_cut
    stopped_mm = bench.plant.sums.get("X", 0.0)
    bench.emulator.advance(bench.emulator.now_s + 10.0)
    assert bench.plant.sums.get("X", 0.0) == stopped_mm < 4.0
    with pytest.raises(DeviceError):
        actuator.push(1.0)


def test_a_message_with_other_letters_is_no_noise() -> None:
    bench = Bench(GRBLHAL)
    actuator = bench.connect()
    actuator.watch = At(bench, 1.0, lambda: bench.emulator.send("[MSG:Büro]\r\n".encode()))
    actuator.push(2.0)
    assert bench.plant.sums["X"] == pytest.approx(2.0, abs=0.005)


def test_lines_may_end_by_a_carriage_return_alone() -> None:
    class Returning(SimulatedPort):
        def read(self, timeout_s: float) -> bytes:
            return super().read(timeout_s).replace(b"\n", b"")

    bench = Bench(GRBL_11H)
    GrblActuator(Returning(bench.emulator), bench.axes).push(2.0)
    assert bench.plant.sums["X"] == pytest.approx(2.0, abs=0.005)


@BOTH
def test_a_screw_motion_moves_both_axes_at_once(dialect: Dialect) -> None:
    bench = Bench(dialect)
    actuator = bench.connect()
    letter = AXES[dialect.name].roll.letter
    ratios: list[tuple[float, float]] = []
    actuator.watch = lambda: ratios.append(
        (bench.plant.sums.get("X", 0.0), -bench.plant.sums.get(letter, 0.0))
    )
    start_s = actuator.now_s()
    actuator.screw(0.4, 2.0 * math.pi)
    assert bench.plant.sums["X"] == pytest.approx(0.4, abs=0.01)
    assert bench.plant.sums[letter] == pytest.approx(-360.0, abs=0.01)
    # Four quarters of a second each, with ramps.
    assert 4.0 < actuator.now_s() - start_s < 8.0
    assert all(mm == pytest.approx(0.4 * deg / 360.0, abs=0.01) for mm, deg in ratios)
    assert len(ratios) > 10
    actuator.screw(3.0, -math.pi)
    assert actuator.position[0] == pytest.approx(3.4)
    assert bench.plant.sums[letter] == pytest.approx(-180.0, abs=0.01)


@BOTH
def test_a_screw_motion_that_is_ended_early_tells_its_part_by_the_angle(dialect: Dialect) -> None:
    bench = Bench(dialect)
    actuator = bench.connect()

    def end() -> None:
        raise Halted("enough")

    actuator.watch = At(bench, 2.0, end)
    with pytest.raises(Halted) as caught:
        actuator.screw(0.4, 2.0 * math.pi)
    letter = AXES[dialect.name].roll.letter
    assert 0.1 < caught.value.part < 0.9
    assert -bench.plant.sums[letter] == pytest.approx(360.0 * caught.value.part, abs=0.05)
    assert bench.plant.sums["X"] == pytest.approx(0.4 * caught.value.part, abs=0.01)
    actuator.roll(2.0 * math.pi * (1.0 - caught.value.part))
    assert bench.plant.sums[letter] == pytest.approx(-360.0, abs=0.05)


@BOTH
def test_impossible_screw_motions_are_refused(dialect: Dialect) -> None:
    bench = Bench(dialect)
    actuator = bench.connect()
    for length_mm, angle_rad in ((-1.0, 1.0), (math.nan, 1.0), (1.0, math.inf)):
        with pytest.raises(DeviceError, match="refuses to screw"):
            actuator.screw(length_mm, angle_rad)
    assert not bench.plant.sums
