"""The automata of JANI and their synchronisation vectors.

In UPPAAL a process hears a broadcast if it can. In JANI all automata of a vector take part, so a
process has loops where it hears nothing.

While a process is in a committed location, only edges from committed locations are taken. An edge
from another location therefore has two actions: one that asks that no process be committed, and,
for a synchronisation with an edge from a committed location, one that does not.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Final

from ntagen.convert.channels import synced_edges
from ntagen.convert.expressions import (
    Assign,
    Binary,
    Choice,
    Expr,
    Name,
    Number,
    Unary,
    conjunction,
    conjuncts,
    mapped,
    names,
)
from ntagen.convert.jani_levels import base_of, depends, levels_of
from ntagen.convert.jani_terms import JaniTerms, Json
from ntagen.convert.names import Names
from ntagen.convert.network import (
    Leg,
    Network,
    NetworkEdge,
    NetworkProcess,
    Place,
    part_name,
    refuse,
)

_RATE: Final = re.compile(r"(\d+(?:\.\d+)?)\s*(?::\s*(\d+(?:\.\d+)?))?")
_FREE, _COMMITTED, _ANY = "", "_committed", "_any"
"""The kinds of an action: nobody is committed; its source is; somebody else is, and takes part."""


class Automata:
    """The automata of a network.

    Args:
        network: The network.
        terms: Writes its expressions.
        class_: The class of JANI.
        path: The name of the model's file, for messages.
        watched: The processes whose locations are variables, too.
    """

    def __init__(
        self,
        network: Network,
        terms: JaniTerms,
        class_: str,
        path: str,
        watched: frozenset[str],
    ) -> None:
        self._network = network
        self._terms = terms
        self._class = class_
        self._path = path
        self._watched = watched
        self._clocks = frozenset(network.clocks)
        self._names = Names()
        self._called = {one.name: self._names.fresh(one.name) for one in network.processes}
        self._channels = {one: self._names.fresh(one) for one in network.channels}
        self._nobody_committed = [
            Binary("!=", Name(f"{process.name}@"), Number(number))
            for process in network.processes
            for number, place in enumerate(process.places)
            if place.kind == "committed"
        ]
        self.actions: list[str] = []
        self.vectors: list[Json] = []
        self._edges = {one.name: self._by_channel(one) for one in network.processes}
        self._require_own_invariants()

    def json(self) -> list[Json]:
        """The automata; `actions` and `vectors` are complete from then on."""
        found = [self._automaton(one) for one in self._network.processes]
        self._add_vectors({one["name"]: one["edges"] for one in found})
        return found

    def _by_channel(self, process: NetworkProcess) -> dict[tuple[str, bool], list[NetworkEdge]]:
        """The edges that synchronise, by channel and whether they send."""
        found: dict[tuple[str, bool], list[NetworkEdge]] = defaultdict(list)
        for one in synced_edges(self._network, process):
            found[one.channel, one.edge.sends].append(one.edge)
        return found

    def _automaton(self, process: NetworkProcess) -> Json:
        local = Names()
        places = [local.fresh(place.name) for place in process.places]
        edges = list(self._json_edges(process, places))
        return {
            "name": self._called[process.name],
            "locations": [
                self._location(name, place, process)
                for name, place in zip(places, process.places, strict=True)
            ],
            "initial-locations": [places[process.initial]],
            "edges": edges,
        }

    def _location(self, name: str, place: Place, process: NetworkProcess) -> Json:
        found: Json = {"name": name}
        if not self._clocks:
            return found
        if place.kind != "normal":
            clock = self._terms.names[urgency_of(process.name)]
            found["time-progress"] = {"exp": {"op": "≤", "left": clock, "right": 0}}
        elif place.invariant != Number(1):
            where = self._where(process, place)
            found["time-progress"] = {"exp": self._terms.truth(where, place.invariant)}
        return found

    def _where(self, process: NetworkProcess, place: Place) -> str:
        return f"{self._path}: process {process.name}, location {place.name}"

    def _json_edges(self, process: NetworkProcess, places: Sequence[str]) -> Iterator[Json]:
        for edge in process.edges:
            if edge.channel is None:
                kind = self._kinds(process, edge)[0]
                yield self._edge(process, places, edge, None, kind)
        for (channel, sends), edges in self._edges[process.name].items():
            for edge in edges:
                for kind in self._kinds(process, edge):
                    name = self._action(channel, sends=sends, kind=kind)
                    yield self._edge(process, places, edge, name, kind)
            if self._network.channels[channel].broadcast and not sends:
                yield from self._loops(process, places, channel, edges)

    def _kinds(self, process: NetworkProcess, edge: NetworkEdge) -> tuple[str, ...]:
        """The kinds of actions of an edge."""
        if not self._nobody_committed:
            return (_FREE,)
        if process.places[edge.source].kind == "committed":
            return (_COMMITTED,)
        if edge.channel is None or not edge.sends:
            return (_FREE,)
        about = self._network.channels[str(part_name(edge.channel))]
        return (_FREE,) if about.broadcast else (_FREE, _ANY)

    def _action(self, channel: str, *, sends: bool, kind: str) -> str:
        name = self._action_name(channel, sends=sends, kind=kind)
        if name not in self.actions:
            self.actions.append(name)
        return name

    def _edge(
        self,
        process: NetworkProcess,
        places: Sequence[str],
        edge: NetworkEdge,
        action: str | None,
        kind: str,
    ) -> Json:
        guards = [*conjuncts(edge.guard), *self._entering(process, edge)]
        # Of a synchronisation, the sender's guard says that nobody is committed.
        if kind == _FREE and (action is None or edge.sends):
            guards += self._nobody_committed
        found: Json = {"location": places[edge.source]}
        if action is not None:
            found["action"] = action
        if self._class == "ctmc":
            found["rate"] = {"exp": self._rate(process, edge)}
        if guards:
            found["guard"] = {"exp": self._terms.truth(f"{edge.place}, guard", conjunction(guards))}
        shift = self._shift(process, edge)
        weights = [self._terms.value(edge.place, leg.weight) for leg in edge.legs]
        found["destinations"] = [
            self._destination(process, places, edge, leg, weight, weights, shift)
            for leg, weight in zip(edge.legs, weights, strict=True)
        ]
        return found

    def _destination(
        self,
        process: NetworkProcess,
        places: Sequence[str],
        edge: NetworkEdge,
        leg: Leg,
        weight: Json,
        weights: Sequence[Json],
        shift: int,
    ) -> Json:
        found: Json = {"location": places[leg.target]}
        if len(weights) > 1:
            total = weights[0]
            for one in weights[1:]:
                total = {"op": "+", "left": total, "right": one}
            found["probability"] = {"exp": {"op": "/", "left": weight, "right": total}}
        assignments = []
        for update, level in zip(leg.updates, levels_of(leg.updates), strict=True):
            for name, value in self._terms.assignments(f"{edge.place}, update", (update,)):
                assignments.append(_assignment(name, value, level + shift))
        if process.name in self._watched:
            name = self._terms.names[f"{process.name}@"]
            assignments.append(_assignment(name, leg.target, 0))
        urgency = self._terms.names.get(urgency_of(process.name))
        if urgency is not None and process.places[leg.target].kind != "normal":
            assignments.append(_assignment(urgency, 0, 0))
        found["assignments"] = assignments
        return found

    def _loops(
        self,
        process: NetworkProcess,
        places: Sequence[str],
        channel: str,
        edges: Sequence[NetworkEdge],
    ) -> Iterator[Json]:
        """What a process does when others broadcast, and it hears nothing."""
        for number, name in enumerate(places):
            here = [one for one in edges if one.source == number]
            if self._nobody_committed and here and process.places[number].kind == "committed":
                refuse(
                    here[0].place,
                    "it hears a broadcast in a committed location, for which JANI has no word",
                    "do without the committed location",
                )
            guards = [
                conjunction([*conjuncts(one.guard), *self._entering(process, one)]) for one in here
            ]
            if any(one == Number(1) for one in guards):
                continue
            action = self._action(channel, sends=False, kind=_FREE)
            found: Json = {"location": name, "action": action}
            if self._class == "ctmc":
                found["rate"] = {"exp": 1}
            if guards:
                negated = conjunction([Unary("!", one) for one in guards])
                place = f"{here[0].place}, guard"
                found["guard"] = {"exp": self._terms.truth(place, negated)}
            found["destinations"] = [{"location": name, "assignments": []}]
            yield found

    def _rate(self, process: NetworkProcess, edge: NetworkEdge) -> Json:
        """The rate of a location, shared by its enabled edges; that of a receiver is 1."""
        if edge.channel is not None and not edge.sends:
            return 1
        place = process.places[edge.source]
        match = _RATE.fullmatch(place.rate.strip())
        if match is None:
            missing = "it has no rate, and others have"
            refuse(
                self._where(process, place),
                f"the rate `{place.rate}` is no number" if place.rate else missing,
                "write a number, or two with a colon between them",
            )
        rate = float(match[1]) / float(match[2] or 1)
        rivals = [
            one
            for one in process.edges
            if one.source == edge.source and (one.channel is None or one.sends)
        ]
        if all(one.guard == Number(1) for one in rivals):
            return rate / len(rivals)
        count: Expr = Number(0)
        for one in rivals:
            count = Binary("+", count, Choice(one.guard, Number(1), Number(0)))
        return {"op": "/", "left": rate, "right": self._terms.value(edge.place, count)}

    def _entering(self, process: NetworkProcess, edge: NetworkEdge) -> list[Expr]:
        """What of the target's invariant must hold before the updates.

        JANI lets an automaton enter a location whose invariant does not hold; UPPAAL does not.
        """
        needed = []
        for leg in edge.legs:
            kept = conjuncts(process.places[edge.source].invariant)
            for one in conjuncts(process.places[leg.target].invariant):
                before = _before(one, leg.updates)
                if before == one and one in kept:
                    continue
                value = _truth(before)
                if value is not True and before not in needed:
                    needed.append(before)
        if needed and len(edge.legs) > 1:
            refuse(
                edge.place,
                "a leg of a branch point enters a location whose invariant may not hold",
                "reset the clocks of the invariant on the way",
            )
        return needed

    def _require_own_invariants(self) -> None:
        """Refuses invariants that other processes could break: JANI lets them."""
        written: dict[str, set[str]] = {
            process.name: {
                base_of(update.target)
                for edge in process.edges
                for leg in edge.legs
                for update in leg.updates
            }
            for process in self._network.processes
        }
        for process in self._network.processes:
            for place in process.places:
                read = names(place.invariant)
                for other, found in written.items():
                    if other != process.name and read & found:
                        refuse(
                            f"{self._where(process, place)}, invariant",
                            f"it has {sorted(read & found)[0]}, which {other} changes: JANI would "
                            "let it break the invariant",
                            "use a clock or variable that only this process changes",
                        )

    def _shift(self, process: NetworkProcess, edge: NetworkEdge) -> int:
        """The first index of the assignments of an edge: a receiver's come after the sender's."""
        if edge.channel is None or edge.sends:
            return 0
        channel = str(part_name(edge.channel))
        before = [
            one
            for other in self._network.processes
            if other.name != process.name
            for one in self._edges[other.name].get((channel, True), ())
        ]
        place = 1
        for other in self._network.processes:
            if other.name == process.name:
                break
            others = self._edges[other.name].get((channel, False), [])
            before += others
            place += bool(others)
        is_later = any(
            depends(one.updates, leg.updates)
            for rival in before
            for one in rival.legs
            for leg in edge.legs
        )
        if not is_later:
            return 0
        deepest = max(
            (max(levels_of(leg.updates), default=0) for rival in before for leg in rival.legs),
            default=0,
        )
        return place * (deepest + 1)

    def _add_vectors(self, edges: dict[str, list[Json]]) -> None:
        """Adds the synchronisation vectors of all channels."""
        order = [one.name for one in self._network.processes]
        used = {
            process: {edge.get("action") for edge in edges[self._called[process]]}
            for process in order
        }
        for channel, about in self._network.channels.items():
            hearing = [one for one in order if self._edges[one].get((channel, False))]
            for sender in order:
                if not self._edges[sender].get((channel, True)):
                    continue
                others = [one for one in hearing if one != sender]
                groups = [others] if about.broadcast else [[one] for one in others]
                for group in groups:
                    for kinds in self._allowed(len(group), broadcast=about.broadcast):
                        named = {sender: self._action_name(channel, sends=True, kind=kinds[0])}
                        for one, kind in zip(group, kinds[1:], strict=True):
                            named[one] = self._action_name(channel, sends=False, kind=kind)
                        if all(action in used[one] for one, action in named.items()):
                            self.vectors.append(
                                {
                                    "synchronise": [named.get(one) for one in order],
                                    "result": self._channels[channel],
                                }
                            )
        results = dict.fromkeys(one["result"] for one in self.vectors)
        self.actions += [one for one in results if one not in self.actions]

    def _action_name(self, channel: str, *, sends: bool, kind: str) -> str:
        return f"{self._channels[channel]}_{'send' if sends else 'receive'}{kind}"

    def _allowed(self, receivers: int, *, broadcast: bool) -> Iterator[tuple[str, ...]]:
        """The kinds of actions, the sender's first, that may go together."""
        yield (_FREE,) * (receivers + 1)
        if self._nobody_committed:
            yield (_COMMITTED, *(_FREE,) * receivers)
            if not broadcast:
                yield _COMMITTED, _COMMITTED
                yield _ANY, _COMMITTED


def urgency_of(process: str) -> str:
    """The key of the clock that keeps time from passing in urgent and committed locations."""
    return f"{process}!"


def _assignment(name: str, value: Json, index: int) -> Json:
    found: Json = {"ref": name, "value": value}
    return found | {"index": index} if index else found


def _before(expr: Expr, updates: Sequence[Assign]) -> Expr:
    """A condition after updates as one before them."""
    for update in reversed(updates):
        expr = _replaced(expr, update.target, update.value)
    return expr


def _replaced(expr: Expr, part: Expr, other: Expr) -> Expr:
    """The expression with another one in the place of a part."""
    return mapped(expr, lambda one: other if one == part else None)


def _truth(expr: Expr) -> bool | None:
    """Whether a comparison of numbers holds; ``None`` if it is another expression."""
    match expr:
        case Binary("<=", Number(left), Number(right)):
            return left <= right
        case Binary("<", Number(left), Number(right)):
            return left < right
    return None
