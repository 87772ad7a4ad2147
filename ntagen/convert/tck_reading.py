"""Reads TChecker's file format into values, each with its line.

The format is described in ``doc/file-format.md`` of TChecker. Declarations may stand in any order,
as long as what is used has been declared; everything is global.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Mapping
from typing import Final, NoReturn, TypeVar

from ntagen.convert.expression_reader import (
    UnknownExpression,
    parse_expression,
    parse_tck_statements,
)
from ntagen.convert.expressions import (
    Expr,
    Number,
)
from ntagen.convert.tck_system import Arrow, Integer, Part, Place, TckSystem, Vector
from ntagen.errors import InputError

_Value = TypeVar("_Value")

_NAME: Final = re.compile(r"[A-Za-z_][\w.]*")
_KINDS: Final = ("system", "process", "event", "clock", "int", "location", "edge", "sync")
_FORMS: Final = {
    "system": "system:NAME",
    "process": "process:NAME",
    "event": "event:NAME",
    "clock": "clock:SIZE:NAME",
    "int": "int:SIZE:MIN:MAX:INITIAL:NAME",
    "location": "location:PROCESS:NAME{…}",
    "edge": "edge:PROCESS:SOURCE:TARGET:EVENT{…}",
    "sync": "sync:PROCESS@EVENT:PROCESS@EVENT",
}
_LOCATION_KEYS: Final = ("initial", "labels", "invariant", "committed", "urgent")
_EDGE_KEYS: Final = ("provided", "do")


def parse_tck(text: str, path: str = "system.tck") -> TckSystem:
    """Reads a system.

    Raises:
        InputError: Something is wrong; the message has the line and how to mend it.
    """
    reader = _Reader(path)
    for number, line in enumerate(text.splitlines(), 1):
        stripped = line.partition("#")[0].strip()
        if stripped:
            reader.declaration(number, stripped)
    return reader.finished()


class _Reader:
    """Reads one file."""

    def __init__(self, path: str) -> None:
        self._system = TckSystem(path)
        self._line = 0

    def declaration(self, number: int, text: str) -> None:
        """Reads one line."""
        self._line = number
        head, brace, attributes = text.partition("{")
        kind, *fields = [one.strip() for one in head.split(":")]
        if kind not in _KINDS:
            self._refuse(
                f"`{kind}` is no declaration of TChecker", f"known are {', '.join(_KINDS)}"
            )
        if not self._system.name and kind != "system":
            self._refuse("the file does not begin with the system", "write system:NAME first")
        if brace and not attributes.endswith("}"):
            self._refuse("the attributes are not closed", "write } at the end of the line")
        given = self._attributes(attributes[:-1]) if brace else {}
        if given and kind not in ("location", "edge"):
            self._refuse(f"attributes of {kind} have no meaning here", "delete them")
        if kind == "sync":
            self._sync(fields)
            return
        wanted = _FORMS[kind].partition("{")[0].count(":")
        if len(fields) != wanted or not all(fields):
            self._refuse(f"`{head.strip()}` has another form", f"write {_FORMS[kind]}")
        name = fields[-1]
        if not _NAME.fullmatch(name):
            self._refuse(f"`{name}` is no name", "use letters, digits, underscores and dots")
        self._declare(kind, fields, given)

    def _declare(self, kind: str, fields: list[str], given: dict[str, str]) -> None:
        """Takes in what a line declares."""
        match kind:
            case "location":
                self._location(*fields, given=given)
            case "edge":
                self._edge(*fields, given=given)
            case "system":
                self._name_system(*fields)
            case "process":
                self._process(*fields)
            case "event":
                self._event(*fields)
            case "clock":
                self._clock(*fields)
            case _:
                self._int(*fields)

    def finished(self) -> TckSystem:
        """The system, once every line is read."""
        system = self._system
        if not system.processes:
            self._refuse("the file has no process", "write system:NAME, then process:NAME")
        for process, places in system.processes.items():
            initial = [place for place in places.values() if place.initial]
            self._line = system.lines[process]
            if not initial:
                self._refuse(f"process {process} has no initial location", "write {initial:}")
            if len(initial) > 1:
                self._line = initial[1].line
                self._refuse(
                    f"process {process} has {len(initial)} initial locations, and a process of "
                    "UPPAAL has one",
                    "keep one, or convert a copy of the file for each",
                )
        return system

    def _name_system(self, name: str) -> None:
        if self._system.name:
            self._refuse("the system is declared twice", "delete this line")
        self._system.name = name

    def _process(self, name: str) -> None:
        self._fresh(name, self._system.processes, "process")
        self._system.processes[name] = {}
        self._system.lines[name] = self._line

    def _event(self, name: str) -> None:
        self._fresh(name, self._system.events, "event")
        self._system.events.add(name)

    def _clock(self, size: str, name: str) -> None:
        self._fresh(name, {*self._system.clocks, *self._system.integers}, "variable")
        self._system.clocks[name] = self._size(size)

    def _int(self, size: str, low: str, high: str, initial: str, name: str) -> None:
        self._fresh(name, {*self._system.clocks, *self._system.integers}, "variable")
        bounds = [self._number(one) for one in (low, high, initial)]
        if not bounds[0] <= bounds[2] <= bounds[1]:
            self._refuse(
                f"{name} begins with {initial}, which is not in {low} to {high}",
                "change its first value or its bounds",
            )
        self._system.integers[name] = Integer(name, self._size(size), *bounds)

    def _location(self, process: str, name: str, *, given: dict[str, str]) -> None:
        places = self._known(process, self._system.processes, "process")
        self._fresh(name, places, f"location of {process}")
        self._keys(given, _LOCATION_KEYS)
        places[name] = Place(
            process,
            name,
            self._line,
            "initial" in given,
            "committed" in given,
            "urgent" in given,
            [one.strip() for one in given.get("labels", "").split(",") if one.strip()],
            self._expression(given.get("invariant", "")),
        )
        if "committed" in given and "urgent" in given:
            self._refuse(f"{name} is committed and urgent", "committed says more; delete urgent")

    def _edge(
        self, process: str, source: str, target: str, event: str, *, given: dict[str, str]
    ) -> None:
        places = self._known(process, self._system.processes, "process")
        for one in (source, target):
            self._known(one, places, f"location of {process}")
        if event not in self._system.events:
            self._unknown(event, self._system.events, "event")
        self._keys(given, _EDGE_KEYS)
        try:
            updates = parse_tck_statements(given.get("do", ""))
        except UnknownExpression as error:
            self._refuse(
                f"cannot convert {error} in `do: {given['do']}`",
                "write assignments only; a choice is x = (if c then a else b)",
            )
        guard = self._expression(given.get("provided", ""))
        self._system.arrows.append(
            Arrow(process, source, target, event, self._line, guard, updates)
        )

    def _sync(self, fields: list[str]) -> None:
        parts: list[Part] = []
        for one in fields:
            process, at, event = (piece.strip() for piece in one.partition("@"))
            weak = event.endswith("?")
            event = event.removesuffix("?").strip()
            if not at or not process or not event:
                self._refuse(f"`{one}` is no part of a synchronisation", f"write {_FORMS['sync']}")
            self._known(process, self._system.processes, "process")
            if event not in self._system.events:
                self._unknown(event, self._system.events, "event")
            if any(part.process == process for part in parts):
                self._refuse(f"process {process} takes part twice", "name each process once")
            parts.append(Part(process, event, weak))
        if len(parts) < 2:
            self._refuse("a synchronisation has at least two parts", f"write {_FORMS['sync']}")
        self._system.vectors.append(Vector(parts, self._line))

    def _attributes(self, text: str) -> dict[str, str]:
        pieces = [one.strip() for one in text.split(":")]
        found: dict[str, str] = {}
        if pieces == [""]:
            return found
        if len(pieces) % 2:
            self._refuse("the attributes have another form", "write {KEY: VALUE : KEY: VALUE}")
        for key, value in zip(pieces[::2], pieces[1::2], strict=True):
            if key in found:
                self._refuse(f"the attribute {key} stands twice", "write one, with both")
            found[key] = value
        return found

    def _keys(self, given: dict[str, str], known: tuple[str, ...]) -> None:
        for key in given:
            if key not in known:
                self._refuse(
                    f"the attribute {key} has no meaning here",
                    f"delete it; known are {', '.join(known)}",
                )

    def _expression(self, text: str) -> Expr:
        if not text:
            return Number(1)
        try:
            return parse_expression(text, tck=True)
        except UnknownExpression as error:
            self._refuse(f"cannot convert {error} in `{text}`", "see file-format.md of TChecker")

    def _number(self, text: str) -> int:
        if not re.fullmatch(r"-?\d+", text):
            self._refuse(f"`{text}` is no integer", "write a number")
        value = int(text)
        if not -(2**31) <= value < 2**31:
            self._refuse(f"{text} has more than 32 bits", "use smaller numbers")
        return value

    def _size(self, text: str) -> int:
        size = self._number(text)
        if size < 1:
            self._refuse(f"an array of {size} has no parts", "write a size of at least 1")
        return size

    def _fresh(self, name: str, known: Container[str], what: str) -> None:
        if name in known:
            self._refuse(f"the {what} {name} is declared twice", "give one of them another name")

    def _known(self, name: str, known: Mapping[str, _Value], what: str) -> _Value:
        if name not in known:
            self._unknown(name, known, what)
        return known[name]

    def _unknown(self, name: str, known: Iterable[str], what: str) -> NoReturn:
        names = ", ".join(sorted(known)[:8]) or "none"
        self._refuse(
            f"no {what} is called `{name}`", f"declare it before it is used; known: {names}"
        )

    def _refuse(self, message: str, hint: str) -> NoReturn:
        raise InputError(f"{self._system.path}:{self._line}: {message}\nhint: {hint}")
