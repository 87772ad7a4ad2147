"""The message types of the log: one protobuf type for each kind of record, built at run time.

A record is a flat dataclass, and its message type follows from its annotations: a number becomes a
``double`` or ``int64``, a text a ``string``, a vector a repeated ``double``. Field 1 is the
record's sequence number; the others are numbered in the order of the dataclass, base class first.
So no compiler is needed, and the log contains the descriptors itself.

Compatibility: new fields are added at the end of a record; a field is never removed and never
changes its type.
"""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any, Final, get_args, get_type_hints

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import Message

from ntagen.drive import records
from ntagen.drive.records import Record

PACKAGE: Final = "ntagen"
_FILE: Final = "ntagen/records.proto"
SEQUENCE: Final = "sequence"
"""The field with a record's position in the run, from 0: it gives the order if times are equal."""

KINDS: Final[tuple[type[Record], ...]] = tuple(
    one
    for one in vars(records).values()
    if isinstance(one, type) and issubclass(one, Record) and one is not Record
)
"""All kinds of records, in the order of the file of descriptors, which is that of their module."""

_FIELDS: Final = {kind: tuple(f.name for f in dataclasses.fields(kind)) for kind in KINDS}
_SOMETIMES: Final = frozenset({"heading", "bevel"})
"""These directions are empty if they were not measured."""

_LARGEST: Final = 1e12
"""No time, length, angle or force of a run is larger, in units of the log."""

_FIELD: Final = descriptor_pb2.FieldDescriptorProto
_SCALARS: Final = {
    float: _FIELD.TYPE_DOUBLE,
    int: _FIELD.TYPE_INT64,
    str: _FIELD.TYPE_STRING,
    bool: _FIELD.TYPE_BOOL,
}


def _lengths(kind: type[Record]) -> dict[str, frozenset[int] | None]:
    """By field, how many numbers it may have; None for a number, a text, and any length."""
    found: dict[str, frozenset[int] | None] = {}
    for name, hint in get_type_hints(kind).items():
        if name not in _FIELDS[kind]:
            continue
        arguments = get_args(hint)
        if arguments and Ellipsis not in arguments:
            found[name] = frozenset({len(arguments)})
        else:
            found[name] = frozenset({0, 3}) if arguments and name in _SOMETIMES else None
    return found


_LENGTHS: Final = {kind: _lengths(kind) for kind in KINDS}


def message_class(kind: type[Record]) -> type[Message]:
    """The protobuf class for a kind of record."""
    return _classes()[f"{PACKAGE}.{kind.__name__}"]


def encode(record: Record, sequence: int) -> bytes:
    """The message of a record."""
    kind = type(record)
    values = {name: getattr(record, name) for name in _FIELDS[kind]}
    message: Any = message_class(kind)(**{SEQUENCE: sequence}, **values)
    encoded: bytes = message.SerializeToString()
    return encoded


def decode(name: str, data: bytes) -> tuple[int, Record]:
    """A record and its sequence number from a message.

    Args:
        name: The full name of the message type.
        data: The message.

    Raises:
        KeyError: No kind of record has this name.
        google.protobuf.message.DecodeError: The data is not a message of this type.
        ValueError: A number is none or much too large, or a vector has another length.
    """
    kind = {f"{PACKAGE}.{kind.__name__}": kind for kind in KINDS}[name]
    message: Any = message_class(kind)()
    message.ParseFromString(data)
    values: dict[str, Any] = {}
    for field, lengths in _LENGTHS[kind].items():
        value = getattr(message, field)
        is_vector = not isinstance(value, float | int | str)
        values[field] = tuple(value) if is_vector else value
        numbers = values[field] if is_vector else (value,)
        if not all(abs(one) <= _LARGEST for one in numbers if isinstance(one, float)):
            raise ValueError(f"{field} has a number that cannot be right")
        if lengths is not None and len(numbers) not in lengths:
            raise ValueError(f"{field} has {len(numbers)} numbers")
    return int(getattr(message, SEQUENCE)), kind(**values)


@cache
def _classes() -> dict[str, type[Message]]:
    """The protobuf classes by the names of their types."""
    return message_factory.GetMessageClassesForFiles([_FILE], _pool())


def _pool() -> descriptor_pool.DescriptorPool:
    file = descriptor_pb2.FileDescriptorProto(name=_FILE, package=PACKAGE, syntax="proto3")
    for kind in KINDS:
        message = file.message_type.add(name=kind.__name__)
        message.field.add(
            name=SEQUENCE, number=1, type=_FIELD.TYPE_INT64, label=_FIELD.LABEL_OPTIONAL
        )
        hints = get_type_hints(kind)
        for number, field in enumerate(dataclasses.fields(kind), start=2):
            hint = hints[field.name]
            repeated = bool(get_args(hint))
            message.field.add(
                name=field.name,
                number=number,
                type=_FIELD.TYPE_DOUBLE if repeated else _SCALARS[hint],
                label=_FIELD.LABEL_REPEATED if repeated else _FIELD.LABEL_OPTIONAL,
            )
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return pool
