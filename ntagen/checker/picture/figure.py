"""Saves figures of matplotlib, and draws the diagrams of this package with it, for PNG and PDF.

It knows the elements and attributes of SVG that the modules beside it write, and no others: an
unknown one is an error, so that nothing is left out in silence. Texts are set in the font that
comes with matplotlib, so pictures are the same everywhere.
"""

from __future__ import annotations

import io
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_INCHES_PER_PIXEL: Final = 1.0 / 96.0
_POINTS_PER_PIXEL: Final = 72.0 / 96.0
_FONT_SCALE: Final = 0.87
"""The font is wider than those for which the pictures are laid out, so it is smaller."""

_DPI: Final = 192
_MOST_PIXELS: Final = 30_000
_MOST_AREA: Final = 100_000_000
"""A larger picture, or one with a longer side, has fewer dots per inch."""

_NUMBER: Final = re.compile(r"-?[0-9.]+(?:e-?[0-9]+)?")
_INHERITED: Final = (
    "fill",
    "stroke",
    "stroke-width",
    "stroke-linejoin",
    "font-size",
    "font-family",
    "font-weight",
    "text-anchor",
)
_ALIGNED: Final[dict[str, Any]] = {"start": "left", "middle": "center", "end": "right"}


CHART_STYLE: Final[dict[Any, Any]] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#b8bec8",
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.labelcolor": "#404040",
    "axes.labelsize": 8.25,
    "axes.titlelocation": "left",
    "axes.titlesize": 9.0,
    "font.size": 9.0,
    "grid.color": "#e6e8ec",
    "grid.linewidth": 0.6,
    "hatch.linewidth": 2.0,
    "legend.borderaxespad": 0.0,
    "legend.borderpad": 0.0,
    "legend.fontsize": 8.25,
    "legend.frameon": False,
    "legend.handlelength": 1.9,
    "savefig.bbox": "tight",
    "savefig.pad_inches": 0.17,
    # Texts stay texts, which a page can be searched for.
    "svg.fonttype": "none",
    # A dollar in a text is a dollar.
    "text.parse_math": False,
    "xtick.color": "#404040",
    "xtick.labelsize": 8.25,
    "ytick.color": "#404040",
    "ytick.labelsize": 8.25,
}
"""How charts look; some of it counts when a chart is drawn, some when it is saved."""


def saved(
    figure: Figure,
    kind: str,
    dpi: float | None = None,
    style: Mapping[Any, Any] | None = None,
    title: str | None = None,
) -> bytes:
    """A figure as the bytes of a file; equal figures give equal bytes.

    Args:
        figure: The figure.
        kind: ``png``, ``pdf`` or ``svg``.
        dpi: Dots per inch; those of the figure if not given.
        style: Settings of matplotlib that count when a figure is saved.
        title: The title of an SVG document.
    """
    import matplotlib as mpl

    # A fixed salt and no dates: the same picture gives the same bytes.
    metadata: dict[str, dict[str, Any]] = {
        "png": {"Software": None},
        "pdf": {"CreationDate": None},
        "svg": {"Date": None, "Creator": None} | ({"Title": title} if title else {}),
    }
    picture = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "ntagen", **(style or {})}):
        figure.savefig(picture, format=kind, metadata=metadata[kind], dpi=dpi or figure.dpi)
    return picture.getvalue()


def converted(svg: str, chart: Figure | None, kind: str) -> bytes:
    """A chart, or the SVG document of a diagram, as the bytes of a PNG or PDF file."""
    figure = chart or figure_of(svg)
    width, height = figure.get_size_inches()
    fine = min(_DPI, _MOST_PIXELS / max(width, height), math.sqrt(_MOST_AREA / (width * height)))
    return saved(figure, kind, fine, CHART_STYLE if chart else None)


def figure_of(svg: str) -> Figure:
    """The figure that shows what the SVG document of a diagram shows.

    Raises:
        ValueError: The document has something that is not known here.
    """
    from matplotlib.figure import Figure

    # The package made the document itself.
    root = ET.fromstring(svg)
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    figure = Figure(figsize=(width * _INCHES_PER_PIXEL, height * _INCHES_PER_PIXEL), dpi=96)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, width)
    axes.set_ylim(height, 0.0)
    _draw(axes, root, {}, (0.0, 0.0))
    return figure


_Place = tuple[float, float]
"""By how much a page within another one is moved."""


def _draw(axes: Axes, one: ET.Element, inherited: Mapping[str, str], place: _Place) -> None:
    """Draws an element and what is in it, above what was drawn before; a tooltip is not seen."""
    name = one.tag.rpartition("}")[2]
    style = dict(inherited)
    style |= {key: one.attrib[key] for key in _INHERITED if key in one.attrib}
    if name in ("svg", "g"):
        for child in one:
            _draw(axes, child, style, _moved(one, place) if name == "svg" else place)
    elif name == "text":
        _draw_text(axes, one, style, place)
    elif name != "title":
        _draw_shape(axes, name, {**style, **one.attrib}, place)


