"""Connections that break: to an emulated controller, and to a simulated tracker."""

from __future__ import annotations

import contextlib
import socket
from typing import NoReturn

from ntagen.errors import DeviceError
from ntagen.grbl.emulator import SimulatedPort
from ntagen.openigtlink.server import Server


def pull_cable(port: SimulatedPort) -> None:
    """Lets all that uses the port fail from now on, as `ntagen.grbl.port` does without a cable."""

    def fail(_: object) -> NoReturn:
        raise DeviceError(
            "sim: the connection to the controller is broken (input/output error)\n"
            "hint: check cable and power; measure where the needle is before you go on"
        )

    port.read = port.write = fail  # type: ignore[method-assign]


def drop_clients(server: Server) -> None:
    """Closes all connections of a server; clients may connect again."""
    with server._changed:
        clients = list(server._clients)
    for client in clients:
        # The server's thread sees the end of the stream, and closes it.
        with contextlib.suppress(OSError):
            client.shutdown(socket.SHUT_RDWR)
