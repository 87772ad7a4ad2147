"""Messages with their headers, and the decoder of a stream of bytes.

A message is a header of 58 bytes and a body. From header version 2 on (protocol version 3), the
body has an extended header in front and metadata behind (openigtlink.org/protocols/v3_proposal):

    extended header | content | metadata header | metadata

A stream has no marks between messages, and the sizes in the headers alone say where the next one
begins. So the decoder treats mistakes in two ways. What is wrong inside a body (checksum, size or
type of the content) costs this message only; it is counted and skipped. After a header that cannot
be right, nobody knows where the next message begins: that is an error, and the connection is
useless.
"""

from __future__ import annotations

import dataclasses
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from ntagen.errors import DeviceError
from ntagen.openigtlink.messages import TYPES, Content, MalformedError, fixed, packed, until_zero

POLYNOMIAL: Final = 0x42F0E1EBA9EA3693
"""Of ECMA-182."""

_MASK: Final = 2**64 - 1


def _entry(index: int) -> int:
    """The checksum of one byte."""
    value = index << 56
    for _ in range(8):
        value = (value << 1) ^ (POLYNOMIAL if value >> 63 else 0)
        value &= _MASK
    return value


_TABLE: Final = tuple(_entry(index) for index in range(256))


def crc64(data: bytes, start: int = 0) -> int:
    """The checksum of bytes: CRC-64, as of the whole body of a message.

    The start value is 0, the most significant bit comes first, and there is no final inversion
    (openigtlink.org/protocols/v2_header.html).

    Args:
        data: The bytes.
        start: The checksum of the bytes before them.
    """
    value = start
    for byte in data:
        value = ((value << 8) & _MASK) ^ _TABLE[(value >> 56) ^ byte]
    return value


HEADER: Final = struct.Struct(">H12s20sQQQ")
"""Version, type, device, time stamp, size of the body, checksum of the body."""

LARGEST_BODY_BYTES: Final = 2**17
"""The largest body of a type that is understood; a text has at most half of it."""

LARGEST_SKIPPED_BYTES: Final = 2**32
"""The largest body of another type, such as an image; it is skipped without being stored."""

_VERSIONS: Final = range(1, 4)
_LATER: Final = 32
"""A version that may come; two letters of a text in another language make greater numbers."""

_EXTENDED: Final = struct.Struct(">HHII")
_COUNT: Final = struct.Struct(">H")
_ENTRY: Final = struct.Struct(">HHI")
_UTF_8: Final = 106
_FRACTIONS: Final = 2**32
_NAME_CHARACTERS: Final = frozenset(
    b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-. "
)


class ProtocolError(DeviceError):
    """The stream of bytes is not OpenIGTLink, or its next message cannot be found."""


@dataclass(frozen=True, slots=True)
class Packet:
    """A message with what its header says.

    Attributes:
        device: The name of the device, at most 20 bytes.
        content: The content.
        stamp_s: When the sender made the content, in seconds since 1970 (by its own clock); `None`
            if the header has no time stamp, which is 0 on the wire.
        version: The version of the header: 1, or 2 for an extended header and metadata.
        metadata: Texts by their keys; empty for header version 1.
        number: The sender's number of the message; 0 for header version 1.
    """

    device: str
    content: Content
    stamp_s: float | None = None
    version: int = 1
    metadata: Mapping[str, str] = field(default_factory=dict)
    number: int = 0

    def to_bytes(self) -> bytes:
        """The message on the wire.

        Raises:
            ValueError: A text is too long, or a number does not fit.
        """
        body = self.content.to_bytes()
        if self.version > 1:
            head, data = _metadata_bytes(self.metadata)
            extended = packed(_EXTENDED, _EXTENDED.size, len(head), len(data), self.number)
            body = extended + body + head + data
        elif self.metadata:
            raise ValueError("metadata need header version 2")
        device, kind = fixed(self.device, 20), fixed(self.content.TYPE, 12)
        stamp = _stamp_of(self.stamp_s)
        return packed(HEADER, self.version, kind, device, stamp, len(body), crc64(body)) + body


