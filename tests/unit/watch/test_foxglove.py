"""A run in Foxglove while it goes on: what its viewers get, also late ones."""

from __future__ import annotations

import asyncio
import json
import struct
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from ntagen.cli import main
from ntagen.drive.records import Journals, Measured
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate
from ntagen.errors import InputError
from ntagen.watch import foxglove
from ntagen.watch.foxglove import FoxgloveView, shown_in_foxglove
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import HIDDEN

PAPER = Path(__file__).parents[3] / "examples" / "paper.nsl"


def test_a_missing_package_is_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "foxglove", None)
    assert main(["drive", str(PAPER), "--foxglove", "--quiet"]) == 2
    assert "hint: pip install 'ntagen[foxglove]'" in capsys.readouterr().err


class Context:
    """What channels belong to."""


class Channel:
    """What a channel of the package takes."""

    def __init__(self, topic: str, **options: object) -> None:
        assert options["message_encoding"] == "protobuf"
        self.topic = topic
        self.sent: list[bytes] = []

    def log(self, data: bytes, *, log_time: int) -> None:
        self.sent.append(data)


class Package:
    """The parts of the package that make channels."""

    Context = Context
    Channel = Channel

    @staticmethod
    def Schema(*, name: str, encoding: str, data: bytes) -> tuple[str, str, int]:  # noqa: N802
        return name, encoding, len(data)


def test_a_late_viewer_gets_the_scene_as_it_is() -> None:
    view = FoxgloveView(Package, HIDDEN)
    simulate(HIDDEN, oracle_synthesis, Settings(), Journals(view), known="C1")
    channel = view._channels["/scene"]
    entities: dict[str, Any] = {}
    for data in channel.sent:
        update = SceneUpdate.FromString(data)
        for deletion in update.deletions:
            entities.pop(deletion.id, None)
        entities |= {entity.id: entity for entity in update.entities}
    channel.sent.clear()
    view.on_subscribe(None, channel)
    late = [one for data in channel.sent for one in SceneUpdate.FromString(data).entities]
    assert {one.id: one for one in late} == entities
    assert {"plan", "shaft"} < set(entities)


async def heard(address: str, act: Callable[[], Awaitable[None]]) -> dict[str, int]:
    """How many messages a viewer gets, by topic, that subscribes to all topics before something."""
    websocket = pytest.importorskip("tornado.websocket", reason="needs tornado")
    socket = await websocket.websocket_connect(address, subprotocols=["foxglove.sdk.v1"])
    topics, counts = dict[int, str](), dict[str, int]()
    while len(topics) < len(foxglove.TOPICS):
        text = await socket.read_message()
        if isinstance(text, str) and (told := json.loads(text))["op"] == "advertise":
            topics |= {one["id"]: one["topic"] for one in told["channels"]}
    wanted = [{"id": number, "channelId": number} for number in topics]
    await socket.write_message(json.dumps({"op": "subscribe", "subscriptions": wanted}))
    await asyncio.sleep(0.3)
    await act()
    while True:
        try:
            data = await asyncio.wait_for(socket.read_message(), 0.5)
        except TimeoutError:
            break
        if isinstance(data, bytes) and data[0] == 1:
            topic = topics[struct.unpack_from("<I", data, 1)[0]]
            counts[topic] = counts.get(topic, 0) + 1
    socket.close()
    return counts


def test_a_viewer_gets_the_run() -> None:
    pytest.importorskip("foxglove", reason="needs foxglove-sdk")

    with shown_in_foxglove(HIDDEN, 0) as (view, address):
        view.started(HIDDEN)

        async def push() -> None:
            view.record(Measured(1.0, 1.0, (0.0, -1.0, 0.0), 0.1, (), ()))

        counts = asyncio.run(heard(address, push))
    assert counts["/needle/measured"] == 1
    assert counts["/scene"] >= len(HIDDEN.regions)


def test_a_port_in_use_is_said() -> None:
    pytest.importorskip("foxglove", reason="needs foxglove-sdk")
    with shown_in_foxglove(HIDDEN, 0) as (_, address):
        port = int(address.rpartition(":")[2])
        with (
            pytest.raises(InputError, match=f"cannot listen on port {port}"),
            shown_in_foxglove(HIDDEN, port),
        ):
            pass
