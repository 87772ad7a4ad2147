"""The layout of a template: positions from the file, and computed ones where it has none.

A template whose locations have no places, as in XTA, is laid out in layers from top to bottom,
after Sugiyama, Tagawa and Toda, "Methods for visual understanding of hierarchical system
structures" (1981). Edges that would close a circle are reversed, and the longest path from the
start decides the layer. Sweeps over the means of the neighbours improve the order in the layers.
Each edge gets a place of its own between the layers that it joins, as wide as its label, so that
labels and parallel edges do not cover each other. A template with very many long edges is put in
rows instead.

Labels without a position are put beside their location or edge. Lengths are in the units of
UPPAAL's editor. The layout is deterministic. Cost: linear in edges times the layers that they span.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final, TypeVar

from ntagen.checker.picture.diagram import Diagram, Edge, LabelKind, Location, Point

LOCATION_RADIUS: Final = 11
BRANCH_POINT_RADIUS: Final = 4
LINE_HEIGHT: Final = 15
CHARACTER_WIDTH: Final = 6.7
"""The mean width of a character of the labels; the layout does not measure fonts."""

LOCATION_LABELS: Final[tuple[LabelKind, ...]] = ("name", "invariant", "rate")
EDGE_LABELS: Final[tuple[LabelKind, ...]] = ("select", "guard", "sync", "update", "weight")

_GAP: Final = 28
"""The least distance between neighbours of a layer."""

_LABEL_GAP: Final = 8
"""The distance between a location and the labels beside it."""

_LAYER_GAP: Final = 44
"""The least distance between a location and the labels of the edges above or below it."""

_SWEEPS: Final = 12

_MOST_SPANNED: Final = 3000
"""If edges span more layers together, layers would take many seconds, and their picture would be
too large to be read: locations are put in rows."""

_ROW_STEP: Final = 110
"""The distance of rows."""

_Drawn = TypeVar("_Drawn", Location, Edge)


def text_width(text: str) -> float:
    """The width of the widest line of a text."""
    return CHARACTER_WIDTH * max(len(line) for line in text.split("\n"))


def text_height(text: str) -> int:
    """The height of a text of some lines."""
    return LINE_HEIGHT * (text.count("\n") + 1)


def labels_of(part: Location | Edge) -> list[tuple[LabelKind, str]]:
    """The labels of a part that are not empty, from top to bottom."""
    kinds = LOCATION_LABELS if isinstance(part, Location) else EDGE_LABELS
    texts: list[tuple[LabelKind, str]] = [(kind, getattr(part, kind)) for kind in kinds]
    return [(kind, text) for kind, text in texts if text]


def _size(labels: Sequence[tuple[LabelKind, str]]) -> tuple[float, int]:
    """The width and the height of labels below each other."""
    width = max((text_width(text) for _, text in labels), default=0.0)
    return width, sum(text_height(text) for _, text in labels)


def placed(diagram: Diagram) -> Diagram:
    """The template with a place for every location, branch point and label."""
    if any(node.position is None for node in diagram.nodes):
        diagram = _layered(diagram)
    positions = positions_of(diagram)
    return replace(
        diagram,
        locations=tuple(_with_labels(one) for one in diagram.locations),
        edges=tuple(_with_path(edge, positions) for edge in diagram.edges),
    )


def drawn_labels(diagram: Diagram) -> Iterator[tuple[Point, LabelKind, str]]:
    """The labels of a placed template: upper left corner, kind and text."""
    parts: tuple[Location | Edge, ...] = (*diagram.locations, *diagram.edges)
    for part in parts:
        for kind, text in labels_of(part):
            if kind in part.labels:
                yield part.labels[kind], kind, text


def positions_of(diagram: Diagram) -> dict[str, Point]:
    """The positions of the locations and branch points of a template, by id."""
    return {node.id: node.position for node in diagram.nodes if node.position is not None}


def _with_labels(location: Location) -> Location:
    """The location with a place for each label: from the file, or else right of the location."""
    if location.position is None:
        return location
    x, y = location.position
    stack = [entry for entry in labels_of(location) if entry[0] not in location.labels]
    top = y - _size(stack)[1] // 2
    return _stacked(location, stack, (x + LOCATION_RADIUS + _LABEL_GAP, top))


def _with_path(edge: Edge, positions: dict[str, Point]) -> Edge:
    """The edge with nails if it is a loop, and with a place for each of its labels."""
    source, target = positions.get(edge.source), positions.get(edge.target)
    if source is None or target is None:
        return edge
    if source == target and not edge.nails:
        x, y = source
        edge = replace(edge, nails=((x - 20, y - 42), (x + 20, y - 42)))
    stack = [entry for entry in labels_of(edge) if entry[0] not in edge.labels]
    path = [source, *edge.nails, target]
    (x1, y1), (x2, y2) = max(pairwise(path), key=lambda ends: _squared_length(*ends))
    return _stacked(edge, stack, ((x1 + x2) // 2 + 6, (y1 + y2 - _size(stack)[1]) // 2))


def _squared_length(first: Point, second: Point) -> int:
    return int((first[0] - second[0]) ** 2 + (first[1] - second[1]) ** 2)


def _stacked(part: _Drawn, stack: list[tuple[LabelKind, str]], corner: Point) -> _Drawn:
    """The part with these labels below each other; `corner` is the first one's upper left."""
    labels = dict(part.labels)
    x, y = corner
    for kind, text in stack:
        labels[kind] = (x, y)
        y += text_height(text)
    return replace(part, labels=labels)


