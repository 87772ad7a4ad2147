"""Draws an SVG document of this package with matplotlib, for PNG and PDF.

It knows the elements and attributes that the modules beside it write, and no others: an unknown one
is an error, so that nothing is left out in silence. Texts are set in the font that comes with
matplotlib, so pictures are the same everywhere.
"""

from __future__ import annotations

import io
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_INCHES_PER_PIXEL: Final = 1.0 / 96.0
_POINTS_PER_PIXEL: Final = 72.0 / 96.0
_FONT_SCALE: Final = 0.87
"""The font is wider than those for which the pictures are laid out, so it is smaller."""

_DPI: Final = 192
_MOST_PIXELS: Final = 30_000
_MOST_AREA: Final = 100_000_000
"""A larger picture, or one with a longer side, has fewer dots per inch."""

_SILENT: Final = {"title", "defs", "clipPath", "pattern"}
_NUMBER: Final = re.compile(r"-?[0-9.]+(?:e-?[0-9]+)?")
_ROTATED: Final = re.compile(r"rotate\((-?[0-9.]+)\)")
_MOVED: Final = re.compile(r"translate\((-?[0-9.]+),(-?[0-9.]+)\)")
_URL: Final = re.compile(r"url\(#(.+)\)")
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
_ALIGNED: Final = {"start": "left", "middle": "center", "end": "right"}


def saved(figure: Figure, kind: str, dpi: float | None = None) -> bytes:
    """A figure as the bytes of a file; equal figures give equal bytes.

    Args:
        figure: The figure.
        kind: ``png``, ``pdf`` or ``svg``.
        dpi: Dots per inch; those of the figure if not given.
    """
    import matplotlib as mpl

    # A fixed salt and no dates: the same picture gives the same bytes.
    metadata = {"png": {"Software": None}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
    picture = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "ntagen"}):
        figure.savefig(picture, format=kind, metadata=metadata[kind], dpi=dpi or figure.dpi)
    return picture.getvalue()


def converted(svg: str, kind: str) -> bytes:
    """An SVG document of this package as the bytes of a PNG or PDF file."""
    figure = figure_of(svg)
    width, height = figure.get_size_inches()
    fine = min(_DPI, _MOST_PIXELS / max(width, height), math.sqrt(_MOST_AREA / (width * height)))
    return saved(figure, kind, fine)


