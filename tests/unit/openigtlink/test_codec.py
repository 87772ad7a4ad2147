"""Messages of OpenIGTLink as bytes, and the decoder of a stream."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ntagen.openigtlink.messages import (
    NEWTON,
    Content,
    Freedom,
    Position,
    QuaternionTrackingData,
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
from ntagen.openigtlink.packets import (
    HEADER,
    LARGEST_BODY_BYTES,
    POLYNOMIAL,
    Counts,
    Decoder,
    Packet,
    ProtocolError,
    crc64,
)

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))

KINDS = [b"TRANSFORM", b"POSITION", b"TDATA", b"QTDATA", b"STATUS", b"SENSOR", b"STRING"]

singles = st.floats(width=32, allow_nan=False)
vectors = st.tuples(singles, singles, singles)
columns = st.tuples(vectors, vectors, vectors, vectors)


def texts(most_bytes: int) -> st.SearchStrategy[str]:
    """Texts for a field of fixed length."""
    letters = st.characters(exclude_characters="\0", exclude_categories=["Cs"])
    return st.text(letters, max_size=most_bytes).filter(lambda t: len(t.encode()) <= most_bytes)


tools = st.builds(Tool, texts(20), st.sampled_from(Freedom), columns)
CONTENTS: st.SearchStrategy[Content] = st.one_of(
    st.builds(Transform, columns),
    st.builds(Position, vectors, st.none() | st.tuples(singles, singles, singles, singles)),
    st.builds(TrackingData, st.lists(tools, max_size=5).map(tuple)),
    st.builds(StartTracking, st.integers(-(2**31), 2**31 - 1), texts(32)),
    st.just(StopTracking()),
    st.builds(TrackingReply, st.booleans()),
    st.builds(
        Status,
        st.integers(0, 2**16 - 1),
        st.integers(-(2**63), 2**63 - 1),
        texts(20),
        texts(200),
    ),
    st.builds(
        Sensor,
        st.lists(st.floats(allow_nan=False), max_size=255).map(tuple),
        st.integers(0, 2**64 - 1),
    ),
    st.builds(Text, texts(300)),
)
stamps = st.none() | st.integers(1, 2**52 - 1).map(lambda n: n / 2**20)


@st.composite
def packets(draw: st.DrawFn) -> Packet:
    version = draw(st.sampled_from([1, 2]))
    metadata = draw(st.dictionaries(texts(20), texts(50), max_size=3)) if version > 1 else {}
    number = draw(st.integers(0, 2**32 - 1)) if version > 1 else 0
    return Packet(draw(texts(20)), draw(CONTENTS), draw(stamps), version, metadata, number)


def read(data: bytes, cuts: Sequence[int] = ()) -> tuple[list[Packet], Counts]:
    """What a decoder makes of a stream that is cut at these bytes."""
    decoder = Decoder()
    found: list[Packet] = []
    start = 0
    for end in [*sorted(cuts), len(data)]:
        found += decoder.feed(data[start:end])
        start = end
    return found, decoder.counts


def with_crc(kind: bytes, body: bytes, version: int = 1) -> bytes:
    return HEADER.pack(version, kind, b"D", 0, len(body), crc64(body)) + body


# The checksum.


def test_the_checksum_is_that_of_ecma_182() -> None:
    # The check value in the catalogue of checksums, reveng.sourceforge.io/crc-catalogue.
    assert crc64(b"123456789") == 0x6C40DF5F0B497347


@given(st.binary(max_size=300))
def test_the_checksum_is_the_remainder_of_a_division(data: bytes) -> None:
    # Polynomials over two numbers are whole numbers here: a bit is a coefficient.
    divisor = 1 << 64 | POLYNOMIAL
    rest = int.from_bytes(data) << 64
    while rest >> 64:
        rest ^= divisor << (rest.bit_length() - 65)
    assert crc64(data) == rest


@given(st.binary(max_size=50), st.binary(max_size=50))
def test_the_checksum_can_be_computed_in_parts(first: bytes, second: bytes) -> None:
    assert crc64(second, crc64(first)) == crc64(first + second)


# Bytes that are written out by hand.


def test_the_bytes_of_a_transform() -> None:
    content = Transform(((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (7.0, 8.0, 9.0), (10.0, 11.0, 12.0)))
    data = Packet("Needle", content, stamp_s=1.5).to_bytes()
    assert len(data) == 58 + 48
    assert data[:2] == b"\0\1"
    assert data[2:14] == b"TRANSFORM\0\0\0"
    assert data[14:34] == b"Needle" + bytes(14)
    assert data[34:42] == bytes([0, 0, 0, 1, 0x80, 0, 0, 0])
    assert data[42:50] == (48).to_bytes(8)
    assert struct.unpack(">12f", data[58:]) == tuple(range(1, 13))


def test_a_time_stamp_of_zero_is_none() -> None:
    (packet,), _ = read(HEADER.pack(1, b"STRING", b"D", 0, 4, crc64(b"\0\3\0\0")) + b"\0\3\0\0")
    assert packet.stamp_s is None
    assert Packet("D", Text("")).to_bytes()[34:42] == bytes(8)


def test_a_position_without_a_quaternion() -> None:
    (packet,), _ = read(with_crc(b"POSITION", struct.pack(">3f", 1.0, 2.0, 3.0)))
    assert packet.content == Position((1.0, 2.0, 3.0))


def test_a_quaternion_without_w_has_the_length_1() -> None:
    body = struct.pack(">6f", 1.0, 2.0, 3.0, 0.6, 0.0, 0.0)
    (packet,), _ = read(with_crc(b"POSITION", body))
    assert isinstance(packet.content, Position)
    assert packet.content.quaternion == pytest.approx((0.6, 0.0, 0.0, 0.8))


def test_units_of_force_become_newtons() -> None:
    assert Sensor((), NEWTON).newtons == 1.0
    assert Sensor((), 0xB << 60 | NEWTON).newtons == pytest.approx(1e-3)
    assert Sensor((), 0).newtons is None
    assert Sensor((), 0x01 << 54 | 1 << 50).newtons is None  # metres
    assert Sensor((), 0x8 << 60 | NEWTON).newtons is None  # a prefix that does not exist


# Properties of the stream.


@pytest.mark.slow
@given(st.lists(packets(), max_size=5), st.data())
def test_every_way_to_cut_a_stream_gives_the_same_messages(
    sent: list[Packet], data: st.DataObject
) -> None:
    stream = b"".join(packet.to_bytes() for packet in sent)
    cuts = data.draw(st.lists(st.integers(0, len(stream)), max_size=20))
    found, counts = read(stream, cuts)
    assert found == sent
    assert counts == Counts(read=len(sent))


def test_single_bytes_give_the_same_messages() -> None:
    sent = [Packet("A", Transform(IDENTITY), 1.0), Packet("B", Text("x"), None, 2, {"k": "v"}, 7)]
    stream = b"".join(packet.to_bytes() for packet in sent)
    assert read(stream, range(len(stream)))[0] == sent


@pytest.mark.slow
@given(packets(), packets(), st.data())
def test_a_message_with_a_wrong_checksum_is_skipped_whole(
    broken: Packet, good: Packet, data: st.DataObject
) -> None:
    stream = bytearray(broken.to_bytes())
    # The checksum itself, or any bit of the body.
    place = data.draw(st.integers(50, len(stream) - 1))
    stream[place] ^= 1 << data.draw(st.integers(0, 7))
    found, counts = read(bytes(stream) + good.to_bytes())
    assert found == [good]
    assert (counts.read, counts.wrong_crc, counts.skipped) == (1, 1, 1)


def test_a_checksum_of_zero_is_counted_and_may_stand_for_none() -> None:
    body = Transform(IDENTITY).to_bytes()
    without = HEADER.pack(1, b"TRANSFORM", b"D", 0, len(body), 0) + body
    wrong = HEADER.pack(1, b"TRANSFORM", b"D", 0, len(body), 1) + body
    assert read(without + wrong)[1] == Counts(wrong_crc=2, zero_crc=1)
    assert "2 with a wrong checksum (1 of them 0)" in str(Counts(wrong_crc=2, zero_crc=1))
    decoder = Decoder(needs_checksum=False)
    assert [one.content for one in decoder.feed(without + wrong)] == [Transform(IDENTITY)]
    assert decoder.counts == Counts(read=1, wrong_crc=1)


def test_a_tool_of_an_unknown_type_does_not_drop_the_others() -> None:
    tools = [
        struct.pack(">20sBx12f", name, kind, *range(12)) for name, kind in ((b"A", 0), (b"B", 2))
    ]
    (packet,), _ = read(with_crc(b"TDATA", b"".join(tools)))
    assert isinstance(packet.content, TrackingData)
    assert [(one.name, one.freedom) for one in packet.content.tools] == [
        ("A", 0),
        ("B", Freedom.POSE),
    ]
    assert isinstance(packet.content.tools[1].freedom, Freedom)


@given(st.tuples(*[st.floats(-1.0, 1.0, width=32)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
def test_quaternions_of_tools_turn_as_those_of_another_library(
    quaternion: tuple[float, float, float, float],
) -> None:
    length = math.hypot(*quaternion)
    numbers = [number / length for number in quaternion]
    body = struct.pack(">20sBx7f", b"Tip", 2, 1.0, 2.0, 3.0, *numbers)
    (packet,), _ = read(with_crc(b"QTDATA", body))
    assert isinstance(packet.content, QuaternionTrackingData)
    (tool,) = packet.content.tools
    matrix = Rotation.from_quat(numbers).as_matrix()
    assert tool.columns[3] == (1.0, 2.0, 3.0)
    assert (tool.name, tool.freedom, tool.message) == ("Tip", Freedom.POSE, "QTDATA")
    assert np.allclose(np.array(tool.columns[:3]).T, matrix, atol=1e-6)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"SSH-2.0-OpenSSH_9.6\r\n", "this is not OpenIGTLink"),
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "this is not OpenIGTLink"),
        (b"{", ""),
        (b"\x01\x00TRANSFORM", "this is not OpenIGTLink"),
        (b"\x00\x04TRANSFORM", "version 4 of the header"),
    ],
)
def test_another_language_is_told_from_its_first_bytes(data: bytes, says: str) -> None:
    decoder = Decoder()
    if not says:
        assert decoder.feed(data) == []
        return
    with pytest.raises(ProtocolError, match=says) as caught:
        decoder.feed(data)
    assert "hint:" in str(caught.value)


@given(st.binary(max_size=400), st.integers(0, 3))
def test_messages_of_unknown_types_are_skipped(body: bytes, cut: int) -> None:
    good = Packet("D", Text("after"))
    # Their checksums do not matter.
    stream = HEADER.pack(1, b"IMAGE", b"D", 0, len(body), 1) + body + good.to_bytes()
    found, counts = read(stream, [cut * len(stream) // 3])
    assert found == [good]
    assert counts == Counts(read=1, unknown=1)


@given(st.sampled_from(KINDS))
def test_a_content_of_a_wrong_size_is_skipped(kind: bytes) -> None:
    good = Packet("D", Text("after"))
    found, counts = read(with_crc(kind, b"\xff") + good.to_bytes())
    assert found == [good]
    assert counts == Counts(read=1, malformed=1)


@pytest.mark.parametrize(
    "body",
    [
        b"",
        struct.pack(">HHII", 12, 0, 2**32 - 1, 0),
        struct.pack(">HHII", 0, 0, 0, 0),
        struct.pack(">HHII", 13, 0, 0, 0),
        struct.pack(">HHII", 12, 1, 0, 0) + b"\0",
        struct.pack(">HHII", 12, 2, 0, 0) + b"\0\1",
        struct.pack(">HHIIHHHI", 12, 10, 0, 0, 1, 1, 106, 1),
    ],
)
def test_an_extended_header_that_does_not_fit_is_skipped(body: bytes) -> None:
    good = Packet("D", Text("after"))
    found, counts = read(with_crc(b"STRING", body, version=2) + good.to_bytes())
    assert found == [good]
    assert counts == Counts(read=1, malformed=1)


def test_an_extended_header_may_be_longer() -> None:
    text = Text("x").to_bytes()
    body = struct.pack(">HHII", 16, 0, 0, 5) + b"more" + text
    (packet,), _ = read(with_crc(b"STRING", body, version=3))
    assert (packet.content, packet.number, packet.metadata) == (Text("x"), 5, {})


@given(st.binary(max_size=2000), st.lists(st.integers(0, 2000), max_size=5))
def test_random_bytes_never_crash(data: bytes, cuts: list[int]) -> None:
    try:
        read(data, cuts)
    except ProtocolError:
        return


@given(packets(), st.data())
def test_changed_messages_never_crash(packet: Packet, data: st.DataObject) -> None:
    stream = bytearray(packet.to_bytes() * 2)
    for _ in range(data.draw(st.integers(1, 4))):
        stream[data.draw(st.integers(0, len(stream) - 1))] = data.draw(st.integers(0, 255))
    try:
        found, _ = read(bytes(stream))
    except ProtocolError:
        return
    assert len(found) <= 2


@given(
    st.sampled_from(KINDS),
    st.sampled_from([1, 2]),
    st.binary(max_size=200),
)
def test_random_contents_with_right_checksums_never_crash(
    kind: bytes, version: int, body: bytes
) -> None:
    _, counts = read(with_crc(kind, body, version))
    assert counts.read + counts.malformed == 1


@pytest.mark.parametrize("size", [LARGEST_BODY_BYTES + 1, 2**40, 2**64 - 1])
def test_an_impossible_size_is_an_error_at_the_header(size: int) -> None:
    decoder = Decoder()
    with pytest.raises(ProtocolError, match="cannot be right"):
        decoder.feed(HEADER.pack(1, b"TRANSFORM", b"D", 0, size, 0))
    with pytest.raises(ProtocolError, match="cannot be right"):
        decoder.feed(b"")


def test_a_large_image_is_skipped_without_being_stored() -> None:
    decoder = Decoder()
    decoder.feed(HEADER.pack(1, b"IMAGE", b"D", 0, 50 * 10**6, 0))
    for _ in range(50):
        assert decoder.feed(bytes(10**6)) == []
        assert len(decoder._waiting) == 0
    assert decoder.feed(Packet("D", Text("after")).to_bytes()) == [Packet("D", Text("after"))]


def test_another_protocol_is_named_as_such() -> None:
    with pytest.raises(ProtocolError, match="not OpenIGTLink"):
        Decoder().feed(
            b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain; charset=utf-8\r\n\r\n"
        )


def test_messages_before_a_wrong_header_are_not_lost() -> None:
    decoder = Decoder()
    good = Packet("D", Text("before"))
    assert decoder.feed(good.to_bytes() + bytes(58)) == [good]
    assert decoder.error is not None
    with pytest.raises(ProtocolError):
        decoder.feed(good.to_bytes())


# What cannot be written.


@pytest.mark.parametrize(
    "packet",
    [
        Packet("a name of 21 letters.", Text("")),
        Packet("D", Text("x" * 70000)),
        Packet("D", Transform(((1e300, 0.0, 0.0), *IDENTITY[1:]))),
        Packet("D", Sensor((0.0,) * 256)),
        Packet("D", StartTracking(2**40)),
        Packet("D", Text(""), stamp_s=-1.0),
        Packet("D", Text(""), stamp_s=float("nan")),
        Packet("D", Text(""), metadata={"key": "needs version 2"}),
        Packet("D", Text(""), None, 2, {"k" * 70000: ""}),
    ],
)
def test_what_does_not_fit_is_refused(packet: Packet) -> None:
    with pytest.raises(ValueError, match=r"OpenIGTLink|version 2"):
        packet.to_bytes()
