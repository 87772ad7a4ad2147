"""A run as a Gantt chart: a row for each process, a bar for each stay in a location.

The axis is the model's time. In a run that takes no time at all, it counts states instead, so that
something is seen. A location that is left at the moment of entry is a thin mark. Each bar has a
tooltip with exact times.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

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


@dataclass(frozen=True, slots=True)
class Stay:
    """A stay in a location.

    Attributes:
        process: The process.
        location: Where it stays.
        start: When it enters the location.
        end: When it leaves it, or when the run ends.
    """

    process: str
    location: str
    start: Fraction
    end: Fraction


_ROW_HEIGHT: Final = 24
_BAR_HEIGHT: Final = 18
_WIDTH: Final = 760
_MARK_WIDTH: Final = 2.0
_TICKS: Final = 10
_NAME_CHARACTERS: Final = 28
_FONT_SIZE: Final = 12


def gantt(
    stays: Sequence[Stay], heading: str, unit: str, marks: Sequence[tuple[Fraction, str]]
) -> Svg:
    """Draws stays, in the order of the processes and of time.

    Args:
        stays: All stays.
        heading: The heading.
        unit: What the axis counts.
        marks: Moments that get a dashed line, each with a word.
    """
    processes = list(dict.fromkeys(stay.process for stay in stays))
    last = max((stay.end for stay in stays), default=Fraction(0))
    left = (
        MARGIN
        + 8
        + max((text_width(shortened(one, _NAME_CHARACTERS)) for one in processes), default=0)
    )
    top = MARGIN + HEADING_HEIGHT
    bottom = top + _ROW_HEIGHT * len(processes)
    scale = _WIDTH / float(last or 1)
    parts = [
        *_axis(left, top, bottom, last, scale, unit),
        *_rows(stays, processes, left, top, scale),
    ]
    for moment, word in marks:
        x = left + float(moment) * scale
        parts.append(
            f'<line x1="{x:.1f}" y1="{top - 4}" x2="{x:.1f}" y2="{bottom}" stroke="#b03030" '
            f'stroke-dasharray="4 3"/>'
        )
        parts.append(
            f'<text x="{x:.1f}" y="{top - 6}" font-size="10" text-anchor="middle" '
            f'fill="#b03030">{safe(word)}</text>'
        )
    box = (0.0, 0.0, left + _WIDTH + 3 * MARGIN, bottom + 48.0)
    return Svg(page(box, heading, parts, _FONT_SIZE))


def _axis(
    left: float, top: float, bottom: float, last: Fraction, scale: float, unit: str
) -> Iterator[str]:
    for tick in ticks(float(last)):
        x = left + tick * scale
        yield f'<line x1="{x:.1f}" y1="{top}" x2="{x:.1f}" y2="{bottom + 4}" stroke="#e2e5ea"/>'
        yield (
            f'<text x="{x:.1f}" y="{bottom + 17}" font-size="11" text-anchor="middle" '
            f'fill="#404040">{tick:g}</text>'
        )
    yield (
        f'<text x="{left + _WIDTH / 2:.1f}" y="{bottom + 34}" font-size="11" '
        f'text-anchor="middle" fill="#404040">{safe(unit)}</text>'
    )


def ticks(last: float) -> list[float]:
    """Round numbers from 0 to `last`, about ten of them."""
    if last <= 0.0:
        return [0.0]
    rough = last / _TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * one for one in (1, 2, 5, 10) if power * one >= rough * (1 - 1e-9))
    return [step * index for index in range(int(last / step + 1e-9) + 1)]


def _rows(
    stays: Sequence[Stay], processes: Sequence[str], left: float, top: float, scale: float
) -> Iterator[str]:
    row_of = {name: row for row, name in enumerate(processes)}
    for name, row in row_of.items():
        y = top + _ROW_HEIGHT * row + _BAR_HEIGHT / 2 + 7
        yield (
            f'<text x="{left - 8:.1f}" y="{y:.1f}" text-anchor="end" fill="#202020">'
            f"{safe(shortened(name, _NAME_CHARACTERS))}</text>"
        )
    # By the order in which the locations of a process are first visited.
    colors: dict[tuple[str, str], str] = {}
    seen: dict[str, int] = {}
    # Thin marks are drawn last: the bar that follows would hide a part of them.
    for stay in sorted(stays, key=lambda one: one.start == one.end):
        key = (stay.process, stay.location)
        if key not in colors:
            seen[stay.process] = seen.get(stay.process, -1) + 1
            colors[key] = LIGHT[seen[stay.process] % len(LIGHT)]
        y = top + _ROW_HEIGHT * row_of[stay.process] + (_ROW_HEIGHT - _BAR_HEIGHT) / 2
        yield _bar(stay, colors[key], left + float(stay.start) * scale, y, scale)


def _bar(stay: Stay, color: str, x: float, y: float, scale: float) -> str:
    width = float(stay.end - stay.start) * scale
    name = f"{stay.process}.{stay.location}"
    if not width:
        return (
            f'<g><title>{safe(name)} at {stay.start}</title><rect x="{x - _MARK_WIDTH / 2:.1f}" '
            f'y="{y - 2:.1f}" width="{_MARK_WIDTH}" height="{_BAR_HEIGHT + 4}" fill="#303030"/></g>'
        )
    label = ""
    if width > 16:
        shown = stay.location
        if text_width(shown) + 6 > width:
            shown = shortened(shown, int((width - 6) / text_width("m")))
        label = (
            f'<text x="{x + 4:.1f}" y="{y + 13:.1f}" font-size="11" fill="#202020">'
            f"{safe(shown)}</text>"
        )
    return (
        f"<g><title>{safe(name)} from {stay.start} to {stay.end}</title>"
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{_BAR_HEIGHT}" rx="2" '
        f'fill="{color}" stroke="#7a8290" stroke-width="0.7"/>{label}</g>'
    )
