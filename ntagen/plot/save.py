"""Saves figures: the file's ending decides the format; files are written whole or not at all."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.errors import InputError
from ntagen.files import write_files

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ntagen.plot.picture import Picture

FIGURES: Final = ("png", "pdf", "svg")
PICTURES: Final = (*FIGURES, "html", "gif")
"""Scenes and runs can also be pages, and animations."""


def write_picture(picture: Picture, path: Path) -> None:
    """Draws a picture into a file: a page to turn and step through, an animation, or a figure.

    Raises:
        InputError: The file cannot be written, or its ending is unknown, or an animation is asked
            for and nothing moves.
    """
    # Matplotlib takes half a second to load, and a page does not need it.
    kind = format_of(path, PICTURES)
    if kind == "gif":
        from ntagen.plot.animation import animation_of

        animation_of(picture).save(path)
        return
    if kind == "html":
        from ntagen.plot.viewer import page_of

        page_of(picture).save(path)
        return
    from ntagen.plot.picture import draw

    save(draw(picture), path)


def format_of(path: Path, known: Sequence[str] = FIGURES) -> str:
    """The format of a file's ending, which is one of those `known`.

    Raises:
        InputError: The ending is not that of a supported format.
    """
    ending = path.suffix.lower().removeprefix(".")
    if ending not in known:
        endings = ", ".join(f".{name}" for name in known)
        raise InputError(
            f"cannot draw {path}: unknown kind of picture\n"
            f"hint: choose a file name with one of these endings: {endings}"
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