@dataclass(slots=True)
class _Box:
    """A place in a layer: a location with its labels, or a stretch of an edge with its labels.

    It reaches `left` and `right` from its x, and `half` up and down from its y.
    """

    left: float
    right: float
    half: float
    x: float = 0.0
    y: float = 0.0
    above: list[int] = field(default_factory=list)
    below: list[int] = field(default_factory=list)


def _layered(diagram: Diagram) -> Diagram:
    """The template with places in layers."""
    ids = [node.id for node in diagram.nodes]
    index_of = {name: index for index, name in enumerate(ids)}
    ends = [
        (index_of[edge.source], index_of[edge.target])
        if edge.source in index_of and edge.target in index_of
        else None
        for edge in diagram.edges
    ]
    start = next((i for i, one in enumerate(diagram.locations) if one.initial), 0)
    links = [pair for pair in ends if pair is not None and pair[0] != pair[1]]
    ranks = _ranks(len(ids), start, links)
    if sum(abs(ranks[first] - ranks[second]) for first, second in links) > _MOST_SPANNED:
        return _in_rows(diagram, ranks)
    boxes = [_location_box(diagram, index, ends) for index in range(len(ids))]
    layers: dict[int, list[int]] = defaultdict(list)
    for index, rank in enumerate(ranks):
        layers[2 * rank].append(index)
    chains = {
        number: _chain(pair, edge, ranks, boxes, layers)
        for number, (pair, edge) in enumerate(zip(ends, diagram.edges, strict=True))
        if pair is not None and pair[0] != pair[1]
    }
    rows = [layers[number] for number in sorted(layers)]
    _order(rows, boxes)
    _spread(rows, boxes)
    return _with_places(diagram, boxes, chains)