def _draw_shape(axes: Axes, name: str, given: Mapping[str, str], place: _Place) -> None:
    from matplotlib.patches import PathPatch

    outline, is_closed = _outline(name, given, place)
    stroke = given.get("stroke", "none")
    width = _POINTS_PER_PIXEL * float(given.get("stroke-width", 1.0))
    patch = PathPatch(
        outline,
        facecolor=given.get("fill", "#000000") if is_closed else "none",
        edgecolor=stroke,
        linewidth=0.0 if stroke == "none" else width,
        joinstyle="round" if given.get("stroke-linejoin") == "round" else "miter",
        capstyle="butt",
        zorder=1.0,
    )
    if dashes := [float(one) for one in given.get("stroke-dasharray", "").split()]:
        # In units of the line's width.
        patch.set_linestyle((0.0, [one * _POINTS_PER_PIXEL / width for one in dashes]))
    axes.add_patch(patch)


def _draw_text(axes: Axes, one: ET.Element, style: Mapping[str, str], place: _Place) -> None:
    from matplotlib.patheffects import withStroke

    size = _FONT_SCALE * _POINTS_PER_PIXEL * float(style.get("font-size", 12.0))
    for text, left, base in _lines(one):
        drawn = axes.text(
            place[0] + left,
            place[1] + base,
            text,
            parse_math=False,
            color=style.get("fill", "#000000"),
            fontsize=size,
            fontweight=style.get("font-weight", "normal"),
            ha=_ALIGNED[style.get("text-anchor", "start")],
            va="baseline",
            zorder=1.0,
        )
        if style.get("stroke", "none") != "none":
            width = _POINTS_PER_PIXEL * float(style.get("stroke-width", 1.0))
            drawn.set_path_effects([withStroke(linewidth=width, foreground=style["stroke"])])


def _moved(page: ET.Element, place: _Place) -> _Place:
    """Pages are drawn in their own size, so a page within another one only moves."""
    left, top, *_ = map(float, page.attrib["viewBox"].split())
    x, y = float(page.attrib.get("x", 0.0)), float(page.attrib.get("y", 0.0))
    return place[0] + x - left, place[1] + y - top


def _lines(one: ET.Element) -> Iterator[tuple[str, float, float]]:
    """The lines of a text with their places; a tooltip in it is none."""
    spans = [child for child in one if child.tag.rpartition("}")[2] == "tspan"]
    for span in spans or [one]:
        # What follows a tooltip is the text itself.
        parts = [span.text or "", *(child.tail or "" for child in span)]
        place = float(span.attrib.get("x", 0.0)), float(span.attrib.get("y", 0.0))
        yield "".join(parts), *place


def _outline(name: str, given: Mapping[str, str], place: _Place) -> tuple[Any, bool]:
    """The outline of a shape, and whether it has an inside.

    Raises:
        ValueError: There is no such shape.
    """
    from matplotlib.path import Path

    match name:
        case "rect":
            outline, is_closed = _rectangle(given), True
        case "circle":
            center = (float(given["cx"]), float(given["cy"]))
            outline, is_closed = Path.circle(center, float(given["r"])), True
        case "line":
            ends = [(float(given[f"x{i}"]), float(given[f"y{i}"])) for i in (1, 2)]
            outline, is_closed = Path(ends), False
        case "polygon":
            numbers = [float(one) for one in _NUMBER.findall(given["points"])]
            corners = list(zip(numbers[::2], numbers[1::2], strict=True))
            outline, is_closed = Path([*corners, corners[0]], closed=True), True
        case "path":
            outline, is_closed = _bent(given["d"]), False
        case _:
            raise ValueError(f"an SVG of this package has no <{name}>")
    moved = [(x + place[0], y + place[1]) for x, y in outline.vertices]
    return Path(moved, outline.codes), is_closed


def _rectangle(given: Mapping[str, str]) -> Any:  # noqa: ANN401
    from matplotlib.patches import FancyBboxPatch
    from matplotlib.path import Path

    x, y = float(given.get("x", 0.0)), float(given.get("y", 0.0))
    width, height = float(given["width"]), float(given["height"])
    radius = min(float(given.get("rx", 0.0)), width / 2.0, height / 2.0)
    if radius > 0.0:
        style = f"round,pad=0,rounding_size={radius}"
        return FancyBboxPatch((x, y), width, height, boxstyle=style).get_path()
    corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height), (x, y)]
    return Path(corners, closed=True)


def _bent(steps: str) -> Any:  # noqa: ANN401
    """A path of lines and quadratic curves, as the arrows of templates are."""
    from matplotlib.path import Path

    kinds: dict[str, list[Any]] = {
        "M": [Path.MOVETO],
        "L": [Path.LINETO],
        "Q": [Path.CURVE3, Path.CURVE3],
    }
    points: list[tuple[float, float]] = []
    codes: list[Any] = []
    for letter, rest in re.findall(r"([MLQ])([^MLQ]*)", steps):
        numbers = [float(one) for one in _NUMBER.findall(rest)]
        points += zip(numbers[::2], numbers[1::2], strict=True)
        codes += kinds[letter]
    return Path(points, codes)
