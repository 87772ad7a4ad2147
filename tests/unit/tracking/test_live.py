"""A tracker behind an OpenIGTLink server on this machine."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import pytest

from ntagen.errors import DeviceError, InputError
from ntagen.needle.measurement import Measurement
from ntagen.openigtlink.messages import (
    NEWTON,
    Content,
    Freedom,
    Position,
    Sensor,
    Tool,
    TrackingData,
    Transform,
)
from ntagen.openigtlink.packets import Packet
from ntagen.openigtlink.samples import Policy
from ntagen.openigtlink.server import Server
from ntagen.tracking import frames
from ntagen.tracking.frames import IDENTITY
from ntagen.tracking.live import LiveTracker, Source, require_frame
from ntagen.tracking.mount import Mount
from tests.faults.connections import drop_clients

WAIT_S = 10.0
PATIENT = Policy(stale_s=WAIT_S)
QUICK = Policy(stale_s=0.25)

# A quarter turn about z, and a shift.
TURN = frames.Transform(
    "Reference", "scene", ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (100.0, 0.0, 0.0)
)


def at(x_mm: float, y_mm: float = 0.0) -> Transform:
    return Transform(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (x_mm, y_mm, 0.0)))


@contextmanager
def tracker(
    server: Server,
    transform: frames.Transform = IDENTITY,
    **changes: Any,  # noqa: ANN401
) -> Iterator[LiveTracker]:
    source = replace(Source("127.0.0.1", server.port, policy=PATIENT), **changes)
    with LiveTracker(source, transform, lambda: 1000.0) as live:
        assert server.wait_for_clients(1, WAIT_S)
        yield live


def measured(server: Server, live: LiveTracker, *packets: Packet) -> Measurement:
    """What is measured when these messages come during the measurement."""
    asked_s = live.client.now_s()
    server.send(*packets)
    return live.measure_after(asked_s)


@pytest.fixture
def server() -> Iterator[Server]:
    with Server() as server:
        yield server


def test_a_measurement_is_in_the_frame_of_the_scene(server: Server) -> None:
    mount = Mount("-x", "+y", (0.0, 0.0, 5.0))
    with tracker(server, TURN, mount=mount) as live:
        found = measured(server, live, Packet("N", at(1.0, 2.0)))
        assert found.position_mm == pytest.approx((98.0, 1.0, 5.0))
        assert found.heading == pytest.approx((0.0, -1.0, 0.0))
        assert found.bevel == pytest.approx((-1.0, 0.0, 0.0))
        assert found.force_n == 0.0
        assert not live.measures_force
        # On the actuator's clock, a moment ago.
        assert 1000.0 - WAIT_S < found.time_s <= 1000.0


def test_a_measurement_is_newer_than_the_question(server: Server) -> None:
    with tracker(server) as live:
        measured(server, live, Packet("N", at(1.0)))
        timer = threading.Timer(0.05, lambda: server.send(Packet("N", at(2.0))))
        timer.start()
        assert live.measure().position_mm == (2.0, 0.0, 0.0)
        timer.join()


def test_a_sample_that_was_under_way_does_not_count(server: Server) -> None:
    with tracker(server, latency_s=0.1, policy=replace(PATIENT)) as live:
        timer = threading.Timer(0.2, lambda: server.send(Packet("N", at(2.0))))
        asked_s = live.client.now_s()
        server.send(Packet("N", at(1.0)))
        timer.start()
        found = live.measure_after(asked_s)
        timer.join()
        assert found.position_mm == (2.0, 0.0, 0.0)
        assert found.time_s <= 1000.0 - 0.1


def test_a_server_that_sends_changes_only_is_not_stale(server: Server) -> None:
    with tracker(server, repeats=False, policy=QUICK) as live:
        first = measured(server, live, Packet("N", at(1.0)))
        threading.Event().wait(2 * QUICK.stale_s)
        assert live.measure().position_mm == first.position_mm
        drop_clients(server)
        # The sample of a lost connection says nothing, but the loss takes a moment to arrive.
        assert any(fails(live) for _ in range(1000))


def test_the_newest_measurement_comes_at_once_or_not_at_all(server: Server) -> None:
    with tracker(server, policy=PATIENT) as live:
        # Waiting for it would take ten seconds.
        with pytest.raises(DeviceError, match="nothing of use"):
            live.newest()
        first = measured(server, live, Packet("N", at(1.0)))
        assert live.newest().position_mm == live.newest().position_mm == first.position_mm
        server.send(invisible(TransformStatus="MISSING"))
        server.send(Packet("Last", at(2.0)))
        live.client.pose("Last")
        with pytest.raises(DeviceError, match="several devices: 'Last', 'N'"):
            live.newest()


def test_a_tool_of_five_degrees_of_freedom(server: Server) -> None:
    with tracker(server, device="Tip", mount=Mount("-z")) as live:
        tools = (
            Tool("Tip", Freedom.HEADING, at(3.0).columns),
            Tool("Hub", Freedom.POSE, at(9.0).columns),
        )
        found = measured(server, live, Packet("T", TrackingData(tools)))
        assert (found.position_mm, found.heading, found.bevel) == (
            (3.0, 0.0, 0.0),
            (0.0, 0.0, -1.0),
            None,
        )


def fails(live: LiveTracker) -> bool:
    threading.Event().wait(0.005)
    try:
        live.measure()
    except DeviceError:
        return True
    return False


# Force.


def test_the_force_comes_from_a_sensor_message(server: Server) -> None:
    with tracker(server, force="Force", force_index=1) as live:
        assert live.measures_force
        milli = 0xB << 60 | NEWTON
        force = Packet("Force", Sensor((7.0, 250.0), milli))
        assert measured(server, live, force, Packet("N", at(1.0))).force_n == pytest.approx(0.25)


@pytest.mark.parametrize("unit", [None, "mN"])
def test_a_force_without_a_unit_needs_to_be_told(server: Server, unit: str | None) -> None:
    force = Packet("Force", Sensor((2.0,)))
    with tracker(server, force="Force", force_unit=unit) as live:
        if unit is None:
            with pytest.raises(DeviceError, match="does not say the unit"):
                measured(server, live, force, Packet("N", at(1.0)))
        else:
            reading = measured(server, live, force, Packet("N", at(1.0)))
            assert reading.force_n == pytest.approx(2e-3)


@pytest.mark.parametrize(
    ("sensor", "match"),
    [
        (Sensor((1.0,), 1 << 54 | 1 << 50), "sends no force"),
        (Sensor((), NEWTON), "sends 0 numbers, and number 1 should be the force"),
    ],
)
def test_what_is_no_force_is_refused(server: Server, sensor: Sensor, match: str) -> None:
    with tracker(server, force="Force") as live, pytest.raises(DeviceError, match=match):
        measured(server, live, Packet("Force", sensor), Packet("N", at(1.0)))


def test_a_force_sensor_that_is_silent_is_an_error(server: Server) -> None:
    with (
        tracker(server, force="Force", policy=QUICK) as live,
        pytest.raises(DeviceError, match="does not send the sensor reading of 'Force'"),
    ):
        measured(server, live, Packet("N", at(1.0)))


# What goes wrong.


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (Transform((*at(0.0).columns[:3], (math.nan, 0.0, 0.0))), "not a number"),
        (Transform(((-1.0, 0.0, 0.0), *at(0.0).columns[1:])), "it mirrors"),
        (Transform(((2.0, 0.0, 0.0), *at(0.0).columns[1:])), "lengths 2, 1, 1"),
        (Position((math.inf, 0.0, 0.0)), "not a number"),
    ],
)
def test_impossible_samples_are_refused(server: Server, content: Content, match: str) -> None:
    with tracker(server) as live, pytest.raises(DeviceError, match=match):
        measured(server, live, Packet("N", content))


def invisible(**metadata: str) -> Packet:
    return Packet("N", at(1.0), None, 2, metadata)


def test_a_tool_that_is_hidden_for_a_moment_is_waited_for(server: Server) -> None:
    hidden = invisible(TransformValid="False", TransformStatus="OUT_OF_VIEW")
    with tracker(server) as live:
        timer = threading.Timer(0.05, lambda: server.send(Packet("N", at(2.0))))
        asked_s = live.client.now_s()
        server.send(hidden)
        timer.start()
        assert live.measure_after(asked_s).position_mm == (2.0, 0.0, 0.0)
        timer.join()


@pytest.mark.parametrize(
    ("packet", "match"),
    [
        (invisible(TransformStatus="OUT_OF_VIEW"), "does not see 'N': its status is OUT_OF_VIEW"),
        (invisible(TransformValid="False"), "its status is not valid"),
    ],
)
def test_a_tool_that_is_hidden_is_named(server: Server, packet: Packet, match: str) -> None:
    with tracker(server, policy=QUICK) as live:
        asked_s = live.client.now_s()
        stop = threading.Event()

        def send_always() -> None:
            while not stop.wait(0.01):
                server.send(packet)

        sender = threading.Thread(target=send_always)
        sender.start()
        try:
            with pytest.raises(DeviceError, match=match):
                live.measure_after(asked_s)
            with pytest.raises(DeviceError, match=match):
                live.newest()
        finally:
            stop.set()
            sender.join()


# Frames.


def test_a_registration_from_another_frame_is_refused() -> None:
    source = Source("localhost", 1, "NeedleTipToTracker")
    with pytest.raises(InputError, match="frame Tracker, but the registration is from Reference"):
        require_frame(source, TURN)
    require_frame(replace(source, device="NeedleTipToReference"), TURN)
    require_frame(replace(source, device="NeedleTip"), TURN)
    require_frame(source, replace(TURN, source="tracker"))
    require_frame(source, replace(TURN, source="RAS"))
    require_frame(source, IDENTITY)


def test_a_registration_from_lps_is_refused() -> None:
    with pytest.raises(InputError, match="--from RAS"):
        require_frame(Source("localhost", 1), replace(TURN, source="LPS"))


def stamped(stamp_s: float) -> Packet:
    return Packet("N", at(1.0), stamp_s=stamp_s)


def test_samples_that_come_later_and_later_by_their_stamps_are_refused(server: Server) -> None:
    """The clock of the sender is another one: it may be years off, and be set forward."""
    with tracker(server) as live:
        began_s = live.client.now_s()

        def measured_at(ahead_s: float) -> Measurement:
            passed_s = live.client.now_s() - began_s
            return measured(server, live, stamped(5e6 + passed_s + ahead_s))

        measured_at(0.0)
        measured_at(-0.9)
        measured_at(100.0)
        with pytest.raises(DeviceError, match=r"'N' came 1\.[5-9] s later than others") as caught:
            measured_at(98.4)
        assert "hint:" in str(caught.value)


def test_a_sample_without_a_stamp_is_not_late(server: Server) -> None:
    with tracker(server) as live:
        measured(server, live, stamped(5e6))
        measured(server, live, Packet("N", at(1.0)))
