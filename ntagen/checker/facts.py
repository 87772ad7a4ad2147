"""The parts of a UPPAAL model as frozen values.

They are made from the engine's object ``ntagen-model`` (see ``ntagen info --json``), with one class
for each kind of part. Templates are as written in the file. Processes, variables, clocks and
channels are those of the network after all templates have been instantiated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import msgspec

from ntagen.checker.picture.diagram import Diagram
from ntagen.checker.queries import Query as Query
from ntagen.checker.queries import queries_from as queries_from


@dataclass(frozen=True, slots=True)
class Template(Diagram):
    """A template; a notebook shows it as a picture.

    Its attributes are those of `Diagram`.
    """

    def svg(self) -> str:
        """The template drawn as in UPPAAL's editor.

        Positions come from the file. A template without them, as in XTA, is laid out in layers.

        Returns:
            An SVG document.
        """
        # Imported here: few commands draw, and the XML libraries take time to load.
        from ntagen.checker.picture.svg import draw

        return draw(self)

    def _repr_svg_(self) -> str:
        return self.svg()


@dataclass(frozen=True, slots=True)
class Process:
    """A process of the system.

    Attributes:
        name: For example ``Gate`` or ``Train(3)``.
        template: The name of its template.
        priority: Its level in the system line; greater is more urgent.
        location_count: How many locations it has.
        edge_count: How many edges it has; all legs of a branch point count as one.
    """

    name: str
    template: str
    priority: int
    location_count: int
    edge_count: int


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable.

    Attributes:
        name: For example ``len`` or ``Gate.list``.
        process: The process it is local to; ``None`` if it is global.
        type: The type of its parts, such as ``int[0,5]``.
        dimensions: The sizes of an array; empty for a single value.
        meta: Whether it is ``meta``, so that states that differ only in it are the same.
        words: How many 32-bit words it takes in a state.
    """

    name: str
    process: str | None
    type: str
    dimensions: tuple[int, ...]
    meta: bool
    words: int


@dataclass(frozen=True, slots=True)
class Clock:
    """A clock, or one part of an array of clocks.

    Attributes:
        name: For example ``x`` or ``Train(1).x``.
        process: The process it is local to; ``None`` if it is global.
        hybrid: Whether it is ignored in symbolic and game queries.
    """

    name: str
    process: str | None
    hybrid: bool


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel, or one part of an array of channels.

    Attributes:
        name: For example ``go[2]``.
        broadcast: Whether every receiver that can take part does.
        urgent: Whether no time passes while a synchronisation on it is possible.
        priority: Its level in ``chan priority``; greater is more urgent.
    """

    name: str
    broadcast: bool
    urgent: bool
    priority: int


@dataclass(frozen=True, slots=True)
class StateSize:
    """The size of the discrete part of a state, in 32-bit words.

    Attributes:
        words: All words.
        location_words: The words of locations, one for each process.
        variable_words: The words of variables that are not ``meta``.
        meta_words: The words of ``meta`` variables.
    """

    words: int
    location_words: int
    variable_words: int
    meta_words: int


@dataclass(frozen=True, slots=True)
class StoredPart:
    """The location of a process or a variable, as a search stores it.

    Attributes:
        kind: What it is; ``left out`` are all variables that only random runs know.
        name: The name of the process or of the variable; empty for what is left out.
        process: The process it belongs to; ``None`` if it is global.
        meta: Whether it is ``meta``: it is stored with the first of the states that differ only in
            it, and not compared.
        words: How many 32-bit words it has.
        stored_bits: How many bits all of them take in a stored state.
        constant_words: How many of them are not stored, because nothing writes them.
        reset_words: How many of them have their initial value wherever nothing may still read
            them. A query that reads them keeps them.
        live_locations: In how many locations of all processes any of these may still be read. While
            a process is in one of these locations, they are kept.
    """

    kind: Literal["location", "variable", "left out"]
    name: str
    process: str | None
    meta: bool
    words: int
    stored_bits: int
    constant_words: int
    reset_words: int
    live_locations: int


@dataclass(frozen=True, slots=True)
class StoredState(StateSize):
    """The size of the discrete part of a state, and what a search stores of it.

    Its attributes are those of `StateSize`, and these.

    Attributes:
        stored_bits: How many bits all parts take in a stored state, before what it has in common
            with others is taken out. ``None`` if only random runs have a meaning: they store no
            states.
        padding_bits: How many bits fill it up to whole words; ``None`` likewise.
        constant_words: How many words are not stored, because nothing writes them; ``None``
            likewise.
        reset_words: How many words have their initial value wherever nothing may still read them.
            A query that reads them keeps them. ``None`` likewise.
        parts: The location of each process, then the variables in the order of their words, then
            what only random runs know; none if nothing is stored.
    """

    stored_bits: int | None
    padding_bits: int | None
    constant_words: int | None
    reset_words: int | None
    parts: tuple[StoredPart, ...]


@dataclass(frozen=True, slots=True)
class ScalarSet:
    """A scalar set.

    Attributes:
        size: How many members it has.
        reduced: Whether symmetry reduction treats states that differ only by exchanged members as
            one.
        obstacle: Why it does not, or ``None``.
        place: The place that distinguishes the members, as ``file:line:column``, or ``None``.
        at: The text there, or ``None``.
    """

    size: int
    reduced: bool
    obstacle: str | None = None
    place: str | None = None
    at: str | None = None


@dataclass(frozen=True, slots=True)
class Facts:
    """All that is in a model.

    Attributes:
        templates: As written, including those that no process uses.
        processes: In the order of the system line.
        variables: In the order of their words.
        clocks: Without the reference clock.
        channels: In the order of their declarations.
        features: Names of what the model uses beyond plain timed automata.
        scalar_sets: In the order of their declarations.
        state: How large a state is.
        queries: Those of the file.
    """

    templates: tuple[Template, ...]
    processes: tuple[Process, ...]
    variables: tuple[Variable, ...]
    clocks: tuple[Clock, ...]
    channels: tuple[Channel, ...]
    features: tuple[str, ...]
    scalar_sets: tuple[ScalarSet, ...]
    state: StateSize
    queries: tuple[Query, ...]

    @classmethod
    def from_object(cls, found: dict[str, Any]) -> Facts:
        """Makes the values from the engine's object ``ntagen-model``."""
        processes = [
            one | {"location_count": one["locations"], "edge_count": one["edges"]}
            for one in found["processes"]
        ]
        return msgspec.convert(found | {"processes": processes}, cls)


def stored_state_from(text: str) -> StoredState:
    """Reads what the engine says of a stored state."""
    return msgspec.json.decode(text, type=StoredState)
