"""Places for what has none, by the layout of `ntagen.checker.picture`.

A template without any place is laid out as a whole. If only some parts have none, these are laid
out by themselves, below the others; what has a place keeps it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, Final, TypeVar

from ntagen.build.parts import Edge, Location, Point
from ntagen.build.template import Template
from ntagen.checker.picture import diagram
from ntagen.checker.picture.layout import EDGE_LABELS, LOCATION_LABELS, placed

_Node = TypeVar("_Node", diagram.Location, diagram.BranchPoint)

_BELOW: Final = 102
"""The distance of new parts from the lowest one that has a place."""


def arranged(template: Template) -> diagram.Diagram:
    """The template as a picture with a place for each part; its parts have the order of the lists.

    The structure must be right: see `ntagen.build.structure`.
    """
    ids = {id(node): str(number) for number, node in enumerate(template.nodes)}
    drawn = diagram.Diagram(
        template.name,
        (template.parameters,) if template.parameters.strip() else (),
        tuple(_location(one, ids, initial=one is template.initial) for one in template.locations),
        tuple(
            diagram.BranchPoint(ids[id(one)], _rounded(one.position))
            for one in template.branch_points
        ),
        tuple(_edge(edge, ids) for edge in template.edges),
    )
    return with_places(drawn)


def with_places(drawn: diagram.Diagram) -> diagram.Diagram:
    """The picture with a place for each part."""
    fixed = [node for node in drawn.nodes if node.position is not None]
    if fixed and len(fixed) < len(drawn.nodes):
        drawn = _with_new_ones_below(drawn)
    return placed(drawn)


def _with_new_ones_below(drawn: diagram.Diagram) -> diagram.Diagram:
    """The picture with places for the locations and branch points that have none."""
    old = [node.position for node in drawn.nodes if node.position is not None]
    new = {node.id for node in drawn.nodes if node.position is None}
    part = placed(
        replace(
            drawn,
            locations=tuple(one for one in drawn.locations if one.id in new),
            branch_points=tuple(one for one in drawn.branch_points if one.id in new),
            edges=tuple(one for one in drawn.edges if {one.source, one.target} <= new),
        )
    )
    spots = {node.id: node.position for node in part.nodes if node.position is not None}
    right = min(x for x, _ in old) - min(x for x, _ in spots.values())
    down = max(y for _, y in old) + _BELOW - min(y for _, y in spots.values())
    spots = {name: (x + right, y + down) for name, (x, y) in spots.items()}

    def moved(nodes: Iterable[_Node]) -> tuple[_Node, ...]:
        return tuple(replace(one, position=spots.get(one.id, one.position)) for one in nodes)

    return replace(
        drawn, locations=moved(drawn.locations), branch_points=moved(drawn.branch_points)
    )


def _location(location: Location, ids: dict[int, str], *, initial: bool) -> diagram.Location:
    return diagram.Location(
        ids[id(location)],
        kind="committed" if location.committed else "urgent" if location.urgent else "normal",
        initial=initial,
        position=_rounded(location.position),
        color=location.color,
        **_labels(location, LOCATION_LABELS),
    )


def _edge(edge: Edge, ids: dict[int, str]) -> diagram.Edge:
    return diagram.Edge(
        ids[id(edge.source)],
        ids[id(edge.target)],
        controllable=edge.controllable,
        nails=tuple((round(x), round(y)) for x, y in edge.nails),
        color=edge.color,
        **_labels(edge, EDGE_LABELS),
    )


def _labels(part: Location | Edge, kinds: Sequence[diagram.LabelKind]) -> dict[str, Any]:
    """The labels that pictures show, and where they are drawn."""
    places = {kind: _rounded(part.labels[kind]) for kind in kinds if kind in part.labels}
    return {"labels": places, **{kind: getattr(part, kind).strip() for kind in kinds}}


def _rounded(position: Point | None) -> diagram.Point | None:
    return None if position is None else (round(position[0]), round(position[1]))
