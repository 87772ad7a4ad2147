"""Damaged exchanges with a controller and with a tracker: stopped, and a clear end.

``NTAGEN_EXCHANGES=2000 NTAGEN_SEED=1`` makes a large run of each test.
"""

from __future__ import annotations

import math
import os
import random
import re
import threading

import pytest

from ntagen.errors import DeviceError
from ntagen.grbl.actuator import GrblActuator
from ntagen.grbl.axes import Axes, Axis
from ntagen.grbl.check import inspect
from ntagen.grbl.dialects import GRBL_11H, GRBLHAL
from ntagen.grbl.emulator import Emulator
from ntagen.grbl.memory import Memory
from ntagen.needle.measurement import Measurement
from ntagen.openigtlink.samples import Policy
from ntagen.tracking.live import Source
from ntagen.tracking.look import look
from ntagen.tracking.simulated import FORCE, NEEDLE, SimulatedTracker, packets_of
from tests.faults.catalogue import Fault
from tests.faults.connections import drop_clients
from tests.faults.exchanges import DamagedPort, Wire, changed_messages, changed_replies
from tests.faults.rig import Reading, Rig
from tests.faults.runs import run

EXCHANGES = int(os.environ.get("NTAGEN_EXCHANGES", "40"))
DRIVES = int(os.environ.get("NTAGEN_EXCHANGES", "4"))
SEED = int(os.environ.get("NTAGEN_SEED", "0"))

SETTINGS = {
    **dict.fromkeys((110, 111, 112, 113), 6000.0),
    **dict.fromkeys((120, 121, 122, 123), 200.0),
}
STILL = 1e-9
QUICK = Policy(stale_s=0.1, first_delay_s=0.001)


def check_message(error: DeviceError) -> None:
    """An error says something, in words of ours."""
    text = str(error)
    assert text
    assert not re.search(r"Traceback|Error\(|object at 0x", text), text


def check_stands(emulator: Emulator, seed: int) -> None:
    """Nothing moves any more, also if somebody presses the resume button."""
    before = emulator.position
    for button in (b"", b"~"):
        emulator.feed(button)
        emulator.advance(emulator.now_s + 20.0)
    assert emulator.position == pytest.approx(before, abs=STILL), seed


def exchange_with_controller(seed: int) -> bool:
    """Looks at a controller and moves it; returns whether all was well."""
    draw = random.Random(f"controller {seed}")
    dialect = draw.choice([GRBL_11H, GRBLHAL])
    changes = {number: value for number, value in SETTINGS.items() if number in dialect.settings}
    emulator = Emulator(dialect, memory=Memory(dialect, changes))
    emulator.power_on()
    port = DamagedPort(emulator, draw)
    axes = Axes(Axis("X"), Axis("A" if dialect is GRBLHAL else "Y", sign=-1))
    try:
        inspect(port, draw.choice([None, axes]))
        actuator = GrblActuator(port, axes)
        for _ in range(draw.randint(1, 4)):
            action = draw.choice([actuator.push, actuator.pull, actuator.roll])
            action(draw.choice([0.001, 0.3, 2.0, 7.0]))
            if draw.random() < 0.3:
                actuator.stop()
    except DeviceError as error:
        check_message(error)
        check_stands(emulator, seed)
        return False
    check_stands(emulator, seed)
    return True


def test_damaged_exchanges_with_a_controller_end_clearly() -> None:
    well = sum(exchange_with_controller(SEED + number) for number in range(EXCHANGES))
    assert 0 < well < EXCHANGES


class Still:
    """A needle that is measured."""

    measures_force = True

    def __init__(self) -> None:
        self.time_s = 0.0

    def measure(self) -> Measurement:
        self.time_s += 0.1
        return Measurement(self.time_s, (0.0, self.time_s, 1.0), 0.1, (0.0, 1.0, 0.0), None)


