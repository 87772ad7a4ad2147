"""Reads values of a run from the JSON of its log; checks that all entries and types are right."""

from __future__ import annotations

from typing import TypeVar

Value = TypeVar("Value")


def value_from_json(document: object, kind: type[Value]) -> Value:
    """The value from which `dataclasses.asdict` and JSON made this document.

    Args:
        document: The result of the JSON reader.
        kind: The dataclass of the value.

    Raises:
        ValueError: An entry is missing, is not known, or is of another kind.
        InputError: The value does not obey its own rules.
    """
    # Only replays and resumed runs read values.
    import msgspec

    try:
        value = msgspec.convert(document, kind)
    except (msgspec.ValidationError, RecursionError) as error:
        raise ValueError(str(error)) from error
    # A default in place of a missing entry could change the run.
    if _plain(value) != _plain(document):
        raise ValueError("entries are missing or unknown")
    return value


def _plain(value: object) -> object:
    import msgspec

    return msgspec.json.decode(msgspec.json.encode(value))
