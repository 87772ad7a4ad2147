"""Reads the log of a run, whole or cut off.

The file is read from front to back, without its index: a writer that was killed leaves no index.
All data before the cut is good; data after the cut was never acknowledged.

Anybody may have written a log. Compressed data is unpacked piece by piece, and never to more than a
multiple of the file's size, nor to more than a limit beyond it (`_Budget`).
"""

from __future__ import annotations

import contextlib
import hashlib
import io
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import IO, Any, Final, cast

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Footer, Header, McapRecord, Metadata, Schema
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader

from ntagen.bags import is_bag, log_in
from ntagen.drive.following import Course
from ntagen.drive.log import (
    ACTUAL,
    EARLIER,
    FORMAT_VERSION,
    METADATA,
    POLICY,
    RESUMES,
    SCENE,
    TREE,
)
from ntagen.drive.messages import PACKAGE, decode
from ntagen.drive.no_log import HEAD, Contents, no_log, no_log_in_bag, nothing_attached
from ntagen.drive.records import Record
from ntagen.drive.scene_json import samples_in, scene_from_json
from ntagen.drive.settings import Settings
from ntagen.drive.trees import COURSE, course_from_log
from ntagen.errors import InputError
from ntagen.files import json_of, open_file
from ntagen.frames import frame_of
from ntagen.plan.policy import Policy, read_policy
from ntagen.scene import Scene

MAX_LOG_BYTES: Final = 512 * 2**20
"""The largest file; a run of a minute takes less than one MiB."""

MAX_RECORD_BYTES: Final = 64 * 2**20
"""The largest compressed record; the model of a thousand regions takes less than one MiB."""

_SPARE_BYTES: Final = 8 * 2**20
_LARGEST_RATIO: Final = 32
_MOST_BYTES: Final = 192 * 2**20
"""So much may be unpacked and kept besides the file's own size."""

_KEPT_BYTES: Final = 800
"""The memory of what is kept of a record of the file, besides its own bytes; real ones take less,
also as rows."""

_READ_BYTES: Final = 64
"""What a record counts that is read and not kept, besides its own bytes: reading takes time."""

_PIECE_BYTES: Final = 2**16

_HEAD_BYTES: Final = 2**18
"""The options of a run stand so far in front in its log."""


_LISTS: Final = frozenset({"way", "length_mm", "std_mm", "shape_mm", "x_mm", "y_mm", "z_mm"})
"""The fields of records that are lists; other tuples are vectors."""

_LARGEST_WINDOW_BYTES: Final = 8 * 2**20
"""The largest window of compressed data; more than any common setting needs."""


