"""From the bytes of a model to its text and back, without a loss.

The encodings are those that the engine reads: `checker/src/syntax/encoding.rs`.
"""

from __future__ import annotations

import re
from typing import Final

from ntagen.errors import InputError
from ntagen.values import dataclass

_DECLARED: Final = re.compile(
    rb"""\s*<\?xml[^>]*?encoding\s*=\s*["'](?:iso-?8859-1|latin-?1|windows-1252|cp1252)["']""",
    re.IGNORECASE,
)
_UTF_8: Final = b"\xef\xbb\xbf"
_MARKS: Final = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


@dataclass(frozen=True, slots=True)
class Encoding:
    """How a file is written.

    Attributes:
        name: The name of the encoding, as Python has it.
        mark: The byte order mark at its start; empty without one.
    """

    name: str
    mark: bytes = b""

    def written(self, text: bytes) -> bytes:
        """The bytes of the file of a text.

        Args:
            text: The text as UTF-8.

        Raises:
            InputError: The encoding lacks one of its characters.
        """
        if self.name == "utf-8":
            return self.mark + text
        try:
            return self.mark + text.decode("utf-8").encode(self.name)
        except UnicodeEncodeError as error:
            lacking = error.object[error.start]
            raise InputError(
                f"the file is written as {self.name}, which has no {lacking!r}\n"
                "hint: delete this character, or save the file as UTF-8 elsewhere first"
            ) from None

    def has(self, character: str) -> bool:
        """Whether it has a character."""
        try:
            character.encode(self.name)
        except UnicodeEncodeError:
            return False
        return True


def decoded(data: bytes) -> tuple[Encoding, bytes]:
    """How a file is written, and its text as UTF-8, without a byte order mark.

    Raises:
        InputError: The file is not text that can be written back byte for byte.
    """
    encoding = _encoding_of(data)
    body = data[len(encoding.mark) :]
    try:
        text = body.decode(encoding.name)
        return encoding, text.encode("utf-8")
    except UnicodeError:
        raise InputError(
            f"the file begins like {encoding.name}, but is not {encoding.name}\n"
            "hint: save the file as UTF-8"
        ) from None


def _encoding_of(data: bytes) -> Encoding:
    for mark, name in _MARKS.items():
        if data.startswith(mark):
            return Encoding(name, mark)
    if data[:2] in (b"<\0", b"\0<"):
        return Encoding("utf-16-le" if data[0] else "utf-16-be")
    mark = _UTF_8 if data.startswith(_UTF_8) else b""
    if not mark and _DECLARED.match(data):
        return Encoding("latin-1")
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return Encoding("latin-1", mark)
    return Encoding("utf-8", mark)
