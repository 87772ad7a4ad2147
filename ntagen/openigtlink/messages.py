"""The contents of OpenIGTLink messages, as values and as bytes.

Numbers are big-endian on the wire. Matrices have 32-bit floating-point numbers there, so that a
position of 100 mm is exact to 4 nm. A text of fixed length ends at its first zero byte. Sources:
openigtlink.org/protocols/v2_*.html and v3_*.html.

A new message type is a class with `TYPE`, `to_bytes` and `from_bytes`, and a line in `TYPES`.
"""

from __future__ import annotations

import enum
import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Protocol, Self

Vector = tuple[float, float, float]
"""Three numbers along the axes x, y, z."""

Columns = tuple[Vector, Vector, Vector, Vector]
"""The columns of a homogeneous matrix without its last row: three axes and the origin, in mm."""

NEWTON: Final = 0x0B << 54 | 1 << 50
"""The unit N, as the library of the protocol packs it (`igtl_unit.h`)."""

_PREFIX_EXPONENTS: Final = {
    **{0: 0, 1: 1, 2: 2, 3: 3, 4: 6, 5: 9, 6: 12, 7: 15},
    **{0x9: -1, 0xA: -2, 0xB: -3, 0xC: -6, 0xD: -9, 0xE: -12, 0xF: -15},
}
"""Powers of ten by the number of their prefix, the first four bits of a unit."""

_ASCII: Final = 3
_UTF_8: Final = 106
_MATRIX: Final = struct.Struct(">12f")
_TOOL: Final = struct.Struct(">20sBx12f")
_QUATERNION_TOOL: Final = struct.Struct(">20sBx7f")
_POINT: Final = struct.Struct(">64s32s4B4f20s")
_START: Final = struct.Struct(">i32s")
_STATUS: Final = struct.Struct(">Hq20s")
_SENSOR: Final = struct.Struct(">BBQ")
_TEXT: Final = struct.Struct(">HH")


class MalformedError(ValueError):
    """The bytes are not a message of the type that they claim to be."""


class Content(Protocol):
    """The content of a message."""

    TYPE: ClassVar[str]
    """The name of the type, at most 12 letters."""

    def to_bytes(self) -> bytes:
        """The content on the wire.

        Raises:
            ValueError: A text is too long, or a number does not fit.
        """

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """The content that these bytes are.

        Raises:
            MalformedError: They are not such a content.
        """


@dataclass(frozen=True, slots=True)
class Transform:
    """TRANSFORM: the pose of a device.

    Attributes:
        columns: The matrix from the device's frame to that of the tracker.
    """

    TYPE: ClassVar[str] = "TRANSFORM"

    columns: Columns

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        return packed(_MATRIX, *_flat(self.columns))

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        _require_size(cls.TYPE, data, _MATRIX.size)
        return cls(_columns(_MATRIX.unpack(data)))


@dataclass(frozen=True, slots=True)
class Position:
    """POSITION: a position and, perhaps, an orientation.

    Attributes:
        position_mm: The position.
        quaternion: The orientation as x, y, z, w. A message may leave it out, or only w, which then
            follows from length 1 and is not negative.
    """

    TYPE: ClassVar[str] = "POSITION"

    position_mm: Vector
    quaternion: tuple[float, float, float, float] | None = None

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        numbers = (*self.position_mm, *(self.quaternion or ()))
        return packed(struct.Struct(f">{len(numbers)}f"), *numbers)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        if len(data) not in (12, 24, 28):
            raise MalformedError(f"POSITION has {len(data)} bytes, not 12, 24 or 28")
        x, y, z, *turn = struct.unpack(f">{len(data) // 4}f", data)
        if not turn:
            return cls((x, y, z))
        if len(turn) == 3:
            rest = 1.0 - sum(number * number for number in turn)
            turn.append(math.sqrt(rest) if rest > 0.0 else 0.0)
        return cls((x, y, z), (turn[0], turn[1], turn[2], turn[3]))


class Freedom(enum.IntEnum):
    """What is known of a tool in TDATA."""

    TRACKER = 1
    POSE = 2
    POSITION = 3
    HEADING = 4
    """Five degrees of freedom: the position and the direction of the tool's own z axis."""


@dataclass(frozen=True, slots=True)
class Tool:
    """One tool of TDATA or QTDATA.

    Attributes:
        name: Its name.
        freedom: What is known of it; a number of another type says nothing that can be used.
        columns: Its matrix.
        message: The type of the message that it came in.
    """

    name: str
    freedom: Freedom | int
    columns: Columns
    message: str = "TDATA"


