"""Zones of two clocks as a picture: an area for each, in the colour of what is done there.

A corner is exact; only the last step, to the places on the page, rounds. Where a zone has no end,
its area goes to the edge of the picture. A bound that belongs to its zone is a line, one that does
not is dashed, and each line is drawn a little inside, so that neighbours do not cover each other's.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Final

from ntagen.checker.picture.gantt import ticks
from ntagen.checker.picture.layout import text_width
from ntagen.checker.picture.page import (
    HEADING_HEIGHT,
    LIGHT,
    MARGIN,
    Svg,
    page,
    safe,
    shortened,
)

Corner = tuple[Fraction, Fraction]


@dataclass(frozen=True, slots=True)
class Half:
    """A half of the plane: where ``along_x * x + along_y * y`` is at most `bound`.

    Attributes:
        along_x: -1, 0 or 1.
        along_y: -1, 0 or 1.
        bound: The greatest value.
        strict: Whether the bound itself is left out.
    """

    along_x: int
    along_y: int
    bound: Fraction
    strict: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether it only says that a clock is not negative."""
        return self.along_x + self.along_y == -1 and not self.bound and not self.strict

    def excess(self, corner: Corner) -> Fraction:
        """By how much a corner is outside; at most 0 if it is inside."""
        return self.along_x * corner[0] + self.along_y * corner[1] - self.bound


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


@dataclass(frozen=True, slots=True)
class Axes:
    """The clocks of a picture.

    Attributes:
        x: The name of the clock to the right.
        y: That of the clock upwards; ``None`` if there is only one clock.
        x_end: Up to which value it is drawn.
        y_end: The same upwards.
    """

    x: str
    y: str | None
    x_end: Fraction
    y_end: Fraction


WAIT: Final = "wait"
"""The kind of areas in which nothing is done yet; they are grey."""

_GREY: Final = "#d5d8dd"
_SIDE: Final = 380
_STRIP: Final = 56
"""The height of the picture of one clock."""
_LINE: Final = "#404854"
_INSIDE: Final = 1.3
"""How far inside its area a line is drawn."""
_LEGEND_CHARACTERS: Final = 90
_ROW: Final = 20
_FONT_SIZE: Final = 12
_DASHES: Final = "5 4"
_STRIPE: Final = 6


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
    colors = _colors(areas)
    striped = striped and len(colors) > 1
    paints = {
        kind: _Paint(f"url(#{_stripe_id(number, colors)})", _darker(color))
        if striped
        else _Paint(color, color)
        for number, (kind, color) in enumerate(colors.items())
    }
    height = _SIDE if axes.y else _STRIP
    frame = _Frame(
        left=MARGIN + 12 + (max(text_width(axes.y), 40.0) if axes.y else 0.0),
        top=MARGIN + HEADING_HEIGHT + 6.0,
        height=height,
        axes=axes,
    )
    parts = [*(_stripes(colors) if striped else ()), *_paper(frame)]
    for area, zone in reversed(list(_seen(areas, striped=striped))):
        parts += _zone(zone, area, paints[area.kind], frame)
    parts += _scales(frame)
    under = frame.top + height + 54
    entries = [(one.area, shortened(kind, _LEGEND_CHARACTERS)) for kind, one in paints.items()]
    parts += _legend(entries, notes, frame.left, under)
    widest = max([0.0, *(text_width(text) for _, text in entries), *map(text_width, notes)])
    width = max(frame.left + _SIDE, frame.left + 40 + widest, text_width(heading) * 1.25)
    bottom = under + _ROW * (len(entries) + len(notes) + 2) + 4
    box = (0.0, 0.0, width + 2 * MARGIN, bottom + MARGIN)
    return Svg(page(box, heading, parts, _FONT_SIZE))


@dataclass(frozen=True, slots=True)
class _Paint:
    """The fill of areas of one kind, and the colour of their lines and points."""

    area: str
    line: str


def _colors(areas: Sequence[Area]) -> dict[str, str]:
    """A colour for each kind, in the order of the areas."""
    palette = [color for color in LIGHT if color != _GREY]
    moves = [kind for kind in dict.fromkeys(area.kind for area in areas) if kind != WAIT]
    colors = {kind: palette[number % len(palette)] for number, kind in enumerate(moves)}
    return colors | ({WAIT: _GREY} if any(area.kind == WAIT for area in areas) else {})


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


