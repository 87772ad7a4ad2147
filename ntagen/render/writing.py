"""What the translated templates need to write a text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")


class Safe(str):
    """A text that is XML already."""

    __slots__ = ()


def shown(value: object) -> str:
    """A value as text."""
    return value if type(value) is str else str(value)


def escaped(value: object) -> str:
    """A value as text in an XML document."""
    if isinstance(value, Safe):
        return value
    text = str(value)
    return text.translate(_ENTITIES) if _SPECIAL.search(text) else text


_SPECIAL = re.compile("""[&<>'"]""")
_ENTITIES = str.maketrans({"&": "&amp;", ">": "&gt;", "<": "&lt;", "'": "&#39;", '"': "&#34;"})


def escaped_text(text: str) -> Safe:
    """The text between two tags; quotes need no escape there."""
    return Safe(text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;"))


def with_last(rows: Iterable[T]) -> Iterator[tuple[bool, T]]:
    """The rows, each with whether it is the last one."""
    known = list(rows)
    for index, row in enumerate(known, start=1):
        yield index == len(known), row
