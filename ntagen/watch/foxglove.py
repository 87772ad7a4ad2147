"""A run in Foxglove while it goes on: the messages that the log has for viewers, over a WebSocket.

Foxglove's own server sends them, on the loopback interface. It has no token, and takes nothing from
viewers. The driver never waits for them: a viewer that is slow misses messages.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final, cast

from mcap_protobuf.schema import build_file_descriptor_set

from ntagen.drive.viewers import Viewers
from ntagen.drive.viewing import TOPICS, Shown
from ntagen.errors import InputError
from ntagen.serve.loopback import HOST

if TYPE_CHECKING:
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
    from google.protobuf.message import Message

    from ntagen.drive.records import Record
    from ntagen.plan.synthesise import Synthesis
    from ntagen.scene import Scene

DEFAULT_PORT: Final = 8765
"""The port that Foxglove suggests."""

_SCENE: Final = "/scene"


class FoxgloveView:
    """A journal whose events viewers get."""

    def __init__(self, foxglove: Any, actual: Scene) -> None:  # noqa: ANN401  the package
        """Opens the channels.

        Args:
            foxglove: The package `foxglove`.
            actual: The true scene.
        """
        self.context = foxglove.Context()
        self._viewers = Viewers(actual)
        self._lock = threading.Lock()
        # The entities of the scene as they are now: a viewer that comes late needs all of them.
        self._entities: dict[str, bytes] = {}
        self._time_ns = 0
        self._channels = {
            topic: foxglove.Channel(
                topic,
                message_encoding="protobuf",
                schema=_schema(foxglove, kind),
                context=self.context,
            )
            for topic, kind in TOPICS.items()
        }

    def started(self, scene: Scene) -> None:
        """Shows the scene."""
        self._show(self._viewers.started(scene))

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Shows the best plan."""
        self._show(self._viewers.synthesised(synthesis, self._time_ns / 1e9))

    def record(self, record: Record) -> None:
        """Shows an event."""
        self._time_ns = round(record.time_s * 1e9)
        self._show(self._viewers.recorded(record))

    def on_subscribe(self, client: Any, channel: Any) -> None:  # noqa: ANN401  the package's types
        """Gives a viewer that comes late the scene as it is now."""
        if channel.topic == _SCENE:
            with self._lock:
                for data in self._entities.values():
                    self._channels[_SCENE].log(data, log_time=self._time_ns)

    def _show(self, shown: Shown) -> None:
        with self._lock:
            for topic, message in shown:
                if topic == _SCENE:
                    self._keep(cast("SceneUpdate", message))
                data = message.SerializeToString()
                self._channels[topic].log(data, log_time=self._time_ns)

    def _keep(self, update: SceneUpdate) -> None:
        for deletion in update.deletions:
            self._entities.pop(deletion.id, None)
        for entity in update.entities:
            self._entities[entity.id] = type(update)(entities=[entity]).SerializeToString()


def _schema(foxglove: Any, kind: type[Message]) -> Any:  # noqa: ANN401  the package's types
    descriptor = build_file_descriptor_set(kind).SerializeToString()
    return foxglove.Schema(name=kind.DESCRIPTOR.full_name, encoding="protobuf", data=descriptor)


@contextlib.contextmanager
def shown_in_foxglove(actual: Scene, port: int) -> Iterator[tuple[FoxgloveView, str]]:
    """Shows a run until the end of the block.

    Args:
        actual: The true scene.
        port: The port; 0 is any that is free.

    Yields:
        The journal of the run, and the address for viewers.

    Raises:
        InputError: The package is not installed, or the port cannot be used.
    """
    try:
        import foxglove
    except ImportError as error:
        raise InputError(
            f"Foxglove's server is not installed ({error})\nhint: pip install 'ntagen[foxglove]'"
        ) from error
    view = FoxgloveView(foxglove, actual)
    # The other events of a listener come only where viewers may write.
    listener: Any = view
    try:
        server = foxglove.start_server(
            name="ntagen", host=HOST, port=port, context=view.context, server_listener=listener
        )
    except (OSError, RuntimeError) as error:
        raise InputError(
            f"cannot listen on port {port}: {error}\nhint: choose another one: --foxglove 9000"
        ) from error
    try:
        yield view, f"ws://{HOST}:{server.port}"
    finally:
        server.stop()