@dataclass(frozen=True, slots=True)
class _Frame:
    """Where the picture stands on the page."""

    left: float
    top: float
    height: float
    axes: Axes

    def place(self, corner: Corner) -> tuple[float, float]:
        x = self.left + _SIDE * float(corner[0] / self.axes.x_end)
        return x, self.top + self.height * (1.0 - float(corner[1] / self.axes.y_end))

    @property
    def sides(self) -> tuple[Half, ...]:
        """Where the picture ends; clocks are not negative."""
        zero = Fraction(0)
        x_end, y_end = self.axes.x_end, self.axes.y_end
        return (Half(-1, 0, zero), Half(0, -1, zero), Half(1, 0, x_end), Half(0, 1, y_end))

    @property
    def corners(self) -> list[Corner]:
        zero = Fraction(0)
        x_end, y_end = self.axes.x_end, self.axes.y_end
        return [(zero, zero), (x_end, zero), (x_end, y_end), (zero, y_end)]


def clipped(corners: Sequence[Corner], halves: Sequence[Half]) -> list[Corner]:
    """The corners of the part of a convex polygon that lies in all these halves.

    It keeps their order. It may be a line (two corners), a point, or empty. After Sutherland and
    Hodgman, "Reentrant polygon clipping" (1974).
    """
    left = list(corners)
    for half in halves:
        kept: list[Corner] = []
        for start, end in pairwise([*left[-1:], *left]):
            before, after = half.excess(start), half.excess(end)
            if (before < 0 < after) or (after < 0 < before):
                share = before / (before - after)
                kept.append(
                    (
                        start[0] + share * (end[0] - start[0]),
                        start[1] + share * (end[1] - start[1]),
                    )
                )
            if after <= 0:
                kept.append(end)
        left = list(dict.fromkeys(kept))
    return left


def _zone(zone: Sequence[Half], area: Area, paint: _Paint, frame: _Frame) -> Iterator[str]:
    corners = clipped(frame.corners, zone)
    if not corners:
        return
    places = [frame.place(corner) for corner in corners]
    tooltip = f"<title>{safe(area.note)}</title>"
    if len(places) == 1:
        (x, y) = places[0]
        yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{paint.line}" stroke="{_LINE}">'
        yield f"{tooltip}</circle>"
        return
    if len(places) == 2:
        yield from _line(zone, corners, places, paint.line, tooltip)
        return
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
    yield f'<polygon points="{points}" fill="{paint.area}">{tooltip}</polygon>'
    ends = pairwise([*zip(corners, places, strict=True), (corners[0], places[0])])
    for (first, start), (second, end) in ends:
        limits = [half for half in zone if not half.excess(first) and not half.excess(second)]
        if any(not half.is_plain for half in limits):
            yield _bound(start, end, strict=any(half.strict for half in limits))


def _line(
    zone: Sequence[Half],
    corners: Sequence[Corner],
    places: Sequence[tuple[float, float]],
    fill: str,
    tooltip: str,
) -> Iterator[str]:
    """A zone without an inside; an end is full if it belongs to the zone, and else hollow."""
    (x1, y1), (x2, y2) = places
    for color, width in ((_LINE, 7), (fill, 4.5)):
        yield (
            f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" '
            f'stroke="{color}" stroke-width="{width}">{tooltip}</line>'
        )
    for corner, other, (x, y) in zip(corners, reversed(corners), places, strict=True):
        ends = [half for half in zone if not half.excess(corner) and half.excess(other)]
        if ends:
            color = "#ffffff" if any(half.strict for half in ends) else _LINE
            yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{color}" stroke="{_LINE}"/>'


def _bound(start: tuple[float, float], end: tuple[float, float], *, strict: bool) -> str:
    (x1, y1), (x2, y2) = start, end
    length = ((x2 - x1) ** 2 + (y2 - y1) ** 2) ** 0.5 or 1.0
    # The corners go round against the clock on the page, so that the inside is on the left.
    aside = (y2 - y1) / length * _INSIDE, -(x2 - x1) / length * _INSIDE
    dashes = f' stroke-dasharray="{_DASHES}"' if strict else ""
    return (
        f'<line x1="{x1 + aside[0]:.1f}" y1="{y1 + aside[1]:.1f}" x2="{x2 + aside[0]:.1f}" '
        f'y2="{y2 + aside[1]:.1f}" stroke="{_LINE}" stroke-width="1.6"{dashes}/>'
    )


