"""Answers requests about one simulation, a line of JSON each, until there are no more."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Any

from ntagen.errors import InputError, NtagenError
from ntagen.simulator.session import Session


def work(begin: Callable[[], Session], requests: Iterable[str], say: Callable[[str], None]) -> None:
    """Answers requests.

    Args:
        begin: Loads the model; called with the first request, so that what is wrong with the model
            is the answer.
        requests: The requests, each an object of JSON.
        say: Gets the answers: objects of JSON with ``ok``, or with ``error``, a message.
    """
    session: Session | None = None
    for line in requests:
        answer: dict[str, Any]
        try:
            session = session or begin()
            answer = {"ok": session.answer(_read(line))}
        except NtagenError as error:
            answer = {"error": str(error)}
        except (IndexError, LookupError, TypeError, ValueError) as error:
            # What the engine or Python says of a request that no page sends.
            answer = {"error": f"this is not possible: {error}"}
        say(json.dumps(answer))


def _read(line: str) -> dict[str, Any]:
    try:
        request = json.loads(line)
    except ValueError:
        request = None
    if not isinstance(request, dict):
        raise InputError("the request is no object of JSON")
    return request
