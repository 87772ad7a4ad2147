"""Fields as text, and those that were computed before, in the user's cache folder."""

from __future__ import annotations

import base64
import dataclasses
import functools
import hashlib
import json
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, cast

from ntagen.cache import cache_folder
from ntagen.errors import InputError
from ntagen.files import read_file, write_files
from ntagen.shapes import Field

_VERSION: Final = 2
_MOST_FILES: Final = 100
_MOST_BYTES: Final = 64 * 2**20


def kept(key: object, make: Callable[[], Field]) -> Field:
    """A field, from the cache if it is there.

    Args:
        key: All that the field depends on, with a `repr` that says it; the content of its file too.
        make: Makes it.
    """
    digest = hashlib.sha256(f"{_VERSION} {key!r}".encode()).hexdigest()
    folder = cache_folder()
    path = None if folder is None else folder / "fields" / f"{digest[:32]}.json"
    if path is not None:
        found = _read(path)
        if found is not None:
            return found
    field = make()
    if path is not None:
        _write(path, field)
    return field


def to_entry(field: Field) -> dict[str, Any]:
    """A field as JSON has it: its samples are compressed, and written with letters and digits."""
    entry = dataclasses.asdict(field)
    entry["samples"] = _packed(field.samples)
    return entry


@functools.lru_cache(maxsize=32)
def _packed(samples: bytes) -> str:
    """Compressed samples; a driver writes the same ones again and again."""
    return base64.b64encode(zlib.compress(samples, 6)).decode("ascii")


@functools.lru_cache(maxsize=32)
def digest_of(samples: bytes) -> str:
    """A name for samples that no others have."""
    return hashlib.sha256(samples).hexdigest()


def from_entry(entry: dict[str, Any]) -> Field:
    """The field of such an entry.

    Raises:
        KeyError, TypeError, ValueError: It is none.
    """
    values = {
        key: tuple(map(_tupled, value)) if isinstance(value, list) else value
        for key, value in entry.items()
    }
    try:
        values["samples"] = zlib.decompress(base64.b64decode(entry["samples"], validate=True))
    except zlib.error as error:
        raise ValueError(f"the samples are damaged: {error}") from error
    field = Field(**cast("Any", values))
    if len(field.samples) != 4 * field.counts[0] * field.counts[1] * field.counts[2]:
        raise ValueError("the samples do not fit the grid")
    return field


def _tupled(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def _read(path: Path) -> Field | None:
    try:
        return from_entry(json.loads(read_file(path, _MOST_BYTES)))
    except (OSError, KeyError, TypeError, ValueError, RecursionError):
        return None


def _write(path: Path, field: Field) -> None:
    """Stores a field, and removes the oldest if there are many; nothing is lost if it fails."""
    try:
        write_files({path: json.dumps(to_entry(field))})
        files = sorted(path.parent.glob("*.json"), key=lambda one: one.stat().st_mtime)
        for old in files[:-_MOST_FILES]:
            old.unlink(missing_ok=True)
    except (OSError, InputError):
        return
