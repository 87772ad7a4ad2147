"""A picture as a value: an SVG document that notebooks show and that can be saved.

Charts are figures of matplotlib. Diagrams, which are graphs and the charts of runs, are written as
SVG by the modules of this package: a run has tens of thousands of bars, for which matplotlib takes
a minute. `page` is the paper on which they stand.
"""

from __future__ import annotations

import colorsys
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final
from xml.sax.saxutils import escape

from ntagen.errors import InputError
from ntagen.files import write_files

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KINDS: Final = ("svg", "png", "pdf")
"""The formats of all pictures, which are the endings of their names."""

LIGHT: Final = (
    "#cfe0f5",
    "#f7d9b8",
    "#cfe8cf",
    "#f3c9cb",
    "#ddd0ec",
    "#e3d5cb",
    "#f6d6e8",
    "#d5d8dd",
    "#e9e9b5",
    "#bfe5ea",
)
"""Colours for things of one kind; light, for dark texts."""

WAIT: Final = "wait"
"""To do nothing yet; it is grey."""

_GREY: Final = "#d5d8dd"

_NOT_XML: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True, slots=True, repr=False)
class Svg:
    """A picture; a notebook shows it.

    Attributes:
        text: The SVG document.
        figure: The figure of a chart; a diagram has none.
    """

    text: str
    figure: Figure | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        return f"<Svg of {len(self.text)} characters>"

    def __str__(self) -> str:
        return self.text

    def _repr_svg_(self) -> str:
        return self.text

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the picture to a file, whole or not at all; its ending is the format.

        Args:
            path: The file; its name ends in ``.svg``, ``.png`` or ``.pdf``.

        Raises:
            InputError: The file cannot be written, or its ending is another one.
        """
        kind = kind_of(path)
        if kind == "svg":
            write_files({Path(path): self.text})
            return
        # Matplotlib takes half a second to load, and the SVG of a diagram does not need it.
        from ntagen.checker.picture.figure import converted

        write_files({Path(path): converted(self.text, self.figure, kind)})


def kind_of(path: str | os.PathLike[str], more: Sequence[str] = ()) -> str:
    """The format that the ending of a picture's name says: one of `KINDS`, or of `more`.

    Raises:
        InputError: It is none of them.
    """
    kind = Path(path).suffix.lower().removeprefix(".")
    known = (*KINDS, *more)
    if kind not in known:
        endings = ", ".join(f".{one}" for one in known)
        raise InputError(
            f"cannot draw {os.fspath(path)}: unknown kind of picture\n"
            f"hint: choose a file name with one of these endings: {endings}"
        )
    return kind


def page(
    box: tuple[float, float, float, float], heading: str, parts: Iterable[str], font_size: int
) -> str:
    """An SVG document: a white page with a heading at its upper left, and what is drawn on it.

    Args:
        box: Left, top, width and height of the page.
        heading: The heading, which is also the title of the document.
        parts: The elements, in the order of drawing.
        font_size: The size of texts that do not say theirs.
    """
    x, y, width, height = box
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="{x:.0f} {y:.0f} {width:.0f} {height:.0f}" '
        f'font-family="Helvetica, Arial, sans-serif" font-size="{font_size}">',
        f"<title>{safe(heading)}</title>",
        f'<rect x="{x:.0f}" y="{y:.0f}" width="{width:.0f}" height="{height:.0f}" fill="#ffffff"/>',
        f'<text x="{x + MARGIN:.0f}" y="{y + MARGIN + 6:.0f}" font-weight="bold" font-size="14" '
        f'fill="#202020">{safe(heading)}</text>',
        *parts,
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


MARGIN: Final = 16
HEADING_HEIGHT: Final = 26
"""The room above the drawing that the heading takes."""


def safe(text: str) -> str:
    """A text as it stands in an XML document."""
    return escape(without_controls(text))


def without_controls(text: str) -> str:
    """A text without the characters that an XML document must not contain."""
    return _NOT_XML.sub("\ufffd", text)


def shortened(text: str, most: int) -> str:
    """A text of at most `most` characters."""
    return text if len(text) <= most else text[: max(1, most - 1)] + "…"


def colors_of(kinds: Iterable[str]) -> dict[str, str]:
    """A colour for each kind, in their order, for dark texts; to wait comes last."""
    found = dict.fromkeys(kinds)
    moves = [kind for kind in found if kind != WAIT]
    palette: Sequence[str] = [color for color in LIGHT if color != _GREY]
    if len(moves) > len(palette):
        palette = [_hue(number / len(moves)) for number in range(len(moves))]
    colors = dict(zip(moves, palette, strict=False))
    return colors | ({WAIT: _GREY} if WAIT in found else {})


def _hue(turn: float) -> str:
    """A light colour of the circle of colours."""
    parts = colorsys.hls_to_rgb(turn, 0.8, 0.7)
    return "#" + "".join(f"{round(255 * part):02x}" for part in parts)


def darker(color: str) -> str:
    """A colour that is still seen in thin stripes."""
    parts = [int(color[at : at + 2], 16) for at in (1, 3, 5)]
    return "#" + "".join(f"{max(0, round(255 - 1.9 * (255 - part))):02x}" for part in parts)
