"""Exchanges with a controller and with a tracker whose bytes are changed on the way.

What the emulated firmwares say is what real ones said (`tests/unit/grbl/test_transcripts.py`). It
is cut, doubled, mixed with other recorded lines, or damaged, once or again and again, from a random
moment on.
"""

from __future__ import annotations

import json
import math
import random
import re
import struct
from collections.abc import Callable
from pathlib import Path

from ntagen.grbl.emulator import Emulator, SimulatedPort
from ntagen.openigtlink.messages import Freedom, Status, Text, Tool, TrackingData
from ntagen.openigtlink.packets import HEADER, Packet, crc64

DATA = Path(__file__).parents[1] / "data" / "grbl"
RECORDED = sorted(
    {
        item["rx"]
        for path in DATA.glob("*.jsonl")
        for item in map(json.loads, path.read_text().splitlines())
        if item.get("rx")
    }
)
REALTIME = frozenset(b"!~?\x18\x84\x85")
NUMBERS = (b"0", b"-1", b"1e9", b"nan", b"", b"999999999999", b"0.000", b"1,2", b"-0.0", b".")

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


class Wire:
    """Changes bytes from a moment on.

    Args:
        change: How.
        draw: When: a piece is changed with a chance that is drawn too.
        first: The piece from which on pieces are changed.
    """

    def __init__(
        self, change: Callable[[bytes, random.Random], bytes], draw: random.Random, first: int
    ) -> None:
        self._change, self._draw = change, draw
        self._left = first
        self._chance = draw.choice([0.02, 0.2, 1.0])
        self._times = draw.choice([1, 1, 3, 1000000])

    def carry(self, data: bytes) -> bytes:
        """The bytes that arrive."""
        self._left -= 1
        if self._left >= 0 or not data or not self._times or self._draw.random() > self._chance:
            return data
        self._times -= 1
        return self._change(data, self._draw)


class DamagedPort(SimulatedPort):
    """A port whose bytes are changed on the way to the driver, and its lines on the way back.

    Bytes that act at once arrive as they are: no driver can do without a way to stop.
    """

    def __init__(self, emulator: Emulator, draw: random.Random) -> None:
        super().__init__(emulator)
        self._from = Wire(changed_replies, draw, draw.choice([0, 3, 30, 300]))
        self._to = Wire(changed_bytes, draw, draw.choice([3, 30, 1000000, 1000000]))

    def read(self, timeout_s: float) -> bytes:
        """What arrives of what the controller sends."""
        return self._from.carry(super().read(timeout_s))

    def write(self, data: bytes) -> None:
        """Sends bytes."""
        super().write(data if REALTIME.issuperset(data) else self._to.carry(data))


def changed_bytes(data: bytes, draw: random.Random) -> bytes:
    """Bytes as a bad wire changes them."""
    start = draw.randrange(len(data))
    end = min(len(data), start + draw.choice([1, 1, 2, 5, 20]))
    match draw.randrange(6):
        case 0:
            return data[:start] + data[end:]
        case 1:
            return data[:end] + data[start:]
        case 2:
            return data[:start] + draw.randbytes(draw.choice([1, 3, 40, 700])) + data[start:]
        case 3:
            return data[:start] + bytes([data[start] ^ 1 << draw.randrange(8)]) + data[start + 1 :]
        case 4:
            return data[:start] + bytes([draw.choice(b"<>|,:.-\r\n\0 09[]")]) + data[end:]
        case _:
            return b""


