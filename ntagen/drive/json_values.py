"""Values of a run from the JSON of its log: each entry is there, and of the kind that is wanted."""

from __future__ import annotations

from typing import TypeVar

import msgspec

Value = TypeVar("Value")


def value_from_json(document: object, kind: type[Value]) -> Value:
    """The value that `dataclasses.asdict` and JSON made this document of.

    Args:
        document: What the JSON reader gives.
        kind: The dataclass of the value.

    Raises:
        ValueError: An entry is missing, is not known, or is of another kind.
        InputError: The value does not obey its own rules.
    """
    try:
        value = msgspec.convert(document, kind)
    except (msgspec.ValidationError, RecursionError) as error:
        raise ValueError(str(error)) from error
    # A default in place of a missing entry would be another run.
    if _plain(value) != _plain(document):
        raise ValueError("entries are missing or not known")
    return value


def _plain(value: object) -> object:
    return msgspec.json.decode(msgspec.json.encode(value))
