"""Saves figures: the file's ending decides the format; files are written whole or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.checker.picture.figure import saved
from ntagen.checker.picture.page import kind_of
from ntagen.files import write_files

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ntagen.plot.picture import Picture

PAGES: Final = ("html", "gif")
"""Scenes and runs can also be pages, and animations."""


def write_picture(picture: Picture, path: Path) -> None:
    """Draws a picture into a file: a page to turn and step through, an animation, or a figure.

    Raises:
        InputError: The file cannot be written, or its ending is unknown, or an animation is asked
            for and nothing moves.
    """
    # Matplotlib takes half a second to load, and a page does not need it.
    kind = kind_of(path, PAGES)
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


def save(figure: Figure, path: Path) -> None:
    """Writes a figure whole; equal figures give equal files.

    Raises:
        InputError: The file cannot be written, or its ending is unknown.
    """
    write_files({path: saved(figure, kind_of(path))})


def svg_of(picture: Picture) -> str:
    """The text of a picture as an SVG document."""
    from ntagen.plot.picture import draw

    return saved(draw(picture), "svg").decode()
