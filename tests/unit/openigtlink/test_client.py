"""The client against our own server on this machine, also one that behaves badly."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from random import Random

import pytest

from ntagen.errors import DeviceError
from ntagen.openigtlink.client import Client
from ntagen.openigtlink.messages import (
    Freedom,
    Position,
    Sensor,
    StartTracking,
    Status,
    StopTracking,
    Text,
    Tool,
    TrackingData,
    TrackingReply,
    Transform,
)
from ntagen.openigtlink.packets import HEADER, Counts, Packet
from ntagen.openigtlink.samples import Policy, Statistics
from ntagen.openigtlink.server import Server
from tests.faults.connections import drop_clients

WAIT_S = 10.0
QUICK = Policy(stale_s=0.25, first_delay_s=0.01, longest_delay_s=0.05)
PATIENT = Policy(stale_s=WAIT_S, first_delay_s=0.01, longest_delay_s=0.05)


def at(x_mm: float) -> Transform:
    return Transform(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (x_mm, 0.0, 0.0)))


@pytest.fixture
def server() -> Iterator[Server]:
    with Server() as server:
        yield server


def connected(server: Server, policy: Policy = QUICK) -> Client:
    client = Client("127.0.0.1", server.port, policy)
    assert server.wait_for_clients(1, WAIT_S)
    return client


def test_the_newest_sample_of_each_device_is_kept(server: Server) -> None:
    with connected(server, PATIENT) as client:
        server.send(*(Packet(name, at(x)) for x in (1.0, 2.0, 3.0) for name in "AB"))
        server.send(Packet("C", Position((4.0, 0.0, 0.0)), stamp_s=5.0))
        assert client.pose("C").content == Position((4.0, 0.0, 0.0))
        assert client.pose("C").stamp_s == 5.0
        assert client.pose("A").content == client.pose("B").content == at(3.0)
        assert client.pose("A").stamp_s is None
        assert client.devices() == ("A", "B", "C")


def test_a_sample_after_a_moment_is_waited_for(server: Server) -> None:
    with connected(server, PATIENT) as client:
        server.send(Packet("A", at(1.0)))
        first = client.pose("A")
        timer = threading.Timer(0.05, lambda: server.send(Packet("A", at(2.0))))
        timer.start()
        second = client.pose("A", after_s=first.received_s)
        timer.join()
        assert (first.content, second.content) == (at(1.0), at(2.0))
        assert second.received_s > first.received_s


def test_tools_of_tracking_data_are_devices_and_are_asked_for(server: Server) -> None:
    policy = Policy(stale_s=WAIT_S, interval_ms=20, frame="Patient")
    with connected(server, policy) as client:
        request = server.wait_for(StartTracking, WAIT_S)
        assert request is not None
        assert request.content == StartTracking(20, "Patient")
        tool = Tool("Tip", Freedom.HEADING, at(7.0).columns)
        server.send(Packet("", TrackingReply(True)), Packet("T", TrackingData((tool,))))
        assert client.pose("Tip").content == tool
        client.close()
        assert server.wait_for(StopTracking, WAIT_S) is not None


def test_a_server_that_refuses_tracking_data_is_named(server: Server) -> None:
    policy = Policy(stale_s=0.2, interval_ms=20)
    with connected(server, policy) as client:
        server.send(Packet("", TrackingReply(False)))
        with pytest.raises(DeviceError, match="refuses to send TDATA"):
            client.pose("Tip")


def test_sensors_and_statuses_are_kept_apart(server: Server) -> None:
    with connected(server, PATIENT) as client:
        server.send(
            Packet("N", Status(18, message="no power")),
            Packet("N", Sensor((0.5,))),
            Packet("N", at(1)),
        )
        assert client.pose("N").content == at(1.0)
        assert client.sensor().content.values == (0.5,)
        status = client.status("N")
        assert status is not None
        assert str(status.content) == "hardware failure, no power"
        assert client.status("M") is None


# What goes wrong.


def test_a_stale_sample_is_refused_with_its_age_and_status(server: Server) -> None:
    with connected(server) as client:
        server.send(Packet("N", at(1.0)), Packet("N", Status(13)))
        sample = client.pose("N")
        time.sleep(2 * QUICK.stale_s)
        with pytest.raises(DeviceError, match=r"'N' is stale: .* device not ready") as caught:
            client.pose("N")
        assert "hint:" in str(caught.value)
        assert sample.content == at(1.0)


def test_a_server_that_repeats_its_last_sample_is_stale(server: Server) -> None:
    with connected(server) as client:
        stop = threading.Event()

        def send_always(*packets: Packet) -> None:
            while not stop.wait(0.01):
                server.send(*packets)

        hanging, plain = Packet("Hanging", at(1.0), stamp_s=5.0), Packet("Plain", at(1.0))
        # A clock that stands still is no sign of that, if the content changes.
        other = [Packet("Clock", at(x), stamp_s=5.0) for x in (1.0, 2.0)]
        sender = threading.Thread(target=send_always, args=(hanging, plain, *other))
        sender.start()
        try:
            first = client.pose("Hanging")
            with pytest.raises(DeviceError, match="'Hanging' is stale"):
                client.pose("Hanging", after_s=first.received_s)
            assert client.pose("Plain", after_s=client.now_s())
            assert client.pose("Clock", after_s=client.now_s())
            assert sum(client.statistics().repeats.values()) > 1
        finally:
            stop.set()
            sender.join()


def test_bytes_of_any_kind_never_hang_the_client(server: Server) -> None:
    random = Random(1)
    for _ in range(20):
        with connected(server, Policy(stale_s=0.01, first_delay_s=0.001)) as client:
            server.send_bytes(random.randbytes(random.randrange(1, 5000)))
            with pytest.raises(DeviceError):
                client.pose("N")


def test_another_name_is_refused_with_the_names_that_were_seen(server: Server) -> None:
    with connected(server) as client:
        server.send(Packet("Stylus", at(1.0)), Packet("Probe", at(2.0)))
        with pytest.raises(DeviceError, match="'Needle'; it sends 'Probe', 'Stylus'"):
            client.pose("Needle")
        with pytest.raises(DeviceError, match="several devices: 'Probe', 'Stylus'"):
            client.pose()


def test_another_frame_of_the_same_tool_is_named(server: Server) -> None:
    with connected(server) as client:
        server.send(Packet("NeedleTipToTracker", at(1.0)))
        with pytest.raises(DeviceError, match="frame 'Tracker', not in 'Reference'"):
            client.pose("NeedleTipToReference")


def test_a_server_that_says_nothing_is_named(server: Server) -> None:
    with (
        connected(server) as client,
        pytest.raises(DeviceError, match="accepts connections, but has sent nothing of use"),
    ):
        client.pose("N")


def test_a_server_that_sends_only_texts_is_named(server: Server) -> None:
    with connected(server) as client:
        server.send(Packet("N", Text("hello")))
        with pytest.raises(DeviceError, match="does not send the position of 'N', and no other"):
            client.pose("N")


def test_no_server_is_an_error_at_once() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(DeviceError, match=f"127.0.0.1:{port}: connection refused"):
        Client("127.0.0.1", port)


def test_a_server_that_does_not_answer_is_an_error() -> None:
    # A full queue of connections: nobody accepts them.
    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen(0)
        place = deaf.getsockname()
        fillers = [socket.socket() for _ in range(8)]
        for filler in fillers:
            filler.setblocking(False)
            filler.connect_ex(place)
        try:
            with pytest.raises(DeviceError, match="no answer"):
                Client(*place, Policy(connect_s=0.2))
        finally:
            for filler in fillers:
                filler.close()


def test_a_server_that_vanishes_is_noticed_and_found_again(server: Server) -> None:
    with connected(server, PATIENT) as client:
        server.send(Packet("N", at(1.0)))
        assert client.pose("N").content == at(1.0)
        drop_clients(server)
        assert wait_until(lambda: client.statistics().connections == 2)
        # The sample of the lost connection is not used again.
        assert client.devices() == ()
        assert server.wait_for_clients(1, WAIT_S)
        server.send(Packet("N", at(2.0)))
        assert client.pose("N").content == at(2.0)


def test_without_reconnecting_the_loss_is_told_at_once(server: Server) -> None:
    policy = Policy(stale_s=WAIT_S, reconnects=False)
    with connected(server, policy) as client:
        server.send(Packet("N", at(1.0)))
        last = client.pose("N")
        drop_clients(server)
        with pytest.raises(DeviceError, match="has closed the connection"):
            client.pose("N", after_s=last.received_s)


def test_a_server_of_another_protocol_is_named(server: Server) -> None:
    with connected(server, Policy(stale_s=WAIT_S, reconnects=False)) as client:
        server.send_bytes(b"<html>" * 20)
        with pytest.raises(DeviceError, match="this is not OpenIGTLink"):
            client.pose("N")


def test_skipped_messages_gaps_and_rates_are_counted(server: Server) -> None:
    with connected(server, Policy(stale_s=0.2)) as client:
        broken = bytearray(Packet("N", at(1.0)).to_bytes())
        broken[-1] ^= 1
        server.send_bytes(bytes(broken) + HEADER.pack(1, b"IMAGE", b"I", 0, 3, 0) + b"abc")
        for x in range(5):
            server.send(Packet("N", at(x)))
            time.sleep(0.02)
        assert wait_until(lambda: client.statistics().counts.read == 5)
        statistics = client.statistics()
        assert statistics.counts == Counts(read=5, wrong_crc=1, unknown=1)
        assert statistics.counts.skipped == 2
        assert statistics.rates_hz["N"] > 1.0
        time.sleep(0.3)
        server.send(Packet("N", at(9.0)))
        assert wait_until(lambda: client.statistics().gaps >= 1)


def test_a_server_that_invents_names_does_not_fill_the_memory(server: Server) -> None:
    with connected(server, PATIENT) as client:
        for block in range(15):
            server.send(*(Packet(f"{block}-{n}", at(n)) for n in range(100)))
        server.send(Packet("", Status(1)))
        assert wait_until(lambda: client.status("") is not None)
        statistics: Statistics = client.statistics()
        assert statistics.counts.read == 1501
        assert len(client.devices()) == len(statistics.rates_hz) == 1000


def test_it_can_be_closed_twice_and_then_gives_nothing(server: Server) -> None:
    client = connected(server)
    client.close()
    client.close()
    with pytest.raises(DeviceError):
        client.pose("N")


def wait_until(holds: object) -> bool:
    """Waits until a condition holds; returns whether it does."""
    assert callable(holds)
    end_s = time.monotonic() + WAIT_S
    while not holds():
        if time.monotonic() > end_s:
            return False
        time.sleep(0.005)
    return True
