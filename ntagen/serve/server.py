"""The server of `ntagen serve`: one page, and what it asks for, on the loopback interface.

The page loads nothing from elsewhere, and the work is done by processes of their own.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.serve.edits import Edits
from ntagen.serve.jobs import File, Workshop
from ntagen.serve.loopback import Listener, Refusal, Request
from ntagen.serve.pages import send_editor, send_page, send_part, send_picture, send_simulator
from ntagen.serve.processes import Limits
from ntagen.serve.simulations import Simulations

_WISH_BYTES: Final = 1 << 18
_DISCARDED_BYTES: Final = 4 << 30


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
        self._http = Listener(self, port)
        self.token, self.address = self._http.token, self._http.address
        self.port: int = self._http.server_port
        self.shop = Workshop(limits)
        self.simulations = Simulations(limits)
        self.edits = Edits(limits)
        self._first: list[str] = []

    def open(self, name: str, data: bytes, origin: Path | None = None) -> None:
        """Adds a file that the page shows when it is opened.

        Args:
            name: Its name.
            data: Its contents.
            origin: Where the page may save it when it was edited; ``None`` is nowhere.

        Raises:
            InputError: It cannot be shown.
        """
        if len(data) > self.shop.limits.upload_bytes:
            raise InputError(_too_large(self.shop.limits))
        try:
            self._first.append(self.shop.add(name, data, origin))
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
        self.simulations.close()
        self.edits.close()
        self.shop.close()

    def route(self, request: Request, method: str, path: list[str], values: dict[str, str]) -> None:
        """Answers a request.

        Raises:
            Refusal: It is not answered.
        """
        shop = self.shop
        match method, path:
            case "GET", []:
                send_page(request)
            case "GET", ["api", "files"]:
                request.json({"files": self.first})
            case "POST", ["api", "files"]:
                number = shop.add(
                    values.get("name", ""), _body(request, shop.limits, shop.limits.upload_bytes)
                )
                request.json(told(number, shop.file(number)), 201)
            case "GET", ["api", "files", number]:
                request.json(told(number, shop.file(number)))
            case "POST", ["api", "files", number, "jobs"]:
                request.json({"job": shop.start(number, _wish(request, shop.limits))}, 201)
            case "GET", ["api", "jobs", identity]:
                request.json(shop.job(identity).report())
            case "DELETE", ["api", "jobs", identity]:
                shop.job(identity).cancel()
                request.json(shop.job(identity).report())
            case "GET", ["api", "jobs", identity, "picture"]:
                send_picture(request, shop.job(identity), is_file="file" in values)
            case _:
                self._route_simulations(request, method, path)

    def _route_simulations(self, request: Request, method: str, path: list[str]) -> None:
        """Answers a request of the page of simulations."""
        simulations, limits = self.simulations, self.shop.limits
        match method, path:
            case "GET", ["simulator"]:
                send_simulator(request, self.token)
            case "GET", ["simulator", name]:
                send_part(request, "simulator", name)
            case "POST", ["api", "files", number, "simulations"]:
                file = self.shop.file(number)
                request.json({"simulation": simulations.add(number, file)}, 201)
            case "POST", ["api", "simulations", identity]:
                wish = _wish(request, limits, limits.upload_bytes)
                request.json(simulations.ask(identity, wish))
            case "GET", ["api", "simulations", identity]:
                found = simulations.get(identity)
                request.json(told(found.number, found.file))
            case "DELETE", ["api", "simulations", identity]:
                simulations.get(identity).end()
                request.json({})
            case _:
                self._route_edits(request, method, path)

    def _route_edits(self, request: Request, method: str, path: list[str]) -> None:
        """Answers a request of the page that edits models."""
        edits, shop = self.edits, self.shop
        match method, path:
            case "GET", ["editor"]:
                send_editor(request, self.token)
            case "GET", ["editor", name]:
                send_part(request, "editor", name)
            case "POST", ["api", "files", number, "edits"]:
                request.json({"edit": edits.add(number, shop.file(number))}, 201)
            case "POST", ["api", "edits", identity]:
                wish = _wish(request, shop.limits, 2 * shop.limits.upload_bytes)
                request.json(edits.ask(identity, wish))
            case "POST", ["api", "edits", identity, "files"]:
                number = shop.add(edits.get(identity).file.name, edits.data(identity))
                request.json(told(number, shop.file(number)), 201)
            case "GET", ["api", "edits", identity, "text"]:
                request.send(200, "application/octet-stream", edits.text(identity))
            case "GET", ["api", "edits", identity, "file"]:
                request.send(200, "application/octet-stream", edits.data(identity))
            case "DELETE", ["api", "edits", identity]:
                edits.get(identity).end()
                request.json({})
            case _:
                raise Refusal(_status(method), "there is nothing here")


def _status(method: str) -> int:
    """The status for what is not there; methods without any use are not allowed."""
    return 404 if method in ("GET", "POST", "DELETE") else 405


def told(number: str, file: File) -> dict[str, str]:
    """What the page knows of a file."""
    return {"file": number, "name": file.name, "kind": file.kind}


def _body(request: Request, limits: Limits, most: int) -> bytes:
    length = request.headers.get("Content-Length", "")
    if not length.isdecimal():
        raise Refusal(411, "the request does not say how long it is")
    if int(length) > most:
        # A browser listens only when it has sent the whole file.
        left = min(int(length), _DISCARDED_BYTES)
        while left > 0 and (piece := request.rfile.read(min(left, 1 << 20))):
            left -= len(piece)
        raise Refusal(413, _too_large(limits))
    data = request.rfile.read(int(length))
    if len(data) < int(length):
        raise Refusal(400, "the file ended early\nhint: drop it again")
    return data


def _wish(request: Request, limits: Limits, most: int = _WISH_BYTES) -> dict[str, Any]:
    try:
        wish = json.loads(_body(request, limits, most))
    except (ValueError, RecursionError):
        wish = None
    if not isinstance(wish, dict):
        raise Refusal(400, "the request is no object of JSON")
    return wish


def _too_large(limits: Limits) -> str:
    most = limits.upload_bytes / (1 << 20)
    return (
        f"the file is larger than {most:g} MiB\n"
        "hint: start the server with a greater limit: ntagen serve --upload 100MiB"
    )
