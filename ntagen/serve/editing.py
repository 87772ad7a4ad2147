"""A model that is edited on the page of `ntagen serve`: its edits, its file, and what is wrong.

What is wrong with a model is asked of a process of its own, which may end at any time; the edits
stay.
"""

from __future__ import annotations

import hashlib
import threading
import time
from pathlib import Path
from typing import Any

from ntagen.document.document import Document
from ntagen.document.names import Names
from ntagen.document.outline import WHOLE
from ntagen.document.wishes import fulfil, number_of, text_of
from ntagen.errors import InputError
from ntagen.files import read_file, write_files
from ntagen.serve.jobs import File
from ntagen.serve.loopback import Refusal
from ntagen.serve.processes import Limits
from ntagen.serve.workers import Gone, Worker


class Editing:
    """A model that is edited.

    Attributes:
        number: The id of the file.
        file: The file as it was opened.
        lock: Whoever reads or changes the document holds it.
        asking: Whoever uses the process holds it.
        used: When it was last asked.
    """

    def __init__(self, number: str, file: File, limits: Limits) -> None:
        """Reads a file.

        Raises:
            InputError: It is not text.
        """
        data = file.path.read_bytes()
        self.number = number
        self.file = file
        self.document = Document(data, limits.upload_bytes)
        self.lock = threading.Lock()
        self.asking = threading.Lock()
        self.used = time.monotonic()
        self._limits = limits
        self._on_disk = hashlib.sha256(data).digest()
        self._worker: Worker | None = None
        self._names: Names | None = None

    def told(self, *, with_parts: bool = True) -> dict[str, Any]:
        """What the page shows; the lock is held."""
        found: dict[str, Any] = {"name": self.file.name, "file": self.number}
        found |= {"savable": self.file.origin is not None}
        return found | self.document.told(with_parts=with_parts)

    def change(self, wish: dict[str, Any]) -> dict[str, Any]:
        """Fulfils a wish of the page; see `ntagen.document.wishes`.

        Returns:
            What the page shows then; where only a text is another one, without the parts.

        Raises:
            InputError: It cannot be fulfilled.
            Refusal: The page shows another version.
        """
        with self.lock:
            self._require_version(wish)
            address = fulfil(self.document, wish)
            # The page knows what it has typed into a part.
            is_typed = wish.get("do") == "text" and address != WHOLE
            told = self.told(with_parts=not is_typed)
            return told | {"address": address}

    def ask(self, wish: dict[str, Any]) -> dict[str, Any]:
        """What the engine says of the model: its mistakes, or what a name may be or is.

        Raises:
            InputError: There is no such text.
            Refusal: The process ended without an answer.
        """
        is_completed = wish.get("do") == "complete"
        # Completions do not wait until what was typed last is looked at.
        names = self._names if is_completed else None
        if names is None:
            with self.asking:
                names = self._survey()
        with self.lock:
            if is_completed and names is not None:
                address, at = text_of(wish, "address"), number_of(wish, "at")
                content = self.document.content(address)
                return names.completions(address, "" if content is None else content.text, at)
            if names is None or names.version != self.document.version:
                return {"version": self.document.version, "late": True}
            found = {"version": names.version}
            if wish.get("do") == "mistakes":
                return found | {"mistakes": names.mistakes(whole=wish.get("whole") is True)}
            return found | names.definition(text_of(wish, "address"), number_of(wish, "at"))

    def save(self, wish: dict[str, Any]) -> dict[str, Any]:
        """Writes the file back.

        Raises:
            InputError: The encoding of the file lacks a character.
            Refusal: It was dropped and has no place, cannot be written, or is another one now.
        """
        path = self.file.origin
        if path is None:
            raise Refusal(
                400, "this file was dropped, so its place is not known\nhint: download it"
            )
        with self.lock:
            self._require_version(wish)
            data = self.document.file()
            if wish.get("anyway") is not True:
                self._require_same(path)
            try:
                write_files({path: data})
            except OSError as error:
                why = (error.strerror or str(error)).lower()
                raise Refusal(
                    409,
                    f"cannot write {path}: {why}\nhint: download the model, and save it elsewhere",
                ) from None
            self._on_disk = hashlib.sha256(data).digest()
            self.document.saved()
            return self.told()

    def end(self) -> None:
        """Ends its process; what it was asked is not answered."""
        worker = self._worker
        if worker is not None:
            worker.is_cancelled = True
            worker.end()

    @property
    def has_process(self) -> bool:
        """Whether it has a process, for the next question."""
        return self._worker is not None and self._worker.is_running

    def rest(self) -> None:
        """Ends its process if nothing is asked of it just now."""
        if self.asking.acquire(blocking=False):
            try:
                if self._worker is not None:
                    self._worker.end()
                    self._worker = None
            finally:
                self.asking.release()

    def _require_version(self, wish: dict[str, Any]) -> None:
        if wish.get("version") != self.document.version:
            raise Refusal(
                409,
                "the model was changed in another tab or window\n"
                "hint: copy what you have just typed, and reload this page",
            )

    def _require_same(self, path: Path) -> None:
        """Refuses a file that others have changed since it was read."""
        try:
            data = read_file(path, 2 * self._limits.upload_bytes)
        except (OSError, InputError):
            raise Refusal(
                409,
                f"{path} cannot be read any more: it was moved or deleted\n"
                "hint: download the model, or press Save anyway to write it there",
            ) from None
        if hashlib.sha256(data).digest() != self._on_disk:
            raise Refusal(
                409,
                f"{path} was changed by another program since it was read here\n"
                "hint: download the model and join both, or press Save anyway to replace that file",
            )

    def _survey(self) -> Names | None:
        """What the engine says; `None` if the model has changed meanwhile. `asking` is held."""
        with self.lock:
            version, text = self.document.version, self.document.text.decode("utf-8")
            if self._names is not None and self._names.version == version:
                return self._names
        try:
            if self._worker is None or not self._worker.is_running:
                folder = self.file.path.parent
                self._worker = Worker(["survey", self.file.path.name], folder, self._limits)
            words = self._worker.line({"text": text})
        except Gone as why:
            self._worker = None
            raise Refusal(
                503,
                f"the process that looks for mistakes has ended: {why}\n"
                "hint: all edits are kept; go on, or start the server with greater limits: "
                "ntagen serve --timeout 5min --memory 4GiB",
            ) from None
        with self.lock:
            if self.document.version == version:
                self._names = Names(self.document, words)
        return self._names