def figure_of(svg: str) -> Figure:
    """The figure that shows what an SVG document of this package shows.

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
    _Painter(axes, _named(root)).element(root, {}, _Place())
    return figure


def _named(root: ET.Element) -> dict[str, ET.Element]:
    """The clips and patterns by their names."""
    return {one.attrib["id"]: one for one in root.iter() if "id" in one.attrib}


@dataclass(frozen=True, slots=True)
class _Place:
    """Where an element is drawn: moved by a way, and inside a patch if there is one."""

    x: float = 0.0
    y: float = 0.0
    clip: Any = None


@dataclass(slots=True)
class _Painter:
    """Draws one element after the other; later ones cover earlier ones."""

    axes: Any
    named: Mapping[str, ET.Element]
    layer: int = field(default=0)

    def element(self, one: ET.Element, inherited: Mapping[str, str], place: _Place) -> None:
        """Draws an element and what is in it."""
        name = one.tag.rpartition("}")[2]
        if name in _SILENT:
            return
        style = dict(inherited)
        style |= {key: one.attrib[key] for key in _INHERITED if key in one.attrib}
        if name == "svg":
            self._inside(one, style, self._page(one, place))
        elif name == "g":
            self._inside(one, style, self._clipped(one, place))
        elif name == "text":
            self._text(one, style, place)
        else:
            self._shape(name, {**style, **one.attrib}, place)

    def _inside(self, one: ET.Element, style: Mapping[str, str], place: _Place) -> None:
        for child in one:
            self.element(child, style, place)

    def _page(self, one: ET.Element, place: _Place) -> _Place:
        """Pages are drawn in their own size, so a page within another one only moves."""
        left, top, *_ = map(float, one.attrib["viewBox"].split())
        x, y = float(one.attrib.get("x", 0.0)), float(one.attrib.get("y", 0.0))
        return replace(place, x=place.x + x - left, y=place.y + y - top)

    def _clipped(self, one: ET.Element, place: _Place) -> _Place:
        url = _URL.fullmatch(one.attrib.get("clip-path", ""))
        if url is None:
            return place
        from matplotlib.patches import Rectangle

        x, y, width, height = _box(self.named[url[1]][0].attrib)
        clip = Rectangle((x + place.x, y + place.y), width, height)
        clip.set_transform(self.axes.transData)
        return replace(place, clip=clip)

    # ------------------------------------------------------------------------------------- shapes

    def _shape(self, name: str, given: Mapping[str, str], place: _Place) -> None:
        outline, is_closed = _outline(name, given, place)
        fill = given.get("fill", "#000000") if is_closed else "none"
        url = _URL.fullmatch(fill)
        if url is not None:
            self._striped(outline, self.named[url[1]], place)
            fill = "none"
        self._patch(outline, {**given, "fill": fill}, place.clip)

    def _patch(self, outline: Any, given: Mapping[str, str], clip: Any) -> Any:  # noqa: ANN401
        from matplotlib.patches import PathPatch

        fill, stroke = given.get("fill", "none"), given.get("stroke", "none")
        width = _POINTS_PER_PIXEL * float(given.get("stroke-width", 1.0))
        dashes = [float(one) for one in given.get("stroke-dasharray", "").split()]
        patch = PathPatch(
            outline,
            facecolor=(fill, float(given.get("fill-opacity", 1.0))) if fill != "none" else "none",
            edgecolor=stroke,
            linewidth=0.0 if stroke == "none" else width,
            joinstyle="round" if given.get("stroke-linejoin") == "round" else "miter",
            capstyle="butt",
            zorder=self._next_layer(),
        )
        if dashes:
            # In units of the line's width.
            patch.set_linestyle((0.0, [one * _POINTS_PER_PIXEL / width for one in dashes]))
        self.axes.add_patch(patch)
        if clip is not None:
            patch.set_clip_path(clip)
        return patch

    def _striped(self, outline: Any, pattern: ET.Element, place: _Place) -> None:  # noqa: ANN401
        """Fills an outline with the stripes of a pattern."""
        from matplotlib.patches import PathPatch
        from matplotlib.path import Path

        around = PathPatch(outline, transform=self.axes.transData)
        rotated = _ROTATED.fullmatch(pattern.attrib["patternTransform"])
        angle = math.radians(float(rotated[1])) if rotated else 0.0
        period, stripe = float(pattern.attrib["height"]), pattern[0].attrib
        first, height = float(stripe.get("y", 0.0)), float(stripe["height"])
        low, high = outline.vertices.min(axis=0), outline.vertices.max(axis=0)
        corners = [(x, y) for x in (low[0], high[0]) for y in (low[1], high[1])]
        cosine, sine = math.cos(angle), math.sin(angle)
        along = [(x - place.x) * cosine + (y - place.y) * sine for x, y in corners]
        across = [(y - place.y) * cosine - (x - place.x) * sine for x, y in corners]
        rows = range(math.floor(min(across) / period) - 1, math.ceil(max(across) / period) + 1)
        for row in rows:
            top = row * period + first
            band = [(a, b) for b in (top, top + height) for a in (min(along), max(along))]
            turned = [
                (place.x + a * cosine - b * sine, place.y + a * sine + b * cosine) for a, b in band
            ]
            ordered = [turned[0], turned[1], turned[3], turned[2], turned[0]]
            self._patch(Path(ordered, closed=True), {"fill": stripe["fill"]}, around)

    # -------------------------------------------------------------------------------------- texts

    def _text(self, one: ET.Element, style: Mapping[str, str], place: _Place) -> None:
        from matplotlib.patheffects import withStroke

        x, y, turn = place.x, place.y, 0.0
        transform = one.attrib.get("transform", "")
        if moved := _MOVED.search(transform):
            x, y = x + float(moved[1]), y + float(moved[2])
        if rotated := _ROTATED.search(transform):
            turn = -float(rotated[1])
        size = _FONT_SCALE * _POINTS_PER_PIXEL * float(style.get("font-size", 12.0))
        for text, left, base in _lines(one):
            drawn = self.axes.text(
                x + left,
                y + base,
                text,
                parse_math=False,
                color=style.get("fill", "#000000"),
                fontsize=size,
                fontweight=style.get("font-weight", "normal"),
                ha=_ALIGNED[style.get("text-anchor", "start")],
                va="baseline",
                rotation=turn,
                rotation_mode="anchor",
                zorder=self._next_layer(),
            )
            if style.get("stroke", "none") != "none":
                width = _POINTS_PER_PIXEL * float(style.get("stroke-width", 1.0))
                drawn.set_path_effects([withStroke(linewidth=width, foreground=style["stroke"])])

    def _next_layer(self) -> int:
        self.layer += 1
        return self.layer


def _lines(one: ET.Element) -> Iterator[tuple[str, float, float]]:
    """The lines of a text with their places; a tooltip in it is none."""
    spans = [child for child in one if child.tag.rpartition("}")[2] == "tspan"]
    for span in spans or [one]:
        # What follows a tooltip is the text itself.
        parts = [span.text or "", *(child.tail or "" for child in span)]
        place = float(span.attrib.get("x", 0.0)), float(span.attrib.get("y", 0.0))
        yield "".join(parts), *place


def _box(given: Mapping[str, str]) -> tuple[float, float, float, float]:
    """Left, top, width and height."""
    x, y = float(given.get("x", 0.0)), float(given.get("y", 0.0))
    return x, y, float(given["width"]), float(given["height"])


def _outline(name: str, given: Mapping[str, str], place: _Place) -> tuple[Any, bool]:
    """The outline of a shape, and whether it has an inside.

    Raises:
        ValueError: There is no such shape.
    """
    from matplotlib.path import Path

    match name:
        case "rect":
            outline, is_closed = _rectangle(_box(given), float(given.get("rx", 0.0))), True
        case "circle":
            center = (float(given["cx"]), float(given["cy"]))
            outline, is_closed = Path.circle(center, float(given["r"])), True
        case "line":
            ends = [(float(given[f"x{i}"]), float(given[f"y{i}"])) for i in (1, 2)]
            outline, is_closed = Path(ends), False
        case "polyline" | "polygon":
            numbers = [float(one) for one in _NUMBER.findall(given["points"])]
            corners = list(zip(numbers[::2], numbers[1::2], strict=True))
            is_closed = name == "polygon"
            outline = Path([*corners, corners[0]] if is_closed else corners, closed=is_closed)
        case "path":
            outline, is_closed = _bent(given["d"]), False
        case _:
            raise ValueError(f"an SVG of this package has no <{name}>")
    moved = [(x + place.x, y + place.y) for x, y in outline.vertices]
    return Path(moved, outline.codes), is_closed


def _rectangle(box: tuple[float, float, float, float], radius: float) -> Any:  # noqa: ANN401
    from matplotlib.patches import FancyBboxPatch
    from matplotlib.path import Path

    x, y, width, height = box
    radius = min(radius, width / 2.0, height / 2.0)
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
