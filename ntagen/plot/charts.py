"""Charts of numbers as figures, for the formats that a browser's SVG does not cover.

The same charts as in `ntagen.checker.picture.chart`, which says what they hold.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ntagen.checker.picture.chart import Band, Bars, Chart, Item, Line, Panel, stepped, svg
from ntagen.plot.save import format_of, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDTH_IN: Final = 8.0
_IN_PER_PIXEL: Final = 2.7 / 190
_AROUND_IN: Final = 1.1
_DPI: Final = 150
_LEGEND_CHARACTERS: Final = 120
_BAND_ALPHA: Final = 0.16
_BARS_ALPHA: Final = 0.75


def write_chart(chart: Chart, path: Path) -> None:
    """Draws a chart into a file; its ending is the format.

    Raises:
        InputError: The file cannot be written, or its ending is unknown.
    """
    if format_of(path) == "svg":
        svg(chart).save(path)
        return
    save(draw_chart(chart), path)


def draw_chart(chart: Chart) -> Figure:
    """The figure; the caller saves it (`ntagen.plot.save`)."""
    from matplotlib.figure import Figure

    heights = [panel.height * _IN_PER_PIXEL for panel in chart.panels]
    size = (_WIDTH_IN, _AROUND_IN + sum(heights))
    figure = Figure(figsize=size, dpi=_DPI, layout="constrained")
    grid = figure.subplots(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
    for axes, panel in zip(grid, chart.panels, strict=True):
        _draw_panel(axes, panel, chart.x_span)
    handles: dict[str, Any] = {}
    for axes in grid:
        drawn, labels = axes.get_legend_handles_labels()
        for handle, label in zip(drawn, labels, strict=True):
            handles.setdefault(label, handle)
    if handles:
        order = [item.label for item in chart.legend]
        figure.legend(
            [handles[label] for label in order],
            [_plain(label) for label in order],
            loc="outside lower center",
            ncols=_columns(order),
            frameon=False,
            fontsize=8,
        )
    figure.suptitle(_plain(chart.heading), fontsize=11, fontweight="bold")
    grid[0].set_title(_plain(chart.caption), fontsize=9, color="#404040")
    return figure


def _columns(labels: list[str]) -> int:
    """How many entries of the legend fit beside each other."""
    widest = max(len(label) for label in labels) + 8
    return max(1, min(len(labels), _LEGEND_CHARACTERS // widest))


def _draw_panel(axes: Any, panel: Panel, x_span: tuple[float, float]) -> None:  # noqa: ANN401
    for item in panel.items:
        _draw_item(axes, item)
    axes.set_xlim(*x_span)
    axes.set_ylim(*panel.y_span)
    axes.set_xlabel(_plain(panel.x_label), fontsize=9)
    axes.set_ylabel(_plain(panel.y_label), fontsize=9)
    axes.grid(True, color="#e6e8ec", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8)


def _draw_item(axes: Any, item: Item) -> None:  # noqa: ANN401
    label = item.label or None
    match item:
        case Line():
            corners = stepped(item.x, item.y) if item.is_step else zip(item.x, item.y, strict=True)
            x, y = zip(*corners, strict=True)
            style = "--" if item.is_dashed else "-"
            # Widths are pixels of a page; here they are points.
            axes.plot(x, y, style, color=item.colour, lw=0.8 * item.width, label=label)
        case Band():
            step = "post" if item.is_step else None
            axes.fill_between(
                item.x,
                item.lower,
                item.upper,
                step=step,
                color=item.colour,
                alpha=_BAND_ALPHA,
                lw=0,
                label=label,
            )
        case Bars():
            edges = list(item.edges)
            widths = [end - start for start, end in pairwise(edges)]
            axes.bar(
                edges[:-1],
                item.heights,
                widths,
                align="edge",
                color=item.colour,
                alpha=_BARS_ALPHA,
                lw=0.3,
                edgecolor="white",
                label=label,
            )


def _plain(text: str) -> str:
    """A text in which matplotlib sees no formulas."""
    return text.replace("$", r"\$")
