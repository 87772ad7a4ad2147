"""Rows of plain values as a frame of pandas, or of polars if there is no pandas."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from typing import Any

from ntagen.errors import InputError


def frame_of(rows: Sequence[Mapping[str, Any]], otherwise: str) -> Any:  # noqa: ANN401  it depends on what is installed
    """A frame with a column for each key; a row without the key has no value there.

    Args:
        rows: The rows.
        otherwise: Where the same is without a frame, for the message.

    Raises:
        InputError: Neither library is installed.
    """
    for name in ("pandas", "polars"):
        try:
            library = importlib.import_module(name)
        except ImportError:
            continue
        columns = list(dict.fromkeys(key for row in rows for key in row))
        return library.DataFrame({key: [row.get(key) for row in rows] for key in columns})
    raise InputError(
        "a frame needs pandas or polars, and neither is installed\n"
        f"hint: pip install polars; {otherwise} without them"
    )
