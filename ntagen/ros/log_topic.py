"""Publishes the log of a run while it is written, so that a bag has it (`ntagen replay BAG`)."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Final

from std_msgs.msg import UInt8MultiArray

from ntagen.drive.records import Ended, Record
from ntagen.plan.synthesise import Synthesis
from ntagen.ros.bridge import Bridge, quality
from ntagen.scene import Scene

_PERIOD_S: Final = 0.5
_KEPT: Final = 10_000
"""So many pieces are kept for whoever begins to record later: those of more than an hour."""

_SENT_S: Final = 0.5
"""Whoever records gets the last piece within this time."""


class LogTopic:
    """A journal behind that of the log; a `ntagen.drive.records.Journal`.

    Args:
        bridge: The node.
        topic: The topic.
        path: The log, which another journal has written when this one is told.
    """

    def __init__(self, bridge: Bridge, topic: str, path: Path) -> None:
        self._bridge = bridge
        self._topic = topic
        self._path = path
        self._read = 0
        self._sent_s = 0.0
        bridge.advertise(topic, UInt8MultiArray, quality(is_kept=True, depth=_KEPT))

    def started(self, scene: Scene) -> None:
        """Publishes how the log begins."""
        del scene
        self._send()

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Does nothing: the next piece has it."""

    def record(self, record: Record) -> None:
        """Publishes what was added, not at every record."""
        if isinstance(record, Ended) or time.monotonic() - self._sent_s >= _PERIOD_S:
            self._send()

    def finish(self) -> None:
        """Publishes the rest of a log that is complete, and gives it time to arrive."""
        self._send()
        time.sleep(_SENT_S)

    def _send(self) -> None:
        self._sent_s = time.monotonic()
        with self._path.open("rb") as file:
            file.seek(self._read)
            data = file.read()
        if data:
            self._read += len(data)
            self._bridge.publish(self._topic, UInt8MultiArray(data=data))
