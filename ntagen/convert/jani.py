"""Writes a network in JANI (jani-specification, version 1): DTMC, MDP, CTMC or PTA.

UPPAAL draws delays at random in statistical queries, and leaves them open in symbolic ones. JANI's
model classes fix one meaning, so the class follows from what the model has:

* clocks: a probabilistic timed automaton. Delays and choices among edges are open, weights of
  branch points are probabilities. This is the symbolic meaning of UPPAAL.
* exponential rates and no clocks: a Markov chain in continuous time. Each process waits by the rate
  of its location, then takes one of its enabled edges, each as likely as the others. This is the
  statistical meaning of UPPAAL, exactly; it needs broadcast channels and no committed locations.
* neither: a Markov decision process, whose steps are transitions; a Markov chain if there is one
  process with at most one edge for each location.

Each process is an automaton. In a timed one, a clock of its own keeps time from passing while it is
in an urgent or committed location. Where a guard must know where others are, for committed
locations and in properties, a variable holds the location: it adds no states.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Final

from ntagen.convert.expressions import (
    Number,
)
from ntagen.convert.jani_automata import Automata, urgency_of
from ntagen.convert.jani_properties import properties_of
from ntagen.convert.jani_terms import JaniTerms, Json
from ntagen.convert.names import Names
from ntagen.convert.network import Network, refuse
from ntagen.values import dataclass

_ABOUT: Final = {
    "dtmc": "steps are transitions; there is never a choice",
    "mdp": "steps are transitions; choices among them are open",
    "ctmc": "the statistical meaning of UPPAAL",
    "pta": "delays and choices are open, as in symbolic queries of UPPAAL",
}


@dataclass(frozen=True, slots=True)
class WrittenJani:
    """A text in JANI, and what it does not say of the model, a line each."""

    text: str
    notes: tuple[str, ...]


def written_jani(network: Network, queries: Sequence[str], name: str, path: str) -> WrittenJani:
    """The text of a network.

    Args:
        network: The network.
        queries: Its queries; those that JANI can ask become properties.
        name: The name of the model.
        path: The name of its file, for messages.

    Raises:
        InputError: Something has no counterpart; the message has its place and a way out.
    """
    class_ = class_of(network, path)
    names = Names()
    called = {one: names.fresh(one) for one in (*network.clocks, *network.variables)}
    places = {f"{one.name}@": names.fresh(f"{one.name}_place") for one in network.processes}
    urgent = {
        urgency_of(one.name): names.fresh(f"{one.name}_urgency")
        for one in network.processes
        if class_ == "pta" and any(place.kind != "normal" for place in one.places)
    }
    terms = JaniTerms(network, called | places | urgent)
    properties, asked, notes = properties_of(queries, network, terms, class_)
    watched = asked | {
        process.name
        for process in network.processes
        if any(place.kind == "committed" for place in process.places)
    }
    automata = Automata(network, terms, class_, path, frozenset(watched))
    built = automata.json()
    model = {
        "jani-version": 1,
        "name": name,
        "metadata": {"description": f"{name}, from UPPAAL: {_ABOUT[class_]}"},
        "type": class_,
        "features": ["derived-operators"],
        "actions": [{"name": one} for one in automata.actions],
        "variables": [
            *({"name": one, "type": "clock", "initial-value": 0} for one in urgent.values()),
            *_variables(network, called, places, watched),
        ],
        "properties": properties,
        "automata": built,
        "system": {
            "elements": [{"automaton": one["name"]} for one in built],
            "syncs": automata.vectors,
        },
    }
    return WrittenJani(json.dumps(model, indent=1, ensure_ascii=False) + "\n", tuple(notes))


def class_of(network: Network, path: str) -> str:
    """The class of JANI that means the same: ``dtmc``, ``mdp``, ``ctmc`` or ``pta``.

    Raises:
        InputError: The network mixes classes; the message has the place.
    """
    rated = [
        (process, place) for process in network.processes for place in process.places if place.rate
    ]
    for process in network.processes:
        for edge in process.edges:
            if not edge.controllable:
                refuse(
                    edge.place,
                    "JANI has no games, and this edge is the environment's",
                    'write -> for -u->, or delete controllable="false"',
                )
    if network.clocks:
        if rated:
            process, place = rated[0]
            refuse(
                f"{path}: process {process.name}, location {place.name}",
                "a model with clocks is exported without random delays, and this location has a "
                "rate",
                "delete the rates, or the clocks",
            )
        return "pta"
    if rated:
        _require_markov(network, path)
        return "ctmc"
    if len(network.processes) == 1:
        process = network.processes[0]
        sources = [edge.source for edge in process.edges]
        if len(set(sources)) == len(sources):
            return "dtmc"
    return "mdp"


def _require_markov(network: Network, path: str) -> None:
    """Refuses what has no counterpart in a Markov chain in continuous time."""
    for channel in network.channels.values():
        if not channel.broadcast:
            refuse(
                f"{path}: channel {channel.name}",
                "with exponential rates, only broadcast channels have a statistical meaning",
                "declare it as broadcast chan, or delete the rates",
            )
    for process in network.processes:
        for place in process.places:
            where = f"{path}: process {process.name}, location {place.name}"
            if place.kind != "normal":
                refuse(
                    where,
                    f"it is {place.kind}, and a Markov chain in continuous time always waits",
                    "join its edges with those before it",
                )
            if place.invariant != Number(1):
                refuse(
                    where,
                    "a Markov chain in continuous time has no invariants",
                    "write it as a guard of the edges that lead here",
                )


def _variables(
    network: Network, called: dict[str, str], places: dict[str, str], watched: set[str]
) -> list[Json]:
    found: list[Json] = [
        {"name": called[one], "type": "clock", "initial-value": 0} for one in network.clocks
    ]
    for one in network.variables.values():
        found.append(_bounded(called[one.name], one.low, one.high, one.initial))
    for process in network.processes:
        if process.name in watched:
            name = places[f"{process.name}@"]
            found.append(_bounded(name, 0, len(process.places) - 1, process.initial))
    return found


def _bounded(name: str, low: int, high: int, initial: int) -> Json:
    type_ = {"kind": "bounded", "base": "int", "lower-bound": low, "upper-bound": high}
    return {"name": name, "type": type_, "initial-value": initial}
