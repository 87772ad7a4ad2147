"""Reading the log of a run, whole or torn.

The file is read from front to back and never through its index: a writer that was killed leaves no
index, and everything before the tear is good. What is behind the tear is nothing that was ever
acknowledged.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from mcap.records import Attachment, Channel, Footer, McapRecord, Metadata, Schema
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader

from ntagen.drive.log import ACTUAL, FORMAT_VERSION, METADATA, SCENE
from ntagen.drive.messages import PACKAGE, decode
from ntagen.drive.records import Record
from ntagen.drive.scene_json import scene_from_json
from ntagen.drive.settings import Settings
from ntagen.errors import InputError
from ntagen.scene import Scene


@dataclass(frozen=True, slots=True)
class RunLog:
    """A run as it was logged.

    Attributes:
        records: The records in order.
        metadata: What the run was started with.
        attachments: The attached files by name.
        torn_at_byte: Where a torn file stops to be readable; None for a whole one.
    """

    records: tuple[Record, ...]
    metadata: dict[str, str]
    attachments: dict[str, bytes]
    torn_at_byte: int | None

    @property
    def scene(self) -> Scene:
        """What the driver was told.

        Raises:
            InputError: The log holds no scene.
        """
        return self._scene(SCENE)

    @property
    def actual(self) -> Scene:
        """What was really so, or what the driver was told where nobody knows more."""
        return self._scene(ACTUAL if ACTUAL in self.attachments else SCENE)

    @property
    def settings(self) -> Settings:
        """The settings of the run.

        Raises:
            InputError: The log holds none.
        """
        try:
            document = json.loads(self.metadata["settings"])
        except (KeyError, ValueError) as error:
            raise InputError("the log holds no settings of a run") from error
        return Settings.from_json(document)

    def _scene(self, name: str) -> Scene:
        if name not in self.attachments:
            raise InputError("the log holds no scene\nhint: it was torn before the run began")
        return scene_from_json(self.attachments[name])


def read_log(path: Path) -> RunLog:
    """Reads a log, as far as it is readable.

    Raises:
        InputError: The file cannot be read, is no MCAP, or is no log of a run.
    """
    if path.is_dir():
        raise InputError(f"cannot read {path}: it is a folder")
    try:
        file = path.open("rb")
    except OSError as error:
        raise InputError(f"cannot read {path}: {(error.strerror or str(error)).lower()}") from error
    with file:
        collected = _Collected()
        torn_at_byte = _read(file, collected)
    if METADATA not in collected.metadata:
        raise InputError(
            f"{path}: not the log of a run\nhint: give a file that `ntagen drive --log` wrote"
        )
    metadata = collected.metadata[METADATA]
    if metadata.get("format_version") != str(FORMAT_VERSION):
        raise InputError(f"{path}: log of version {metadata.get('format_version')} is not known")
    records = tuple(record for _, record in sorted(collected.records, key=lambda item: item[0]))
    return RunLog(records, metadata, collected.attachments, torn_at_byte)


class _Collected:
    """What was read so far."""

    def __init__(self) -> None:
        self.records: list[tuple[int, Record]] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, str] = {}

    def add(self, item: McapRecord) -> None:
        """Takes one record of the file."""
        match item:
            case Schema():
                self._schemas[item.id] = item.name
            case Channel():
                self._channels[item.id] = self._schemas.get(item.schema_id, "")
            case Metadata():
                self.metadata[item.name] = dict(item.metadata)
            case Attachment():
                self.attachments[item.name] = item.data
            case McapMessage():
                name = self._channels.get(item.channel_id, "")
                if name.startswith(f"{PACKAGE}."):
                    self.records.append(decode(name, item.data))


def _read(file: IO[bytes], collected: _Collected) -> int | None:
    """Reads what is readable; where it stops being so, or None if the file is whole."""
    good_byte = 0
    items: Any = iter(StreamReader(file, record_size_limit=1 << 30).records)
    while True:
        try:
            item = next(items)
            collected.add(item)
        except StopIteration:
            return good_byte
        except Exception:
            # At a tear the libraries raise whatever their parsers stumble on: errors of their own,
            # of struct, of the decompressor. All of them mean that the file is good up to here.
            return good_byte
        if isinstance(item, Footer):
            return None
        good_byte = file.tell()
