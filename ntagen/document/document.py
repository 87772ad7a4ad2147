"""A model that is edited: its file, what was changed, and what it looks like.

All that was not changed is byte for byte as it was: layout, comments, unknown elements, the order
and the quotes of attributes, line ends, the byte order mark and the encoding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ntagen.checker.picture.svg import drawn_in_parts
from ntagen.document.content import (
    Change,
    Content,
    Form,
    content_of,
    require_characters,
    whole_content,
)
from ntagen.document.drawing import placed_diagram
from ntagen.document.encoding import decoded
from ntagen.document.history import History
from ntagen.document.markup import applied
from ntagen.document.outline import WHOLE, Outline
from ntagen.document.texts import text_rewritten, text_set
from ntagen.errors import InputError
from ntagen.files import MODEL_BYTES


class Document:
    """A model that is edited.

    Attributes:
        version: Counts all changes of the text.
        problem: Why its parts cannot be edited; empty if they can.
    """

    def __init__(self, data: bytes, most_bytes: int = MODEL_BYTES) -> None:
        """Reads the bytes of a file, whose text may grow to so many bytes.

        Raises:
            InputError: They are not text.
        """
        self._encoding, text = decoded(data)
        self._history = History(text)
        self._saved = text
        self._most_bytes = most_bytes
        self._is_xml = text.lstrip().startswith(b"<")
        line_end = "\r\n" if text.count(b"\r\n") * 2 > text.count(b"\n") else "\n"
        self._form = Form(line_end, self._encoding.has, is_xml=self._is_xml)
        self._plain = Form(line_end, self._encoding.has, is_xml=False)
        self.version = 0
        self.problem = ""
        self._outline: Outline | None = None
        self._read()

    @property
    def text(self) -> bytes:
        """Its text as UTF-8, without a byte order mark."""
        return self._history.text

    @property
    def is_changed(self) -> bool:
        """Whether it differs from what was saved."""
        return self.text != self._saved

    def file(self) -> bytes:
        """The bytes of its file.

        Raises:
            InputError: The encoding of the file lacks a character.
        """
        return self._encoding.written(self.text)

    def saved(self) -> None:
        """Its text is now that of the file."""
        self._saved = self.text

    @property
    def has_parts(self) -> bool:
        """Whether it has parts that can be edited; XTA is one text."""
        return self._outline is not None

    @property
    def outline(self) -> Outline:
        """Its parts.

        Raises:
            InputError: The file has none that can be edited.
        """
        if self._outline is None:
            why = self.problem or "a model that is no XML is one text"
            raise InputError(f"{why}\nhint: edit the whole text")
        return self._outline

    def told(self, *, with_parts: bool = True) -> dict[str, Any]:
        """What a page shows of it; ``parts`` only if it has some, and they are asked for."""
        found: dict[str, Any] = {
            "version": self.version,
            "undo": len(self._history.done),
            "redo": len(self._history.undone),
            "changed": self.is_changed,
            "problem": self.problem,
            "xml": self._is_xml,
        }
        if with_parts and self._outline is not None:
            found["parts"] = self._outline.told()
        return found

    def content(self, address: str) -> Content | None:
        """A text of the model; ``None`` if the file does not have it yet.

        Raises:
            InputError: There can be no such text.
        """
        if address == WHOLE:
            return whole_content(self.text)
        element = self.outline.text_element(address)
        return None if element is None else content_of(self.text, element)

    def set_text(self, address: str, text: str, *, join: bool = False) -> None:
        """Replaces a text, or adds it if the file does not have it.

        Args:
            address: Its address; see `ntagen.document.outline`.
            text: The new text; its lines end in line feeds.
            join: Whether this is one edit with the last one of this text.

        Raises:
            InputError: There can be no such text, or it has a character that no file can hold.
        """
        text = text.replace("\r\n", "\n").replace("\r", "\n")
        require_characters(text)
        if address == WHOLE:
            self._require_encoded(text)
            change = whole_content(self.text).replaced(text, self._plain)
            self._make(address, [] if change is None else [change], join=join)
            return
        # The least change may stand in CDATA or beside `]]`, and mean something else there.
        for changed in (text_set, text_rewritten):
            changes = changed(self.outline, address, text)
            after, _ = self._outline_of(applied(self.text, changes)[0])
            if after is not None and _text_at(after, address) == text:
                self._make(address, changes, join=join, outline=after)
                return
        raise InputError("this text cannot be written there\nhint: edit the whole text")

    def edit(
        self, address: str, changed: Callable[[Outline], Sequence[Change]], *, join: bool = False
    ) -> None:
        """Changes the parts of the model.

        Args:
            address: Where a page shows the change.
            changed: Gives the changes.
            join: Whether this is one edit with the last one of this address.

        Raises:
            InputError: The model has no parts, or `changed` refuses.
        """
        self._make(address, changed(self.outline), join=join)

    def undo(self) -> str | None:
        """Takes the last edit back; returns its address, or ``None`` if there is none."""
        return self._turned(self._history.undo())

    def redo(self) -> str | None:
        """Makes an edit again that was taken back; returns its address, or ``None``."""
        return self._turned(self._history.redo())

    def picture(self, number: int) -> str:
        """The picture of a template, by its number, as `drawn_in_parts` gives it.

        Raises:
            InputError: There is no such template.
        """
        template = self.outline.template(f"templates/{number}")
        return drawn_in_parts(placed_diagram(template, self.text))

    def _turned(self, address: str | None) -> str | None:
        if address is not None:
            self._read()
        return address

    def _make(
        self,
        address: str,
        changes: Sequence[Change],
        *,
        join: bool,
        outline: Outline | None = None,
    ) -> None:
        """Makes changes, after which the parts are those of `outline` if it is given."""
        if changes:
            grown = sum(len(one.text) - (one.end - one.start) for one in changes)
            if grown > 0 and len(self.text) + grown > self._most_bytes:
                raise InputError(
                    f"the model becomes larger than {self._most_bytes / (1 << 20):g} MiB\n"
                    "hint: start the server with a greater limit: ntagen serve --upload 100MiB"
                )
            self._history.make(address, changes, join=join)
            self._outline = outline or self._outline
            self._read()

    def _read(self) -> None:
        self.version += 1
        self._outline, self.problem = self._outline_of(self.text)

    def _outline_of(self, text: bytes) -> tuple[Outline | None, str]:
        """The parts of a text, or why it has none."""
        if not self._is_xml:
            return None, ""
        if self._outline is not None and self._outline.data == text:
            return self._outline, ""
        try:
            return Outline(text, self._form), ""
        except InputError as error:
            return None, str(error)

    def _require_encoded(self, text: str) -> None:
        for one in set(text):
            if not self._encoding.has(one):
                self._encoding.written(one.encode("utf-8"))


def _text_at(outline: Outline, address: str) -> str:
    """A text; empty if the file does not have it."""
    element = outline.text_element(address)
    return "" if element is None else content_of(outline.data, element).text
