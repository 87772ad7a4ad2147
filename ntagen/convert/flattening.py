"""Makes the network of a model: labels as trees, in which all names are those of the network.

The engine instantiates, and gives the variables and the templates. What is left are the names in
labels: a variable of the process or a global one, a reference that the system line bound, a value
of a `select`, or a constant, whose value the engine says (`ntagen.convert.questions`).
"""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Final

from ntagen import checker
from ntagen.convert.exchangeable import require_exchangeable
from ntagen.convert.expression_reader import (
    UnknownExpression,
    parse_expression,
    parse_updates,
)
from ntagen.convert.expressions import (
    Assign,
    Binary,
    Call,
    Expr,
    Index,
    Name,
    Number,
    Quantified,
    mapped,
    names,
    parts,
    shown,
)
from ntagen.convert.instances import Instances, names_of_parameters
from ntagen.convert.network import (
    Array,
    Channel,
    Leg,
    Network,
    NetworkEdge,
    NetworkProcess,
    Place,
    Variable,
    refuse,
)
from ntagen.convert.questions import Questions
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen import build
    from ntagen.checker.facts import Process, Template
    from ntagen.checker.picture.diagram import Edge, Location

MOST_EDGES: Final = 100_000
"""At most so many edges stand for one edge with a `select`."""

_WAY_OUT: Final = "write it with comparisons, + - * / % and assignments"


def network_of(model: checker.Model, written: build.Model, path: str, tool: str) -> Network:
    """The network of a model.

    Args:
        model: The model in the engine.
        written: The same model as it is written.
        path: The name of its file, for messages.
        tool: The name of the other tool, for messages.

    Raises:
        InputError: The model or a label uses what no other format has.
    """
    require_exchangeable(model, written, path, tool)
    questions = Questions(written, path)
    instances = Instances(written)
    found = json.loads(model.network_json())
    names_in = _NamesInModel(
        frozenset(one.name for one in model.variables),
        frozenset(re.sub(r"(\[\d+\])+$", "", one) for one in found["clocks"]),
        frozenset(one.name.partition("[")[0] for one in model.channels),
    )
    while True:
        processes = []
        for process, numbers in zip(model.processes, found["processes"], strict=True):
            template = model.template(process.template)
            references = instances.references(process.name, template)
            hidden = _constants(written[process.template], template) - set(references)
            scope = _Scope(process, template, references, hidden)
            maker = _ProcessMaker(scope, names_in, questions, path)
            processes.append(maker.process(numbers["initial"]))
        if not questions.answer():
            break
    return Network(
        tuple(found["clocks"]),
        {
            one["name"]: Variable(one["name"], one["low"], one["high"], one["initial"])
            for one in found["variables"]
        },
        {
            one.name: Array(one.name, one.dimensions)
            for one in model.variables
            if one.dimensions and "struct" not in one.type
        },
        {one.name: Channel(one.name, one.broadcast) for one in model.channels},
        tuple(processes),
    )


def _constants(written: build.Template, template: Template) -> set[str]:
    """The names that a template declares as constants, its parameters included."""
    found = {name for one in template.parameters for name in names_of_parameters(one)}
    for statement in re.findall(r"\bconst\b[^;]*", written.declarations):
        found |= set(re.findall(r"([A-Za-z_]\w*)\s*(?:\[[^=;]*)?:?=", statement))
    return found


@dataclass(frozen=True, slots=True)
class _NamesInModel:
    """The names of variables, clocks and channels; of arrays without indexes."""

    variables: frozenset[str]
    clocks: frozenset[str]
    channels: frozenset[str]

    def __contains__(self, name: str) -> bool:
        return name in self.variables or name in self.clocks or name in self.channels


@dataclass(frozen=True, slots=True)
class _Scope:
    """What the names in the labels of a process mean.

    Attributes:
        process: The process.
        template: Its template.
        references: The parameters that stand for something else.
        constants: The names of the template's constants, which hide global names.
    """

    process: Process
    template: Template
    references: Mapping[str, Expr]
    constants: set[str]


