"""What the server of `ntagen serve` sends: its pages with their programs, and pictures."""

from __future__ import annotations

import secrets
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from typing import Final

from ntagen.serve.jobs import ENDINGS, Job
from ntagen.serve.loopback import STYLED, Refusal, Request

_TYPES: Final = {
    ".svg": "image/svg+xml",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
}
_PAGE: Final = (
    "default-src 'none'; style-src 'nonce-{0}'; script-src 'nonce-{0}'; connect-src 'self'; "
    "frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_SHARED: Final = ("dom.js",)
"""Programs of the simulator that the other page uses, too."""

_NOTHING: Final = "default-src 'none'; frame-ancestors 'none'"


def send_page(request: Request) -> None:
    """Sends the page of queries."""
    _send(request, resources.files("ntagen.serve") / "page.html", {"ENDINGS": ", ".join(ENDINGS)})


def send_simulator(request: Request, token: str) -> None:
    """Sends the page of simulations."""
    _send_modules(request, "simulator", token)


def send_editor(request: Request, token: str) -> None:
    """Sends the page on which models are edited."""
    _send_modules(request, "editor", token)


def _send_modules(request: Request, folder: str, token: str) -> None:
    """Sends the page of a folder.

    Each of its programs is asked for with the token, so the page maps their names to addresses.
    """
    where = dict.fromkeys(_SHARED, "simulator") | dict.fromkeys(parts(folder), folder)
    names = [name for name in where if name.endswith(".js")]
    imports = ",\n".join(f'"{name}": "/{where[name]}/{name}?token={token}"' for name in names)
    words = {"IMPORTS": imports, "TOKEN": token}
    _send(request, resources.files("ntagen.serve") / folder / "page.html", words)


def send_part(request: Request, folder: str, name: str) -> None:
    """Sends a program or the style of the page of a folder.

    Raises:
        Refusal: There is none by this name.
    """
    part = parts(folder).get(name)
    if part is None:
        raise Refusal(404, "there is nothing here")
    request.send(200, _TYPES[f".{name.rpartition('.')[2]}"], part.read_bytes(), _NOTHING)


@cache
def parts(folder: str) -> dict[str, Traversable]:
    """The programs and the style of the page of a folder, by name."""
    inside = resources.files("ntagen.serve") / folder
    found = sorted(inside.iterdir(), key=lambda one: one.name)
    return {one.name: one for one in found if one.name.endswith((".js", ".css"))}


def _send(request: Request, page: Traversable, words: dict[str, str]) -> None:
    nonce = secrets.token_urlsafe(16)
    text = page.read_text("utf-8")
    for word, value in (words | {"NONCE": nonce}).items():
        text = text.replace(word, value)
    request.send(200, _TYPES[".html"], text.encode(), _PAGE.format(nonce))


def send_picture(request: Request, job: Job, *, is_file: bool) -> None:
    """Sends the picture of a job; as a file to be saved, or as a page.

    Raises:
        Refusal: There is none.
    """
    path = job.picture()
    if path is None:
        raise Refusal(404, "there is no picture")
    data, kind = path.read_bytes(), _TYPES[path.suffix]
    if is_file:
        request.send(200, kind, data)
    elif path.suffix == ".html":
        # The page of a scene is a program of its own; its frame keeps it apart from this page.
        request.send(200, kind, data, f"{STYLED}; script-src 'unsafe-inline'")
    else:
        # On a page of its own, a browser would make a large picture too small to read.
        around = b"<!DOCTYPE html><meta charset=utf-8><title>picture</title>"
        request.send(200, _TYPES[".html"], around + data)