def changed_replies(data: bytes, draw: random.Random) -> bytes:
    """What a controller says, changed as a bad wire or another firmware would."""
    if draw.random() < 0.4:
        return changed_bytes(data, draw)
    lines = data.split(b"\n")
    place = draw.randrange(len(lines))
    recorded = draw.choice(RECORDED).encode()
    match draw.randrange(7):
        case 0:
            lines.insert(place, recorded)
        case 1:
            lines[place] = recorded
        case 2:
            lines.insert(place, lines[place])
        case 3:
            del lines[place]
        case 4:
            lines[place] = re.sub(
                rb"-?[0-9]+(\.[0-9]+)?",
                lambda found: draw.choice(NUMBERS) if draw.random() < 0.3 else found[0],
                lines[place],
            )
        case 5:
            lines[place] = re.sub(rb"[-0-9.]+,", b"", lines[place], count=draw.randint(1, 3))
        case _:
            words = (b"Idle", b"Run", b"Jog", b"Hold:0", b"Hold:1", b"Alarm", b"Door:2", b"Check")
            lines[place] = re.sub(rb"<[A-Za-z]+(:[0-9])?", b"<" + draw.choice(words), lines[place])
    return b"\n".join(lines)


def changed_messages(data: bytes, draw: random.Random) -> bytes:
    """What a tracker sends, changed as a bad wire or another sender would."""
    if draw.random() < 0.3:
        return changed_bytes(data, draw)
    changed, start = b"", 0
    while start + HEADER.size <= len(data):
        fields = list(HEADER.unpack_from(data, start))
        end = start + HEADER.size + fields[4]
        body = data[start + HEADER.size : end]
        if draw.random() < 0.7:
            fields, body = _another(fields, body, draw)
        changed += HEADER.pack(*fields) + body
        if draw.random() < 0.2:
            changed += _other_message(draw)
        start = end
    return changed + data[start:]


def _another(
    fields: list[int | bytes], body: bytes, draw: random.Random
) -> tuple[list[int | bytes], bytes]:
    """A message with another body or header; its checksum is right, but in one of eight."""
    match draw.randrange(9):
        case 0 | 1:
            place = 4 * draw.randrange(max(1, len(body) // 4))
            number = draw.choice([math.nan, math.inf, 0.0, 1e30, -1.0, 1e-30, 100.0])
            body = body[:place] + struct.pack(">f", number) + body[place + 4 :]
        case 2:
            body = changed_bytes(body, draw) if body else b"x"
        case 3:
            fields[0] = draw.choice([0, 1, 2, 3, 4, 256, 65535])
        case 4:
            kinds = (b"TRANSFORM", b"POSITION", b"TDATA", b"QTDATA", b"SENSOR", b"STATUS", b"IMAGE")
            fields[1] = draw.choice([*kinds, b"", b"\xff", b"RTS_TDATA", b"STRING"])
        case 5:
            fields[2] = draw.choice([b"", b"Other", b"\xff\xfe", b"ToTo", b"NeedleTip\0\xcc"])
        case 6:
            fields[3] = draw.choice([0, 1, 2**63, 2**64 - 1, draw.getrandbits(64)])
        case 7:
            status = draw.choice([b"INVALID", b"MISSING", b"OK", b"", b"\xff"])
            head = struct.pack(">HHHI", 1, 15, 3, len(status))
            more = b"TransformStatus" + status
            body = struct.pack(">HHII", 12, len(head), len(more), 1) + body + head + more
            fields[0] = 2
        case _:
            body = b""
    fields[4], fields[5] = len(body), crc64(body)
    match draw.randrange(16):
        case 0:
            fields[5] = draw.choice([0, 1])
        case 1:
            fields[4] = draw.choice([0, 1, 2**16, 2**40, 2**64 - 1, draw.randrange(100)])
        case _:
            pass
    return fields, body


def _other_message(draw: random.Random) -> bytes:
    match draw.randrange(4):
        case 0:
            return Packet("NeedleTip", Status(draw.randrange(30), message="odd")).to_bytes()
        case 1:
            kind = draw.choice([*Freedom, 0, 77])
            tools = tuple(Tool(name, kind, IDENTITY) for name in ("NeedleTip", "Other"))
            return Packet("Tracker", TrackingData(tools)).to_bytes()
        case 2:
            return Packet("NeedleTip", Text("hello")).to_bytes()
        case _:
            return HEADER.pack(1, b"IMAGE", b"I", 0, 5, 0) + b"abcde"
