"""The simulated lab: what a driver sees of it, and what is true."""

from __future__ import annotations

import contextlib
import json
import math
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ntagen.cli import main
from ntagen.errors import DeviceError, InputError
from ntagen.grbl.actuator import GrblActuator
from ntagen.grbl.axes import Axes, Axis
from ntagen.grbl.port import SerialPort
from ntagen.lab.lab import Freeze, Lab, TrackerFaults
from ntagen.lab.needles import place
from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import distance
from ntagen.needle.virtual import Errors
from ntagen.scene import Vector
from ntagen.tracking.frames import IDENTITY
from ntagen.tracking.live import LiveTracker, Source
from ntagen.tracking.spec import parse_tracker
from tests.steering import PAPER

EXAMPLE = Path(__file__).parents[3] / "examples" / "stepper.nsl"
ENTRY_MM = PAPER.needle.tip.position_mm
FAST = Axes(push_mm_per_s=1.0, pull_mm_per_s=5.0)


def lab(name: str = "virtual", speed: float = 20.0, errors: Errors | None = None) -> Lab:
    return Lab(PAPER, place(name, PAPER, 1, 2.0, errors), speed=speed)


@contextlib.contextmanager
def driver(its: Lab, watch: Callable[[], None] = lambda: None) -> Iterator[GrblActuator]:
    port = SerialPort(its.port)
    try:
        yield GrblActuator(port, FAST, watch)
    finally:
        port.close()


@contextlib.contextmanager
def tracker(its: Lab, options: str = "stale=5s") -> Iterator[LiveTracker]:
    source = parse_tracker(f"{its.tracker_address},{options}")
    assert isinstance(source, Source)
    with LiveTracker(source, IDENTITY, lambda: 0.0) as live:
        yield live


def test_a_driver_that_is_started_again_finds_the_axes_where_they_stand() -> None:
    with lab() as its:
        with driver(its) as actuator:
            actuator.push(2.0)
        with driver(its) as actuator:
            assert actuator.position[0] == pytest.approx(2.0)
            actuator.push(1.0)
            actuator.roll(math.pi)
        truth = its.truth()
    assert truth.has_moved
    # A chord of an arc of 3 mm on a circle of 30 mm.
    assert distance(truth.tip.position_mm, ENTRY_MM) == pytest.approx(60.0 * math.sin(0.05))
    assert truth.tip.bevel[2] < -0.9
    assert truth.target == "T1"
    assert truth.target_distance_mm == pytest.approx(
        distance(truth.tip.position_mm, (0.0, -50.0, 0.0)) - 10.0
    )
    assert 15.0 < truth.clearance_mm < 23.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["virtual", "phantom"])
def test_the_tip_is_seen_in_the_middle_of_a_motion(name: str) -> None:
    seen: list[Measurement] = []
    with lab(name, speed=10.0) as its, tracker(its) as sensor:
        assert sensor.measure().heading is not None
        with driver(its, lambda: seen.append(sensor.newest())) as actuator:
            actuator.push(5.0)
            pushed = len(seen)
            actuator.roll(math.pi)
            actuator.pull(5.0)
            last = sensor.measure()
    depths = [distance(one.position_mm, ENTRY_MM) for one in seen]
    between = [depth for depth in depths[:pushed] if 0.5 < depth < 4.5]
    assert len(set(between)) >= 5
    assert between == pytest.approx(sorted(between), abs=0.5)
    assert distance(last.position_mm, ENTRY_MM) < 0.6
    turned = [one.bevel[2] for one in seen[pushed:] if one.bevel is not None]
    assert turned[0] > 0.9
    assert turned[-1] < -0.9
    if name == "virtual":
        assert any(-0.8 < z < 0.8 for z in turned)


def test_a_roll_has_one_error_however_often_it_is_seen() -> None:
    with lab(errors=Errors(roll_rad=0.2)) as its, driver(its) as actuator:
        actuator.roll(math.pi)
        its.truth()
        bevel = its.truth().tip.bevel
    with lab(speed=100.0, errors=Errors(roll_rad=0.2)) as its, driver(its) as actuator:
        actuator.roll(math.pi)
        assert its.truth().tip.bevel == pytest.approx(bevel, abs=1e-3)
    assert abs(bevel[0]) > 0.01


def off(sensor: LiveTracker) -> Vector:
    measured = sensor.measure().position_mm
    return tuple(a - b for a, b in zip(measured, ENTRY_MM, strict=True))  # type: ignore[return-value]


def measure_on(sensor: LiveTracker) -> None:
    """Measures until samples that were under way are gone."""
    for _ in range(10):
        sensor.measure()


