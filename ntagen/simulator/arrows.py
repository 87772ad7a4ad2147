"""Which arrows of a template's picture show the edges of its processes, which the engine numbers.

The engine keeps the order of the file. It makes one edge of the arrow to a branch point and all
arrows that leave it, or one for each of these if they have labels of their own; and it leaves out
what is never possible, such as a select without values.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ntagen.checker.facts import Template
from ntagen.checker.picture.diagram import Edge
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class _Unit:
    """Arrows that may be an edge.

    Attributes:
        source: The id of its location.
        targets: The ids of its targets.
        labels: What is written on it; ``None`` where the engine puts labels together.
        sync: Its synchronisation.
        arrows: The numbers of the arrows for each target.
    """

    source: str
    targets: tuple[str, ...]
    labels: tuple[str, str] | None
    sync: str
    arrows: list[list[int]]


def drawn_edges(template: Template, edges: Sequence[Mapping[str, Any]]) -> list[list[list[int]]]:
    """The numbers of the arrows, for each edge and each of its legs.

    Args:
        template: The template.
        edges: The edges of one of its processes, as ``Model.network_json`` has them.
    """
    number_of = {one.id: number for number, one in enumerate(template.locations)}
    units, found, begin = list(_units(template)), [], 0
    for edge in edges:
        for at in range(begin, len(units)):
            if _is(units[at], edge, number_of):
                found.append(units[at].arrows)
                begin = at + 1
                break
        else:
            # It is in no picture, and nothing is lit for it.
            found.append([[] for _ in edge["targets"]])
    return found


def _units(template: Template) -> Iterator[_Unit]:
    """All that may be an edge, in the order of the file."""
    points = {one.id for one in template.branch_points}
    for number, edge in enumerate(template.edges):
        if edge.source in points:
            continue
        if edge.target not in points:
            yield _Unit(edge.source, (edge.target,), _labels(edge), edge.sync, [[number]])
            continue
        legs = [(at, leg) for at, leg in enumerate(template.edges) if leg.source == edge.target]
        targets = tuple(leg.target for _, leg in legs)
        arrows = [[number, at] for at, _ in legs]
        yield _Unit(edge.source, targets, None, edge.sync, arrows)
        for at, leg in legs:
            yield _Unit(edge.source, (leg.target,), None, leg.sync or edge.sync, [[number, at]])


def _labels(edge: Edge) -> tuple[str, str]:
    return _words(edge.guard), _words(edge.update)


def _words(text: str) -> str:
    return " ".join(text.split())


def _is(unit: _Unit, edge: Mapping[str, Any], number_of: Mapping[str, int]) -> bool:
    """Whether an edge is that of these arrows."""
    if number_of[unit.source] != edge["source"]:
        return False
    if [number_of.get(one) for one in unit.targets] != edge["targets"]:
        return False
    if _words(unit.sync) != _words(edge["sync"]):
        return False
    return unit.labels is None or unit.labels == (_words(edge["guard"]), _words(edge["update"]))
