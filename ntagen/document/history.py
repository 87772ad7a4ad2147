"""The edits of a model, each of which can be taken back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ntagen.document.content import Change
from ntagen.document.markup import applied
from ntagen.values import dataclass

_MOST_EDITS: Final = 10_000
_MOST_BYTES: Final = 64 << 20


@dataclass(frozen=True, slots=True)
class Edit:
    """What was changed at a time.

    Attributes:
        address: Where a page shows it.
        steps: The changes that take it back, those of each step; the last is taken back first.
    """

    address: str
    steps: tuple[tuple[Change, ...], ...]

    @property
    def bytes(self) -> int:
        """How much of the text it keeps."""
        return sum(len(change.text) + 64 for step in self.steps for change in step)


class History:
    """A text with its edits.

    Attributes:
        text: The text, as UTF-8.
        undone: Edits that were taken back, the next one last.
        done: Edits that were made, the newest last.
    """

    def __init__(self, text: bytes) -> None:
        self.text = text
        self.done: list[Edit] = []
        self.undone: list[Edit] = []

    def make(self, address: str, changes: Sequence[Change], *, join: bool) -> None:
        """Changes the text.

        Args:
            address: Where a page shows it.
            changes: The changes.
            join: Whether it is one edit with the last one, if that has the same address.
        """
        self.text, back = applied(self.text, changes)
        edit = Edit(address, (tuple(back),))
        last = self.done[-1] if self.done else None
        if join and last is not None and last.address == address and not self.undone:
            self.done[-1] = Edit(address, last.steps + edit.steps)
        else:
            self.done.append(edit)
        self.undone.clear()
        self._forget()

    def undo(self) -> str | None:
        """Takes the last edit back; returns its address, or ``None`` if there is none."""
        return self._turned(self.done, self.undone)

    def redo(self) -> str | None:
        """Makes the edit again that was taken back last; returns its address, or ``None``."""
        return self._turned(self.undone, self.done)

    def _turned(self, source: list[Edit], target: list[Edit]) -> str | None:
        if not source:
            return None
        edit = source.pop()
        steps = []
        for step in reversed(edit.steps):
            self.text, back = applied(self.text, step)
            steps.append(tuple(back))
        target.append(Edit(edit.address, tuple(steps)))
        return edit.address

    def _forget(self) -> None:
        """Forgets the oldest edits when there are too many."""
        kept = sum(edit.bytes for edit in self.done)
        while len(self.done) > 1 and (len(self.done) > _MOST_EDITS or kept > _MOST_BYTES):
            kept -= self.done.pop(0).bytes