@dataclass(frozen=True, slots=True)
class TrackingData:
    """TDATA: the poses of all tools of a tracker."""

    TYPE: ClassVar[str] = "TDATA"

    tools: tuple[Tool, ...]

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        return b"".join(
            packed(_TOOL, fixed(tool.name, 20), tool.freedom, *_flat(tool.columns))
            for tool in self.tools
        )

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        return cls(
            tuple(
                Tool(until_zero(name), _freedom(kind), _columns(tuple(numbers)))
                for name, kind, *numbers in _tools(cls.TYPE, _TOOL, data)
            )
        )


@dataclass(frozen=True, slots=True)
class QuaternionTrackingData(TrackingData):
    """QTDATA: the same with positions and quaternions instead of matrices. It is only read."""

    TYPE: ClassVar[str] = "QTDATA"

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        raise ValueError("QTDATA is not sent: TDATA says the same")

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        found = []
        for name, kind, x_mm, y_mm, z_mm, *turn in _tools(cls.TYPE, _QUATERNION_TOOL, data):
            columns = turned((turn[0], turn[1], turn[2], turn[3]), (x_mm, y_mm, z_mm))
            found.append(Tool(until_zero(name), _freedom(kind), columns, cls.TYPE))
        return cls(tuple(found))


@dataclass(frozen=True, slots=True)
class Points:
    """POINT: a list of points in their order; here the places of a needle, the tip last.

    Their names, groups, colours, diameters and owners are not read.
    """

    TYPE: ClassVar[str] = "POINT"

    positions_mm: tuple[Vector, ...]

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        return b"".join(
            packed(_POINT, fixed(f"P{number}", 64), b"", *_WHITE, *position_mm, 0.0, b"")
            for number, position_mm in enumerate(self.positions_mm, start=1)
        )

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        if not data:
            raise MalformedError("POINT has no points")
        return cls(tuple((one[6], one[7], one[8]) for one in _tools(cls.TYPE, _POINT, data)))


_WHITE: Final = (255, 255, 255, 255)


def turned(quaternion: tuple[float, float, float, float], position_mm: Vector) -> Columns:
    """The matrix of a quaternion x, y, z, w; a length other than 1 scales it by its square."""
    x, y, z, w = quaternion
    return (
        (w * w + x * x - y * y - z * z, 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)),
        (2.0 * (x * y - z * w), w * w - x * x + y * y - z * z, 2.0 * (y * z + x * w)),
        (2.0 * (x * z + y * w), 2.0 * (y * z - x * w), w * w - x * x - y * y + z * z),
        position_mm,
    )


@dataclass(frozen=True, slots=True)
class StartTracking:
    """STT_TDATA: asks a server to send TDATA.

    Attributes:
        interval_ms: The least time between two messages; 0 for as fast as possible.
        frame: The frame in which the poses are wanted; empty for the server's own.
    """

    TYPE: ClassVar[str] = "STT_TDATA"

    interval_ms: int
    frame: str = ""

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        return packed(_START, self.interval_ms, fixed(self.frame, 32))

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        _require_size(cls.TYPE, data, _START.size)
        interval_ms, frame = _START.unpack(data)
        return cls(interval_ms, until_zero(frame))


@dataclass(frozen=True, slots=True)
class StopTracking:
    """STP_TDATA: asks a server to end TDATA. Many servers close the connection then."""

    TYPE: ClassVar[str] = "STP_TDATA"

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        return b""

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        _require_size(cls.TYPE, data, 0)
        return cls()


@dataclass(frozen=True, slots=True)
class TrackingReply:
    """RTS_TDATA: whether the server does what STT_TDATA or STP_TDATA asked for."""

    TYPE: ClassVar[str] = "RTS_TDATA"

    accepted: bool

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        return bytes([0 if self.accepted else 1])

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        _require_size(cls.TYPE, data, 1)
        return cls(data[0] == 0)


STATUS_NAMES: Final = (
    "invalid packet",
    "OK",
    "unknown error",
    "panic mode, emergency",
    "not found",
    "access denied",
    "busy",
    "time out",
    "overflow",
    "checksum error",
    "configuration error",
    "not enough resources",
    "unknown instruction",
    "device not ready",
    "manual mode",
    "device disabled",
    "device not present",
    "unknown device version",
    "hardware failure",
    "exiting",
)
"""What the code of a STATUS means, by its number."""


