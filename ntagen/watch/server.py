"""The server of a run: its page, what is new on it, and its stop.

The driver never waits for it. Who gets in is decided as for `ntagen serve`.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from typing import Final

from ntagen.plot.viewer import page_of
from ntagen.serve.loopback import Listener, Refusal, Request
from ntagen.watch.feed import Feed

_PROGRAM: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

_DIGITS: Final = 12
"""No run has events with longer numbers."""

_OPEN_S: Final = 1.0
"""A page that is open asks more often than this."""

_LAST_S: Final = 2.0
"""A page that is open gets so much time to ask for the end."""


class _Watched:
    """Answers the pages of a run."""

    def __init__(self, feed: Feed, stop: Callable[[], None]) -> None:
        self._feed = feed
        self._stop = stop
        self._asked_s = -_OPEN_S
        self._has_end = threading.Event()

    def route(self, request: Request, method: str, path: list[str], values: dict[str, str]) -> None:
        """Answers a request.

        Raises:
            Refusal: It is not answered.
        """
        match method, path:
            case "GET", []:
                page = page_of(self._feed.picture(), is_live=True)
                request.send(200, "text/html; charset=utf-8", page.text.encode(), _PROGRAM)
            case "GET", ["api", "run"]:
                since = values.get("since", "0")
                if not (since.isascii() and since.isdecimal()) or len(since) > _DIGITS:
                    raise Refusal(400, "since is no number of an event")
                news = self._feed.since(int(since))
                request.json(news)
                self._asked_s = time.monotonic()
                if news["ended"]:
                    self._has_end.set()
            case "POST", ["api", "stop"]:
                self._stop()
                request.json({})
            case _:
                raise Refusal(404, "there is nothing here")

    def wait_for_pages(self) -> None:
        """Lets a page that is open ask for the end of the run."""
        if time.monotonic() - self._asked_s < _OPEN_S:
            self._has_end.wait(_LAST_S)


@contextlib.contextmanager
def watched(feed: Feed, stop: Callable[[], None], port: int = 0) -> Iterator[str]:
    """Shows a run until the end of the block, which open pages still get.

    Args:
        feed: The journal of the run.
        stop: What the stop on the page calls, from another thread.
        port: The port; 0 is any that is free.

    Yields:
        The address of the page, with its token.

    Raises:
        InputError: The port cannot be used.
    """
    own = _Watched(feed, stop)
    listener = Listener(own, port)
    thread = threading.Thread(
        target=listener.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True
    )
    thread.start()
    try:
        yield listener.address
        own.wait_for_pages()
    finally:
        listener.shutdown()
        listener.server_close()
        thread.join()