@dataclass(frozen=True, slots=True)
class RunLog:
    """A run as it was logged.

    Attributes:
        records: The records in order.
        metadata: The options with which the run was started.
        attachments: The attached files by name.
        torn_at_byte: The byte at which a file that is cut off becomes unreadable; None if whole.
        path: The file, for messages.
        file_bytes: The length of the file when it was read.
        sha256: The digest of these bytes.
    """

    records: tuple[Record, ...]
    metadata: dict[str, str]
    attachments: dict[str, bytes]
    torn_at_byte: int | None
    path: Path = field(compare=False)
    file_bytes: int = field(default=0, compare=False)
    sha256: str = field(default="", compare=False)

    @property
    def scene(self) -> Scene:
        """The scene that the driver knew.

        Raises:
            InputError: The log has no scene.
        """
        return self._scene(SCENE)

    @property
    def actual(self) -> Scene:
        """The true scene; if the log does not have it, the scene that the driver knew."""
        return self._scene(ACTUAL if ACTUAL in self.attachments else SCENE)

    @property
    def settings(self) -> Settings:
        """The settings of the run.

        Raises:
            InputError: The log has none.
        """
        try:
            document = json_of(self.metadata["settings"])
        except (KeyError, ValueError, RecursionError) as error:
            raise InputError(f"{self.path}: the log has no settings of a run") from error
        with self.naming():
            return Settings.from_json(document)

    @property
    def course(self) -> Course | None:
        """How the run went in a tissue that answers; None in another one.

        Raises:
            InputError: The log does not say so in the way in which it is written.
        """
        if COURSE not in self.metadata:
            return None
        tree = self.attachments.get(TREE)
        try:
            return course_from_log(self.metadata[COURSE], tree)
        except (KeyError, TypeError, ValueError, RecursionError) as error:
            raise InputError(
                f"{self.path}: the strategy of the run cannot be read: {error!r}"
            ) from error

    @property
    def policy(self) -> Policy | None:
        """The policy that was asked in the run; None if there was none.

        Raises:
            InputError: It cannot be read.
        """
        if POLICY not in self.attachments:
            return None
        with self.naming():
            return read_policy(self.attachments[POLICY], None)

    @property
    def earlier(self) -> RunLog | None:
        """The log from which this run goes on; None if it began at the entry.

        Raises:
            InputError: It is missing, is not the one that is named, or cannot be read.
        """
        named = self.resumes
        if named is None:
            return None
        data = self.attachments.get(EARLIER, b"")
        if hashlib.sha256(data).hexdigest() != named["sha256"]:
            raise InputError(
                f"{self.path}: the run goes on from {named['file']}, and that log is not in the "
                f"attachment {EARLIER} as it was (SHA-256 {named['sha256']})"
            )
        return _log_in(io.BytesIO(data), Path(f"{self.path}: {named['file']}"))

    @property
    def resumes(self) -> dict[str, str] | None:
        """The ``file`` and the ``sha256`` of the log from which this run goes on, if it does.

        Raises:
            InputError: They are not as they are written.
        """
        if RESUMES not in self.metadata:
            return None
        try:
            named = json_of(self.metadata[RESUMES])
            return {"file": str(named["file"]), "sha256": str(named["sha256"])}
        except (KeyError, TypeError, ValueError, RecursionError) as error:
            raise InputError(
                f"{self.path}: the log from which the run goes on is not named as it should be"
            ) from error

    def scene_of(self, number: int) -> Scene:
        """The scene of a synthesis.

        Raises:
            InputError: The log has none.
        """
        return self._scene(f"rebuild-{number:04d}/scene.json")

    def rows(self) -> list[dict[str, Any]]:
        """The records as flat rows, in order: ``record`` is the kind, and the rest its fields.

        The parts of a vector are fields of their own, such as ``position_x_mm``. What was not
        measured is left out.
        """
        return [
            {"record": type(record).__name__.lower(), **_flat(asdict(record))}
            for record in self.records
        ]

    def to_frame(self) -> Any:  # noqa: ANN401  it depends on what is installed
        """The `rows` as a frame of pandas, or of polars if there is no pandas.

        Raises:
            InputError: Neither is installed.
        """
        return frame_of(self.rows(), "`rows` has the records")

    @contextlib.contextmanager
    def naming(self) -> Iterator[None]:
        """Lets an error about what the log has begin with the name of the log."""
        try:
            yield
        except InputError as error:
            raise InputError(f"{self.path}: {error}") from error

    def _scene(self, name: str) -> Scene:
        if name not in self.attachments:
            is_torn = self.torn_at_byte is not None
            raise nothing_attached(self.path, name, self.attachments, is_torn=is_torn)
        known = samples_in(self.attachments[SCENE]) if SCENE in self.attachments else {}
        with self.naming():
            return scene_from_json(self.attachments[name], known)


def _flat(fields: dict[str, Any]) -> dict[str, Any]:
    """The fields of a record with each part of a vector apart."""
    found: dict[str, Any] = {}
    for name, value in fields.items():
        if not isinstance(value, tuple):
            found[name] = value
        elif name in _LISTS:
            found[name] = " ".join(f"{one:.9g}" for one in value)
        else:
            base = name.removesuffix("_mm")
            unit = name[len(base) :]
            # The heading and the bevel of a tracker that measures positions only are empty.
            found |= {f"{base}_{axis}{unit}": one for axis, one in zip("xyz", value, strict=False)}
    return found


