"""Trees of decisions as diagrams: a box for each question, and at the ends what is done.

They grow to the right, so that texts stay readable and each leaf has a row of its own. The upper
branch is that of "yes".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from ntagen.checker.picture.layout import text_width
from ntagen.checker.picture.page import (
    HEADING_HEIGHT,
    MARGIN,
    Svg,
    page,
    safe,
    shortened,
)


@dataclass(frozen=True, slots=True)
class Leaf:
    """What is done.

    Attributes:
        action: The action.
        worth: What it is worth.
    """

    action: str
    worth: str


@dataclass(frozen=True, slots=True)
class Question:
    """A comparison.

    Attributes:
        text: What is asked.
        note: The same with all digits, for a tooltip.
        yes: What is done if it holds.
        no: What is done else.
    """

    text: str
    note: str
    yes: Node
    no: Node


Node = Leaf | Question

_ROW: Final = 30
_BOX: Final = 22
_GAP: Final = 44
"""Between columns, with room for "yes" and "no"."""
_PAD: Final = 8
_TITLE: Final = 24
_FONT_SIZE: Final = 12
_LINE: Final = "#404854"
_FAINT: Final = "#5a6270"
_QUESTION_CHARACTERS: Final = 34
_ACTION_CHARACTERS: Final = 60


@dataclass(slots=True)
class _Placed:
    """A node with its place: the column, and the middle of its box."""

    node: Node
    column: int
    middle: float
    parts: list[_Placed] = field(default_factory=list)


def tree_picture(trees: Sequence[tuple[str, Node]], heading: str, colors: Mapping[str, str]) -> Svg:
    """Draws trees below each other.

    Args:
        trees: Each with its title.
        heading: The heading.
        colors: The colours of the actions.
    """
    top = float(MARGIN + HEADING_HEIGHT)
    titles: list[tuple[str, float]] = []
    placed: list[_Placed] = []
    for title, tree in trees:
        if title:
            titles.append((title, top + 14.0))
            top += _TITLE
        place = _Rows(top)
        placed.append(place.of(tree, 0))
        top = place.next_row + 10.0
    nodes = [one for root in placed for one in _all(root)]
    widths: dict[int, float] = {}
    for one in nodes:
        widths[one.column] = max(widths.get(one.column, 0.0), text_width(_text(one.node)))
    lefts = {0: float(MARGIN)}
    for column in range(max(widths)):
        lefts[column + 1] = lefts[column] + widths[column] + 2 * _PAD + _GAP
    parts = [
        f'<text x="{MARGIN}" y="{base:.0f}" font-weight="bold" fill="{_FAINT}">{safe(title)}</text>'
        for title, base in titles
    ]
    for one in nodes:
        parts += _branches(one, lefts, widths)
    for one in nodes:
        parts += _box(one, lefts, colors)
    right = max(lefts[one.column] + widths[one.column] + 2 * _PAD for one in nodes)
    heading = shortened(" ".join(heading.split()), 110)
    words = max(text_width(text) * 1.25 for text in (heading, *(title for title, _ in titles)))
    width = max(right, MARGIN + words) + MARGIN
    return Svg(page((0.0, 0.0, width, top + MARGIN), heading, parts, _FONT_SIZE))


class _Rows:
    """Gives leaves rows, one below the other."""

    def __init__(self, top: float) -> None:
        self.next_row = top

    def of(self, node: Node, column: int) -> _Placed:
        """A tree with its places."""
        if isinstance(node, Leaf):
            middle = self.next_row + _ROW / 2.0
            self.next_row += _ROW
            return _Placed(node, column, middle)
        parts = [self.of(part, column + 1) for part in (node.yes, node.no)]
        return _Placed(node, column, (parts[0].middle + parts[1].middle) / 2.0, parts)


def _all(root: _Placed) -> Iterator[_Placed]:
    yield root
    for part in root.parts:
        yield from _all(part)


def _text(node: Node) -> str:
    if isinstance(node, Question):
        return shortened(node.text, _QUESTION_CHARACTERS)
    return f"{shortened(node.action, _ACTION_CHARACTERS)}: {node.worth}"


def _branches(
    one: _Placed, lefts: Mapping[int, float], widths: Mapping[int, float]
) -> Iterator[str]:
    """The lines from a question to what follows."""
    if isinstance(one.node, Leaf):
        return
    start = lefts[one.column] + text_width(_text(one.node)) + 2 * _PAD
    bend = lefts[one.column] + widths[one.column] + 2 * _PAD + 12.0
    for part, word in zip(one.parts, ("yes", "no"), strict=True):
        end = lefts[part.column]
        yield (
            f'<path d="M{start:.1f},{one.middle:.1f} L{bend:.1f},{one.middle:.1f} '
            f'L{bend:.1f},{part.middle:.1f} L{end:.1f},{part.middle:.1f}" fill="none" '
            f'stroke="{_LINE}" stroke-width="1.2"/>'
        )
        yield (
            f'<text x="{bend + 4.0:.1f}" y="{part.middle - 4.0:.1f}" font-size="11" '
            f'fill="{_FAINT}">{word}</text>'
        )


def _box(one: _Placed, lefts: Mapping[int, float], colors: Mapping[str, str]) -> Iterator[str]:
    """A question, or what is done."""
    text, left = _text(one.node), lefts[one.column]
    width = text_width(text) + 2 * _PAD
    if isinstance(one.node, Leaf):
        note, fill, radius = f"{one.node.action}: {one.node.worth}", colors[one.node.action], 8
    else:
        note, fill, radius = one.node.note, "#ffffff", 0
    yield (
        f'<g><title>{safe(note)}</title><rect x="{left:.1f}" y="{one.middle - _BOX / 2:.1f}" '
        f'width="{width:.1f}" height="{_BOX}" rx="{radius}" fill="{fill}" '
        f'stroke="{_LINE}" stroke-width="1"/>'
        f'<text x="{left + _PAD:.1f}" y="{one.middle + 4.0:.1f}" fill="#202020">{safe(text)}</text>'
        "</g>"
    )