@dataclass(frozen=True, slots=True)
class Status:
    """STATUS: how a device is.

    Attributes:
        code: 1 means that all is well; `STATUS_NAMES` has the others.
        subcode: A number that the device's maker chose.
        name: A name that the device's maker chose.
        message: Words for people.
    """

    TYPE: ClassVar[str] = "STATUS"

    code: int
    subcode: int = 0
    name: str = ""
    message: str = ""

    def __str__(self) -> str:
        known = STATUS_NAMES[self.code] if self.code < len(STATUS_NAMES) else f"code {self.code}"
        return ", ".join(part for part in (known, self.name, self.message) if part)

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        head = packed(_STATUS, self.code, self.subcode, fixed(self.name, 20))
        return head + self.message.encode() + b"\0"

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        code, subcode, name = _begun(cls.TYPE, _STATUS, data)
        return cls(code, subcode, until_zero(name), until_zero(data[_STATUS.size :]))


@dataclass(frozen=True, slots=True)
class Sensor:
    """SENSOR: the readings of a sensor.

    Attributes:
        values: At most 255 numbers.
        unit: Their unit, as the protocol packs it; 0 if the server does not say it.
    """

    TYPE: ClassVar[str] = "SENSOR"

    values: tuple[float, ...]
    unit: int = 0

    @property
    def newtons(self) -> float | None:
        """The factor that makes newtons of the values; `None` if the unit is no force."""
        exponent = _PREFIX_EXPONENTS.get(self.unit >> 60)
        is_force = self.unit & (2**60 - 1) == NEWTON
        return 10.0**exponent if is_force and exponent is not None else None

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        head = packed(_SENSOR, len(self.values), 0, self.unit)
        return head + struct.pack(f">{len(self.values)}d", *self.values)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        count, _, unit = _begun(cls.TYPE, _SENSOR, data)
        _require_size(cls.TYPE, data, _SENSOR.size + 8 * count)
        return cls(struct.unpack_from(f">{count}d", data, _SENSOR.size), unit)


@dataclass(frozen=True, slots=True)
class Text:
    """STRING: a text."""

    TYPE: ClassVar[str] = "STRING"

    text: str

    def to_bytes(self) -> bytes:
        """See `Content.to_bytes`."""
        data = self.text.encode()
        return packed(_TEXT, _ASCII if self.text.isascii() else _UTF_8, len(data)) + data

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """See `Content.from_bytes`."""
        _, length = _begun(cls.TYPE, _TEXT, data)
        _require_size(cls.TYPE, data, _TEXT.size + length)
        return cls(data[_TEXT.size :].decode(errors="replace"))


TYPES: Final[dict[str, type[Content]]] = {
    kind.TYPE: kind
    for kind in (
        *(Transform, Position, TrackingData, QuaternionTrackingData, Points),
        *(StartTracking, StopTracking, TrackingReply, Status, Sensor, Text),
    )
}
"""The contents that are understood, by the names of their types."""


def fixed(text: str, length: int) -> bytes:
    """A text in a field of fixed length.

    Raises:
        ValueError: It is too long, or has a zero byte.
    """
    data = text.encode()
    if len(data) > length or b"\0" in data:
        raise ValueError(f"'{text}' does not fit into {length} bytes of an OpenIGTLink message")
    return data


def until_zero(data: bytes) -> str:
    """The text in such a field."""
    return data.partition(b"\0")[0].decode(errors="replace")


def packed(form: struct.Struct, *values: object) -> bytes:
    """The bytes of some numbers.

    Raises:
        ValueError: A number does not fit.
    """
    try:
        return form.pack(*values)
    except (struct.error, OverflowError) as error:
        raise ValueError(f"this does not fit into an OpenIGTLink message: {error}") from error


def _flat(columns: Columns) -> tuple[float, ...]:
    return tuple(number for column in columns for number in column)


def _columns(numbers: tuple[float, ...]) -> Columns:
    a, b, c, d, e, f, g, h, i, x, y, z = numbers
    return ((a, b, c), (d, e, f), (g, h, i), (x, y, z))


def _tools(name: str, form: struct.Struct, data: bytes) -> Iterator[tuple[Any, ...]]:
    """The fields of each tool or point.

    Raises:
        MalformedError: The bytes are not those of whole ones.
    """
    if len(data) % form.size:
        raise MalformedError(f"{name} has {len(data)} bytes, which is no multiple of {form.size}")
    return form.iter_unpack(data)


def _freedom(kind: int) -> Freedom | int:
    return Freedom(kind) if kind in Freedom.__members__.values() else kind


def _begun(name: str, form: struct.Struct, data: bytes) -> tuple[Any, ...]:
    """The fields at the beginning of a content.

    Raises:
        MalformedError: It is shorter than they are.
    """
    if len(data) < form.size:
        raise MalformedError(f"{name} has {len(data)} bytes, fewer than {form.size}")
    return form.unpack_from(data)


def _require_size(name: str, data: bytes, size: int) -> None:
    if len(data) != size:
        raise MalformedError(f"{name} has {len(data)} bytes, not {size}")
