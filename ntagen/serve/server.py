"""The server of `ntagen serve`: one page, and what it asks for, on the loopback interface.

Every request needs the token of the address, which is compared in constant time, and names this
server in its Host header: so other users of the computer and pages of other sites get nothing, not
even by DNS rebinding. The page loads nothing from elsewhere. The standard library's server is
enough: there is one user, and the work is done by processes of their own.
"""

from __future__ import annotations

import errno
import json
import secrets
import sys
import urllib.parse
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.serve.jobs import ENDINGS, File, Limits, Refusal, Workshop

HOST: Final = "127.0.0.1"
_TOKEN: Final = "X-Ntagen-Token"
_WISH_BYTES: Final = 1 << 18
_DISCARDED_BYTES: Final = 4 << 30
_TYPES: Final = {".svg": "image/svg+xml", ".html": "text/html; charset=utf-8"}
_STYLED: Final = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'self'"
_PAGE: Final = (
    "default-src 'none'; style-src 'nonce-{0}'; script-src 'nonce-{0}'; connect-src 'self'; "
    "frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


class Server:
    """A server that listens; `serve` answers until `close` is called, from another thread.

    Attributes:
        address: Its address with the token, for a browser.
        token: The token.
        port: The port.
    """

    def __init__(self, limits: Limits, port: int = 0) -> None:
        """Begins to listen.

        Args:
            limits: What is allowed.
            port: The port; 0 is any that is free.

        Raises:
            InputError: The port cannot be used.
        """
        self.token = secrets.token_urlsafe(24)
        self.shop = Workshop(limits)
        self._first: list[str] = []
        try:
            self._http = _Listener((HOST, port), _Handler)
        except OSError as error:
            self.shop.close()
            raise InputError(_why_not(port, error)) from None
        self._http.own = self
        self.port: int = self._http.server_address[1]
        self.hosts = {f"{HOST}:{self.port}", f"localhost:{self.port}"}
        self.address = f"http://{HOST}:{self.port}/?token={self.token}"

    def open(self, name: str, data: bytes) -> None:
        """Adds a file that the page shows when it is opened.

        Raises:
            InputError: It cannot be shown.
        """
        if len(data) > self.shop.limits.upload_bytes:
            raise InputError(_too_large(self.shop.limits))
        try:
            self._first.append(self.shop.add(name, data))
        except Refusal as refusal:
            raise InputError(refusal.message) from None

    @property
    def first(self) -> list[dict[str, str]]:
        """The files that the page shows when it is opened."""
        return [told(number, self.shop.file(number)) for number in self._first]

    def serve(self) -> None:
        """Answers requests."""
        self._http.serve_forever(poll_interval=0.2)

    def close(self) -> None:
        """Ends all workers, and frees the port."""
        self._http.shutdown()
        self.end()

    def end(self) -> None:
        """The same once `serve` has ended."""
        self._http.server_close()
        self.shop.close()


def told(number: str, file: File) -> dict[str, str]:
    """What the page knows of a file."""
    return {"file": number, "name": file.name, "kind": file.kind}


def _why_not(port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"port {port} is in use\nhint: choose another one with --port, or leave it out"
    if error.errno == errno.EACCES:
        return f"port {port} needs more rights\nhint: choose one from 1024 on, or leave it out"
    return f"cannot listen on port {port}: {(error.strerror or str(error)).lower()}"


def _too_large(limits: Limits) -> str:
    most = limits.upload_bytes / (1 << 20)
    return (
        f"the file is larger than {most:g} MiB\n"
        "hint: start the server with a greater limit: ntagen serve --upload 100MiB"
    )


class _Listener(ThreadingHTTPServer):
    daemon_threads = True
    own: Server

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Says nothing of a browser that goes away; other errors are those of ntagen."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers one request."""

    protocol_version = "HTTP/1.1"
    server_version = "ntagen"
    sys_version = ""
    timeout = 30.0
    server: _Listener

    def do_GET(self) -> None:
        """Answers a request; HEAD as GET, without the content."""
        method = "GET" if self.command == "HEAD" else self.command
        url = urllib.parse.urlsplit(self.path)
        values = dict(urllib.parse.parse_qsl(url.query))
        try:
            self._admit(values)
            self._route(method, [part for part in url.path.split("/") if part], values)
        except Refusal as refusal:
            # What the browser still sends is not read, so the connection cannot be used again.
            self.close_connection = True
            if method == "GET" and not url.path.startswith("/api/"):
                self._send(refusal.status, "text/plain; charset=utf-8", refusal.message.encode())
            else:
                self._json({"error": refusal.message}, refusal.status)

    do_HEAD = do_POST = do_DELETE = do_GET  # noqa: N815  the names of the standard library

    def log_message(self, format: str, *args: object) -> None:
        """Says nothing: the address has the token."""

    def _admit(self, values: dict[str, str]) -> None:
        """Refuses who is not the user, or was sent by another site."""
        own = self.server.own
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
                "the token is missing or wrong\n"
                "hint: open the address that ntagen serve has printed",
            )

    def _route(self, method: str, path: list[str], values: dict[str, str]) -> None:
        shop = self.server.own.shop
        match method, path:
            case "GET", []:
                self._page()
            case "GET", ["api", "files"]:
                self._json({"files": self.server.own.first})
            case "POST", ["api", "files"]:
                number = shop.add(values.get("name", ""), self._body(shop.limits.upload_bytes))
                self._json(told(number, shop.file(number)), 201)
            case "POST", ["api", "files", number, "jobs"]:
                self._json({"job": shop.start(number, self._wish())}, 201)
            case "GET", ["api", "jobs", identity]:
                self._json(shop.job(identity).report())
            case "DELETE", ["api", "jobs", identity]:
                shop.job(identity).cancel()
                self._json(shop.job(identity).report())
            case "GET", ["api", "jobs", identity, "picture"]:
                self._picture(identity, is_file="file" in values)
            case _:
                raise Refusal(404, "there is nothing here")

    def _page(self) -> None:
        nonce = secrets.token_urlsafe(16)
        text = resources.files("ntagen.serve").joinpath("page.html").read_text("utf-8")
        text = text.replace("NONCE", nonce).replace("ENDINGS", ", ".join(ENDINGS))
        self._send(200, "text/html; charset=utf-8", text.encode(), _PAGE.format(nonce))

    def _picture(self, identity: str, *, is_file: bool) -> None:
        path = self.server.own.shop.job(identity).picture()
        if path is None:
            raise Refusal(404, "there is no picture")
        data, kind = path.read_bytes(), _TYPES[path.suffix]
        if is_file:
            self._send(200, kind, data)
        elif path.suffix == ".html":
            # The page of a scene is a program of its own; its frame keeps it apart from this page.
            self._send(200, kind, data, f"{_STYLED}; script-src 'unsafe-inline'")
        else:
            # On a page of its own, a browser would make a large picture too small to read.
            around = b"<!DOCTYPE html><meta charset=utf-8><title>picture</title>"
            self._send(200, _TYPES[".html"], around + data)

    def _body(self, most: int) -> bytes:
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal():
            raise Refusal(411, "the request does not say how long it is")
        if int(length) > most:
            # A browser listens only when it has sent the whole file.
            left = min(int(length), _DISCARDED_BYTES)
            while left > 0 and (piece := self.rfile.read(min(left, 1 << 20))):
                left -= len(piece)
            raise Refusal(413, _too_large(self.server.own.shop.limits))
        data = self.rfile.read(int(length))
        if len(data) < int(length):
            raise Refusal(400, "the file ended early\nhint: drop it again")
        return data

    def _wish(self) -> dict[str, Any]:
        try:
            wish = json.loads(self._body(_WISH_BYTES))
        except ValueError:
            wish = None
        if not isinstance(wish, dict):
            raise Refusal(400, "the request is no object of JSON")
        return wish

    def _json(self, value: object, status: int = 200) -> None:
        self._send(status, "application/json", json.dumps(value).encode())

    def _send(self, status: int, kind: str, data: bytes, policy: str = _STYLED) -> None:
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
