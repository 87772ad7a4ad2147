"""Templates: the methods that make their parts, and lists of parts that may be changed."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ntagen.build.parts import BranchPoint, Edge, LabelKind, Location, Node, Point, places
from ntagen.errors import InputError


@dataclass(slots=True, repr=False)
class Template:
    """A template; `Model.template` makes one.

    ``template["Safe"]`` is its location ``Safe``. The lists may be changed freely.

    Attributes:
        name: Its name.
        parameters: For example ``const int id``.
        declarations: Local declarations.
        locations: In the order of the file.
        branch_points: In the order of the file.
        edges: In the order of the file.
        initial: Where its processes start.
        labels: Where its name and parameters are drawn.
        attributes: Further attributes of the element.
        extra: Further elements in it, as XML.
    """

    name: str
    parameters: str = ""
    declarations: str = ""
    locations: list[Location] = field(default_factory=list)
    branch_points: list[BranchPoint] = field(default_factory=list)
    edges: list[Edge] = field(default_factory=list)
    initial: Location | None = None
    labels: dict[LabelKind, Point] = field(default_factory=places, compare=False)
    attributes: dict[str, str] = field(default_factory=dict)
    extra: list[str] = field(default_factory=list)

    @property
    def nodes(self) -> list[Node]:
        """All that edges can join: the locations, then the branch points."""
        return [*self.locations, *self.branch_points]

    def __getitem__(self, name: str) -> Location:
        found = [one for one in self.locations if one.name == name]
        if not found:
            raise KeyError(f"template {self.name} has no location {name}; it has {self._known}")
        return found[0]

    @property
    def _known(self) -> str:
        """The names of its locations, for messages."""
        return ", ".join(one.name for one in self.locations if one.name) or "no named one"

    def __repr__(self) -> str:
        counts = f"{len(self.locations)} locations, {len(self.edges)} edges"
        return f"Template({self.name!r}, {counts})"

    def location(
        self,
        name: str = "",
        *,
        initial: bool = False,
        invariant: str = "",
        rate: str = "",
        urgent: bool = False,
        committed: bool = False,
        comment: str = "",
        position: Point | None = None,
        color: str | None = None,
    ) -> Location:
        """Adds a location; the keywords are its attributes, and `initial` makes it the first one.

        Raises:
            InputError: There is a location with this name, or another initial one.
        """
        if initial and self.initial is not None:
            raise InputError(
                f"template {self.name}, location {name}: {self.initial.name or 'a location'} is "
                "initial already\nhint: a template starts in one location; to change it, set "
                "template.initial"
            )
        if name and any(one.name == name for one in self.locations):
            raise InputError(
                f"template {self.name} has a location {name} already\n"
                f'hint: choose another name; template["{name}"] is the one that is there'
            )
        location = Location(
            name,
            invariant,
            rate,
            urgent,
            committed,
            comment,
            id=self._fresh_id(),
            position=position,
            color=color,
        )
        self.locations.append(location)
        if initial:
            self.initial = location
        return location

    def branch_point(
        self, *, position: Point | None = None, color: str | None = None
    ) -> BranchPoint:
        """Adds a branch point: one edge leads to it, and its legs have weights."""
        point = BranchPoint(self._fresh_id(), position, color)
        self.branch_points.append(point)
        return point

    def _end(self, name: str) -> Location:
        """The location of an end of an edge.

        Raises:
            InputError: There is none with this name.
        """
        try:
            return self[name]
        except KeyError:
            near = difflib.get_close_matches(name, [one.name for one in self.locations], 1)
            hint = f"did you mean {near[0]!r}?" if near else f"it has {self._known}"
            raise InputError(
                f"template {self.name} has no location {name!r}\nhint: {hint}"
            ) from None

    def edge(
        self,
        source: Node | str,
        target: Node | str,
        *,
        select: str = "",
        guard: str = "",
        sync: str = "",
        update: str = "",
        weight: str = "",
        controllable: bool = True,
        comment: str = "",
        nails: Sequence[Point] = (),
        color: str | None = None,
    ) -> Edge:
        """Adds an edge; its ends are locations, names of locations, or branch points.

        Raises:
            InputError: An end belongs to another template, or no location has its name.
        """
        ends = [self._end(one) if isinstance(one, str) else one for one in (source, target)]
        edge = Edge(
            ends[0],
            ends[1],
            select,
            guard,
            sync,
            update,
            weight,
            controllable,
            comment,
            list(nails),
            color=color,
        )
        for end in ends:
            if not any(end is node for node in self.nodes):
                raise InputError(stranger(self, edge, end))
        self.edges.append(edge)
        return edge

    def remove(self, part: Node | Edge) -> None:
        """Removes an edge; or a location or branch point, with all edges that join it.

        Raises:
            InputError: The part is not in this template.
        """
        parts: list[Any]
        for parts in (self.locations, self.branch_points, self.edges):
            for index, one in enumerate(parts):
                if one is part:
                    del parts[index]
                    self.edges = [
                        e for e in self.edges if part is not e.source and part is not e.target
                    ]
                    if self.initial is part:
                        self.initial = None
                    return
        raise InputError(
            f"{part!r} is not a part of template {self.name}\n"
            "hint: take the part from the template's locations, branch_points or edges"
        )

    def svg(self) -> str:
        """The template drawn as in UPPAAL's editor, laid out where it has no places: an SVG."""
        from ntagen.build.arranging import arranged
        from ntagen.checker.picture.svg import draw

        return draw(arranged(self))

    def _repr_svg_(self) -> str:
        return self.svg()

    def _fresh_id(self) -> str:
        """An id that is not used; it has the template's name, to be the only one in a file."""
        used = {node.id for node in self.nodes}
        number = len(used)
        while f"{self.name}.{number}" in used:
            number += 1
        return f"{self.name}.{number}"


def stranger(template: Template, edge: Edge, end: object) -> str:
    """The message about an edge one of whose ends is not in its template."""
    place = f"template {template.name}, edge {edge.shown_name}"
    if not isinstance(end, Location | BranchPoint):
        return (
            f"{place}: {end!r} is no location\n"
            "hint: the ends of an edge are what location() and branch_point() return"
        )
    return (
        f"{place}: {end.shown_name} is not in this template\n"
        f'hint: make it with location("{end.shown_name}") of template {template.name}, or add the '
        "edge to its own template"
    )