def _stripe_id(number: int, all_kinds: Collection[str]) -> str:
    """The id of a pattern; in a notebook, several pictures stand on one page."""
    return f"stripes-{number}-of-{len(all_kinds)}"


def _stripes(colors: dict[str, str]) -> Iterator[str]:
    """Stripes for each colour, each in a place of its own: where areas overlap, all are seen."""
    yield "<defs>"
    period = _STRIPE * len(colors)
    for number, color in enumerate(colors.values()):
        yield (
            f'<pattern id="{_stripe_id(number, colors)}" width="{period}" height="{period}" '
            'patternUnits="userSpaceOnUse" patternTransform="rotate(45)">'
            f'<rect y="{_STRIPE * number}" width="{period}" height="{_STRIPE}" '
            f'fill="{_darker(color)}"/></pattern>'
        )
    yield "</defs>"


def _darker(color: str) -> str:
    """A colour that is still seen in thin stripes."""
    parts = [int(color[at : at + 2], 16) for at in (1, 3, 5)]
    return "#" + "".join(f"{max(0, round(255 - 1.9 * (255 - part))):02x}" for part in parts)


def _paper(frame: _Frame) -> Iterator[str]:
    yield (
        f'<rect x="{frame.left:.1f}" y="{frame.top:.1f}" width="{_SIDE}" '
        f'height="{frame.height}" fill="#fafafa" stroke="#c3c8d0"/>'
    )


def _scales(frame: _Frame) -> Iterator[str]:
    axes, bottom = frame.axes, frame.top + frame.height
    for tick in ticks(float(axes.x_end)):
        x, _ = frame.place((Fraction(tick), Fraction(0)))
        yield (
            f'<line x1="{x:.1f}" y1="{bottom}" x2="{x:.1f}" y2="{bottom + 5}" stroke="{_LINE}"/>'
        )
        yield (
            f'<text x="{x:.1f}" y="{bottom + 18}" font-size="11" text-anchor="middle" '
            f'fill="#404040">{tick:g}</text>'
        )
    middle = frame.left + _SIDE / 2
    unit = "[units of the model's time]"
    yield (
        f'<text x="{middle:.1f}" y="{bottom + 35}" text-anchor="middle" fill="#202020">'
        f"{safe(axes.x)} {unit}</text>"
    )
    if axes.y is None:
        return
    for tick in ticks(float(axes.y_end)):
        _, y = frame.place((Fraction(0), Fraction(tick)))
        yield (
            f'<line x1="{frame.left - 5:.1f}" y1="{y:.1f}" x2="{frame.left:.1f}" y2="{y:.1f}" '
            f'stroke="{_LINE}"/>'
        )
        yield (
            f'<text x="{frame.left - 8:.1f}" y="{y + 4:.1f}" font-size="11" text-anchor="end" '
            f'fill="#404040">{tick:g}</text>'
        )
    yield (
        f'<text x="{frame.left - 6:.1f}" y="{frame.top - 6:.1f}" text-anchor="end" '
        f'fill="#202020">{safe(axes.y)}</text>'
    )


def _legend(
    entries: Sequence[tuple[str, str]], notes: Sequence[str], left: float, top: float
) -> Iterator[str]:
    for number, (fill, text) in enumerate(entries):
        y = top + _ROW * number
        yield (
            f'<rect x="{left:.1f}" y="{y}" width="26" height="13" fill="{fill}" '
            f'stroke="{_LINE}" stroke-width="0.8"/>'
        )
        yield f'<text x="{left + 36:.1f}" y="{y + 11}" fill="#202020">{safe(text)}</text>'
    y = top + _ROW * len(entries)
    for dashes, text in (
        ("", "the bound belongs to the zone (<=, >=)"),
        (f' stroke-dasharray="{_DASHES}"', "the bound does not belong to it (<, >)"),
    ):
        yield (
            f'<line x1="{left:.1f}" y1="{y + 7}" x2="{left + 26:.1f}" y2="{y + 7}" '
            f'stroke="{_LINE}" stroke-width="1.6"{dashes}/>'
        )
        yield f'<text x="{left + 36:.1f}" y="{y + 11}" fill="#404040">{safe(text)}</text>'
        y += _ROW
    for note in notes:
        yield f'<text x="{left:.1f}" y="{y + 11}" fill="#606874">{safe(note)}</text>'
        y += _ROW
