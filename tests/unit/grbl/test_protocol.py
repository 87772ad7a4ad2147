"""What a controller says, as values; and that no bytes give any other error than the protocol's."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen.grbl.protocol import (
    Activity,
    Alarm,
    Banner,
    Feedback,
    Ok,
    ProtocolError,
    Refusal,
    Reply,
    Setting,
    Status,
    parse,
)

DATA = Path(__file__).parents[2] / "data" / "grbl"


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("ok", Ok()),
        ("error:9", Refusal(9)),
        ("ALARM:3", Alarm(3)),
        ("Grbl 1.1h ['$' for help]", Banner("Grbl", "1.1h")),
        ("GrblHAL 1.1f ['$' or '$HELP' for help]", Banner("GrblHAL", "1.1f")),
        ("$100=250.000", Setting(100, "250.000")),
        ("$0=10 (step pulse, usec)", Setting(0, "10")),
        ("[MSG:Caution: Unlocked]", Feedback("MSG", "Caution: Unlocked")),
        ("[NVS STORAGE:*EEPROM]", Feedback("NVS STORAGE", "*EEPROM")),
        ("[MSG:INFO: Connected to Büro\t😀]", Feedback("MSG", "INFO: Connected to Büro\t😀")),
        (
            "<Idle,MPos:1.000,0.000,2.000,WPos:0.000,0.000,0.000>",
            Status(Activity.IDLE, machine=(1.0, 0.0, 2.0), is_old=True),
        ),
        ("<Critical|MPos:0.000,0.000>", Status(Activity.CRITICAL, machine=(0.0, 0.0))),
        ("", None),
        (
            "<Hold:1|MPos:5.000,-0.250,0.000|Bf:15,128|FS:208,0|Pn:XZ|New:1,2|Ov:100,100,100>",
            Status(Activity.HOLD, 1, (5.0, -0.25, 0.0), feed=208.0, pins="XZ"),
        ),
        (
            "<Idle|WPos:1.000,2.000|F:0|WCO:0.500,0.000>",
            Status(Activity.IDLE, work=(1.0, 2.0), offset=(0.5, 0.0), feed=0.0),
        ),
    ],
)
def test_each_kind_of_line_is_read(line: str, expected: Reply | None) -> None:
    assert parse(line.encode()) == expected


@pytest.mark.parametrize(
    "line",
    [
        *(
            "okay",
            "error:",
            "error:x",
            "ALARM:-1",
            "<Idle>",
            "<Fly|MPos:0.000>",
            "<Idle|MPos:1,,2>",
        ),
        *("<Idle|MPos:nan,0.000>", "<Idle|MPos:1e9,0.000>", "<Idle|MPos:0.000", "$=1", "G1 X1"),
        *("\x00\x7fok", "\u00e9", "x" * 600, "[VER:\u00e9]", "<Idle,MPos:,WPos:>"),
    ],
)
def test_other_lines_are_refused(line: str) -> None:
    with pytest.raises(ProtocolError, match="no reply of GRBL"):
        parse(line.encode())


def test_a_message_in_another_encoding_is_noise() -> None:
    with pytest.raises(ProtocolError, match="no reply of GRBL"):
        parse("[MSG:Büro]".encode("latin-1"))


def test_all_recorded_lines_are_read() -> None:
    for path in sorted(DATA.glob("*.jsonl")):
        for text in path.read_text().splitlines():
            item = json.loads(text)
            if item.get("rx"):
                assert parse(item["rx"].encode("ascii")) is not None


def test_errors_and_alarms_have_names() -> None:
    assert str(Refusal(9)) == "error:9 (G-code is locked during an alarm or a jog)"
    assert str(Alarm(3)) == "ALARM:3 (a reset came in motion, so the position may be lost)"
    assert "error:999" in str(Refusal(999))


@pytest.mark.parametrize(
    ("state", "stands"),
    [
        *(("Idle", True), ("Hold:0", True), ("Hold:1", False), ("Door:0", True), ("Door:2", False)),
        *(("Run", False), ("Jog", False), ("Home", False), ("Alarm", True), ("Sleep", True)),
    ],
)
def test_a_status_says_whether_the_axes_stand(state: str, stands: bool) -> None:
    status = parse(f"<{state}|MPos:0.000,0.000,0.000|FS:0,0>".encode())
    assert isinstance(status, Status)
    assert status.stands is stands


PIECES = st.sampled_from(
    [
        *("<", ">", "|", "Idle", "Hold", ":", "MPos:", "WPos:", "FS:", "1.5", ",", "-", "9" * 400),
        *("[", "]", "$", "=", "error:", "ALARM:", "ok", "Grbl ", "1.1h", "(", ")", "\u0663", " "),
    ]
)


@given(st.one_of(st.binary(max_size=600), st.lists(PIECES).map(lambda p: "".join(p).encode())))
def test_no_bytes_give_another_error(line: bytes) -> None:
    try:
        reply = parse(line)
    except ProtocolError:
        return
    assert reply is None or isinstance(reply, Reply)
