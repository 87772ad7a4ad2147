"""Charts of numbers: lines, steps, bands and bars over an axis, in one panel or several.

A `Chart` is a plain value: here it becomes an SVG document for notebooks and files. The legend
stands below the panels, never on the data.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from ntagen.checker.picture.layout import text_width
from ntagen.checker.picture.page import HEADING_HEIGHT, MARGIN, Svg, page, safe, shortened

BLUE: Final = "#1f5fbf"
PALE: Final = "#b8bec8"
DARK: Final = "#0b2545"
SERIES: Final = (
    BLUE,
    "#b03030",
    "#0b7a3b",
    "#7a3e9d",
    "#b3700f",
    "#0e87a5",
    "#8b1a5a",
    "#5a6b1f",
)
"""Colours of lines that are told apart."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line through points.

    Attributes:
        label: Its name in the legend; empty for none.
        x: The places of its points, in ascending order.
        y: Their values.
        colour: Its colour.
        width: Its width in pixels.
        is_step: Whether a value holds until the next point.
        is_dashed: Whether it is dashed.
    """

    label: str
    x: Sequence[float]
    y: Sequence[float]
    colour: str = BLUE
    width: float = 1.4
    is_step: bool = False
    is_dashed: bool = False


@dataclass(frozen=True, slots=True)
class Band:
    """What lies between two lines; fields as of `Line`."""

    label: str
    x: Sequence[float]
    lower: Sequence[float]
    upper: Sequence[float]
    colour: str = BLUE
    is_step: bool = False


@dataclass(frozen=True, slots=True)
class Bars:
    """Bars beside each other.

    Attributes:
        label: Their name in the legend; empty for none.
        edges: Where bars begin and end: one more than there are bars.
        heights: How high they are.
        colour: Their colour.
    """

    label: str
    edges: Sequence[float]
    heights: Sequence[float]
    colour: str = BLUE


Item = Line | Band | Bars


@dataclass(frozen=True, slots=True)
class Panel:
    """Axes and what is drawn on them.

    Attributes:
        x_label: What the horizontal axis shows, with its unit.
        y_label: What the vertical axis shows.
        items: What is drawn, in this order.
        y_range: The least and greatest value of the vertical axis; ``None`` leaves it to the items.
        height: How high it is, in pixels of a page that is 640 of them wide within the axes.
    """

    x_label: str
    y_label: str
    items: Sequence[Item]
    y_range: tuple[float, float] | None = None
    height: float = 190.0

    @property
    def x_span(self) -> tuple[float, float]:
        """The least and the greatest place of all items."""
        places = [one for item in self.items for one in _places(item)]
        return _widened(min(places, default=0.0), max(places, default=1.0))

    @property
    def y_span(self) -> tuple[float, float]:
        """The least and the greatest value that is shown."""
        if self.y_range is not None:
            return self.y_range
        values = [one for item in self.items for one in _values(item) if math.isfinite(one)]
        low, high = _widened(min(values, default=0.0), max(values, default=1.0))
        if any(isinstance(item, Bars) for item in self.items):
            return 0.0, 1.05 * high
        room = 0.04 * (high - low)
        return low - room, high + room


@dataclass(frozen=True, slots=True)
class Chart:
    """Panels below each other.

    Attributes:
        heading: The heading: what was asked.
        caption: What was found out, on one line.
        panels: The panels; all have the same horizontal axis.
    """

    heading: str
    caption: str
    panels: Sequence[Panel]

    @property
    def x_span(self) -> tuple[float, float]:
        """The horizontal span of all panels."""
        spans = [panel.x_span for panel in self.panels]
        return min(low for low, _ in spans), max(high for _, high in spans)

    @property
    def legend(self) -> list[Item]:
        """One item for each label, in the order of drawing."""
        found: dict[str, Item] = {}
        for panel in self.panels:
            for item in panel.items:
                if item.label:
                    found.setdefault(item.label, item)
        return list(found.values())


def _places(item: Item) -> Sequence[float]:
    return item.edges if isinstance(item, Bars) else item.x


def _values(item: Item) -> list[float]:
    match item:
        case Line():
            return list(item.y)
        case Band():
            return [*item.lower, *item.upper]
        case Bars():
            return list(item.heights)


def _widened(low: float, high: float) -> tuple[float, float]:
    """A span that is not empty."""
    return (low, high) if low < high else (low - 0.5, high + 0.5)


def stepped(x: Sequence[float], y: Sequence[float]) -> list[tuple[float, float]]:
    """The corners of steps: each value holds until the next place."""
    corners: list[tuple[float, float]] = []
    for place, value in zip(x, y, strict=True):
        if corners:
            corners.append((place, corners[-1][1]))
        corners.append((place, value))
    return corners


def round_ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers between two others, at most `most` of them."""
    rough = (high - low) / max(1, most - 1)
    if not (math.isfinite(rough) and rough > 0.0):
        return [low]
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * one for one in (1, 2, 5, 10) if power * one >= rough * (1 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [step * number for number in range(first, last + 1)]


_WIDTH: Final = 640.0
_GAP: Final = 22.0
_AXIS_HEIGHT: Final = 46.0
_CAPTION_HEIGHT: Final = 18.0
_LEGEND_LINE: Final = 20.0
_LEFT: Final = 78.0
_FONT_SIZE: Final = 12
_MOST_LABEL: Final = 60
_SAMPLE: Final = 22.0

Anchor = Literal["start", "middle", "end"]


def svg(chart: Chart) -> Svg:
    """Draws a chart as an SVG document."""
    top = MARGIN + HEADING_HEIGHT + _CAPTION_HEIGHT
    parts = [_text(MARGIN, MARGIN + HEADING_HEIGHT + 4, chart.caption, colour="#404040")]
    low, high = chart.x_span
    for index, panel in enumerate(chart.panels):
        frame = _Frame(_LEFT, top, panel.height, (low, high), panel.y_span)
        parts += _panel(panel, frame, f"panel{index}")
        top += panel.height + _AXIS_HEIGHT + (_GAP if index + 1 < len(chart.panels) else 0.0)
    legend = list(_legend(chart.legend, top))
    parts += legend
    rows = len(legend_rows(chart.legend, _LEFT + _WIDTH))
    box = (0.0, 0.0, _LEFT + _WIDTH + 2 * MARGIN, top + rows * _LEGEND_LINE + MARGIN)
    return Svg(page(box, shortened(chart.heading, 90), parts, _FONT_SIZE))


@dataclass(frozen=True, slots=True)
class _Frame:
    """Where the axes of a panel lie on the page."""

    left: float
    top: float
    height: float
    x_span: tuple[float, float]
    y_span: tuple[float, float]

    def x(self, value: float) -> float:
        low, high = self.x_span
        return self.left + (value - low) / (high - low) * _WIDTH

    def y(self, value: float) -> float:
        low, high = self.y_span
        return self.top + self.height - (value - low) / (high - low) * self.height

    def points(self, corners: Sequence[tuple[float, float]]) -> str:
        return " ".join(f"{self.x(x):.1f},{self.y(y):.1f}" for x, y in corners)


def _panel(panel: Panel, frame: _Frame, name: str) -> Iterator[str]:
    bottom, right = frame.top + frame.height, frame.left + _WIDTH
    for tick in round_ticks(*frame.x_span, most=10):
        x = frame.x(tick)
        yield _rule(x, frame.top, x, bottom)
        yield _text(x, bottom + 16, f"{tick:g}", "middle", "#404040", 11)
    for tick in round_ticks(*frame.y_span, most=6):
        y = frame.y(tick)
        yield _rule(frame.left, y, right, y)
        yield _text(frame.left - 7, y + 4, f"{tick:g}", "end", "#404040", 11)
    middle = frame.left + _WIDTH / 2
    yield _text(middle, bottom + 34, shortened(panel.x_label, 90), "middle", "#404040", 11)
    across = frame.top + frame.height / 2
    label = safe(shortened(panel.y_label, 34))
    yield (
        f'<text transform="translate({MARGIN + 10:.0f},{across:.1f}) rotate(-90)" '
        f'text-anchor="middle" font-size="11" fill="#404040">{label}</text>'
    )
    yield (
        f'<clipPath id="{name}"><rect x="{frame.left:.1f}" y="{frame.top:.1f}" '
        f'width="{_WIDTH:.1f}" height="{frame.height:.1f}"/></clipPath>'
    )
    yield f'<g clip-path="url(#{name})">'
    for item in panel.items:
        yield from _item(item, frame)
    yield "</g>"
    yield (
        f'<rect x="{frame.left:.1f}" y="{frame.top:.1f}" width="{_WIDTH:.1f}" '
        f'height="{frame.height:.1f}" fill="none" stroke="#b8bec8"/>'
    )


def _item(item: Item, frame: _Frame) -> Iterator[str]:
    match item:
        case Line():
            corners = stepped(item.x, item.y) if item.is_step else _finite(item.x, item.y)
            dash = ' stroke-dasharray="5 3"' if item.is_dashed else ""
            title = f"<title>{safe(item.label)}</title>" if item.label else ""
            yield (
                f'<polyline points="{frame.points(corners)}" fill="none" stroke="{item.colour}" '
                f'stroke-width="{item.width:g}" stroke-linejoin="round"{dash}>{title}</polyline>'
            )
        case Band():
            bounds = (_finite(item.x, item.lower), _finite(item.x, item.upper))
            if item.is_step:
                bounds = (stepped(item.x, item.lower), stepped(item.x, item.upper))
            outline = frame.points([*bounds[0], *reversed(bounds[1])])
            yield f'<polygon points="{outline}" fill="{item.colour}" fill-opacity="0.16"/>'
        case Bars():
            base = frame.y(0.0)
            for start, end, height in zip(item.edges, item.edges[1:], item.heights, strict=False):
                if height:
                    left, top = frame.x(start), frame.y(height)
                    width = max(0.5, frame.x(end) - left - 0.5)
                    yield (
                        f'<rect x="{left:.2f}" y="{top:.1f}" width="{width:.2f}" '
                        f'height="{base - top:.1f}" fill="{item.colour}" fill-opacity="0.75">'
                        f"<title>{start:g} to {end:g}: {height:.4g}</title></rect>"
                    )


def _finite(x: Sequence[float], y: Sequence[float]) -> list[tuple[float, float]]:
    return [pair for pair in zip(x, y, strict=True) if math.isfinite(pair[1])]


def legend_rows(items: Sequence[Item], width: float) -> list[list[Item]]:
    """The legend in lines that are at most so wide."""
    rows: list[list[Item]] = []
    left = 0.0
    for item in items:
        needed = _legend_width(item)
        if not rows or left + needed > width:
            rows.append([])
            left = 0.0
        rows[-1].append(item)
        left += needed
    return rows


def _legend_width(item: Item) -> float:
    return _SAMPLE + 6 + text_width(shortened(item.label, _MOST_LABEL)) + 18


def _legend(items: Sequence[Item], top: float) -> Iterator[str]:
    for row in legend_rows(items, _LEFT + _WIDTH):
        left = float(MARGIN)
        for item in row:
            y = top + _LEGEND_LINE / 2
            match item:
                case Line():
                    dash = ' stroke-dasharray="5 3"' if item.is_dashed else ""
                    yield (
                        f'<line x1="{left:.1f}" y1="{y:.1f}" x2="{left + _SAMPLE:.1f}" '
                        f'y2="{y:.1f}" stroke="{item.colour}" stroke-width="2"{dash}/>'
                    )
                case Band() | Bars():
                    opacity = 0.16 if isinstance(item, Band) else 0.75
                    yield (
                        f'<rect x="{left:.1f}" y="{y - 5:.1f}" width="{_SAMPLE:.0f}" height="10" '
                        f'fill="{item.colour}" fill-opacity="{opacity}"/>'
                    )
            yield _text(left + _SAMPLE + 6, y + 4, shortened(item.label, _MOST_LABEL))
            left += _legend_width(item)
        top += _LEGEND_LINE


def _rule(x1: float, y1: float, x2: float, y2: float) -> str:
    ends = f'x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"'
    return f'<line {ends} stroke="#e6e8ec" stroke-width="0.8"/>'


def _text(
    x: float,
    y: float,
    text: str,
    anchor: Anchor = "start",
    colour: str = "#202020",
    size: int = _FONT_SIZE,
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" '
        f'fill="{colour}">{safe(text)}</text>'
    )
