"""The models that are edited on the page of `ntagen serve`.

The edits are kept here, so a reload of the page loses nothing.
"""

from __future__ import annotations

import secrets
import threading
import time
from typing import Any, Final

from ntagen.document.wishes import number_of
from ntagen.errors import InputError
from ntagen.serve.editing import Editing
from ntagen.serve.jobs import File
from ntagen.serve.loopback import Refusal
from ntagen.serve.processes import Limits

_RECORDS: Final = 50
"""So many models are edited at a time; those that were not used for the longest time go first."""


class Edits:
    """The models that are edited on a server."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._all: dict[str, Editing] = {}
        self._lock = threading.Lock()

    def close(self) -> None:
        """Ends all processes."""
        with self._lock:
            for one in self._all.values():
                one.end()

    def unsaved(self) -> list[str]:
        """The names of the files with changes that were not written to them."""
        with self._lock:
            return [one.file.name for one in self._all.values() if one.document.is_changed]

    def add(self, number: str, file: File) -> str:
        """Begins to edit a model, or goes on; returns its id.

        Raises:
            Refusal: The file is no model.
        """
        if file.kind != "model":
            raise Refusal(400, f"{file.name} is no model of UPPAAL, and only those are edited")
        with self._lock:
            for identity, one in self._all.items():
                if one.number == number:
                    return identity
            try:
                made = Editing(number, file, self._limits)
            except InputError as error:
                raise Refusal(400, str(error)) from None
            for old in sorted(self._all, key=lambda one: self._all[one].used)[: -_RECORDS + 1]:
                self._all.pop(old).end()
            identity = secrets.token_hex(8)
            self._all[identity] = made
        return identity

    def get(self, identity: str) -> Editing:
        """A model that is edited, by its id.

        Raises:
            Refusal: There is none.
        """
        found = self._all.get(identity)
        if found is None:
            raise Refusal(
                404, "this model is not edited any more\nhint: open it, and press Edit again"
            )
        found.used = time.monotonic()
        return found

    def text(self, identity: str) -> bytes:
        """The whole text of a model as it is now, as UTF-8.

        Raises:
            Refusal: There is no such model.
        """
        one = self.get(identity)
        with one.lock:
            return one.document.text

    def data(self, identity: str) -> bytes:
        """The bytes of a model as it is now.

        Raises:
            Refusal: There is no such model, or the encoding of its file lacks a character.
        """
        one = self.get(identity)
        try:
            with one.lock:
                return one.document.file()
        except InputError as error:
            raise Refusal(400, str(error)) from None

    def ask(self, identity: str, wish: dict[str, Any]) -> dict[str, Any]:
        """What a request of the page is answered.

        Raises:
            Refusal: There is no such model, or the request is refused.
        """
        one = self.get(identity)
        try:
            match wish.get("do"):
                case "open":
                    with one.lock:
                        return one.told()
                case "picture":
                    with one.lock:
                        return {"svg": one.document.picture(number_of(wish, "template"))}
                case "save":
                    return one.save(wish)
                case "mistakes" | "complete" | "define":
                    self._make_room(one)
                    return one.ask(wish)
                case _:
                    return one.change(wish)
        except InputError as error:
            raise Refusal(400, str(error)) from None

    def _make_room(self, one: Editing) -> None:
        """Ends the processes that were not used for the longest time, if there are many."""
        with self._lock:
            others = [other for other in self._all.values() if other is not one]
        others = sorted((other for other in others if other.has_process), key=lambda one: one.used)
        for other in others[: max(0, len(others) + 1 - self._limits.simulations)]:
            other.rest()
