"""Writes a network in TChecker's file format.

A binary channel becomes an event, and each pair of a sender and a receiver a synchronisation, the
sender first: TChecker runs the statements in this order. A broadcast channel becomes
synchronisations in which the receivers are weak. TChecker allows no guards there; a process with
one must take part instead, and has loops that do nothing where it would not hear. A channel whose
index changes becomes one edge for each part, and so does a `select` for each value.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Final

from ntagen.convert.channels import Synced, synced_edges
from ntagen.convert.expressions import (
    Number,
    Unary,
    conjunction,
)
from ntagen.convert.names import Names
from ntagen.convert.network import (
    Network,
    NetworkEdge,
    NetworkProcess,
    has_clock,
    part_names,
    refuse,
)
from ntagen.convert.tck_labels import labels_of
from ntagen.convert.tck_terms import Terms
from ntagen.values import dataclass

TCK_WORDS: Final = frozenset(
    [
        "system",
        "process",
        "event",
        "clock",
        "int",
        "location",
        "edge",
        "sync",
        "if",
        "then",
        "else",
        "end",
        "while",
        "do",
        "local",
        "nop",
        "initial",
        "labels",
        "invariant",
        "committed",
        "urgent",
        "provided",
    ]
)
_INTERNAL: Final = "tau"


@dataclass(frozen=True, slots=True)
class WrittenTck:
    """A text in TChecker's format, and what it does not say of the model, a line each."""

    text: str
    notes: tuple[str, ...]


def written_tck(network: Network, queries: Sequence[str], name: str, path: str) -> WrittenTck:
    """The text of a network.

    Args:
        network: The network.
        queries: Its queries; those that labels can express get labels, the others are comments.
        name: The name of the system.
        path: The name of the model's file, for messages.

    Raises:
        InputError: Something has no counterpart; the message has its place and a way out.
    """
    return _Writer(network, path).written(queries, name)