def read_log(path: str | Path) -> RunLog:
    """Reads the readable part of a log, also one in a bag of ROS (`ntagen.bags`).

    Raises:
        InputError: The file cannot be read, is not MCAP, or is not the log of a run.
    """
    path = Path(path)
    with _opened(path) as file:
        return _log_in(file, path)


def metadata_in(path: Path) -> dict[str, str]:
    """The options of a run, from the beginning of its log alone; empty if it is none."""
    try:
        with open_file(path, MAX_LOG_BYTES) as file:
            head = io.BytesIO(file.read(_HEAD_BYTES))
    except OSError:
        return {}
    collected = _Collected()
    with contextlib.suppress(InputError):
        _read(head, collected, _Budget(path, len(head.getvalue())))
    return collected.metadata.get(METADATA, {})


def _log_in(file: IO[bytes], path: Path) -> RunLog:
    """The readable part of a log in an open file, whose name is for messages."""
    file_bytes = file.seek(0, io.SEEK_END)
    file.seek(0)
    collected = _Collected()
    torn_at_byte = _read(file, collected, _Budget(path, file_bytes))
    if METADATA not in collected.metadata:
        count = len(collected.records)
        raise no_log(path, file, collected.contents, count, torn_at_byte)
    sha256 = _digest_of(file, file_bytes)
    metadata = collected.metadata[METADATA]
    if metadata.get("format_version") != str(FORMAT_VERSION):
        raise InputError(
            f"{path}: this log has version {metadata.get('format_version')}, but this ntagen "
            f"reads only version {FORMAT_VERSION}"
        )
    records = tuple(record for _, record in sorted(collected.records, key=lambda item: item[0]))
    return RunLog(records, metadata, collected.attachments, torn_at_byte, path, file_bytes, sha256)


def _opened(path: Path) -> IO[bytes]:
    """The log in a file, or in a bag.

    Raises:
        InputError: It cannot be read.
    """
    if is_bag(path):
        try:
            data = log_in(path)
        except InputError:
            # Of a file, more is said by what can be read of it.
            if path.is_dir():
                raise
            data = None
        if data is not None:
            return io.BytesIO(data)
        if path.is_dir():
            raise no_log_in_bag(path)
    try:
        return open_file(path, MAX_LOG_BYTES)
    except OSError as error:
        raise InputError(f"cannot read {path}: {(error.strerror or str(error)).lower()}") from error


def _digest_of(file: IO[bytes], file_bytes: int) -> str:
    """The SHA-256 of the first bytes of a file: a run that goes on may have added more."""
    file.seek(0)
    digest, left = hashlib.sha256(), file_bytes
    while left and (piece := file.read(min(left, _PIECE_BYTES))):
        digest.update(piece)
        left -= len(piece)
    return digest.hexdigest()


class _Collected:
    """The data that has been read until now."""

    def __init__(self) -> None:
        self.records: list[tuple[int, Record]] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self.contents = Contents()
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, str] = {}

    def add(self, item: McapRecord) -> bool:
        """Takes one record of the file; returns whether anything of it is kept."""
        match item:
            case Header():
                self.contents.profile = item.profile
            case Schema():
                self._schemas[item.id] = item.name
            case Channel():
                self._channels[item.id] = self._schemas.get(item.schema_id, "")
                self.contents.topics[item.topic] = item.message_encoding
            case Metadata():
                self.metadata[item.name] = dict(item.metadata)
            case Attachment():
                self.attachments[item.name] = item.data
            case McapMessage():
                name = self._channels.get(item.channel_id, "")
                if not name.startswith(f"{PACKAGE}."):
                    return False
                self.records.append(decode(name, item.data))
            case _:
                return False
        return True


