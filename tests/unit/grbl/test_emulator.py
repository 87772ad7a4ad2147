"""The emulated controller: motion times, real-time bytes, settings, limits and faults."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen.grbl.dialects import GRBL_11H, GRBLHAL, Dialect
from ntagen.grbl.emulator import Emulator
from ntagen.grbl.memory import Memory
from ntagen.grbl.planner import Limits, Planner
from ntagen.grbl.protocol import ProtocolError, Status, parse

BOTH = pytest.mark.parametrize("dialect", [GRBL_11H, GRBLHAL], ids=lambda d: d.name)


class Recorder:
    """A plant that adds up what it is told."""

    def __init__(self) -> None:
        self.sums: dict[str, float] = {}
        self.seconds = 0.0

    def move(self, steps: Mapping[str, float], seconds: float) -> None:
        self.seconds += seconds
        for axis, step in steps.items():
            self.sums[axis] = self.sums.get(axis, 0.0) + step


class Bench:
    """A started controller, and short ways to talk to it."""

    def __init__(self, dialect: Dialect, **settings: float) -> None:
        self.plant = Recorder()
        changes = {int(name[1:]): value for name, value in settings.items()}
        self.emulator = Emulator(dialect, self.plant, Memory(dialect, changes))
        self.emulator.power_on()
        self.wait(0.1)

    def wait(self, seconds: float) -> list[str]:
        self.emulator.advance(self.emulator.now_s + seconds)
        return [line for line in self.emulator.take().decode().split("\r\n") if line]

    def say(self, text: str) -> list[str]:
        self.emulator.feed(text.encode("latin-1"))
        return self.wait(0.01)

    def status(self) -> Status:
        reply = parse(self.say("?")[-1].encode())
        assert isinstance(reply, Status)
        return reply

    def seconds_until_it_stands(self) -> float:
        start_s = self.emulator.now_s
        while not self.status().stands:
            assert self.emulator.now_s < start_s + 100.0
        return self.emulator.now_s - start_s


@BOTH
@pytest.mark.parametrize(
    ("length_mm", "speed_mm_per_s", "seconds"),
    [
        # Long: two ramps of v/a, and the rest at v. Short: two ramps of sqrt(s/a).
        (10.0, 5.0, 10.0 / 5.0 + 5.0 / 50.0),
        (0.1, 5.0, 2.0 * math.sqrt(0.1 / 50.0)),
        (10.0, 100.0, 10.0 / (500.0 / 60.0) + (500.0 / 60.0) / 50.0),
    ],
)
def test_motions_take_the_time_of_a_trapezoid(
    dialect: Dialect, length_mm: float, speed_mm_per_s: float, seconds: float
) -> None:
    bench = Bench(dialect, _120=50.0)
    assert bench.say(f"G1G91X{length_mm}F{speed_mm_per_s * 60}") == []
    bench.say("\n")
    bench.wait(seconds + 0.1)
    assert bench.plant.seconds == pytest.approx(seconds, abs=0.011)
    assert bench.plant.sums == {"X": pytest.approx(length_mm)}
    assert bench.status().machine == pytest.approx((length_mm, *[0.0] * (len(dialect.axes) - 1)))


@BOTH
def test_a_hold_overruns_by_the_computed_motion_and_the_braking(dialect: Dialect) -> None:
    bench = Bench(dialect, _120=50.0)
    bench.say("G1G91X20F300\n")
    bench.wait(1.0)
    before_mm = bench.emulator.position[0]
    bench.say("!")
    assert str(bench.status()) == "Hold:1"
    bench.seconds_until_it_stands()
    assert str(bench.status()) == "Hold:0"
    expected_mm = 5.0 * dialect.lead_s + 5.0**2 / (2 * 50.0)
    assert bench.emulator.position[0] - before_mm == pytest.approx(expected_mm, abs=0.002)
    bench.say("~")
    bench.seconds_until_it_stands()
    assert bench.plant.sums["X"] == pytest.approx(20.0)


@BOTH
def test_a_jog_ends_on_cancel_and_the_rest_is_forgotten(dialect: Dialect) -> None:
    bench = Bench(dialect)
    # A hold ends a jog of GRBL, too; grblHAL goes on (`docs/firmware.md`).
    for byte in "\x85" if dialect.is_hal else "\x85!":
        bench.say("$J=G91G21X20F300\n")
        bench.wait(1.0)
        bench.say(byte)
        assert bench.status().activity.value == "Jog"
        bench.seconds_until_it_stands()
        assert str(bench.status()) == "Idle"
    assert 4.0 < bench.plant.sums["X"] < 20.0


def test_grblhal_does_not_hear_a_hold_in_a_jog() -> None:
    bench = Bench(GRBLHAL)
    bench.say("$J=G91G21X20F300\n")
    bench.wait(1.0)
    bench.say("!")
    bench.seconds_until_it_stands()
    assert bench.plant.sums["X"] == pytest.approx(20.0)


def test_grblhal_stands_in_a_jog_for_ever_when_the_door_is_opened() -> None:
    bench = Bench(GRBLHAL)
    bench.say("$J=G91G21X20F300\n")
    bench.wait(1.0)
    assert bench.say("\x84") == ["[MSG:Check Door]"]
    bench.wait(5.0)
    there_mm = bench.plant.sums["X"]
    bench.say("\x85")
    assert str(bench.status()) == "Jog"
    assert bench.plant.sums["X"] == there_mm
    bench.say("~")
    bench.seconds_until_it_stands()
    assert bench.plant.sums["X"] == pytest.approx(20.0)
    bench.say("$J=G91G21X-20F300\n")
    bench.wait(1.0)
    bench.say("\x84")
    bench.wait(1.0)
    assert bench.say("\x18") == ["ALARM:3"]


def test_grbl_ends_a_jog_when_the_door_is_opened_and_is_held_until_it_is_closed() -> None:
    """As GRBL 1.1h did in simavr (`docs/firmware.md`)."""
    bench = Bench(GRBL_11H)
    bench.say("$J=G91G21X20F300\n")
    bench.wait(1.0)
    bench.emulator.press("D")
    assert bench.wait(0.0) == ["[MSG:Check Door]"]
    assert str(bench.status()) == "Jog"
    bench.wait(1.0)
    assert str(bench.status()) == "Door:1"
    there_mm = bench.plant.sums["X"]
    bench.say("~")
    assert str(bench.status()) == "Door:1"
    bench.emulator.press("")
    assert str(bench.status()) == "Door:0"
    bench.say("~")
    assert str(bench.status()) == "Idle"
    bench.wait(1.0)
    assert bench.plant.sums["X"] == there_mm < 10.0


@BOTH
def test_a_reset_in_motion_is_an_alarm_and_at_rest_it_is_not(dialect: Dialect) -> None:
    bench = Bench(dialect)
    assert bench.say("\x18") + bench.wait(1.0) == [dialect.banner]
    bench.say("G1G91X20F300\n")
    bench.wait(1.0)
    position_mm = bench.emulator.position[0]
    assert bench.say("\x18") == ["ALARM:3"]
    assert bench.wait(1.0) == [dialect.banner, "[MSG:'$H'|'$X' to unlock]"]
    assert bench.emulator.position[0] == pytest.approx(position_mm, abs=0.01)
    assert bench.say("G1X1F300\n") == ["error:9"]
    assert bench.say("$X\n") == ["[MSG:Caution: Unlocked]", "ok"]
    assert str(bench.status()) == "Idle"


def test_only_grblhal_latches_errors() -> None:
    for dialect, answer in ((GRBL_11H, "ok"), (GRBLHAL, "error:20")):
        bench = Bench(dialect)
        assert bench.say("G99\n") == ["error:20"]
        assert bench.say("G21\n") == [answer]
        assert bench.say("\n") == ["ok"]
        assert bench.say("G21\n") == ["ok"]


@BOTH
@pytest.mark.parametrize(
    ("line", "answer"),
    [
        *(
            ("G1", "error:22"),
            ("G0G1X1", "error:21"),
            ("X1X2F10", "error:25"),
            ("G2X1", "error:20"),
        ),
        *(("G4", "error:28"), ("XF1", "error:2"), ("1X", "error:1"), ("F-1", "error:4")),
        *(("$J=X1", "error:22"), ("$J=F100", "error:26"), ("$J=G1X1F100", "error:16")),
        *(
            ("$999=1", "error:3"),
            ("$100=x", "error:2"),
            ("$100=-1", "error:4"),
            ("$0=1", "error:6"),
        ),
        *(("$20=1", "error:10"), ("$H", "error:5"), ("$Q", "error:3"), ("(words) G21 ; ok", "ok")),
    ],
)
def test_lines_are_refused_with_their_number(dialect: Dialect, line: str, answer: str) -> None:
    assert Bench(dialect).say(f"{line}\n") == [answer]


def test_a_long_line_is_refused() -> None:
    bench = Bench(GRBL_11H)
    assert bench.say("G21" + "(" + "x" * 74 + ")\n") == ["error:11"]
    assert bench.say("G21" + " " * 70 + "G90\n") == ["ok"]


@BOTH
def test_settings_survive_resets(dialect: Dialect) -> None:
    bench = Bench(dialect)
    assert bench.say("$100=80\n") == ["ok"]
    bench.say("\x18")
    bench.wait(1.0)
    assert any(line.startswith("$100=80.000") for line in bench.say("$$\n"))


@BOTH
def test_soft_limits_refuse_jogs_and_stop_motions(dialect: Dialect) -> None:
    bench = Bench(dialect, _22=1, _20=1, _130=50)
    bench.say("$X\n")
    assert bench.say("$J=G91X-60F500\n") == ["error:15"]
    assert bench.say("$J=G91X-40F500\n") == ["ok"]
    bench.wait(10.0)
    assert bench.say("G91G1X-20F500\n") == ["ALARM:2", "[MSG:Reset to continue]"]
    assert bench.say("$X\n") == []
    # As GRBL 1.1h in simavr, and grblHAL in its simulator.
    assert len(bench.say("?")) == (1 if dialect is GRBLHAL else 0)
    bench.say("\x18")
    assert bench.wait(1.0)[-1] == "[MSG:'$H'|'$X' to unlock]"


def test_homing_ends_at_the_pull_off() -> None:
    bench = Bench(GRBL_11H, _22=1)
    assert str(bench.status()) == "Alarm"
    assert bench.say("$H\n") == []
    assert bench.wait(10.0) == ["ok"]
    assert bench.status().machine == (-1.0, -1.0, -1.0)


def test_a_limit_switch_that_is_hit_in_motion_is_an_alarm() -> None:
    bench = Bench(GRBL_11H, _21=1)
    bench.say("G1G91X20F300\n")
    bench.wait(1.0)
    bench.emulator.press("X")
    assert "ALARM:1" in bench.wait(0.1)
    bench.say("\x18")
    bench.wait(1.0)
    assert bench.status().pins == "X"
    assert str(bench.status()) == "Alarm"


def test_lines_wait_for_dwells_and_for_the_end_of_a_hold() -> None:
    bench = Bench(GRBL_11H)
    assert bench.say("G4P0.5\n") == []
    assert bench.wait(0.4) == []
    assert bench.wait(0.2) == ["ok"]
    bench.say("!")
    assert bench.say("G21\n") == []
    assert bench.say("~") == ["ok"]


def test_what_does_not_fit_into_the_buffer_is_lost() -> None:
    bench = Bench(GRBL_11H)
    bench.say("!")
    bench.say("G21\n" * 50)
    assert 20 < bench.say("~").count("ok") + bench.wait(5.0).count("ok") < 50


def test_faults() -> None:
    bench = Bench(GRBL_11H)
    bench.emulator.faults.lost["X"] = 0.25
    bench.emulator.faults.pace = 0.5
    bench.say("G1G91X1F300\n")
    bench.wait(0.7)
    assert str(bench.status()) == "Run"
    bench.wait(1.0)
    assert bench.plant.sums["X"] == pytest.approx(0.75)
    assert bench.emulator.position[0] == pytest.approx(1.0)
    bench.emulator.faults.is_silent = True
    assert bench.say("?") == []


LIMITS = Limits((10.0, 20.0), (50.0, 100.0), 0.01)


@given(
    st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(0.1, 30)), max_size=6),
    st.lists(st.tuples(st.sampled_from("hr"), st.floats(0.0, 1.0)), max_size=6),
)
def test_the_planner_keeps_speeds_and_arrives(
    ways: list[tuple[float, float, float]], calls: list[tuple[str, float]]
) -> None:
    planner = Planner((0.0, 0.0), 0.05)
    for x, y, speed in ways:
        planner.add((x, y), speed, LIMITS)
    goal, now_s = planner.target, 0.0

    def go(seconds: float) -> None:
        nonlocal now_s
        end_s = now_s + seconds
        while now_s < end_s:
            before = planner.position
            now_s += 0.01
            planner.advance(now_s)
            for b, a, limit in zip(before, planner.position, LIMITS.speeds, strict=True):
                assert abs(a - b) <= 0.01 * limit + 1e-6

    for call, seconds in calls:
        if call == "h":
            planner.hold()
        elif not planner.is_moving:
            planner.resume()
        go(seconds)
    go(1.5)
    planner.resume()
    if planner.is_moving:
        go(planner.end_s - now_s + 0.1)
    assert not planner.is_moving
    assert planner.position == pytest.approx(goal, abs=1e-6)
    assert planner.block_count == 0


@given(st.lists(st.tuples(st.binary(max_size=60), st.floats(0.0, 0.5)), max_size=8), st.booleans())
def test_any_bytes_are_answered_with_lines_of_the_protocol(
    pieces: list[tuple[bytes, float]], is_hal: bool
) -> None:
    emulator = Emulator(GRBLHAL if is_hal else GRBL_11H)
    emulator.power_on()
    for data, seconds in pieces:
        emulator.feed(data)
        emulator.advance(emulator.now_s + seconds)
    for line in emulator.take().split(b"\r\n"):
        try:
            parse(line)
        except ProtocolError:
            pytest.fail(f"the emulator said {line!r}")
