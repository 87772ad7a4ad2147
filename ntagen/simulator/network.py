"""The processes and edges of a model by number, as the page of the simulator knows them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from ntagen.checker import Model
from ntagen.checker.picture.svg import drawn_in_parts
from ntagen.checker.runs import Edge
from ntagen.errors import InputError
from ntagen.simulator.arrows import drawn_edges


class Part(NamedTuple):
    """An edge that is taken.

    Attributes:
        process: The number of the process.
        edge: The number of the edge in its process.
        leg: The leg of its branch point; 0 without one.
        select: The values of its select bindings.
    """

    process: int
    edge: int
    leg: int
    select: tuple[int, ...]


Parts = tuple[Part, ...]
"""A move: the edges that are taken together, the sender's first."""


class Network:
    """What a model is after all templates have been instantiated.

    Attributes:
        processes: The names of the processes.
        clocks: The names of the clocks.
    """

    def __init__(self, model: Model) -> None:
        raw = json.loads(model.network_json())
        self._model = model
        self._raw: list[dict[str, Any]] = raw["processes"]
        self.processes: list[str] = [one["name"] for one in self._raw]
        self.clocks: list[str] = raw["clocks"]
        self._number_of = {name: number for number, name in enumerate(self.processes)}
        self._locations = [
            {place["name"]: number for number, place in enumerate(one["locations"])}
            for one in self._raw
        ]

    def located(self, locations: Mapping[str, str]) -> list[int]:
        """The number of each process's location, from the names."""
        found = zip(self.processes, self._locations, strict=True)
        return [numbers[locations[name]] for name, numbers in found]

    def location_names(self, numbers: Iterable[int]) -> dict[str, str]:
        """The location of each process by names, from the numbers."""
        places = zip(self._raw, numbers, strict=True)
        return {one["name"]: one["locations"][number]["name"] for one, number in places}

    def parts(self, edges: Iterable[Mapping[str, Any]]) -> Parts:
        """A move as it stands in the engine's JSON.

        Raises:
            InputError: The model has no such edge.
        """
        found = []
        for edge in edges:
            try:
                process = self._number_of[edge["process"]]
                known = self._raw[process]["edges"][edge["edge"]]
                known["targets"][edge["branch"]]
                select = tuple(int(edge["select"][name]) for name in known["select"])
            except (LookupError, TypeError, ValueError):
                named = edge.get("process") if isinstance(edge, Mapping) else None
                raise InputError(f"the model has no edge as one of {named}") from None
            found.append(Part(process, edge["edge"], edge["branch"], select))
        return tuple(found)

    def parts_named(self, edges: Sequence[Edge]) -> Parts:
        """A move by what its edges look like; of equal edges of a process, the first."""
        found = []
        for one in edges:
            process = self._number_of[one.process]
            found.append(self._found(process, one))
        return tuple(found)

    def _found(self, process: int, wanted: Edge) -> Part:
        raw = self._raw[process]
        names = [place["name"] for place in raw["locations"]]
        labels = (wanted.source, wanted.guard, wanted.sync, wanted.update)
        for number, edge in enumerate(raw["edges"]):
            if (names[edge["source"]], edge["guard"], edge["sync"], edge["update"]) != labels:
                continue
            for leg, target in enumerate(edge["targets"]):
                if names[target] == wanted.target and edge["select"] == list(wanted.select):
                    return Part(process, number, leg, tuple(wanted.select.values()))
        raise LookupError(f"no edge of {wanted.process} is {wanted}")

    def edges_json(self, parts: Parts) -> list[dict[str, Any]]:
        """A move as it stands in a trace."""
        found = []
        for part in parts:
            raw = self._raw[part.process]
            edge, places = raw["edges"][part.edge], raw["locations"]
            found.append(
                {
                    "process": raw["name"],
                    "edge": part.edge,
                    "source": places[edge["source"]]["name"],
                    "target": places[edge["targets"][part.leg]]["name"],
                    "branch": part.leg,
                    "select": dict(zip(edge["select"], part.select, strict=True)),
                    "guard": edge["guard"],
                    "sync": edge["sync"],
                    "update": edge["update"],
                }
            )
        return found

    def told(self, parts: Parts) -> str:
        """A move in words."""
        return " | ".join(
            f"{one['process']}.{one['source']} -> {one['target']}" for one in self.edges_json(parts)
        )

    def told_of(self, edges: Sequence[Edge]) -> str:
        """The same of edges by what they look like."""
        return self.told(self.parts_named(edges))

    def described(self) -> dict[str, Any]:
        """The processes, and the templates that they use, with their pictures.

        Processes of one template have different edges if selects have no values in some of them;
        such a template is there more than once.
        """
        facts = self._model.facts
        pictures = {one.name: drawn_in_parts(one) for one in facts.templates}
        templates: dict[str, dict[str, Any]] = {}
        processes = []
        for process, raw in zip(facts.processes, self._raw, strict=True):
            key = json.dumps([process.template, raw["edges"]])
            if key not in templates:
                template = self._model.template(process.template)
                templates[key] = {
                    "name": process.template,
                    "svg": pictures[process.template],
                    "locations": raw["locations"],
                    "edges": [
                        edge | {"drawn": drawn}
                        for edge, drawn in zip(
                            raw["edges"], drawn_edges(template, raw["edges"]), strict=True
                        )
                    ],
                }
            processes.append({"name": process.name, "template": list(templates).index(key)})
        return {
            "processes": processes,
            "templates": list(templates.values()),
            "clocks": self.clocks,
        }