REFUSED: dict[str, tuple[Callable[[TrackerFaults], object], str]] = {
    "silent": (lambda faults: setattr(faults, "is_silent", True), "stale"),
    "lost": (lambda faults: setattr(faults, "is_lost", True), "stale"),
    "frozen": (lambda faults: setattr(faults, "freeze", Freeze.WHOLE), "stale"),
    "no number": (lambda faults: setattr(faults, "is_nan", True), "not a number"),
    "mirrored": (lambda faults: setattr(faults, "signs", (-1.0, 1.0, 1.0)), "mirrors"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_faults_that_a_tracker_client_notices(name: str) -> None:
    change, says = REFUSED[name]
    with lab() as its, tracker(its, "stale=700ms") as sensor:
        assert off(sensor) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
        change(its.faults)
        with pytest.raises(DeviceError, match=says):
            measure_on(sensor)


def test_faults_that_look_like_measurements() -> None:
    with lab() as its, tracker(its) as sensor:
        sensor.measure()
        its.faults.jump_mm = (0.0, 30.0, 0.0)
        its.faults.force_n = 50.0
        its.faults.signs = (-1.0, -1.0, 1.0)
        sensor.measure()
        measured = sensor.measure()
        assert measured.position_mm == pytest.approx((0.0, -30.0, 0.0), abs=1e-6)
        assert measured.force_n == 50.0
        its.faults.jump_mm = (0.0, 0.0, 0.0)
        its.faults.freeze = Freeze.STAMPED
        with driver(its) as actuator:
            actuator.push(2.0)
        assert sensor.measure().position_mm == pytest.approx((0.0, -30.0, 0.0), abs=1e-6)
        its.faults.freeze = Freeze.NO
        its.faults.signs = (1.0, 1.0, 1.0)
        sensor.measure()
        assert distance(sensor.measure().position_mm, ENTRY_MM) == pytest.approx(2.0, abs=0.01)


def test_a_delay_shows_the_needle_as_it_was() -> None:
    options = "stale=3s,latency=400ms"
    with lab() as its, tracker(its, options) as sensor, driver(its) as actuator:
        its.faults.delay_s = 0.4
        actuator.push(1.0)
        assert distance(sensor.newest().position_mm, ENTRY_MM) < 0.95
        assert distance(sensor.measure().position_mm, ENTRY_MM) == pytest.approx(1.0, abs=0.01)


def test_the_axes_of_a_task_are_those_of_the_lab() -> None:
    axes = Axes(Axis("Y", -1, 80.0), Axis("Z", 1, 8.0))
    with Lab(PAPER, place("virtual", PAPER, 1, 2.0), axes=axes, speed=20.0) as its:
        port = SerialPort(its.port)
        GrblActuator(port, axes).push(2.0)
        port.close()
        assert its.emulator.position[1] == pytest.approx(-2.0)
        assert distance(its.truth().tip.position_mm, ENTRY_MM) == pytest.approx(2.0, abs=0.01)
    with pytest.raises(InputError, match="no axis B"):
        Lab(PAPER, place("virtual", PAPER, 1, 2.0), axes=Axes(roll=Axis("B")))


@pytest.mark.slow
def test_the_command_says_how_to_drive_and_then_the_truth() -> None:
    words = [sys.executable, "-m", "ntagen", "device", "simulate", str(EXAMPLE), "--json"]
    with subprocess.Popen([*words, "--speed", "20"], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        facts = json.loads(process.stdout.readline())
        port = SerialPort(facts["port"])
        GrblActuator(port, FAST).push(3.0)
        process.send_signal(signal.SIGTERM)
        truth = json.loads(process.communicate(timeout=20)[0])
        port.close()
    assert process.returncode == 0
    assert facts["device"] == f"grbl:{facts['port']}"
    for word in (facts["device"], facts["tracker"], "--registration none", str(EXAMPLE)):
        assert word in facts["command"]
    assert "  prior noise " in facts["command"].partition("--set '")[2]
    assert truth["has_moved"]
    assert distance(tuple(truth["tip_mm"]), ENTRY_MM) == pytest.approx(3.0, abs=0.01)


@pytest.mark.slow
def test_the_lab_closes_when_nothing_has_moved_for_some_time(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["device", "simulate", str(EXAMPLE), "--needle", "virtual", "--speed", "50"]
    command = threading.Thread(target=main, args=([*words, "--until-idle", "1.2"],))
    command.start()
    said = ""
    while "Ctrl-C" not in said:
        command.join(0.02)
        assert command.is_alive()
        said += capsys.readouterr().out
    port = SerialPort(said.partition("grbl:")[2].split()[0])
    GrblActuator(port, FAST).push(1.0)
    command.join(20.0)
    port.close()
    assert "39.00 mm outside of T1, and the cut path is" in capsys.readouterr().out


def test_options_that_the_needle_in_the_lab_does_not_have(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["device", "simulate", str(EXAMPLE), "--needle", "grbl"]) == 2
    assert main(["device", "simulate", "nowhere.nsl"]) == 2
    assert "nowhere.nsl" in capsys.readouterr().err
    assert main(["device", "simulate", str(EXAMPLE.with_name("paper.nsl"))]) == 2
    assert "the task describes no device" in capsys.readouterr().err