class _Writer:
    """Writes one network."""

    def __init__(self, network: Network, path: str) -> None:
        self._network = network
        self._names = Names([*TCK_WORDS, _INTERNAL])
        self._lines: list[str] = []
        self._notes: list[str] = []
        self._processes = {one.name: self._names.fresh(one.name) for one in network.processes}
        self._require_plain(path)
        self._terms = self._declared()
        self._places: dict[tuple[str, int], str] = {}
        for process in network.processes:
            local = Names(TCK_WORDS)
            for number, place in enumerate(process.places):
                self._places[process.name, number] = local.fresh(place.name)

    def written(self, queries: Sequence[str], name: str) -> WrittenTck:
        """The whole text."""
        # Declarations of variables are written already; they come behind the name of the system.
        declared, self._lines = self._lines, []
        system = Names(TCK_WORDS).fresh(name)
        labels, remarks = self._labelled(queries)
        synced = {one.name: synced_edges(self._network, one) for one in self._network.processes}
        vectors, events = self._vectors(synced)
        for process in self._network.processes:
            self._write_process(process, labels, synced[process.name], events)
        names = dict.fromkeys([_INTERNAL, *events.values()])
        head = [f"system:{system}", *declared, *(f"event:{one}" for one in names)]
        lines = [*head, *self._lines, "", *vectors, *remarks]
        return WrittenTck("\n".join(lines) + "\n", tuple(self._notes))

    def _require_plain(self, path: str) -> None:
        """Refuses what TChecker has no word for."""
        for process in self._network.processes:
            for place in process.places:
                if place.rate:
                    refuse(
                        f"{path}: process {process.name}, location {place.name}",
                        "TChecker has no exponential rates",
                        "delete the rate: it counts in statistical queries only",
                    )
            for edge in process.edges:
                if len(edge.legs) > 1 or edge.legs[0].weight != Number(1):
                    refuse(
                        edge.place,
                        "TChecker has no branch points",
                        "write an edge for each leg, or convert to JANI",
                    )
                if not edge.controllable:
                    refuse(
                        edge.place,
                        "TChecker has no games, and this edge is the environment's",
                        'write -> for -u->, or delete controllable="false"',
                    )

    def _declared(self) -> Terms:
        """Writes the declarations of clocks and variables."""
        network, parts, arrays = self._network, {}, {}
        for clock in network.clocks:
            parts[clock] = self._names.fresh(clock)
            self._lines.append(f"clock:1:{parts[clock]}")
        for array in network.arrays.values():
            members = [network.variables[one] for one in part_names(array.name, array.dimensions)]
            first = members[0]
            kind = first.low, first.high, first.initial
            if all((one.low, one.high, one.initial) == kind for one in members):
                name = arrays[array.name] = self._names.fresh(array.name)
                parts |= {one.name: f"{name}[{number}]" for number, one in enumerate(members)}
                bounds = ":".join(str(one) for one in kind)
                self._lines.append(f"int:{len(members)}:{bounds}:{name}")
        for one in network.variables.values():
            if one.name not in parts:
                parts[one.name] = self._names.fresh(one.name)
                bounds = f"{one.low}:{one.high}:{one.initial}"
                self._lines.append(f"int:1:{bounds}:{parts[one.name]}")
        return Terms(network, parts, arrays)

    def _labelled(
        self, queries: Sequence[str]
    ) -> tuple[Mapping[tuple[str, str], list[str]], list[str]]:
        """The labels of locations, and what is said of the queries at the end of the text."""
        labels: dict[tuple[str, str], list[str]] = defaultdict(list)
        remarks: list[str] = []
        for number, query in enumerate(queries, 1):
            words = " ".join(query.split())
            found = labels_of(query, self._network)
            if found is None:
                remarks.append(f"# query {number}, which labels cannot express: {words}")
                self._notes.append(
                    f"query {number} is only a comment, for labels cannot express it: {words}"
                )
                continue
            given = []
            for place, clause in enumerate(found.clauses, 1):
                label = f"query{number}" if len(found.clauses) == 1 else f"query{number}_{place}"
                given.append(label)
                for where in clause:
                    labels[where].append(label)
            answer = "REACHABLE true" if found.expected else "REACHABLE false"
            remarks.append(f"# query {number}: {words}")
            remarks.append(f"#   satisfied if `tck-reach -l {','.join(given)}` says {answer}")
        return labels, remarks

    def _vectors(
        self, synced: Mapping[str, Sequence[Synced]]
    ) -> tuple[list[str], dict[tuple[str, str, bool], str]]:
        """The synchronisations, and the events of those that take part in them."""
        senders: dict[str, list[str]] = defaultdict(list)
        receivers: dict[str, list[str]] = defaultdict(list)
        for process, edges in synced.items():
            for one in edges:
                side = senders if one.edge.sends else receivers
                if process not in side[one.channel]:
                    side[one.channel].append(process)
        lines: list[str] = []
        events: dict[tuple[str, str, bool], str] = {}
        for channel, sending in senders.items():
            receiving = receivers[channel]
            is_apart = not set(sending) & set(receiving)
            sent = self._names.fresh(channel)
            received = sent if is_apart else self._names.fresh(f"{channel}_received")
            if self._network.channels[channel].broadcast:
                pairs = [(one, [two for two in receiving if two != one]) for one in sending]
            else:
                pairs = [(one, [two]) for one in sending for two in receiving if one != two]
            is_broadcast = self._network.channels[channel].broadcast
            mark = {
                one: "" if self._must_hear(one, channel, synced[one]) or not is_broadcast else "?"
                for one in receiving
            }
            for sender, others in pairs:
                events[sender, channel, True] = sent
                events |= {(one, channel, False): received for one in others}
                if others:
                    ends = [f"{self._processes[sender]}@{sent}"]
                    ends += [f"{self._processes[one]}@{received}{mark[one]}" for one in others]
                    lines.append(f"sync:{':'.join(ends)}")
        return lines, events

    def _write_process(
        self,
        process: NetworkProcess,
        labels: Mapping[tuple[str, str], list[str]],
        synced: Sequence[Synced],
        events: Mapping[tuple[str, str, bool], str],
    ) -> None:
        name = self._processes[process.name]
        self._lines += ["", f"process:{name}"]
        for number, place in enumerate(process.places):
            where = f"process {process.name}, location {place.name}, invariant"
            given = {
                "initial": "" if number == process.initial else None,
                place.kind: None if place.kind == "normal" else "",
                "labels": ",".join(labels.get((process.name, place.name), [])) or None,
                "invariant": self._terms.guard(where, place.invariant) or None,
            }
            head = f"location:{name}:{self._places[process.name, number]}"
            self._lines.append(head + _attributes(given))
        for edge in process.edges:
            if edge.channel is None:
                self._write_edge(process, edge, _INTERNAL)
        for one in synced:
            event = events.get((process.name, one.channel, one.edge.sends))
            if event is None:
                self._lines.append(f"# never taken, for nobody answers: {one.edge.place}")
            else:
                self._write_edge(process, one.edge, event)
        self._write_loops(process, synced, events)

    def _write_edge(self, process: NetworkProcess, edge: NetworkEdge, event: str) -> None:
        leg = edge.legs[0]
        ends = (self._places[process.name, one] for one in (edge.source, leg.target))
        given = {
            "provided": self._terms.guard(f"{edge.place}, guard", edge.guard) or None,
            "do": self._terms.statements(f"{edge.place}, update", leg.updates) or None,
        }
        head = f"edge:{self._processes[process.name]}:{':'.join(ends)}:{event}"
        self._lines.append(head + _attributes(given))

    def _must_hear(self, process: str, channel: str, synced: Sequence[Synced]) -> bool:
        """Whether a process hears a broadcast under a guard: TChecker allows no weak part then."""
        return any(
            one.channel == channel and not one.edge.sends and one.edge.guard != Number(1)
            for one in synced
        )

    def _write_loops(
        self,
        process: NetworkProcess,
        synced: Sequence[Synced],
        events: Mapping[tuple[str, str, bool], str],
    ) -> None:
        """Loops for a process that must take part in a broadcast although it does not hear it."""
        for name, channel in self._network.channels.items():
            event = events.get((process.name, name, False))
            if not channel.broadcast or event is None:
                continue
            if not self._must_hear(process.name, name, synced):
                continue
            for number, place in enumerate(process.places):
                edges = [
                    one.edge
                    for one in synced
                    if one.channel == name and not one.edge.sends and one.edge.source == number
                ]
                if any(one.guard == Number(1) for one in edges):
                    continue
                where = edges[0].place if edges else f"process {process.name}"
                if place.kind == "committed":
                    refuse(
                        f"{where}, location {place.name}",
                        f"it is committed, and the process hears the broadcast {name} under a "
                        "guard, for which TChecker has no word",
                        "delete the guard, or do without the committed location",
                    )
                self._write_loop(process, number, event, edges)

    def _write_loop(
        self, process: NetworkProcess, number: int, event: str, edges: Sequence[NetworkEdge]
    ) -> None:
        """The loop of a location for when no guard of these edges holds."""
        clocks = frozenset(self._network.clocks)
        for one in edges:
            if has_clock(one.guard, clocks):
                refuse(
                    f"{one.place}, guard",
                    "TChecker allows no guard where a broadcast is heard, and this one has a clock",
                    "split the location so that the edge needs no guard",
                )
        place = self._places[process.name, number]
        negated = conjunction([Unary("!", one.guard) for one in edges])
        where = f"{edges[0].place}, guard" if edges else ""
        provided = self._terms.guard(where, negated) or None
        head = f"edge:{self._processes[process.name]}:{place}:{place}:{event}"
        self._lines.append(head + _attributes({"provided": provided}))


def _attributes(given: Mapping[str, str | None]) -> str:
    """The attributes that are there; empty without any."""
    pairs = [f"{key}: {value}".rstrip() for key, value in given.items() if value is not None]
    return f"{{{' : '.join(pairs)}}}" if pairs else ""
