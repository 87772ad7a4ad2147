"""Charts by matplotlib: axes of a known size, a heading above, and a legend below.

Only what draws a chart imports this module, at the moment of drawing: matplotlib takes half a
second to load. The axes fill their figure, and what stands around them, such as headings, numbers
and legends, makes the picture larger when it is saved. So nothing here computes the size of a page.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

import matplotlib as mpl
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from ntagen.checker.picture.figure import CHART_STYLE, saved
from ntagen.checker.picture.layout import text_width
from ntagen.checker.picture.page import Svg, safe, shortened, without_controls

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

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

BAND: Final = 0.16
"""How much a band between two lines covers what is below it."""

_WIDTH: Final = 640
_PANEL_HEIGHT: Final = 190
_GAP: Final = 20
_TILE_GAPS: Final = (76, 74)
"""The room between axes that have their own numbers, labels and titles, across and down."""
_HEADING_GAP: Final = 26
"""The room between the heading and the axes, for a line of text."""

_UNDER_AXES: Final = 50
"""The height of the numbers and the label below the lowest axes."""

_PIXELS: Final = 96
"""In an inch."""

_SAMPLE: Final = 46
"""The width of a sample in the legend, with the room around its text."""

MOST_TIPS: Final = 300
"""More tooltips than that nobody could point at."""

_TIP: Final = re.compile(r'<g id="tip(\d+)">')


@mpl.rc_context(CHART_STYLE)
def stacked(heading: str, size: tuple[float, float], count: int = 1) -> tuple[Figure, list[Axes]]:
    """Axes below each other that share the horizontal one, each of a size in pixels."""
    width, height = size
    whole = height * count + _GAP * (count - 1)
    figure = Figure((width / _PIXELS, whole / _PIXELS), dpi=_PIXELS)
    filled = {"left": 0.0, "right": 1.0, "bottom": 0.0, "top": 1.0, "hspace": _GAP / height}
    axes = figure.subplots(count, sharex=True, squeeze=False, gridspec_kw=filled)
    _head(figure, heading, whole)
    return figure, list(axes[:, 0])


@mpl.rc_context(CHART_STYLE)
def tiled(
    heading: str, size: tuple[float, float], count: int, columns: int
) -> tuple[Figure, list[Axes]]:
    """Axes in rows, each of a size in pixels and with its own numbers, labels and title."""
    width, height = size
    rows = -(-count // columns)
    across = width * columns + _TILE_GAPS[0] * (columns - 1)
    down = height * rows + _TILE_GAPS[1] * (rows - 1)
    figure = Figure((across / _PIXELS, down / _PIXELS), dpi=_PIXELS)
    gaps = {"wspace": _TILE_GAPS[0] / width, "hspace": _TILE_GAPS[1] / height}
    filled = {"left": 0.0, "right": 1.0, "bottom": 0.0, "top": 1.0, **gaps}
    axes = figure.subplots(rows, columns, squeeze=False, gridspec_kw=filled)
    for left_over in list(axes.flat)[count:]:
        left_over.remove()
    _head(figure, shortened(heading.strip(), 90), down)
    return figure, list(axes.flat)[:count]


def _head(figure: Figure, heading: str, height: float) -> None:
    """Writes the heading above a figure of a height in pixels."""
    figure.suptitle(
        # A query may have several lines.
        " ".join(without_controls(heading).split()),
        x=0.0,
        y=1.0 + _HEADING_GAP / height,
        horizontalalignment="left",
        verticalalignment="bottom",
        fontsize=10.0,
        fontweight="bold",
    )


@mpl.rc_context(CHART_STYLE)
def panels(
    heading: str, caption: str, x_label: str, y_labels: Sequence[str]
) -> tuple[Figure, list[Axes]]:
    """Panels below each other, one for each label of a vertical axis.

    Args:
        heading: The heading: what was asked.
        caption: What was found out, on one line.
        x_label: What the horizontal axis of all panels shows, with its unit.
        y_labels: What the vertical axes show.
    """
    figure, made = stacked(shortened(heading.strip(), 90), (_WIDTH, _PANEL_HEIGHT), len(y_labels))
    for axes, label in zip(made, y_labels, strict=True):
        axes.margins(x=0.0, y=0.04)
        axes.set_ylabel(shortened(label, 34))
    made[0].set_title(caption, pad=6.0, color="#404040")
    made[-1].set_xlabel(shortened(x_label, 90))
    figure.align_ylabels()
    return figure, made


def add_band(
    axes: Axes,
    x: Sequence[float],
    bounds: tuple[Sequence[float], Sequence[float]],
    label: str,
    step: Literal["post"] | None = None,
) -> None:
    """Draws what lies between two lines, or with `step` between the steps of two."""
    axes.fill_between(x, *bounds, step=step, color=BLUE, alpha=BAND, linewidth=0.0, label=label)


def add_bars(
    axes: Axes, bars: Sequence[tuple[float, float, float]], label: str
) -> list[tuple[Artist, str]]:
    """Draws bars, each from one place to another and so high.

    Returns:
        Their tooltips; none if there are so many that nobody could point at one.
    """
    style: dict[str, Any] = {"color": BLUE, "alpha": 0.75, "label": label}
    if len(bars) > MOST_TIPS:
        # As one artist, they are drawn in a hundredth of the time.
        corners = [((a, 0.0), (a, height), (b, height), (b, 0.0)) for a, b, height in bars]
        axes.add_collection(PolyCollection(corners, linewidth=0.0, **style))
        return []
    starts, heights = [bar[0] for bar in bars], [bar[2] for bar in bars]
    widths = [end - start for start, end, _ in bars]
    drawn = axes.bar(
        starts, heights, widths, align="edge", edgecolor="white", linewidth=0.4, **style
    )
    notes = [f"{start:g} to {end:g}: {height:.4g}" for start, end, height in bars]
    return list(zip(drawn, notes, strict=True))


def picture(
    figure: Figure,
    tips: Iterable[tuple[Artist, str]] = (),
    entries: Sequence[tuple[Artist, str]] = (),
) -> Svg:
    """The picture that a figure makes.

    Args:
        figure: The figure, with a heading.
        tips: What a tooltip says of some artists; a browser shows it.
        entries: The legend: artists with their texts, of which an invisible one has a text alone;
            by default all that has a label.
    """
    if not entries:
        found: dict[str, Artist] = {}
        for axes in figure.axes:
            for artist, label in zip(*axes.get_legend_handles_labels(), strict=True):
                found.setdefault(label, artist)
        entries = [(artist, label) for label, artist in found.items()]
    if entries:
        _add_legend(figure, entries)
    notes: list[str] = []
    for artist, note in tips:
        artist.set_gid(f"tip{len(notes)}")
        notes.append(f"<g><title>{safe(note)}</title>")
    text = saved(figure, "svg", style=CHART_STYLE, title=figure.get_suptitle()).decode()
    # A page has no place for the lines before the picture, and matplotlib knows no tooltips.
    text = _TIP.sub(lambda found: notes[int(found[1])], text[text.index("<svg") :])
    return Svg(text, figure)


@mpl.rc_context(CHART_STYLE)
def _add_legend(figure: Figure, entries: Sequence[tuple[Artist, str]]) -> None:
    """Writes below a figure what artists mean, in as many columns as there is room for."""
    labels = [shortened(label, 90) for _, label in entries]
    width, height = (_PIXELS * one for one in figure.get_size_inches())
    legend = figure.legend(
        [artist for artist, _ in entries],
        # Matplotlib leaves out what begins with an underscore, as names of processes may.
        ["?"] * len(entries),
        loc="upper left",
        bbox_to_anchor=(0.0, -_UNDER_AXES / height),
        ncols=max(1, int(width / (0.92 * max(map(text_width, labels)) + _SAMPLE))),
    )
    for text, label in zip(legend.get_texts(), labels, strict=True):
        text.set_text(label)
