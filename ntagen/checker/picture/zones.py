"""Zones of two clocks as a picture: an area for each, in the colour of what is done there.

A corner is exact; only the last step, to the places on the page, rounds. Where a zone has no end,
its area goes to the edge of the picture. A bound that belongs to its zone is a line, one that does
not is dashed, and each line is drawn inside its area, so that neighbours do not cover each other's.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, Literal

import matplotlib as mpl
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle

from ntagen.checker.picture.chart import picture, stacked
from ntagen.checker.picture.figure import CHART_STYLE
from ntagen.checker.picture.halves import Axes, Half, clipped
from ntagen.checker.picture.page import Svg, colors_of, darker

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes as Plane


@dataclass(frozen=True, slots=True)
class Area:
    """What holds in some zones.

    Attributes:
        kind: What is done there; areas of one kind have one colour and one line in the legend.
        zones: Each is an intersection of halves.
        note: What a tooltip says.
    """

    kind: str
    zones: tuple[tuple[Half, ...], ...]
    note: str


_SIDE: Final = 380
_STRIP: Final = 56
"""The height of the picture of one clock."""
_LINE: Final = "#404854"
_WIDTH: Final = 1.2
_UNIT: Final = "[units of the model's time]"
_HATCHES: Final = ("///", "\\\\\\", "---", "|||", "...", "ooo", "++", "xx")
"""How areas are striped; of those that overlap, all are seen."""


@mpl.rc_context(CHART_STYLE)
def zones_picture(
    areas: Sequence[Area], axes: Axes, heading: str, notes: Sequence[str], *, striped: bool
) -> Svg:
    """Draws areas.

    Args:
        areas: Where areas overlap, the first one counts.
        axes: The clocks.
        heading: The heading.
        notes: Lines below the legend.
        striped: Whether all areas count where they overlap: they have stripes, so that all are
            seen.
    """
    colors = colors_of(area.kind for area in areas)
    striped = striped and len(colors) > 1
    figure, (plane,) = stacked(heading, (_SIDE, _SIDE if axes.y else _STRIP))
    plane.grid(visible=False)
    plane.set_facecolor("#fafafa")
    plane.set_xlim(0.0, float(axes.x_end))
    plane.set_ylim(0.0, float(axes.y_end))
    plane.set_xlabel(f"{axes.x} {_UNIT}")
    if axes.y is None:
        plane.set_yticks([])
    else:
        plane.set_ylabel(f"{axes.y} {_UNIT}")
    paints = {
        kind: _striped(number, darker(color)) if striped else {"facecolor": color}
        for number, (kind, color) in enumerate(colors.items())
    }
    tips = [
        (artist, area.note)
        for area, zone in reversed(list(_seen(areas, striped=striped)))
        for artist in _zone(plane, zone, axes, paints[area.kind])
    ]
    entries: list[tuple[Artist, str]] = [
        (Rectangle((0.0, 0.0), 1.0, 1.0, **paint), kind) for kind, paint in paints.items()
    ]
    entries += [
        (_bound("-"), "the bound belongs to the zone (<=, >=)"),
        (_bound("--"), "the bound does not belong to it (<, >)"),
        *((_bound("none"), note) for note in notes),
    ]
    return picture(figure, tips, entries)


_Style = Literal["-", "--", "none"]


def _bound(style: _Style) -> Line2D:
    return Line2D([], [], color=_LINE, linewidth=_WIDTH, linestyle=style)


def _striped(number: int, color: str) -> dict[str, Any]:
    """Stripes of a colour, in a direction of their own."""
    hatch = _HATCHES[number % len(_HATCHES)]
    return {"facecolor": "none", "edgecolor": color, "linewidth": 0.0, "hatch": hatch}


def _seen(areas: Sequence[Area], *, striped: bool) -> Iterator[tuple[Area, Sequence[Half]]]:
    """The zones of areas without those that others hide: their outlines would only confuse.

    Where the first area counts, an earlier zone hides those within it. Where all count, only one
    of the same kind does.
    """
    kept: list[tuple[Area, Sequence[Half]]] = []
    for area in areas:
        for zone in area.zones:
            if any(
                _is_within(zone, other)
                for one, other in kept
                if not striped or one.kind == area.kind
            ):
                continue
            if striped:
                kept = [
                    (one, other)
                    for one, other in kept
                    if one.kind != area.kind or not _is_within(other, zone)
                ]
            kept.append((area, zone))
    yield from kept


def _is_within(zone: Sequence[Half], other: Sequence[Half]) -> bool:
    """Whether a zone is a part of another one; its halves leave nothing to be tightened."""
    limits = {(half.along_x, half.along_y): (half.bound, not half.strict) for half in zone}
    return all(
        (found := limits.get((half.along_x, half.along_y))) is not None
        and found <= (half.bound, not half.strict)
        for half in other
    )


def _zone(
    plane: Plane, zone: Sequence[Half], axes: Axes, paint: dict[str, Any]
) -> Iterator[Artist]:
    """Draws a zone; gives what shows it."""
    zero = Fraction(0)
    whole = ((zero, zero), (axes.x_end, zero), (axes.x_end, axes.y_end), (zero, axes.y_end))
    corners = clipped(whole, zone)
    places = [(float(x), float(y)) for x, y in corners]
    if len(places) > 2:
        area = plane.add_patch(Polygon(places, zorder=1.0, **paint))
        yield area
        ends = pairwise([*zip(corners, places, strict=True), (corners[0], places[0])])
        # The bounds of one style are one line with gaps, which is drawn in less time.
        bounds: dict[_Style, list[tuple[float, float]]] = {}
        for (first, start), (second, end) in ends:
            limits = [half for half in zone if not half.excess(first) and not half.excess(second)]
            if any(not half.is_plain for half in limits):
                style: _Style = "--" if any(half.strict for half in limits) else "-"
                bounds.setdefault(style, []).extend([start, end, (math.nan, math.nan)])
        for style, line in bounds.items():
            # Half of it is outside of the area, and is not seen.
            _line(plane, line, 2.0 * _WIDTH, _LINE, style).set_clip_path(area)
        return
    color = paint.get("edgecolor", paint["facecolor"])
    if len(places) == 2:
        # Without an inside, it is a thick line; an end is full if it belongs to the zone.
        yield _line(plane, places, 5.25, _LINE)
        yield _line(plane, places, 3.4, color)
        for corner, other, place in zip(corners, reversed(corners), places, strict=True):
            limits = [half for half in zone if not half.excess(corner) and half.excess(other)]
            if limits:
                is_open = any(half.strict for half in limits)
                _point(plane, place, 6.0, "#ffffff" if is_open else _LINE)
    for place in places[:1] if len(places) == 1 else ():
        yield _point(plane, place, 7.5, color)


def _line(
    plane: Plane, ends: Sequence[tuple[float, float]], width: float, color: str, style: _Style = "-"
) -> Line2D:
    """A line above what was drawn before, and below what follows."""
    x, y = zip(*ends, strict=True)
    line = Line2D(x, y, linewidth=width, color=color, linestyle=style, zorder=1.0)
    line.set_solid_capstyle("butt")
    return plane.add_line(line)


def _point(plane: Plane, place: tuple[float, float], size: float, color: str) -> Line2D:
    """A point, whole even on the edge of the picture."""
    (point,) = plane.plot(*place, "o", markersize=size, zorder=1.0, clip_on=False)
    point.set(markerfacecolor=color, markeredgecolor=_LINE)
    return point
