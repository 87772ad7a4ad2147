"""Makes a model of UPPAAL from a system of TChecker, with the same states and transitions.

Everything stays global. A synchronisation of two processes that both must take part becomes a
binary channel, whose sender is the process that TChecker lets act first. Any other one is written
out: each combination of edges has a channel of its own. The edge of its first process has the
guards and statements of all; the others only follow, on a broadcast channel if they are more than
one. So that the guard can ask where the others are, a variable of each process holds its location:
it adds no states.

TChecker takes no edge whose statement would leave the bounds of a variable. UPPAAL calls that a
run-time error, so a guard forbids it where the bounds do not show that it cannot happen.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Final, NoReturn

from ntagen.build import Model, Template
from ntagen.convert.expressions import (
    Assign,
    Binary,
    Expr,
    Index,
    Name,
    Number,
    conjunction,
    conjuncts,
    mapped,
    names,
    parts,
    shown,
    shown_update,
)
from ntagen.convert.intervals import Interval, interval, under
from ntagen.convert.names import UPPAAL_WORDS, Names
from ntagen.convert.tck_system import Arrow, Part, TckSystem, Vector
from ntagen.errors import InputError

MOST_EDGES: Final = 100_000
"""A synchronisation that would be written out in more edges is refused."""


def model_of_tck(system: TckSystem) -> Model:
    """The model of a system; a query for each label asks whether it can be reached.

    Raises:
        InputError: Something has no counterpart; the message has the line.
    """
    return _Importer(system).model()


class _Importer:
    """Makes one model."""

    def __init__(self, system: TckSystem) -> None:
        self._system = system
        self._global = Names(UPPAAL_WORDS)
        self._variables = {
            name: self._global.fresh(name) for name in (*system.clocks, *system.integers)
        }
        self._processes = {name: self._global.fresh(name) for name in system.processes}
        self._bounds: dict[str, Interval] = {
            name: (one.low, one.high) for name, one in system.integers.items()
        }
        self._templates: dict[str, Template] = {}
        self._locations: dict[tuple[str, str], str] = {}
        self._channels: dict[str, list[str]] = {"chan": [], "broadcast chan": []}
        self._arrows: dict[tuple[str, str], list[Arrow]] = defaultdict(list)
        for arrow in system.arrows:
            self._arrows[arrow.process, arrow.event].append(arrow)
        self._places: dict[str, str] = {}
        self._numbers = {
            name: {place: number for number, place in enumerate(places)}
            for name, places in system.processes.items()
        }
        self._count = 0

    def model(self) -> Model:
        system = self._system
        written_out = [one for one in system.vectors if not self._is_binary(one)]
        for vector in written_out:
            for part in vector.parts if len(vector.parts) > 2 or self._has_weak(vector) else ():
                if part.process not in self._places:
                    wanted = f"{part.process}_place"
                    self._places[part.process] = self._global.fresh(wanted)
        model = Model()
        self._add_templates(model)
        together = {(part.process, part.event) for one in system.vectors for part in one.parts}
        for arrow in system.arrows:
            if (arrow.process, arrow.event) not in together:
                self._add(arrow, arrow.guard, arrow.updates, arrow.event)
        for vector in system.vectors:
            if vector in written_out:
                self._write_out(vector)
            else:
                self._add_binary(vector)
        model.declarations = "\n".join(self._declarations())
        model.system = f"system {', '.join(self._processes.values())};"
        self._add_queries(model)
        return model

    def _add_templates(self, model: Model) -> None:
        for process, places in self._system.processes.items():
            template = model.template(self._processes[process])
            self._templates[process] = template
            # The name of a location would hide a variable of the same name.
            local = Names([*UPPAAL_WORDS, *self._variables.values(), *self._places.values()])
            for place in places.values():
                name = local.fresh(place.name)
                self._locations[process, place.name] = name
                self._check(place.invariant, f"invariant of {place.name}", place.line)
                template.location(
                    name,
                    initial=place.initial,
                    committed=place.committed,
                    urgent=place.urgent,
                    invariant=self._text(place.invariant),
                    comment=f"labels: {', '.join(place.labels)}" if place.labels else "",
                )

    def _declarations(self) -> Iterator[str]:
        system = self._system
        yield f"// System {system.name} of TChecker."
        for name, size in system.clocks.items():
            yield f"clock {self._variables[name]}{f'[{size}]' if size > 1 else ''};"
        for one in system.integers.values():
            head = f"int[{one.low},{one.high}] {self._variables[one.name]}"
            if one.size > 1:
                values = ", ".join([str(one.initial)] * one.size)
                yield f"{head}[{one.size}] = {{ {values} }};"
            else:
                yield f"{head} = {one.initial};"
        if self._places:
            yield "// The location of each process, for guards of others."
        for process, name in self._places.items():
            places = list(system.processes[process].values())
            initial = next(i for i, one in enumerate(places) if one.initial)
            yield f"int[0,{len(places) - 1}] {name} = {initial};"
        for kind, channels in self._channels.items():
            if channels:
                yield f"{kind} {', '.join(channels)};"

    def _add_queries(self, model: Model) -> None:
        labelled: dict[str, list[str]] = defaultdict(list)
        for process, places in self._system.processes.items():
            for place in places.values():
                for label in place.labels:
                    where = f"{self._processes[process]}.{self._locations[process, place.name]}"
                    labelled[label].append(where)
        for label, found in labelled.items():
            model.query(f"E<> {' or '.join(found)}", f"label {label}")

    @staticmethod
    def _has_weak(vector: Vector) -> bool:
        return any(part.weak for part in vector.parts)

    def _is_binary(self, vector: Vector) -> bool:
        """Whether a binary channel says the same, bounds of variables included."""
        if len(vector.parts) != 2 or self._has_weak(vector):
            return False
        first, second = (self._arrows[part.process, part.event] for part in vector.parts)
        written = {_base(one.target) for arrow in first for one in arrow.updates}
        for arrow in second:
            needed = self._in_bounds(arrow.guard, arrow.updates, arrow.line)
            read = set().union(*(names(one) for one in needed), *())
            if written & read:
                return False
        return True

    def _add_binary(self, vector: Vector) -> None:
        first, second = vector.parts
        channel = self._channel("chan", [first, second])
        for part, sign in ((first, "!"), (second, "?")):
            for arrow in self._arrows[part.process, part.event]:
                self._add(arrow, arrow.guard, arrow.updates, part.event, f"{channel}{sign}")

    def _channel(self, kind: str, taking_part: Sequence[Part]) -> str:
        events = list(dict.fromkeys(part.event for part in taking_part))
        name = self._global.fresh("_".join(events))
        self._channels[kind].append(name)
        return name

    def _write_out(self, vector: Vector) -> None:
        """Adds the edges of all combinations of edges that a synchronisation allows."""
        choices: list[list[Arrow | None]] = []
        for part in vector.parts:
            edges: list[Arrow | None] = list(self._arrows[part.process, part.event])
            choices.append([*edges, None] if part.weak else edges)
        for combination in itertools.product(*choices):
            self._count += 1
            if self._count > MOST_EDGES:
                self._refuse(
                    vector.line,
                    f"this synchronisation has more than {MOST_EDGES} combinations of edges",
                    "use fewer processes in it, or fewer edges with its events",
                )
            taken = [one for one in combination if one is not None]
            if taken:
                absent = [
                    part for part, one in zip(vector.parts, combination, strict=True) if one is None
                ]
                self._add_combination(vector, taken, absent)

    def _add_combination(
        self, vector: Vector, taken: Sequence[Arrow], absent: Sequence[Part]
    ) -> None:
        first, *others = taken
        # A process must take part where it has an edge with the event, whatever its guard.
        elsewhere = {
            (part.process, arrow.source): None
            for part in absent
            for arrow in self._arrows[part.process, part.event]
        }
        guards = [self._at(process, source, "!=") for process, source in elsewhere]
        if len(others) > 1:
            guards += [self._at(one.process, one.source, "==") for one in others]
        guards += [one.guard for one in taken]
        updates = [update for one in taken for update in one.updates]
        guard = conjunction([one for guard in guards for one in conjuncts(guard)])
        label = " ".join(dict.fromkeys(one.event for one in taken))
        if not others:
            self._add(first, guard, updates, label)
            return
        kind = "broadcast chan" if len(others) > 1 else "chan"
        present = [part for part in vector.parts if part not in absent]
        channel = self._channel(kind, present)
        self._add(first, guard, updates, label, f"{channel}!")
        for one in others:
            self._add(one, Number(1), [], one.event, f"{channel}?")

    def _at(self, process: str, place: str, operator: str) -> Expr:
        number = self._numbers[process][place]
        return Binary(operator, Name(f"{process}@"), Number(number))

    def _add(
        self, arrow: Arrow, guard: Expr, updates: Sequence[Assign], event: str, sync: str = ""
    ) -> None:
        """Adds an edge of a process with these labels."""
        self._check(guard, "guard", arrow.line)
        for one in updates:
            for expr in (one.target, one.value):
                self._check(expr, "statement", arrow.line)
        needed = self._in_bounds(guard, updates, arrow.line)
        moved = [self._renamed_update(one) for one in updates]
        if arrow.process in self._places:
            place = Number(self._numbers[arrow.process][arrow.target])
            moved.append(Assign(Name(self._places[arrow.process]), place))
        self._templates[arrow.process].edge(
            self._locations[arrow.process, arrow.source],
            self._locations[arrow.process, arrow.target],
            guard=self._text(conjunction([*conjuncts(guard), *needed])),
            sync=sync,
            update=shown_update(moved),
            comment=f"event {event}",
        )

    def _in_bounds(self, guard: Expr, updates: Sequence[Assign], line: int) -> list[Expr]:
        """What must hold before the updates for all variables to stay in their bounds."""
        bounds = under(guard, self._bounds)
        now: dict[str, Expr] = {}
        needed: list[Expr] = []
        for one in updates:
            name = _base(one.target)
            if name in self._system.clocks:
                continue
            low, high = self._bounds[name]
            value = _with(one.value, now)
            if name in names(value) and isinstance(one.target, Index) and name in now:
                value = Name("?")  # a part of an array that has changed
            least, greatest = interval(value, bounds)
            if (least < low or greatest > high) and Name("?") in parts(value):
                self._refuse(
                    line,
                    f"whether {name} stays in its bounds depends on an array that this edge writes",
                    f"write a `provided` that shows it, or give {name} wider bounds",
                )
            if least < low:
                needed.append(Binary("<=", Number(low), value))
            if greatest > high:
                needed.append(Binary("<=", value, Number(high)))
            now[name] = Name("?") if isinstance(one.target, Index) else value
        return needed

    def _check(self, expr: Expr, what: str, line: int) -> None:
        """Refuses what is not declared."""
        declared = (*self._system.clocks, *self._system.integers)
        for one in parts(expr):
            if isinstance(one, Name) and not one.text.endswith("@") and one.text not in declared:
                self._refuse(
                    line,
                    f"`{one.text}` in the {what} is not declared",
                    f"declare it: int:1:0:1:0:{one.text} or clock:1:{one.text}",
                )

    def _text(self, expr: Expr) -> str:
        return "" if expr == Number(1) else shown(self._renamed(expr))

    def _renamed(self, expr: Expr) -> Expr:
        """The expression with the names of the model; `a < b < c` becomes two comparisons."""

        def change(one: Expr) -> Expr | None:
            match one:
                case Name(text) if text.endswith("@"):
                    return Name(self._places[text[:-1]])
                case Name(text):
                    return Name(self._variables[text])
                case Binary(operator, Binary(inner, left, middle), right) if operator in (
                    "<",
                    "<=",
                ) and inner in ("<", "<="):
                    pair = (Binary(inner, left, middle), Binary(operator, middle, right))
                    return Binary("&&", *(self._renamed(half) for half in pair))
            return None

        return mapped(expr, change)

    def _renamed_update(self, update: Assign) -> Assign:
        return Assign(self._renamed(update.target), self._renamed(update.value))

    def _refuse(self, line: int, message: str, hint: str) -> NoReturn:
        raise InputError(f"{self._system.path}:{line}: {message}\nhint: {hint}")


def _base(target: Expr) -> str:
    """The variable that an assignment writes."""
    while isinstance(target, Index):
        target = target.base
    return target.text if isinstance(target, Name) else "?"


def _with(expr: Expr, now: dict[str, Expr]) -> Expr:
    """The expression before the assignments that gave variables the values `now`."""

    def change(one: Expr) -> Expr | None:
        if isinstance(one, Index) and isinstance(one.base, Name):
            changed = now.get(one.base.text)
            return changed if changed is not None else None
        return now.get(one.text) if isinstance(one, Name) else None

    return mapped(expr, change)