class _ProcessMaker:
    """Makes a process of the network."""

    def __init__(
        self, scope: _Scope, names_in: _NamesInModel, questions: Questions, path: str
    ) -> None:
        self._scope = scope
        self._names = names_in
        self._questions = questions
        self._where = f"{path}: template {scope.template.name}"
        self._number = {one.id: i for i, one in enumerate(scope.template.locations)}
        self._shown = {one.id: one.name or one.id for one in scope.template.locations}

    def process(self, initial: int) -> NetworkProcess:
        """The process that starts in this location."""
        template = self._scope.template
        places = [self._place(one) for one in template.locations]
        edges = [
            made
            for one in template.edges
            if one.source in self._number
            for made in self._edges(one)
        ]
        return NetworkProcess(self._scope.process.name, initial, tuple(places), tuple(edges))

    def _place(self, location: Location) -> Place:
        name = self._shown[location.id]
        where = f"{self._where}, location {name}, invariant"
        invariant = self._final(where, self._parsed(where, location.invariant), {})
        return Place(name, location.kind, invariant, location.rate)

    def _edges(self, edge: Edge) -> Iterator[NetworkEdge]:
        """The edges for all values of the `select` of a written edge."""
        where = self._edge_place(edge)
        legs = [edge]
        if edge.target not in self._number:
            legs = [one for one in self._scope.template.edges if one.source == edge.target]
        for leg in legs:
            if leg is not edge and (leg.select or leg.guard or leg.sync):
                refuse(
                    self._edge_place(leg),
                    "a leg of a branch point has more than a weight and updates",
                    "move select, guard and synchronisation to the edge before the branch point",
                )
        guard = self._parsed(f"{where}, guard", edge.guard)
        channel = self._parsed(f"{where}, sync", edge.sync.rstrip("!? ")) if edge.sync else None
        for values in self._bindings(f"{where}, select", edge.select):
            yield NetworkEdge(
                where,
                self._number[edge.source],
                self._final(f"{where}, guard", guard, values),
                None if channel is None else self._final(f"{where}, sync", channel, values),
                edge.sync.rstrip().endswith("!"),
                tuple(self._leg(edge, leg, values) for leg in legs),
                edge.controllable,
            )

    def _leg(self, edge: Edge, leg: Edge, values: Mapping[str, Expr]) -> Leg:
        where = self._edge_place(leg)
        updates = self._updates(self._edge_place(edge), edge.update, values)
        if leg is not edge:
            updates += self._updates(where, leg.update, values)
        weight = self._parsed(f"{where}, weight", leg.weight)
        return Leg(
            self._number[leg.target],
            self._final(f"{where}, weight", weight, values),
            tuple(updates),
        )

    def _updates(self, where: str, text: str, values: Mapping[str, Expr]) -> list[Assign]:
        place = f"{where}, update"
        try:
            written = parse_updates(text)
        except UnknownExpression as error:
            refuse(place, f"cannot convert {error} in `{text.strip()}`", _WAY_OUT)
        return [
            Assign(self._final(place, one.target, values), self._final(place, one.value, values))
            for one in written
        ]

    def _bindings(self, where: str, select: str) -> Iterator[dict[str, Expr]]:
        """All values of what a `select` binds."""
        bound = _selects(select)
        ranges = [self._questions.range(self._scope.process, text) for _, text in bound]
        count = 1
        for low, high in ranges:
            count *= high - low + 1
        if count > MOST_EDGES:
            refuse(
                where,
                f"`{select}` has {count} values, and each would be an edge",
                "give the type of the select a smaller range",
            )
        for values in itertools.product(*(range(low, high + 1) for low, high in ranges)):
            yield {name: Number(one) for (name, _), one in zip(bound, values, strict=True)}

    def _parsed(self, where: str, text: str) -> Expr:
        if not text.strip():
            return Number(1)
        try:
            return parse_expression(text)
        except UnknownExpression as error:
            refuse(where, f"cannot convert {error} in `{text.strip()}`", _WAY_OUT)

    def _final(self, where: str, expr: Expr, values: Mapping[str, Expr]) -> Expr:
        """The expression with full names and the values of constants."""
        process = self._scope.process

        def change(one: Expr) -> Expr | None:
            if not names(one):
                return None
            if self._is_constant(one):
                return Number(self._questions.value(process, shown(one).replace("@", "")))
            if isinstance(one, Index) and self._is_constant(one.base):
                refuse(
                    where,
                    f"`{shown(one.base).replace('@', '')}` in `{shown(expr)}` is a table of "
                    "constants whose index changes",
                    "declare the table as a variable: without `const`",
                )
            return None

        found = mapped(self._resolved(expr, values), change)
        for one in parts(found):
            if isinstance(one, Call):
                refuse(
                    where,
                    f"the function `{one.function}` in `{shown(expr)}` has no counterpart",
                    "write what it computes into the label",
                )
        return found

    def _resolved(self, expr: Expr, values: Mapping[str, Expr]) -> Expr:
        """The expression with full names of variables and clocks, and quantifiers written out."""

        def change(one: Expr) -> Expr | None:
            match one:
                case Name(text):
                    return self._meaning(text, values)
                case Quantified(kind, name, type_, body):
                    low, high = self._questions.range(self._scope.process, type_)
                    sign = {"forall": "&&", "exists": "||", "sum": "+"}[kind]
                    found = self._resolved(body, {**values, name: Number(low)})
                    for value in range(low + 1, high + 1):
                        operand = self._resolved(body, {**values, name: Number(value)})
                        found = Binary(sign, found, operand)
                    return found
            return None

        return mapped(expr, change)

    def _meaning(self, name: str, values: Mapping[str, Expr]) -> Expr | None:
        """What a name stands for; the name of a constant of the template gets an ``@``."""
        local = f"{self._scope.process.name}.{name}"
        if name in values:
            return values[name]
        if local in self._names:
            return Name(local)
        if name in self._scope.references:
            return self._scope.references[name]
        return Name(f"{name}@") if name in self._scope.constants else None

    def _is_constant(self, expr: Expr) -> bool:
        """Whether an expression has only numbers and constants, so that the engine knows it."""
        return not any(
            isinstance(one, Call | Quantified)
            or (isinstance(one, Name) and one.text in self._names)
            for one in parts(expr)
        )

    def _edge_place(self, edge: Edge) -> str:
        ends = (self._shown.get(one, one) for one in (edge.source, edge.target))
        return f"{self._where}, edge {' → '.join(ends)}"


def _selects(select: str) -> list[tuple[str, str]]:
    """The names and types of a `select`."""
    found = []
    # A comma inside brackets belongs to a range.
    for one in re.split(r",(?![^\[(]*[\])])", select):
        name, colon, text = one.partition(":")
        if colon:
            found.append((name.strip(), " ".join(text.split())))
    return found
