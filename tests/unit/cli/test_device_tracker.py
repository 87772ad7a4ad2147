"""`ntagen device check` with a tracker: what it prints, and when it says that it is not ready."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import re
import socket
import struct
import threading
from collections.abc import Callable, Iterator

import pytest

from ntagen.cli import main
from ntagen.openigtlink.messages import (
    NEWTON,
    Columns,
    Freedom,
    Position,
    Sensor,
    Status,
    Tool,
    TrackingData,
    Transform,
)
from ntagen.openigtlink.packets import HEADER, Packet, crc64
from ntagen.openigtlink.server import Server

PLAIN: Columns = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 2.0, 3.0))
MIRRORED: Columns = ((-1.0, 0.0, 0.0), *PLAIN[1:])


@pytest.fixture
def server() -> Iterator[Server]:
    """A server that sends the same again and again; one device has a clock."""
    tools = (Tool("Tip", Freedom.HEADING, PLAIN),)
    messages = (
        Packet("Mirror", Transform(MIRRORED)),
        Packet("Point", Position((4.0, 5.0, 6.0))),
        Packet("Tracker", TrackingData(tools)),
        Packet("Force", Sensor((250.0,), 0xB << 60 | NEWTON)),
        Packet("Tracker", Status(13)),
    )
    stop, clock = threading.Event(), itertools.count(5.0)
    with Server() as server:

        def send_always() -> None:
            while not stop.wait(0.01):
                server.send(Packet("Needle", Transform(PLAIN), stamp_s=next(clock)), *messages)
                server.send_bytes(HEADER.pack(1, b"IMAGE", b"I", 0, 3, 0) + b"abc")

        sender = threading.Thread(target=send_always)
        sender.start()
        yield server
        stop.set()
        sender.join()


def check(server: Server, *options: str, words: str = "") -> int:
    device = f"openigtlink:127.0.0.1:{server.port}{words}"
    return main(["device", "check", device, "--listen", "0.3", *options])


def test_all_devices_are_told(server: Server, capsys: pytest.CaptureFixture[str]) -> None:
    assert check(server, words=":Needle") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].endswith(":Needle: 4 device(s) in 0.3 s")
    assert [line.partition(",")[0] for line in lines[1:5]] == [
        "  Mirror: TRANSFORM",
        "  Needle: TRANSFORM",
        "  Point: POSITION",
        "  Tip: TDATA",
    ]
    assert "without time stamps; at (4.00, 5.00, 6.00) mm" in lines[3]
    assert "without time stamps" not in lines[2]
    assert "without the roll" in lines[4]
    assert lines[5:7] == ["  sensor Force: 0.25 N", "  status of Tracker: device not ready"]
    assert lines[7].startswith("  skipped: ")


def test_json_is_one_object(server: Server, capsys: pytest.CaptureFixture[str]) -> None:
    assert check(server, "--json", words=":Tip") == 0
    document = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in document["devices"]] == ["Mirror", "Needle", "Point", "Tip"]
    assert document["devices"][3]["rate_hz"] > 1.0
    assert document["counts"]["unknown"] > 0


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (":Mirror", "'Mirror' is not a rotation: it mirrors"),
        (":Tip,bevel=+x", "five degrees of freedom of 'Tip'"),
        (":Point,tip=0/0/1", "no orientation of 'Point'"),
        (":Other", "it sends 'Mirror', 'Needle', 'Point', 'Tip'"),
    ],
)
def test_a_device_that_cannot_steer_is_not_ready(
    server: Server, capsys: pytest.CaptureFixture[str], words: str, match: str
) -> None:
    assert check(server, words=words) == 5
    assert match in capsys.readouterr().err


def test_servers_that_say_nothing_or_are_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    with Server() as silent:
        assert check(silent) == 5
        assert "has sent nothing of use" in capsys.readouterr().err
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    assert main(["device", "check", f"openigtlink:127.0.0.1:{port}"]) == 5
    assert "connection refused" in capsys.readouterr().err
    assert main(["device", "check", "openigtlink:nowhere"]) == 2
    assert "host and port are missing" in capsys.readouterr().err


def test_options_of_steppers_are_named_as_idle(
    server: Server, capsys: pytest.CaptureFixture[str]
) -> None:
    assert check(server, "--move", "2", words=":Needle") == 0
    assert "--move has no effect with a tracker" in capsys.readouterr().err


# Servers that send other things.


@contextlib.contextmanager
def sending(data: Callable[[int], bytes]) -> Iterator[Server]:
    """A server that sends these bytes to each client, again and again."""
    stop = threading.Event()
    with Server() as server:

        def send_always() -> None:
            for number in itertools.count():
                if stop.wait(0.01):
                    return
                server.send_bytes(data(number))

        sender = threading.Thread(target=send_always)
        sender.start()
        try:
            yield server
        finally:
            stop.set()
            sender.join()


def moving(number: int, status: str | None = None, version: int = 2) -> Packet:
    columns: Columns = (*PLAIN[:3], (0.1 * number, 2.0, 3.0))
    metadata = {} if status is None else {"TransformStatus": status}
    return Packet("Needle", Transform(columns), 5.0 + number, version, metadata)


def later_version(number: int) -> bytes:
    data = bytearray(moving(number).to_bytes())
    data[1] = 4
    return bytes(data)


def without_checksum(number: int) -> bytes:
    data = bytearray(moving(number).to_bytes())
    data[50:58] = bytes(8)
    return bytes(data)


def of_unknown_type(number: int) -> bytes:
    tools = (Tool("Odd", 0, PLAIN), Tool("Even", Freedom.POSE, PLAIN))
    return Packet("Tracker", TrackingData(tools), 5.0 + number).to_bytes()


def with_quaternions(number: int) -> bytes:
    body = struct.pack(">20sBx7f", b"Tip", 2, 0.1 * number, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)
    return HEADER.pack(1, b"QTDATA", b"Tracker", 0, len(body), crc64(body)) + body


@pytest.mark.parametrize(
    ("data", "words", "code", "says"),
    [
        (lambda n: moving(n, "INVALID").to_bytes(), "", 5, "its status is INVALID"),
        (lambda n: moving(n, "MISSING").to_bytes(), "", 5, "Needle: TRANSFORM, ? per s; not seen"),
        (lambda n: moving(n, "OK").to_bytes(), "", 0, ", 2.00, 3.00) mm"),
        (lambda _: moving(1).to_bytes(), "", 5, "the samples of 'Needle' never change"),
        (lambda _: moving(1).to_bytes(), ",sends=changes", 0, "the same sample"),
        (later_version, "", 5, "version 4 of the header of OpenIGTLink"),
        (lambda _: b"SSH-2.0-OpenSSH_9.6\r\n", "", 5, "this is not OpenIGTLink"),
        (without_checksum, "", 5, "add checksum=optional"),
        (without_checksum, ",checksum=optional", 0, ", 2.00, 3.00) mm"),
        (of_unknown_type, ":Even", 0, "Odd: TDATA, a tool of the unknown type 0"),
        (of_unknown_type, ":Odd", 5, "sends 'Odd' as a tool of the type 0"),
        (with_quaternions, "", 0, "Tip: QTDATA, a whole pose"),
    ],
)
def test_what_a_server_sends_is_told(
    capsys: pytest.CaptureFixture[str],
    data: Callable[[int], bytes],
    words: str,
    code: int,
    says: str,
) -> None:
    with sending(data) as server:
        assert check(server, words=words) == code
    out, err = capsys.readouterr()
    assert says in re.sub(r"[0-9.]+ per s", "? per s", out + err)
    assert err.count("hint:") == (code != 0)


def test_numbers_that_are_none_are_null_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    columns: Columns = (*PLAIN[:3], (math.nan, 0.0, 0.0))
    with sending(lambda _: Packet("N", Transform(columns)).to_bytes()) as server:
        assert check(server, "--json") == 5
    (device,) = json.loads(capsys.readouterr().out)["devices"]
    assert device["position_mm"] is None
