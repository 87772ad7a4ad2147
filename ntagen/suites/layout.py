"""Which parts of a template the engine's numbers in traces stand for."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ntagen import build
from ntagen.errors import InputError, NtagenError

if TYPE_CHECKING:
    from ntagen.checker import Model as LoadedModel


@dataclass(frozen=True, slots=True)
class Layout:
    """A model as it is written, beside the network that the engine has made of it.

    Attributes:
        written: The model as values.
        templates: The template of each process, by the names of both.
        places: By template, the names that the engine gives to its locations, in their order.
    """

    written: build.Model
    templates: dict[str, str]
    places: dict[str, list[str]]

    def processes(self, template: str) -> list[str]:
        """The processes of a template, in the order of the system line."""
        return [process for process, name in self.templates.items() if name == template]

    @property
    def committed(self) -> list[str]:
        """The committed locations with a name, in all processes, such as ``Gate.Busy``."""
        return [
            f"{process}.{location.name}"
            for process, template in self.templates.items()
            for location in self.written[template].locations
            if location.committed and location.name
        ]

    def edge_index(self, taken: dict[str, Any]) -> tuple[str, int]:
        """The template and the index in it of an edge of a trace; the leg, at a branch point."""
        template = self.written[self.templates[taken["process"]]]
        entry = [e for e in template.edges if isinstance(e.source, build.Location)][taken["edge"]]
        edge = entry
        if isinstance(entry.target, build.BranchPoint):
            legs = [e for e in template.edges if e.source is entry.target]
            edge = legs[taken["branch"]]
        index = next(i for i, one in enumerate(template.edges) if one is edge)
        return template.name, index

    def location_index(self, process: str, place: str) -> tuple[str, int]:
        """The template and the index in it of the location of a process."""
        template = self.templates[process]
        return template, self.places[template].index(place)


def written_model(model: LoadedModel) -> build.Model:
    """The model as values.

    Raises:
        InputError: The model was loaded from XTA, which cannot be read as values.
    """
    if not model.text.lstrip("\ufeff \t\r\n").startswith("<"):
        raise InputError(
            "this needs a model in UPPAAL's XML, and the file is XTA\n"
            "hint: `ntagen convert MODEL.xta -o MODEL.xml` makes XML of it"
        )
    return build.parse(model.text)


def layout_of(model: LoadedModel) -> Layout:
    """The layout of a loaded model.

    Raises:
        InputError: The model was loaded from XTA.
    """
    written = written_model(model)
    network = {one["name"]: one for one in json.loads(model.network_json())["processes"]}
    templates = {one.name: one.template for one in model.processes}
    places: dict[str, list[str]] = {}
    for process, template in templates.items():
        names = [one["name"] for one in network[process]["locations"]]
        own = written[template]
        sources = sum(isinstance(edge.source, build.Location) for edge in own.edges)
        if (len(names), len(network[process]["edges"])) != (len(own.locations), sources):
            raise NtagenError(
                f"process {process} has other locations or edges than its template {template}"
            )
        places[template] = names
    return Layout(written, templates, places)