@dataclass(slots=True)
class Counts:
    """How many messages of each fate a stream had.

    Attributes:
        read: Messages that were understood.
        wrong_crc: Messages whose checksum was wrong.
        zero_crc: Those of them whose checksum was 0: some senders leave it out.
        malformed: Messages of a known type whose content was not of this type.
        unknown: Messages of types that are not understood.
    """

    read: int = 0
    wrong_crc: int = 0
    zero_crc: int = 0
    malformed: int = 0
    unknown: int = 0

    @property
    def skipped(self) -> int:
        """All messages that were not understood."""
        return self.wrong_crc + self.malformed + self.unknown

    def __str__(self) -> str:
        """What was skipped, in words."""
        zero = f" ({self.zero_crc} of them 0)" if self.zero_crc else ""
        return (
            f"{self.unknown} messages of other types, {self.wrong_crc} with a wrong checksum"
            f"{zero}, {self.malformed} that were malformed"
        )

    def __add__(self, other: Counts) -> Counts:
        names = [one.name for one in dataclasses.fields(Counts)]
        return Counts(*(getattr(self, name) + getattr(other, name) for name in names))


@dataclass(frozen=True, slots=True)
class _Header:
    version: int
    kind: str
    device: str
    stamp: int
    size: int
    crc: int


class Decoder:
    """Reads messages from pieces of a stream, however the stream is cut.

    It stores at most one message of at most `LARGEST_BODY_BYTES`, and takes memory only for bytes
    that have come.

    Args:
        needs_checksum: Whether a checksum of 0 counts as a wrong one; if not, as none.

    Attributes:
        counts: What was read and skipped until now.
        error: Why the stream cannot be read further; `None` if it can.
    """

    def __init__(self, *, needs_checksum: bool = True) -> None:
        self._needs_checksum = needs_checksum
        self.counts = Counts()
        self.error: ProtocolError | None = None
        self._waiting = bytearray()
        self._header: _Header | None = None
        self._skip_bytes = 0

    def feed(self, data: bytes) -> list[Packet]:
        """Takes the next piece of the stream; returns the messages that are now complete.

        If messages were complete before a wrong header, they are returned. `error` is set then.

        Raises:
            ProtocolError: The stream cannot be read further. Every later call raises it too.
        """
        if self.error is not None:
            raise self.error
        self._waiting += data
        packets: list[Packet] = []
        try:
            while self._step(packets):
                pass
        except ProtocolError as error:
            self.error = error
            self._waiting.clear()
            if not packets:
                raise
        return packets

    def _step(self, packets: list[Packet]) -> bool:
        """Goes on by one header or body; returns whether there was enough for that."""
        if self._skip_bytes:
            count = min(self._skip_bytes, len(self._waiting))
            del self._waiting[:count]
            self._skip_bytes -= count
            return self._skip_bytes == 0 and bool(self._waiting)
        if self._header is None:
            return self._read_header()
        if len(self._waiting) < self._header.size:
            return False
        header, self._header = self._header, None
        body = bytes(self._waiting[: header.size])
        del self._waiting[: header.size]
        packet = self._packet(header, body)
        if packet is not None:
            packets.append(packet)
        return True

    def _read_header(self) -> bool:
        if len(self._waiting) >= _COUNT.size:
            # A peer that speaks another language may never send as much as a header.
            _require_version(bytes(self._waiting[: HEADER.size]))
        if len(self._waiting) < HEADER.size:
            return False
        header = _header(bytes(self._waiting[: HEADER.size]))
        del self._waiting[: HEADER.size]
        if header.kind in TYPES:
            self._header = header
        else:
            self.counts.unknown += 1
            self._skip_bytes = header.size
        return True

    def _packet(self, header: _Header, body: bytes) -> Packet | None:
        """The message, or nothing if it must be skipped."""
        is_told = header.crc != 0 or self._needs_checksum
        if is_told and crc64(body) != header.crc:
            self.counts.wrong_crc += 1
            self.counts.zero_crc += header.crc == 0
            return None
        try:
            number, metadata, data = _parts(body) if header.version > 1 else (0, {}, body)
            content = TYPES[header.kind].from_bytes(data)
        except MalformedError:
            self.counts.malformed += 1
            return None
        self.counts.read += 1
        stamp_s = header.stamp / _FRACTIONS if header.stamp else None
        return Packet(header.device, content, stamp_s, header.version, metadata, number)


