"""A run as a sequence chart: a line for each process, from top to bottom, and what passes.

Steps have equal heights; the moment of each stands at its left. A synchronisation is an arrow from
the sender to each receiver. The locations that a step enters stand on the lines in boxes, and what
it changes at the right.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from ntagen.checker.picture.layout import text_width
from ntagen.checker.picture.page import HEADING_HEIGHT, MARGIN, Svg, page, safe, shortened


@dataclass(frozen=True, slots=True)
class Event:
    """A step of a run.

    Attributes:
        when: Its moment, as a text.
        moves: The processes that move, the sender first, each with the location that it enters.
        label: What they do together, for example ``go[1]``; empty if there is nothing to say.
        changes: The variables that change, in words.
    """

    when: str
    moves: Mapping[str, str]
    label: str
    changes: str


_STEP_HEIGHT: Final = 44
_NAME_CHARACTERS: Final = 24
_CHANGE_CHARACTERS: Final = 60
_FONT_SIZE: Final = 12
_LINE: Final = "#9aa3b0"
_ARROW: Final = "#0e87a5"


def sequence(first: Mapping[str, str], events: Sequence[Event], heading: str, ending: str) -> Svg:
    """Draws a run.

    Args:
        first: The location of each process at the beginning.
        events: The steps.
        heading: The heading.
        ending: How the run ends, in words; empty if there is nothing to say.
    """
    widths = {name: text_width(shortened(name, _NAME_CHARACTERS)) for name in first}
    for moves in ({**first}, *(event.moves for event in events)):
        for name, place in moves.items():
            widths[name] = max(widths[name], text_width(shortened(place, _NAME_CHARACTERS)))
    gap = max(
        [34.0, *(text_width(shortened(event.label, _NAME_CHARACTERS)) - 30 for event in events)]
    )
    left = MARGIN + 12 + max([30.0, *(text_width(event.when) for event in events)])
    middles, x = {}, left
    for name, width in widths.items():
        middles[name] = x + width / 2 + 8
        x += width + 16 + gap
    top = MARGIN + HEADING_HEIGHT + 14
    bottom = top + 34 + _STEP_HEIGHT * (len(events) + 1)
    changes = max([0.0, *(text_width(shortened(e.changes, _CHANGE_CHARACTERS)) for e in events)])
    parts = [
        f'<line x1="{middle:.1f}" y1="{top + 8}" x2="{middle:.1f}" y2="{bottom - 24}" '
        f'stroke="{_LINE}"/>'
        for middle in middles.values()
    ]
    for name, middle in middles.items():
        parts.append(
            f'<text x="{middle:.1f}" y="{top}" text-anchor="middle" font-weight="bold" '
            f'fill="#202020"><title>{safe(name)}</title>'
            f"{safe(shortened(name, _NAME_CHARACTERS))}</text>"
        )
        parts.append(_place(name, first[name], middle, top + 20))
    for number, event in enumerate(events):
        y = top + 20 + _STEP_HEIGHT * (number + 1)
        parts += _step(event, middles, y, left, x)
    if ending:
        parts.append(f'<text x="{left:.1f}" y="{bottom:.1f}" fill="#404040">{safe(ending)}</text>')
    width = max(x + changes, left + text_width(ending), text_width(heading) * 1.3)
    box = (0.0, 0.0, width + 2 * MARGIN, bottom + MARGIN)
    return Svg(page(box, heading, parts, _FONT_SIZE))


def _step(
    event: Event, middles: Mapping[str, float], y: float, left: float, right: float
) -> Iterator[str]:
    """The step whose boxes stand at the height `y`; its arrows are above them."""
    moving = list(event.moves)
    at = y - 20
    yield (
        f'<text x="{left - 12:.1f}" y="{at + 4:.1f}" text-anchor="end" fill="#606874">'
        f"{safe(event.when)}</text>"
    )
    sender = middles[moving[0]] if moving else left
    for name in moving[1:]:
        end = middles[name]
        back = end - 8 if end > sender else end + 8
        yield (
            f'<line x1="{sender:.1f}" y1="{at:.1f}" x2="{back:.1f}" y2="{at:.1f}" '
            f'stroke="{_ARROW}" stroke-width="1.4"/>'
        )
        yield (
            f'<polygon points="{end:.1f},{at:.1f} {back:.1f},{at - 3.6:.1f} '
            f'{back:.1f},{at + 3.6:.1f}" fill="{_ARROW}"/>'
        )
    if moving:
        yield f'<circle cx="{sender:.1f}" cy="{at:.1f}" r="3" fill="{_ARROW}"/>'
    if event.label:
        # A label stands beside the sender's line, on the side of the first receiver.
        to_left = len(moving) > 1 and middles[moving[1]] < sender
        anchor, x = ("end", sender - 7) if to_left else ("start", sender + 7)
        yield (
            f'<text x="{x:.1f}" y="{at - 4:.1f}" text-anchor="{anchor}" font-size="11" '
            f'fill="{_ARROW}"><title>{safe(event.label)}</title>'
            f"{safe(shortened(event.label, _NAME_CHARACTERS))}</text>"
        )
    for name, place in event.moves.items():
        yield _place(name, place, middles[name], y)
    if event.changes:
        yield (
            f'<text x="{right:.1f}" y="{at + 4:.1f}" font-size="11" fill="#1f3fbf">'
            f"<title>{safe(event.changes)}</title>"
            f"{safe(shortened(event.changes, _CHANGE_CHARACTERS))}</text>"
        )


def _place(process: str, location: str, middle: float, y: float) -> str:
    shown = shortened(location, _NAME_CHARACTERS)
    width = text_width(shown) + 12
    return (
        f"<g><title>{safe(process)}.{safe(location)}</title>"
        f'<rect x="{middle - width / 2:.1f}" y="{y - 10:.1f}" width="{width:.1f}" height="19" '
        f'rx="9" fill="#dbe7f8" stroke="#7a8290" stroke-width="0.7"/>'
        f'<text x="{middle:.1f}" y="{y + 4:.1f}" text-anchor="middle" font-size="11" '
        f'fill="#202020">{safe(shown)}</text></g>'
    )
