"""The log of a run: an MCAP file that is complete up to the last record, even after a crash.

It contains:

* metadata ``ntagen``: format version, program version, seed, settings and more from the caller;
* attachments ``earlier.mcap`` (the log from which the run goes on, as it was),
  ``scene.json`` (the scene that the driver knew), ``actual.json`` and ``scene.nsl``
  (the true scene and its source), ``against-tissue.json`` (the strategy against a tissue that
  answers, if one is followed), ``policy.json`` (the policy, if one is asked), and for each
  synthesis ``rebuild-0001/scene.json``, ``…/model.xml`` (``…/model.xml.gz`` if it is large),
  ``…/plans.json``, ``…/strategy.json.gz``;
* one channel ``/ntagen/…`` for each kind of record (`ntagen.drive.messages`), and the channels for
  viewers (`ntagen.drive.viewing`).

A record is acknowledged when `record` returns. The operating system has it then, so that it
survives the death of this process. The log waits for the disk itself only at the start, at alarms
and at the end: power cuts are rarer, and waiting takes milliseconds.

These choices come from measurements with killed writers; without a flush the MCAP library keeps up
to 1 MiB in memory.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, Final, cast

from google.protobuf.message import Message
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from ntagen.drive.messages import KINDS, encode, message_class
from ntagen.drive.records import (
    Answered,
    Ended,
    JournalError,
    Learned,
    Measured,
    Predicted,
    Record,
    Transition,
)
from ntagen.drive.scene_json import samples_in, scene_from_json, scene_to_json
from ntagen.drive.states import ABORTS, Event
from ntagen.drive.viewers import Viewers
from ntagen.drive.viewing import TOPICS, Shown
from ntagen.errors import InputError
from ntagen.files import GrowingFile
from ntagen.plan.document import document
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene

FORMAT_VERSION: Final = 1
METADATA: Final = "ntagen"
SCENE: Final = "scene.json"
ACTUAL: Final = "actual.json"
SOURCE: Final = "scene.nsl"
TREE: Final = "against-tissue.json"
POLICY: Final = "policy.json"
EARLIER: Final = "earlier.mcap"
RESUMES: Final = "resumes"
"""The entry of a log with the name and the digest of the log from which its run goes on."""

STRATEGY: Final = "strategy.json.gz"

VIEW_S: Final = 2.0
"""How often viewers see the needle in a log that is not kept up. Records are never left out."""

_PLANS_LOGGED: Final = 200
"""At most this many plans of a synthesis are attached, the best first."""

_LARGE_BYTES: Final = 2**20
"""A model with more is packed: ``model.xml.gz``."""

_ALARMS: Final = frozenset(event.value for event in (Event.FORCE, Event.DEVIATION, *ABORTS))


def topic_of(kind: type[Record]) -> str:
    """The topic of a kind of record."""
    return f"/ntagen/{kind.__name__.lower()}"


class Log:
    """A journal that writes MCAP; use it as a context manager.

    Args:
        path: The file; an existing one is replaced. Others cannot write to it during the run.
        metadata: Facts about the run, as texts.
        attachments: Files to store with the run, by name.
        is_kept_up: Whether each record is acknowledged. Else nothing is written before the end,
            and viewers see the needle every `VIEW_S` only, which takes less than half the time and
            a fifth of the place: for runs that nobody watches, and that can be repeated.

    Raises:
        InputError: The file cannot be written, or another run is writing to it.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, str],
        attachments: Mapping[str, bytes],
        *,
        is_kept_up: bool = True,
    ) -> None:
        self._file = GrowingFile(path)
        self._is_kept_up = is_kept_up
        # The file has all methods of a stream that the writer needs.
        self._writer = Writer(cast("IO[bytes]", self._file), chunk_size=1 << 16)
        self._writer.start(profile="", library="ntagen")
        self._sequence = 0
        self._time_ns = 0
        self._writer.add_metadata(METADATA, {"format_version": str(FORMAT_VERSION), **metadata})
        for name, data in attachments.items():
            self._attach(name, data)
        self._channels = {
            kind: self._channel(topic_of(kind), message_class(kind)) for kind in KINDS
        }
        self._samples: dict[str, str] = {}
        actual = scene_from_json(attachments[ACTUAL]) if ACTUAL in attachments else None
        self._viewers = Viewers(actual)
        # When viewers saw the needle last, by the kind of record.
        self._seen_s: dict[type[Record], float] = {}
        self._views = {topic: self._channel(topic, kind) for topic, kind in TOPICS.items()}

    def __enter__(self) -> Log:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None or issubclass(kind, Exception):
            self.close()
        else:
            # The user wants an end at once, perhaps in the middle of a record.
            self._file.close()

    @property
    def is_empty(self) -> bool:
        """Whether nothing was recorded."""
        return self._sequence == 0

    def started(self, scene: Scene) -> None:
        """Writes the a-priori scene."""
        text = scene_to_json(scene)
        self._samples = samples_in(text)
        self._attach(SCENE, text.encode())
        self._show(self._viewers.started(scene))
        self._acknowledge(to_disk=True)

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Attaches the scene, the model and the best plans of a synthesis.

        Raises:
            JournalError: They cannot be written.
        """
        if self._file.closed:
            return
        folder = f"rebuild-{number:04d}"
        best = synthesis.candidates[:_PLANS_LOGGED]
        plans = document(synthesis.scene, best, synthesis.ranking, synthesis.margins)
        scene = scene_to_json(synthesis.scene, self._samples)
        self._attach(f"{folder}/scene.json", scene.encode())
        model = synthesis.model_xml.encode()
        if len(model) < _LARGE_BYTES:
            self._attach(f"{folder}/model.xml", model, "application/xml")
        else:
            # Tables of distances make models of megabytes.
            packed = gzip.compress(model, compresslevel=1, mtime=0)
            self._attach(f"{folder}/model.xml.gz", packed, "application/gzip")
        self._attach(f"{folder}/plans.json", json.dumps(plans).encode())
        if synthesis.strategy_json:
            # The strategy of the paper's task is 0.6 MB of JSON, and 40 KB packed.
            packed = gzip.compress(synthesis.strategy_json.encode(), compresslevel=1, mtime=0)
            self._attach(f"{folder}/{STRATEGY}", packed, "application/gzip")
        self._show(self._viewers.synthesised(synthesis, self._time_ns / 1e9))
        self._keep(to_disk=False)

    def record(self, record: Record) -> None:
        """Writes a record; it then survives the death of the process.

        Raises:
            JournalError: It cannot be written. The file ends with the record before it.
        """
        if self._file.closed:
            return
        self._time_ns = round(record.time_s * 1e9)
        self._add(self._channels[type(record)], encode(record, self._sequence))
        self._sequence += 1
        self._show(self._viewers.recorded(record, is_due=self._is_due(record)))
        is_alarm = isinstance(record, Transition) and record.event in _ALARMS
        self._keep(to_disk=is_alarm or isinstance(record, Answered | Learned | Ended))

    def close(self) -> None:
        """Completes the file; without this it is cut off, but readable.

        Raises:
            JournalError: It cannot be completed. All records are in it.
        """
        if self._file.closed:
            return
        self._writer.finish()  # type: ignore[no-untyped-call]
        try:
            self._file.acknowledge(to_disk=True)
        except InputError as error:
            raise JournalError(f"the run is over, and its log has no index: {error}") from error
        self._file.close()

    def _channel(self, topic: str, kind: type[Message]) -> int:
        schema: int = register_schema(self._writer, kind)
        return self._writer.register_channel(topic, "protobuf", schema)

    def _is_due(self, record: Record) -> bool:
        """Whether viewers are to see a record."""
        if self._is_kept_up or not isinstance(record, Measured | Predicted):
            return True
        seen_s = self._seen_s.get(type(record))
        if seen_s is not None and record.time_s - seen_s < VIEW_S:
            return False
        self._seen_s[type(record)] = record.time_s
        return True

    def _show(self, shown: Shown) -> None:
        for topic, message in shown:
            self._add(self._views[topic], message.SerializeToString())

    def _add(self, channel: int, data: bytes) -> None:
        self._writer.add_message(
            channel,
            log_time=self._time_ns,
            publish_time=self._time_ns,
            data=data,
            sequence=self._sequence,
        )

    def _attach(self, name: str, data: bytes, media_type: str = "application/json") -> None:
        self._writer.add_attachment(
            create_time=self._time_ns,
            log_time=self._time_ns,
            name=name,
            media_type=media_type,
            data=data,
        )

    def _keep(self, *, to_disk: bool) -> None:
        """Acknowledges what a run that goes on has written."""
        try:
            self._acknowledge(to_disk=to_disk)
        except InputError as error:
            raise JournalError(str(error)) from error

    def _acknowledge(self, *, to_disk: bool) -> None:
        if not self._is_kept_up:
            return
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._file.acknowledge(to_disk=to_disk)


def metadata_of(values: Mapping[str, Any]) -> dict[str, str]:
    """The texts for MCAP's metadata: texts unchanged, other values as JSON."""
    return {
        name: value if isinstance(value, str) else json.dumps(value)
        for name, value in values.items()
    }
