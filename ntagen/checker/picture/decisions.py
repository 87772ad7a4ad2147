"""Decisions as maps over two features, or over one as a band with what each action is worth.

A patch ends exactly at the cuts of the strategy. What no patch covers has never been seen, and is
striped. Waiting is grey, as in the pictures of zones.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import matplotlib as mpl
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import FixedLocator

from ntagen.checker.picture.chart import MOST_TIPS, picture, tiled
from ntagen.checker.picture.figure import CHART_STYLE
from ntagen.checker.picture.page import Svg, darker, shortened

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes as Plane

    from ntagen.checker.picture.patches import Axis, Panel, Patch, Text

_SIDE: Final = 380
_SMALL_SIDE: Final = 250
"""The side of a map if there are several."""
_CURVES: Final = (560, 190)
_WHOLE: Final = 560
"""The room for a title that has no neighbour."""
_COLUMNS: Final = 3
_MOST_NAMES: Final = 14
_UNSEEN: Final[dict[str, Any]] = {
    "facecolor": "#ffffff",
    "edgecolor": "#d5d8dd",
    "hatch": "///",
    "linewidth": 0.0,
}
_SEAM: Final = 0.5
"""The width of the outline of a patch in its own colour: no gap is seen between neighbours."""

_Tips = list[tuple["Artist", str]]


@mpl.rc_context(CHART_STYLE)
def map_picture(
    panels: Sequence[Panel], axes: tuple[Axis, Axis], colors: Mapping[str, str], text: Text
) -> Svg:
    """Draws a map for each panel.

    Args:
        panels: The panels.
        axes: The feature to the right, and the one upwards.
        colors: The colours of all actions.
        text: What is written around them.
    """
    side = _SIDE if len(panels) == 1 else _SMALL_SIDE
    figure, planes = tiled(text.heading, (side, side), len(panels), min(_COLUMNS, len(panels)))
    tips: _Tips = []
    for plane, panel in zip(planes, panels, strict=True):
        _prepare(plane, panel, axes[0], side if len(panels) > 1 else _WHOLE)
        plane.set_ylim(*axes[1].ends)
        plane.set_ylabel(shortened(axes[1].feature, side // 7))
        _name(plane.yaxis, axes[1])
        tips += _paint(plane, panel.patches, colors)
    return _finished(figure, tips, panels, axes, colors, text)


@mpl.rc_context(CHART_STYLE)
def curves_picture(
    panels: Sequence[Panel], axis: Axis, colors: Mapping[str, str], text: Text
) -> Svg:
    """Draws, in a panel below the other, what each action is worth, upon the band of the best one.

    Args:
        panels: The panels.
        axis: The feature to the right.
        colors: The colours of all actions.
        text: What is written around them.
    """
    figure, planes = tiled(text.heading, _CURVES, len(panels), 1)
    tips: _Tips = []
    for plane, panel in zip(planes, panels, strict=True):
        _prepare(plane, panel, axis, _WHOLE)
        plane.set_ylabel("value from there on")
        plane.margins(y=0.08)
        for curve in panel.curves:
            # A gap stands where the action was never tried.
            x = [place for ends, _ in curve.steps for place in (*ends, math.nan)]
            y = [value for _, value in curve.steps for _ in range(3)]
            plane.plot(*_connected(x, y), color=_line(colors[curve.action]), linewidth=1.6)
        low, high = plane.get_ylim()
        plane.set_ylim(low, high)
        whole = [replace(one, sides=(one.sides[0], (low, high))) for one in panel.patches]
        tips += _paint(plane, whole, colors)
    return _finished(figure, tips, panels, (axis,), colors, text)


def _connected(x: list[float], y: list[float]) -> tuple[list[float], list[float]]:
    """Steps without the gaps between neighbours."""
    kept = [
        at
        for at in range(len(x))
        if not (math.isnan(x[at]) and at + 1 < len(x) and x[at - 1] == x[at + 1])
    ]
    return [x[at] for at in kept], [y[at] for at in kept]


def _line(color: str) -> str:
    """A colour that is seen on its light one."""
    return darker(darker(color))


def _prepare(plane: Plane, panel: Panel, axis: Axis, width: int) -> None:
    """The title in a width, the horizontal axis, and the stripes behind all."""
    plane.set_title(shortened(panel.title, width // 6), pad=6.0, color="#404040")
    plane.grid(visible=False)
    plane.set_xlim(*axis.ends)
    plane.set_xlabel(shortened(axis.feature, width // 6))
    _name(plane.xaxis, axis)
    whole = Rectangle((0.0, 0.0), 1.0, 1.0, transform=plane.transAxes, zorder=0.2, **_UNSEEN)
    plane.add_artist(whole)


def _name(side: Any, axis: Axis) -> None:  # noqa: ANN401
    """Writes the values of an exact feature at their places."""
    if axis.names:
        places = range(0, len(axis.names), math.ceil(len(axis.names) / _MOST_NAMES))
        side.set_major_locator(FixedLocator(list(places)))
        side.set_ticklabels([shortened(axis.names[one], 14) for one in places])


def _paint(plane: Plane, patches: Sequence[Patch], colors: Mapping[str, str]) -> _Tips:
    """Paints patches; gives their tooltips, unless nobody could point at one."""
    corners = [
        ((left, low), (left, high), (right, high), (right, low))
        for (left, right), (low, high) in (one.sides for one in patches)
    ]
    paints = [colors[one.action] for one in patches]
    style: dict[str, Any] = {"linewidth": _SEAM, "zorder": 0.5}
    if len(patches) > MOST_TIPS:
        plane.add_collection(
            PolyCollection(corners, facecolors=paints, edgecolors=paints, **style), autolim=False
        )
        return []
    tips: _Tips = []
    for one, paint in zip(patches, paints, strict=True):
        (left, right), (low, high) = one.sides
        patch = Rectangle((left, low), right - left, high - low, color=paint, **style)
        plane.add_artist(patch)
        tips.append((patch, one.note))
    return tips


def _finished(
    figure: Any,  # noqa: ANN401
    tips: Iterable[tuple[Artist, str]],
    panels: Sequence[Panel],
    axes: Sequence[Axis],
    colors: Mapping[str, str],
    text: Text,
) -> Svg:
    """The picture with its legend."""
    has_curves = any(panel.curves for panel in panels)
    entries: list[tuple[Artist, str]] = []
    drawn = {one.action for panel in panels for one in panel.patches}
    drawn |= {one.action for panel in panels for one in panel.curves}
    for action, color in ((one, color) for one, color in colors.items() if one in drawn):
        sample: dict[str, Any] = {"facecolor": color}
        if has_curves:
            sample |= {"edgecolor": _line(color), "linewidth": 1.6}
        entries.append((Rectangle((0.0, 0.0), 1.0, 1.0, **sample), action))
    notes = list(text.notes)
    if has_curves:
        notes.insert(0, "a line is what the action is worth; the colour behind is that of the best")
    if any(_has_gaps(panel, axes) for panel in panels):
        unseen = Rectangle((0.0, 0.0), 1.0, 1.0, **_UNSEEN)
        entries.append((unseen, "never seen: all that is possible has the same chance"))
    entries += [(Line2D([], [], linestyle="none"), note) for note in notes]
    return picture(figure, tips, entries)


def _has_gaps(panel: Panel, axes: Sequence[Axis]) -> bool:
    """Whether a place of exact features is covered by no patch."""
    places = {
        tuple(side for side, axis in zip(one.sides, axes, strict=True) if axis.names)
        for one in panel.patches
    }
    return len(places) < math.prod(len(axis.names) for axis in axes if axis.names)