def exchange_with_tracker(seed: int) -> bool:
    """Measures through a damaged connection, and looks at it; returns whether all was well."""
    draw = random.Random(f"tracker {seed}")
    wire = Wire(changed_messages, draw, draw.choice([0, 1, 4]))
    with SimulatedTracker(Still(), lambda: 0.0, policy=QUICK) as tracker:
        send = tracker.server.send_bytes
        tracker.server.send_bytes = lambda data: send(wire.carry(data))  # type: ignore[method-assign]
        try:
            for _ in range(draw.randint(1, 8)):
                found = tracker.measure()
                assert all(map(math.isfinite, found.position_mm)), seed
                if draw.random() < 0.1:
                    drop_clients(tracker.server)
        except DeviceError as error:
            check_message(error)
            return False
    return True


def test_damaged_exchanges_with_a_tracker_end_clearly() -> None:
    well = sum(exchange_with_tracker(SEED + number) for number in range(EXCHANGES))
    assert 0 < well < EXCHANGES


def look_at_tracker(seed: int) -> None:
    """What `ntagen device check` does, while damaged messages come."""
    draw = random.Random(f"look {seed}")
    wire = Wire(changed_messages, draw, 0)
    needle = Still()
    with SimulatedTracker(needle, lambda: 0.0, policy=QUICK) as tracker:
        device = draw.choice([None, NEEDLE])
        source = Source("127.0.0.1", tracker.server.port, device, force=FORCE, policy=QUICK)
        count = 1 + len(tracker.server._clients)

        def send() -> None:
            tracker.server.wait_for_clients(count, 1.0)
            for _ in range(6):
                data = b"".join(one.to_bytes() for one in packets_of(needle.measure()))
                tracker.server.send_bytes(wire.carry(data))

        sender = threading.Thread(target=send)
        sender.start()
        try:
            found = look(source, 0.05)
            places = [one.position_mm for one in found.devices if one.position_mm is not None]
            assert all(math.isfinite(number) for place in places for number in place), seed
        except DeviceError as error:
            check_message(error)
        finally:
            sender.join()


def test_damaged_messages_are_looked_at() -> None:
    for number in range(EXCHANGES):
        look_at_tracker(SEED + number)


# While it drives.


def _damage_line(rig: Rig, draw: random.Random) -> None:
    wire = Wire(changed_replies, draw, 0)
    read = rig.device.port.read
    rig.device.port.read = lambda timeout_s: wire.carry(read(timeout_s))  # type: ignore[method-assign]


@pytest.mark.slow
def test_a_drive_ends_clearly_when_the_line_is_damaged() -> None:
    fault = Fault("damaged line", _damage_line)
    for number in range(DRIVES):
        needle = ("virtual", "phantom")[number % 2]
        assert not (finding := run(fault, needle, SEED + number)).wrong, (number, finding)


@pytest.mark.slow
def test_a_drive_ends_clearly_when_the_tracker_is_damaged() -> None:
    for number in range(DRIVES):
        trackers: list[SimulatedTracker] = []

        def strike(
            rig: Rig, draw: random.Random, trackers: list[SimulatedTracker] = trackers
        ) -> None:
            rig.distort = _through(rig, draw, trackers)

        needle = ("virtual", "phantom")[number % 2]
        try:
            finding = run(Fault("damaged tracker", strike), needle, SEED + number)
        finally:
            for tracker in trackers:
                tracker.__exit__()
        assert not finding.wrong, (number, finding)


def _through(rig: Rig, draw: random.Random, trackers: list[SimulatedTracker]) -> Reading:
    """A reading that goes through a damaged connection."""
    wire = Wire(changed_messages, draw, 0)

    class Given:
        measures_force = True
        reading: Measurement

        def measure(self) -> Measurement:
            return self.reading

    given = Given()
    tracker = SimulatedTracker(given, rig.device.now_s, policy=QUICK)
    trackers.append(tracker)
    send = tracker.server.send_bytes
    tracker.server.send_bytes = lambda data: send(wire.carry(data))  # type: ignore[method-assign]

    def read(reading: Measurement) -> Measurement:
        given.reading = reading
        return tracker.measure()

    return read
