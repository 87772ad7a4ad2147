"""A server on the loopback interface, for one user: who gets in, and how answers are sent.

Every request needs the token of the address, which is compared in constant time, and names this
server in its Host header: so other users of the computer and pages of other sites get nothing, not
even by DNS rebinding. The standard library's server is enough: there is one user.
"""

from __future__ import annotations

import errno
import json
import secrets
import sys
import urllib.parse
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Final, Protocol

from ntagen.errors import InputError

HOST: Final = "127.0.0.1"
STYLED: Final = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'self'"
"""The content security policy of answers that are no pages with programs."""

_TOKEN: Final = "X-Ntagen-Token"


class Refusal(Exception):  # noqa: N818  it is an answer, not an error of the server
    """A request that is refused.

    Attributes:
        status: The status of HTTP.
        message: What is wrong, and the way out.
    """

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status
        self.message = message


class Server(Protocol):
    """What answers requests that got in."""

    def route(self, request: Request, method: str, path: list[str], values: dict[str, str]) -> None:
        """Answers a request.

        Args:
            request: The request, with which the answer is sent.
            method: The method of HTTP; HEAD is GET.
            path: The parts of the path.
            values: The values in the query of the address.

        Raises:
            Refusal: It is not answered.
        """


class Listener(ThreadingHTTPServer):
    """Listens at a port.

    Attributes:
        own: What answers.
        token: What requests must have.
        hosts: The names of the server.
        address: Its address with the token, for a browser.
    """

    daemon_threads = True
    request_queue_size = 128
    """Fifty tabs that ask at once, each by some connections, are not refused."""

    def __init__(self, own: Server, port: int) -> None:
        """Begins to listen.

        Args:
            own: What answers.
            port: The port; 0 is any that is free.

        Raises:
            InputError: The port cannot be used.
        """
        try:
            super().__init__((HOST, port), Request)
        except OSError as error:
            raise InputError(_why_not(port, error)) from None
        self.own = own
        self.token = secrets.token_urlsafe(24)
        self.hosts = {f"{HOST}:{self.server_port}", f"localhost:{self.server_port}"}
        self.address = f"http://{HOST}:{self.server_port}/?token={self.token}"

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Says nothing of a browser that goes away; other errors are those of ntagen."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


def _why_not(port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"port {port} is in use\nhint: choose another one with --port, or leave it out"
    if error.errno == errno.EACCES:
        return f"port {port} needs more rights\nhint: choose one from 1024 on, or leave it out"
    return f"cannot listen on port {port}: {(error.strerror or str(error)).lower()}"


class Request(BaseHTTPRequestHandler):
    """One request and its answer."""

    protocol_version = "HTTP/1.1"
    server_version = "ntagen"
    sys_version = ""
    timeout = 30.0
    server: Listener

    def do_GET(self) -> None:
        """Answers a request; HEAD as GET, without the content."""
        method = "GET" if self.command == "HEAD" else self.command
        url = urllib.parse.urlsplit(self.path)
        values = dict(urllib.parse.parse_qsl(url.query))
        try:
            self._admit(values)
            path = [part for part in url.path.split("/") if part]
            self.server.own.route(self, method, path, values)
        except Refusal as refusal:
            # What the browser still sends is not read, so the connection cannot be used again.
            self.close_connection = True
            if method == "GET" and not url.path.startswith("/api/"):
                self.send(refusal.status, "text/plain; charset=utf-8", refusal.message.encode())
            else:
                self.json({"error": refusal.message}, refusal.status)

    # Methods that nobody needs are refused in words, like all else, and only to the user.
    do_HEAD = do_POST = do_DELETE = do_GET  # noqa: N815  the names of the standard library
    do_OPTIONS = do_PUT = do_PATCH = do_TRACE = do_GET  # noqa: N815

    def log_message(self, format: str, *args: object) -> None:
        """Says nothing: the address has the token."""

    def _admit(self, values: dict[str, str]) -> None:
        """Refuses who is not the user, or was sent by another site."""
        own = self.server
        if self.headers.get("Host") not in own.hosts:
            raise Refusal(421, "this server is asked for by another name\nhint: use its address")
        origin = self.headers.get("Origin")
        # A picture is a page without an origin of its own; it asks for nothing.
        if origin is not None and origin not in {f"http://{host}" for host in own.hosts}:
            raise Refusal(403, "another site asks\nhint: open the address of the server itself")
        given = self.headers.get(_TOKEN) or values.get("token", "")
        if not secrets.compare_digest(given.encode("utf-8", "replace"), own.token.encode()):
            raise Refusal(
                403,
                "the token is missing or wrong\nhint: open the address that was printed",
            )

    def json(self, value: object, status: int = 200) -> None:
        """Sends a value as JSON."""
        self.send(status, "application/json", json.dumps(value).encode())

    def send(self, status: int, kind: str, data: bytes, policy: str = STYLED) -> None:
        """Sends content of a kind, under a content security policy."""
        self.send_response(status)
        for name, value in (
            ("Content-Type", kind),
            ("Content-Length", str(len(data))),
            ("Content-Security-Policy", policy),
            ("Cache-Control", "no-store"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
        ):
            self.send_header(name, value)
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)