def _header(data: bytes) -> _Header:
    """The fields of a header.

    Raises:
        ProtocolError: This cannot be a header.
    """
    version, name, device, stamp, size, crc = HEADER.unpack(data)
    kind = name.rstrip(b"\0")
    if not kind or not set(kind) <= _NAME_CHARACTERS:
        raise _other_language(data)
    text = kind.decode("ascii").rstrip()
    limit = LARGEST_BODY_BYTES if text in TYPES else LARGEST_SKIPPED_BYTES
    if size > limit:
        raise ProtocolError(
            f"the server announces a message {text} of {size:,} bytes, which cannot be right: "
            f"more than {limit:,}\nhint: check that the server speaks OpenIGTLink"
        )
    return _Header(version, text, until_zero(device), stamp, size, crc)


def _require_version(data: bytes) -> None:
    """Refuses the beginning of a header that is none, or of a later version.

    Raises:
        ProtocolError: It is so.
    """
    (version,) = _COUNT.unpack_from(data)
    if _VERSIONS.stop <= version < _LATER:
        raise ProtocolError(
            f"the server sends version {version} of the header of OpenIGTLink, and ntagen reads "
            f"the versions {_VERSIONS.start} to {_VERSIONS.stop - 1}\n"
            "hint: let the server use version 3 of the protocol or an earlier one"
        )
    if version not in _VERSIONS:
        raise _other_language(data)


def _other_language(data: bytes) -> ProtocolError:
    return ProtocolError(
        f"this is not OpenIGTLink: a message begins with the bytes {data[:14].hex(' ')}\n"
        "hint: check the port; OpenIGTLink servers often use 18944"
    )


def _parts(body: bytes) -> tuple[int, dict[str, str], bytes]:
    """Number, metadata and content of a body with an extended header.

    Raises:
        MalformedError: The sizes in it do not fit its length.
    """
    if len(body) < _EXTENDED.size:
        raise MalformedError("the extended header is cut off")
    extended_bytes, head_bytes, metadata_bytes, number = _EXTENDED.unpack_from(body)
    end = len(body) - head_bytes - metadata_bytes
    if not _EXTENDED.size <= extended_bytes <= end:
        raise MalformedError("the sizes in the extended header do not fit the body")
    metadata = _metadata(body[end : end + head_bytes], body[end + head_bytes :])
    return number, metadata, body[extended_bytes:end]


def _metadata(head: bytes, data: bytes) -> dict[str, str]:
    """The metadata.

    Raises:
        MalformedError: The sizes in it do not fit its length.
    """
    if not head:
        return {}
    if len(head) < _COUNT.size:
        raise MalformedError("the header of the metadata is cut off")
    (count,) = _COUNT.unpack_from(head)
    if len(head) != _COUNT.size + count * _ENTRY.size:
        raise MalformedError("the header of the metadata has another length than it says")
    texts, start = {}, 0
    for key_bytes, _, value_bytes in _ENTRY.iter_unpack(head[_COUNT.size :]):
        middle, end = start + key_bytes, start + key_bytes + value_bytes
        if end > len(data):
            raise MalformedError("the metadata are cut off")
        key = data[start:middle].decode(errors="replace")
        texts[key] = data[middle:end].decode(errors="replace")
        start = end
    return texts


def _metadata_bytes(metadata: Mapping[str, str]) -> tuple[bytes, bytes]:
    """The header of the metadata, and the metadata."""
    head = [packed(_COUNT, len(metadata))]
    data: list[bytes] = []
    for key, value in metadata.items():
        texts = key.encode(), value.encode()
        head.append(packed(_ENTRY, len(texts[0]), _UTF_8, len(texts[1])))
        data += texts
    return b"".join(head), b"".join(data)


def _stamp_of(stamp_s: float | None) -> int:
    """The time stamp on the wire: 32 bits of seconds, 32 bits of fractions.

    Raises:
        ValueError: The time is before 1970 or after 2106.
    """
    if stamp_s is None:
        return 0
    if not 0.0 <= stamp_s < _FRACTIONS or not math.isfinite(stamp_s):
        raise ValueError(f"{stamp_s} s does not fit into the time stamp of OpenIGTLink")
    return min(round(stamp_s * _FRACTIONS), 2**64 - 1)