def _in_rows(diagram: Diagram, ranks: list[int]) -> Diagram:
    """The template with its locations in a square, those of the first layers first."""
    order = sorted(range(len(ranks)), key=lambda node: (ranks[node], node))
    columns = math.isqrt(len(order) - 1) + 1
    widths = [_size(labels_of(one))[0] for one in diagram.locations]
    step = 2 * LOCATION_RADIUS + _LABEL_GAP + 2 * _GAP + round(max(widths, default=0.0))
    places = {
        node: (step * (at % columns), _ROW_STEP * (at // columns)) for at, node in enumerate(order)
    }
    count = len(diagram.locations)
    return replace(
        diagram,
        locations=tuple(
            replace(one, position=places[index], labels={})
            for index, one in enumerate(diagram.locations)
        ),
        branch_points=tuple(
            replace(one, position=places[count + index])
            for index, one in enumerate(diagram.branch_points)
        ),
        edges=tuple(replace(edge, nails=(), labels={}) for edge in diagram.edges),
    )


def _ranks(count: int, start: int, links: list[tuple[int, int]]) -> list[int]:
    """The layer of each node: the longest path to it after circles have been cut open.

    A link back to a node that is still being visited is reversed.
    """
    following: list[list[int]] = [[] for _ in range(count)]
    for source, target in links:
        following[source].append(target)
    finished: list[int] = []
    state = [0] * count  # 0 is not seen, 1 being visited, 2 finished
    for root in [start, *range(count)]:
        stack = [(root, iter(following[root]))] if count and not state[root] else []
        if stack:
            state[root] = 1
        while stack:
            node, rest = stack[-1]
            fresh = next((other for other in rest if not state[other]), None)
            if fresh is None:
                stack.pop()
                state[node] = 2
                finished.append(node)
            else:
                state[fresh] = 1
                stack.append((fresh, iter(following[fresh])))
    order = {node: place for place, node in enumerate(reversed(finished))}
    ranks = [0] * count
    forward = [(a, b) if order[a] < order[b] else (b, a) for a, b in links]
    forward.sort(key=lambda link: order[link[0]])
    for source, target in forward:
        ranks[target] = max(ranks[target], ranks[source] + 1)
    return ranks


def _location_box(diagram: Diagram, index: int, ends: list[tuple[int, int] | None]) -> _Box:
    """The room of a location or branch point with its labels and loops."""
    if index >= len(diagram.locations):
        return _Box(BRANCH_POINT_RADIUS, BRANCH_POINT_RADIUS, BRANCH_POINT_RADIUS)
    width, height = _size(labels_of(diagram.locations[index]))
    right = LOCATION_RADIUS + _LABEL_GAP + width
    box = _Box(LOCATION_RADIUS, right, max(LOCATION_RADIUS, height / 2))
    for pair, edge in zip(ends, diagram.edges, strict=True):
        if pair == (index, index):
            width, height = _size(labels_of(edge))
            box.left += _LOOP_REACH + width + 8
            box.half = max(box.half, height / 2, LOCATION_RADIUS + 8)
    return box


_LOOP_REACH: Final = 34
"""The distance to which the first loop of a location reaches to its left."""


def _chain(
    pair: tuple[int, int],
    edge: Edge,
    ranks: list[int],
    boxes: list[_Box],
    layers: dict[int, list[int]],
) -> list[int]:
    """Makes the places of an edge in the layers between its ends, from its source to its target."""
    width, height = _size(labels_of(edge))
    upper, lower = sorted(pair, key=lambda node: ranks[node])
    top, bottom = 2 * ranks[upper], 2 * ranks[lower]
    # Labels lie in the layers between those of the locations, as near to the middle as possible.
    labelled = (top + bottom) // 2 | 1
    chain = []
    before = upper
    for layer in range(top + 1, bottom):
        box = _Box(4, width + 8 if width else 4, height / 2) if layer == labelled else _Box(4, 4, 0)
        boxes.append(box)
        number = len(boxes) - 1
        layers[layer].append(number)
        chain.append(number)
        boxes[before].below.append(number)
        box.above.append(before)
        before = number
    boxes[before].below.append(lower)
    boxes[lower].above.append(before)
    return chain if upper == pair[0] else chain[::-1]


def _order(rows: list[list[int]], boxes: list[_Box]) -> None:
    """Orders each layer by the means of the neighbours' places, down and up in turns."""
    place = {box: index for row in rows for index, box in enumerate(row)}
    for sweep in range(_SWEEPS):
        downwards = sweep % 2 == 0
        for row in rows if downwards else reversed(rows):
            means = {box: _mean_place(box, boxes, place, downwards=downwards) for box in row}
            row[:] = [box for _, _, box in sorted((means[box], place[box], box) for box in row)]
            place.update((box, index) for index, box in enumerate(row))


def _mean_place(box: int, boxes: list[_Box], place: dict[int, int], *, downwards: bool) -> float:
    """The mean position of the neighbours above, or below; without neighbours its own position."""
    near = boxes[box].above if downwards else boxes[box].below
    return sum(place[other] for other in near) / len(near) if near else float(place[box])


def _spread(rows: list[list[int]], boxes: list[_Box]) -> None:
    """Gives the boxes coordinates: near to their neighbours, and without overlaps."""
    y = 0.0
    for row in rows:
        half = max(boxes[box].half for box in row)
        y += half
        x = 0.0
        for box in row:
            x += boxes[box].left
            boxes[box].x, boxes[box].y = x, y
            x += boxes[box].right + _GAP
        y += half + _LAYER_GAP
    for sweep in range(2 * _SWEEPS):
        for row in rows if sweep % 2 == 0 else reversed(rows):
            _pull(row, boxes)


def _pull(row: list[int], boxes: list[_Box]) -> None:
    """Moves a row as near to the means of all neighbours as its order and its widths allow.

    Boxes that would overlap move together, to the mean of the positions that they want.
    """
    # Of each group the first member's place in the row, the first one's x, and the sum of wishes.
    groups: list[tuple[int, float, float]] = []
    offsets = _offsets(row, boxes)
    for place, box in enumerate(row):
        near = [boxes[other].x for other in (*boxes[box].above, *boxes[box].below)]
        wish = sum(near) / len(near) if near else boxes[box].x
        group = (place, wish, wish)
        while groups:
            begin, first, wishes = groups[-1]
            distance = offsets[group[0]] - offsets[begin]
            if first + distance <= group[1]:
                break
            groups.pop()
            # `wishes` is the sum of the positions that the members want for the first one.
            count = place + 1 - group[0]
            wishes += group[2] - count * distance
            group = (begin, wishes / (place + 1 - begin), wishes)
        groups.append(group)
    ends = [begin for begin, _, _ in groups[1:]] + [len(row)]
    for (begin, first, _), end in zip(groups, ends, strict=True):
        for place in range(begin, end):
            boxes[row[place]].x = first + offsets[place] - offsets[begin]


def _offsets(members: list[int], boxes: list[_Box]) -> list[float]:
    """The least distance of each box from the first one of the row."""
    offsets = [0.0]
    for left, right in pairwise(members):
        offsets.append(offsets[-1] + boxes[left].right + _GAP + boxes[right].left)
    return offsets


def _with_places(diagram: Diagram, boxes: list[_Box], chains: dict[int, list[int]]) -> Diagram:
    """The template with the places that were found."""

    def place(box: int) -> Point:
        return round(boxes[box].x), round(boxes[box].y)

    edges = []
    loops: dict[str, int] = defaultdict(int)
    index_of = {one.id: index for index, one in enumerate(diagram.locations)}
    height_of = {node.id: boxes[index].y for index, node in enumerate(diagram.nodes)}
    for number, edge in enumerate(diagram.edges):
        if number in chains:
            upwards = height_of[edge.source] > height_of[edge.target]
            edges.append(_routed(edge, chains[number], boxes, upwards=upwards))
        elif edge.source in index_of and edge.source == edge.target:
            x, y = place(index_of[edge.source])
            edges.append(_looped(edge, (x - loops[edge.source], y)))
            loops[edge.source] += _LOOP_REACH + round(_size(labels_of(edge))[0]) + 8
        else:
            edges.append(edge)
    count = len(diagram.locations)
    return replace(
        diagram,
        locations=tuple(
            replace(one, position=place(index), labels={})
            for index, one in enumerate(diagram.locations)
        ),
        branch_points=tuple(
            replace(one, position=place(count + index))
            for index, one in enumerate(diagram.branch_points)
        ),
        edges=tuple(edges),
    )


def _routed(edge: Edge, chain: list[int], boxes: list[_Box], *, upwards: bool) -> Edge:
    """The edge through its places, with its labels at the place that was made for them."""
    nails: list[Point] = []
    for box in chain:
        # Beside its labels the line is vertical, so that it does not cross them.
        ends = sorted({-boxes[box].half, boxes[box].half}, reverse=upwards)
        nails += [(round(boxes[box].x), round(boxes[box].y + end)) for end in ends]
    stack = labels_of(edge)
    widest = max(chain, key=lambda box: boxes[box].half)
    corner = (round(boxes[widest].x) + 6, round(boxes[widest].y) - _size(stack)[1] // 2)
    return _stacked(replace(edge, nails=tuple(nails), labels={}), stack, corner)


def _looped(edge: Edge, position: Point) -> Edge:
    """A loop to the left of a place, with its labels beyond it."""
    x, y = position
    stack = labels_of(edge)
    width, height = _size(stack)
    nails = ((x - _LOOP_REACH, y - 14), (x - _LOOP_REACH, y + 14))
    corner = (x - _LOOP_REACH - 4 - round(width), y - height // 2)
    return _stacked(replace(edge, nails=nails, labels={}), stack, corner)
