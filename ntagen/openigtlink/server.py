"""A small OpenIGTLink server: it sends what it is given to all who are connected.

It stands in for a tracker in tests, and between the virtual needle and the driver where the whole
network path is tried without hardware. By default it listens on this machine only.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import threading
from collections import deque
from typing import Final, Self

from ntagen.errors import DeviceError
from ntagen.openigtlink.packets import Decoder, Packet, ProtocolError

_PIECE_BYTES: Final = 2**16
_KEPT: Final = 1000
_SEND_S: Final = 1.0
"""A client that takes no bytes for so long is dropped."""


class Server:
    """A server for any number of clients; use it as a context manager.

    Args:
        host: The address to listen on.
        port: The port; 0 for any that is free.

    Attributes:
        port: The port on which it listens.

    Raises:
        DeviceError: It cannot listen there.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 0) -> None:
        try:
            self._socket = socket.create_server((host, port))
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise DeviceError(f"cannot listen on {host}:{port}: {reason}") from error
        self.port: int = self._socket.getsockname()[1]
        self._clients: dict[socket.socket, Decoder] = {}
        self._received: deque[Packet] = deque(maxlen=_KEPT)
        self._changed = threading.Condition()
        self._closing, self._wake = socket.socketpair()
        self._thread = threading.Thread(target=self._serve, name="igtl-server", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def send(self, *packets: Packet) -> None:
        """Sends messages to all clients, in order; a client that does not take them is dropped."""
        self.send_bytes(b"".join(packet.to_bytes() for packet in packets))

    def send_bytes(self, data: bytes) -> None:
        """Sends bytes to all clients."""
        with self._changed:
            clients = list(self._clients)
        for client in clients:
            try:
                client.sendall(data)
            except OSError:
                self._drop(client)

    def wait_for_clients(self, count: int, timeout_s: float) -> bool:
        """Waits until so many clients are connected; returns whether they are."""
        with self._changed:
            return self._changed.wait_for(lambda: len(self._clients) >= count, timeout_s)

    def wait_for(self, kind: type, timeout_s: float) -> Packet | None:
        """Waits for a message with a content of this kind; the newest, or `None`."""

        def newest() -> Packet | None:
            return next((p for p in reversed(self._received) if isinstance(p.content, kind)), None)

        with self._changed:
            self._changed.wait_for(lambda: newest() is not None, timeout_s)
            return newest()

    def close(self) -> None:
        """Closes everything. It may be called twice."""
        with contextlib.suppress(OSError):
            self._wake.send(b".")
        self._thread.join()
        self._wake.close()
        self._clients.clear()

    def _serve(self) -> None:
        with selectors.DefaultSelector() as selector:
            selector.register(self._socket, selectors.EVENT_READ)
            selector.register(self._closing, selectors.EVENT_READ)
            while all(self._turn(key, selector) for key, _ in selector.select()):
                pass
            for key in list(selector.get_map().values()):
                _socket_of(key).close()

    def _turn(self, key: selectors.SelectorKey, selector: selectors.BaseSelector) -> bool:
        """Does what one socket is ready for; returns whether the server goes on."""
        ready = _socket_of(key)
        if ready is self._closing:
            return False
        if ready is self._socket:
            self._accept(selector)
        elif not self._read(ready):
            selector.unregister(ready)
            self._drop(ready)
            ready.close()
        return True

    def _accept(self, selector: selectors.BaseSelector) -> None:
        with contextlib.suppress(OSError):
            client, _ = self._socket.accept()
            client.settimeout(_SEND_S)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            selector.register(client, selectors.EVENT_READ)
            with self._changed:
                self._clients[client] = Decoder()
                self._changed.notify_all()

    def _read(self, client: socket.socket) -> bool:
        """Reads what a client sent; returns whether it is still there."""
        try:
            data = client.recv(_PIECE_BYTES)
            packets = self._clients[client].feed(data) if data else []
        except (OSError, ProtocolError, KeyError):
            return False
        with self._changed:
            self._received += packets
            self._changed.notify_all()
        return bool(data)

    def _drop(self, client: socket.socket) -> None:
        with self._changed:
            self._clients.pop(client, None)
        with contextlib.suppress(OSError):
            client.shutdown(socket.SHUT_RDWR)


def _socket_of(key: selectors.SelectorKey) -> socket.socket:
    """The socket that was registered."""
    if not isinstance(key.fileobj, socket.socket):
        raise AssertionError("only sockets are registered")
    return key.fileobj
