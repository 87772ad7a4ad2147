"""A system in TChecker's format as values."""

from __future__ import annotations

from dataclasses import dataclass, field

from ntagen.convert.expressions import Assign, Expr


@dataclass(slots=True)
class Integer:
    """An integer variable, or an array of `size` of them."""

    name: str
    size: int
    low: int
    high: int
    initial: int


@dataclass(slots=True)
class Place:
    """A location."""

    process: str
    name: str
    line: int
    initial: bool
    committed: bool
    urgent: bool
    labels: list[str]
    invariant: Expr


@dataclass(slots=True)
class Arrow:
    """An edge."""

    process: str
    source: str
    target: str
    event: str
    line: int
    guard: Expr
    updates: list[Assign]

    @property
    def shown(self) -> str:
        """Its name in messages."""
        return f"edge {self.source} → {self.target} of {self.process}"


@dataclass(slots=True)
class Part:
    """A constraint of a synchronisation: a process with an event."""

    process: str
    event: str
    weak: bool


@dataclass(slots=True)
class Vector:
    """A synchronisation."""

    parts: list[Part]
    line: int


@dataclass(slots=True)
class TckSystem:
    """A system in TChecker's format.

    Attributes:
        path: The name of its file.
        name: Its name.
        clocks: The sizes by name.
        integers: By name.
        processes: The locations by process and name, in the order of the file.
        arrows: All edges.
        vectors: All synchronisations.
        events: The names of events.
    """

    path: str
    name: str = ""
    clocks: dict[str, int] = field(default_factory=dict)
    integers: dict[str, Integer] = field(default_factory=dict)
    processes: dict[str, dict[str, Place]] = field(default_factory=dict)
    arrows: list[Arrow] = field(default_factory=list)
    vectors: list[Vector] = field(default_factory=list)
    events: set[str] = field(default_factory=set)
    lines: dict[str, int] = field(default_factory=dict)
