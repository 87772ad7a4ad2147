"""Draws a template as an SVG picture in the style of UPPAAL's editor.

A committed location shows a C, an urgent one a U; the initial one has a second circle. Edges of the
environment and legs of branch points are dashed. Each kind of label has its own colour.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final

from ntagen.checker.picture.diagram import BranchPoint, Diagram, Edge, LabelKind, Location, Point
from ntagen.checker.picture.layout import (
    BRANCH_POINT_RADIUS,
    LINE_HEIGHT,
    LOCATION_RADIUS,
    drawn_labels,
    placed,
    positions_of,
    text_height,
    text_width,
)
from ntagen.checker.picture.page import HEADING_HEIGHT, MARGIN, Svg, page, safe

_COLORS: Final[dict[LabelKind, str]] = {
    "name": "#8b1a1a",
    "invariant": "#a020a0",
    "rate": "#c0392b",
    "select": "#9a7d0a",
    "guard": "#0b7a3b",
    "sync": "#0e87a5",
    "update": "#1f3fbf",
    "weight": "#8a5a2b",
}
_LINE_COLOR: Final = "#303030"
_FILL: Final = "#dbe7f8"
_FONT_SIZE: Final = 12
_ARROW_LENGTH: Final = 9.0
_ARROW_HALF_WIDTH: Final = 3.6
_BEND_RADIUS: Final = 9.0
_SIZE: Final = re.compile(r'<svg [^>]*?width="(\d+)" height="(\d+)"')
_INITIAL_GAP: Final = 3.5
"""The distance between the two circles of the initial location."""


def draw(diagram: Diagram) -> str:
    """Draws a template.

    Returns:
        An SVG document; lengths are in the units of UPPAAL's editor.
    """
    drawn = placed(diagram)
    left, top, right, bottom = _bounds(drawn)
    heading = _heading(diagram)
    width = max(right - left, text_width(heading) * 1.2) + 2 * MARGIN
    height = bottom - top + 2 * MARGIN + HEADING_HEIGHT
    x, y = left - MARGIN, top - MARGIN - HEADING_HEIGHT
    return page((x, y, width, height), heading, _body(drawn), _FONT_SIZE)


def draw_all(diagrams: Sequence[Diagram]) -> Svg:
    """Draws templates below each other; lengths are as in `draw`."""
    parts, width, bottom = [], 0.0, 0.0
    for diagram in diagrams:
        text = draw(diagram)
        found = _SIZE.match(text)
        if found is None:
            raise ValueError("a picture begins with its size")
        parts.append(text.replace("<svg ", f'<svg y="{bottom:.0f}" ', 1))
        width, bottom = max(width, float(found[1])), bottom + float(found[2])
    return Svg(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{bottom:.0f}" '
        f'viewBox="0 0 {width:.0f} {bottom:.0f}">\n{"".join(parts)}</svg>\n'
    )


def drawn_in_parts(diagram: Diagram) -> str:
    """Draws a template for a page that lights single parts of it, without heading and paper.

    Returns:
        An SVG document, as in `draw`. Locations, edges, branch points and labels have these words
        as classes, and what belongs to a location, an edge or a branch point is in a group whose
        ``data-number`` is its place in the list of the diagram.
    """
    drawn = placed(diagram)
    left, top, right, bottom = (round(one) for one in _bounds(drawn))
    box = (left - MARGIN, top - MARGIN, right - left + 2 * MARGIN, bottom - top + 2 * MARGIN)
    size = f'width="{box[2]}" height="{box[3]}" viewBox="{" ".join(map(str, box))}"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-size="{_FONT_SIZE}">',
        *_body(drawn, grouped=True),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _heading(diagram: Diagram) -> str:
    if not diagram.parameters:
        return diagram.name
    return f"{diagram.name}({', '.join(diagram.parameters)})"


def _body(diagram: Diagram, *, grouped: bool = False) -> Iterator[str]:
    """Draws edges first, then locations, then labels on a light background.

    With `grouped`, parts are in groups as `drawn_in_parts` says, and backgrounds are the page's.
    """
    positions = positions_of(diagram)
    radii = {one.id: _radius(one) for one in diagram.locations}
    radii |= {one.id: float(BRANCH_POINT_RADIUS) for one in diagram.branch_points}
    branch_ids = {one.id for one in diagram.branch_points}
    for number, edge in enumerate(diagram.edges):
        if edge.source in positions and edge.target in positions:
            path = [positions[edge.source], *edge.nails, positions[edge.target]]
            dashed = not edge.controllable or edge.source in branch_ids
            arrow = _arrow(edge, path, radii[edge.source], radii[edge.target], dashed=dashed)
            yield from _group("edge", number, arrow) if grouped else arrow
    for number, point in enumerate(diagram.branch_points):
        dot = _branch_point(point)
        yield from _group("branch-point", number, dot) if grouped else dot
    for number, location in enumerate(diagram.locations):
        circle = _circle(location)
        yield from _group("location", number, circle) if grouped else circle
    labels = list(drawn_labels(diagram))
    if not grouped:
        yield '<g stroke="#ffffff" stroke-width="3" stroke-linejoin="round">'
        yield from (_text(corner, text, "#ffffff") for corner, _, text in labels)
        yield "</g>"
    for corner, kind, text in labels:
        label = _text(corner, text, _COLORS[kind])
        yield f'<g class="label {kind}">{label}</g>' if grouped else label


def _group(kind: str, number: int, parts: Iterator[str]) -> Iterator[str]:
    yield f'<g class="{kind}" data-number="{number}">'
    yield from parts
    yield "</g>"


def _radius(location: Location) -> float:
    return LOCATION_RADIUS + (_INITIAL_GAP if location.initial else 0.0)


def _arrow(
    edge: Edge, path: Sequence[Point], source_radius: float, target_radius: float, *, dashed: bool
) -> Iterator[str]:
    """The line of an edge, cut off at the circles of its ends, and its arrow head."""
    points = [complex(x, y) for x, y in path]
    points[0] = _towards(points[0], points[1], source_radius)
    tip = _towards(points[-1], points[-2], target_radius)
    back = _towards(tip, points[-2], _ARROW_LENGTH)
    points[-1] = back
    color = edge.color or _LINE_COLOR
    dash = ' stroke-dasharray="5 3"' if dashed else ""
    yield (f'<path d="{_rounded(points)}" fill="none" stroke="{color}" stroke-width="1.2"{dash}/>')
    across = -1j * (tip - back) / (abs(tip - back) or 1.0) * _ARROW_HALF_WIDTH
    corners = " ".join(map(_xy, (tip, back + across, back - across)))
    yield f'<polygon points="{corners}" fill="{color}"/>'


def _rounded(points: Sequence[complex]) -> str:
    """The SVG path through the points, with rounded bends."""
    steps = [f"M{_xy(points[0])}"]
    for (before, bend), (_, after) in pairwise(pairwise(points)):
        radius = min(_BEND_RADIUS, abs(before - bend) / 2, abs(bend - after) / 2)
        enter, leave = _towards(bend, before, radius), _towards(bend, after, radius)
        steps.append(f"L{_xy(enter)} Q{_xy(bend)} {_xy(leave)}")
    return " ".join([*steps, f"L{_xy(points[-1])}"])


def _xy(point: complex) -> str:
    return f"{point.real:.1f},{point.imag:.1f}"


def _towards(start: complex, end: complex, distance: float) -> complex:
    """The point at a distance from the start on the way to the end; points are x + y·i."""
    length = abs(end - start)
    return start + (end - start) * (distance / length) if length else start


def _branch_point(point: BranchPoint) -> Iterator[str]:
    if point.position is None:
        return
    x, y = point.position
    yield (
        f'<circle cx="{x}" cy="{y}" r="{BRANCH_POINT_RADIUS}" fill="#ffffff" '
        f'stroke="{_LINE_COLOR}" stroke-width="1.5"/>'
    )


def _circle(location: Location) -> Iterator[str]:
    if location.position is None:
        return
    x, y = location.position
    if location.initial:
        yield (
            f'<circle cx="{x}" cy="{y}" r="{LOCATION_RADIUS + _INITIAL_GAP}" fill="#ffffff" '
            f'stroke="{_LINE_COLOR}" stroke-width="1.2"/>'
        )
    yield (
        f'<circle cx="{x}" cy="{y}" r="{LOCATION_RADIUS}" fill="{location.color or _FILL}" '
        f'stroke="{_LINE_COLOR}" stroke-width="1.2"/>'
    )
    mark = {"committed": "C", "urgent": "U"}.get(location.kind)
    if mark:
        yield (
            f'<text x="{x}" y="{y + 4.3:.1f}" text-anchor="middle" font-weight="bold" '
            f'fill="{_LINE_COLOR}">{mark}</text>'
        )


def _text(corner: Point, text: str, color: str) -> str:
    """A text of some lines."""
    x, y = corner
    spans = "".join(
        f'<tspan x="{x}" y="{y + _FONT_SIZE + LINE_HEIGHT * number}">{safe(line) or " "}</tspan>'
        for number, line in enumerate(text.split("\n"))
    )
    return f'<text fill="{color}" xml:space="preserve">{spans}</text>'


def _bounds(diagram: Diagram) -> tuple[float, float, float, float]:
    """The smallest rectangle around a placed template: left, top, right, bottom."""
    reach = LOCATION_RADIUS + _INITIAL_GAP
    boxes: list[tuple[float, float, float, float]] = [
        (x - reach, y - reach, x + reach, y + reach) for x, y in positions_of(diagram).values()
    ]
    boxes += [(x, y, x, y) for edge in diagram.edges for x, y in edge.nails]
    for (x, y), _, text in drawn_labels(diagram):
        boxes.append((x, y, x + text_width(text), y + text_height(text)))
    left, top, right, bottom = zip(*boxes or [(0.0, 0.0, 0.0, 0.0)], strict=True)
    return min(left), min(top), max(right), max(bottom)