def _read(file: IO[bytes], collected: _Collected, budget: _Budget) -> int | None:
    """Reads the readable part; returns the byte at which it ends, or None if the file is whole."""
    good_byte = 0
    whole = cast("io.BytesIO", _Whole(file, budget.file_bytes))
    reader = StreamReader(whole, emit_chunks=True, record_size_limit=MAX_RECORD_BYTES)
    items: Any = iter(reader.records)
    while True:
        try:
            item = next(items)
            for one in _unpacked(item, budget) if isinstance(item, Chunk) else (item,):
                if collected.add(one):
                    budget.take(_KEPT_BYTES)
        except StopIteration:
            return good_byte
        except (InputError, MemoryError):
            raise
        except Exception:
            # Where a file is cut off, the libraries raise many kinds of errors: their own, those of
            # struct, those of the decompressor. All of them mean that the file is good up to here.
            return good_byte
        if isinstance(item, Footer):
            return None
        good_byte = file.tell()


class _Whole:
    """A file that reads no more bytes than it has: a wrong length would reserve memory."""

    def __init__(self, file: IO[bytes], file_bytes: int) -> None:
        self._file = file
        self._left = file_bytes

    def read(self, size: int) -> bytes:
        """`size` bytes, or fewer at the end."""
        piece = self._file.read(min(size, self._left))
        self._left -= len(piece)
        return piece


class _Budget:
    """The number of bytes that may still be unpacked and kept.

    A few kilobytes of compressed data can unpack to gigabytes. A real run shrinks to a half, or to
    a tenth if it is compressed as a whole.
    """

    def __init__(self, path: Path, file_bytes: int) -> None:
        self._path = path
        self.file_bytes = file_bytes
        ratio_bytes = _SPARE_BYTES + _LARGEST_RATIO * file_bytes
        self._all = self._left = min(ratio_bytes, file_bytes + _MOST_BYTES)

    def take(self, count: int) -> None:
        """Takes bytes from the budget.

        Raises:
            InputError: There is not enough left.
        """
        self._left -= count
        if self._left < 0:
            raise InputError(
                f"{self._path}: not the log of a run: it unpacks to more than "
                f"{self._all // 2**20:,} MiB, or has too many records"
            )


class _Unpacking:
    """The contents of a chunk as a stream, unpacked during reading."""

    def __init__(self, chunk: Chunk, budget: _Budget) -> None:
        self._budget = budget
        self._stream: IO[bytes]
        match chunk.compression:
            case "zstd":
                zstd = zstandard.ZstdDecompressor(max_window_size=_LARGEST_WINDOW_BYTES)
                self._stream = cast("IO[bytes]", zstd.stream_reader(chunk.data))
            case "lz4":
                lz4_file = lz4.frame.LZ4FrameFile(io.BytesIO(chunk.data))
                # Records are read in pieces of a few bytes.
                self._stream = io.BufferedReader(lz4_file, _PIECE_BYTES)
            case _:
                self._stream = io.BytesIO(chunk.data)

    def read(self, size: int) -> bytes:
        """`size` bytes, or none at the end.

        Raises:
            EOFError: The stream ends within them.
            InputError: They are more than the budget allows.
        """
        pieces, missing = [], size
        # The length may be wrong too; only the real data counts.
        while missing and (piece := self._stream.read(min(missing, _PIECE_BYTES))):
            self._budget.take(len(piece))
            pieces.append(piece)
            missing -= len(piece)
        if missing and pieces:
            raise EOFError(f"{missing} bytes are missing")
        return b"".join(pieces)


def _unpacked(chunk: Chunk, budget: _Budget) -> Iterator[McapRecord]:
    """The records of a chunk, one after the other.

    Raises:
        InputError: They are more than the budget allows.
    """
    unpacking = _Unpacking(chunk, budget)
    stream = ReadDataStream(cast("io.BytesIO", unpacking))
    while head := unpacking.read(HEAD.size):
        budget.take(_READ_BYTES)
        opcode, length = HEAD.unpack(head)
        match opcode:
            case Opcode.SCHEMA:
                yield Schema.read(stream)
            case Opcode.CHANNEL:
                yield Channel.read(stream)
            case Opcode.MESSAGE:
                yield McapMessage.read(stream, length)
            case _:
                stream.read(length)
