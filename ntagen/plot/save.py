"""Saves figures: the file's ending decides the format; files are written whole or not at all."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.errors import InputError
from ntagen.files import write_files

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS: Final = ("png", "pdf", "svg")


def format_of(path: Path) -> str:
    """The format of a file's ending.

    Raises:
        InputError: The ending is not that of a supported format.
    """
    ending = path.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        known = ", ".join(f".{name}" for name in FORMATS)
        raise InputError(
            f"cannot draw {path}: unknown kind of picture\n"
            f"hint: choose a file name with one of these endings: {known}"
        )
    return ending


def save(figure: Figure, path: Path) -> None:
    """Writes a figure whole; equal figures give equal files.

    Raises:
        InputError: The file cannot be written, or its ending is unknown.
    """
    import matplotlib as mpl

    kind = format_of(path)
    # A fixed salt and no dates: the same picture gives the same bytes.
    metadata = {"png": {"Software": None}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
    picture = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "ntagen"}):
        figure.savefig(picture, format=kind, metadata=metadata[kind])
    write_files({path: picture.getvalue()})
