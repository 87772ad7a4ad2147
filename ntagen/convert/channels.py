"""Which channels the edges of a network synchronise on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ntagen.convert.expressions import (
    Binary,
    Expr,
    Index,
    Name,
    Number,
    conjunction,
    conjuncts,
)
from ntagen.convert.network import Network, NetworkEdge, NetworkProcess, part_name, refuse
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Synced:
    """An edge that takes part in synchronisations; its `channel` is the name of the channel."""

    channel: str
    edge: NetworkEdge


def synced_edges(network: Network, process: NetworkProcess) -> list[Synced]:
    """The edges of a process that synchronise.

    An edge whose channel has an index that changes stands here once for each channel that it may
    be, with a guard that says so.
    """
    found = []
    for edge in process.edges:
        if edge.channel is None:
            continue
        name = part_name(edge.channel)
        if name is not None and name in network.channels:
            found.append(Synced(name, replace(edge, channel=Name(name))))
            continue
        for channel, tests in _possible(network, edge.place, edge.channel):
            guard = conjunction([*conjuncts(edge.guard), *tests])
            found.append(Synced(channel, replace(edge, guard=guard, channel=Name(channel))))
    return found


def _possible(network: Network, place: str, channel: Expr) -> Iterator[tuple[str, list[Expr]]]:
    """The channels that an expression may mean, each with what makes it that one."""
    indexes: list[Expr] = []
    inner = channel
    while isinstance(inner, Index):
        indexes.insert(0, inner.index)
        inner = inner.base
    if not isinstance(inner, Name):
        refuse(f"{place}, sync", "this channel cannot be converted", "use arrays of channels")
    for name in network.channels:
        base, *numbers = name.replace("]", "").split("[")
        if base == inner.text and len(numbers) == len(indexes):
            pairs = zip(indexes, map(int, numbers), strict=True)
            tests = [(one, Number(number)) for one, number in pairs if one != Number(number)]
            if not any(isinstance(one, Number) for one, _ in tests):
                yield name, [Binary("==", one, number) for one, number in tests]
