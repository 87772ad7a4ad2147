"""The state space of a small model as a graph: symbolic states, and all moves between them.

A move leads to the state whose zone contains where it leads, so every run of the model is a path in
the graph. Without clocks, states with equal locations and variables are one.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ntagen.checker.edges import EdgeTable, EngineStep, step_of
from ntagen.checker.picture.diagram import Diagram, Edge, Location
from ntagen.checker.picture.page import Svg, kind_of
from ntagen.checker.picture.svg import draw
from ntagen.checker.states import SymbolicState
from ntagen.errors import InputError
from ntagen.files import write_files

MOST_DRAWN: Final = 100
"""A drawing of more states can hardly be read, so it is made only if more are asked for."""

_PLACES_ON_A_LINE: Final = 3
_LINES_OF_VALUES: Final = 6

RawStep = list[tuple[int, int, int, list[int]]]
"""Process, edge, leg and select values of each edge, as the engine gives them."""


@dataclass(frozen=True, slots=True)
class Move:
    """A move from one state to another.

    Attributes:
        source: The index of the state from which it leads.
        step: The edges that are taken together, the sender's first.
        target: The index of the state to which it leads.
        controllable: Whether it is the controller's, in a game.
    """

    source: int
    step: EngineStep
    target: int
    controllable: bool


@dataclass(frozen=True, slots=True)
class StateSpace:
    """The reachable symbolic states of a model, and all moves between them.

    Attributes:
        states: Those with the fewest moves first; `SymbolicState.index` is the place here.
        moves: In the order of the states from which they lead. A move that leads to several states
            stands here once for each.
    """

    states: tuple[SymbolicState, ...]
    moves: tuple[Move, ...]

    def __repr__(self) -> str:
        return f"<StateSpace of {len(self.states)} states and {len(self.moves)} moves>"

    def svg(self, *, clocks: bool = True, limit: int = MOST_DRAWN) -> Svg:
        """The graph as a picture; the initial state has a second circle.

        Moves of the environment are dashed. Moves that have the same ends and the same text are one
        arrow, and variables that never change are left out.

        Args:
            clocks: Whether states with different zones are different.
            limit: How many states the picture may have.

        Raises:
            InputError: The graph has more states.
        """
        diagram = _diagram(self, clocks=clocks)
        count = len(diagram.locations)
        if count > limit:
            few = "" if clocks is False else "leave out the clocks (--as discrete), "
            raise InputError(
                f"the graph has {count} states, and the picture may have {limit}\n"
                f"hint: allow more (--set 'limit {count}'), make constants of the model smaller, "
                f"{few}or write a file that ends in .dot, for Graphviz"
            )
        return Svg(draw(diagram))

    def dot(self, *, clocks: bool = True) -> str:
        """The graph in the language of Graphviz, of any size; see `svg`."""
        return _dot(_diagram(self, clocks=clocks))

    def save(
        self, path: str | os.PathLike[str], *, clocks: bool = True, limit: int = MOST_DRAWN
    ) -> None:
        """Writes the graph to a file; its ending is the format: that of a picture, or ``.dot``.

        Args:
            path: The file.
            clocks: Whether states with different zones are different.
            limit: How many states a picture may have.

        Raises:
            InputError: The file cannot be written, its ending is unknown, or the graph has too many
                states for a picture.
        """
        if kind_of(path, ("dot",)) == "dot":
            write_files({Path(path): self.dot(clocks=clocks)})
            return
        self.svg(clocks=clocks, limit=limit).save(path)

    def _repr_svg_(self) -> str | None:
        return self.svg().text if len(self.states) <= MOST_DRAWN else None


def state_space(
    states: Iterator[SymbolicState], links: Sequence[tuple[int, RawStep, int]], edges: EdgeTable
) -> StateSpace:
    """The graph from what the engine has found; `edges` are those of the model."""
    moves = (
        Move(
            source,
            step_of(edges, step),
            target,
            all(edges[process][edge].controllable for process, edge, *_ in step),
        )
        for source, step, target in links
    )
    return StateSpace(tuple(states), tuple(moves))


def _diagram(space: StateSpace, *, clocks: bool) -> Diagram:
    """What is drawn."""
    numbers: dict[object, int] = {}
    number_of = []
    shown: list[SymbolicState] = []
    for state in space.states:
        values = (tuple(state.locations.values()), tuple(state.variables.values()))
        key = state.index if clocks else values
        if key not in numbers:
            numbers[key] = len(shown)
            shown.append(state)
        number_of.append(numbers[key])
    changing = [
        name
        for name in (shown[0].variables if shown else ())
        if len({state.variables[name] for state in shown}) > 1
    ]
    locations = tuple(
        Location(
            id=str(number),
            name=_places(state.locations),
            invariant="\n".join(state.zone) if clocks else "",
            rate=_values([f"{name} = {state.variables[name]}" for name in changing]),
            initial=state.predecessor is None,
        )
        for number, state in enumerate(shown)
    )
    arrows = dict.fromkeys(
        (number_of[move.source], number_of[move.target], _label(move.step), move.controllable)
        for move in space.moves
    )
    edges = tuple(
        Edge(str(source), str(target), controllable=controllable, sync=label)
        for source, target, label, controllable in arrows
    )
    kind = "symbolic" if clocks else "discrete"
    states = "1 state" if len(shown) == 1 else f"{len(shown)} {kind} states"
    arrow = "1 arrow" if len(edges) == 1 else f"{len(edges)} arrows"
    return Diagram(f"{states}, {arrow}", (), locations, (), edges)


def _label(step: EngineStep) -> str:
    """Who moves, or sends; what is sent; and the choices."""
    first = step.edges[0]
    select = ", ".join(f"{name}={value}" for name, value in first.select.items())
    sent = f": {first.sync}" if first.sync else ""
    return f"{first.process}{sent}{f' [{select}]' if select else ''}"


def _places(locations: dict[str, str]) -> str:
    places = [f"{process}.{location}" for process, location in locations.items()]
    starts = range(0, len(places), _PLACES_ON_A_LINE)
    return "\n".join("  ".join(places[start : start + _PLACES_ON_A_LINE]) for start in starts)


def _values(values: Sequence[str]) -> str:
    left = len(values) - _LINES_OF_VALUES
    if left <= 0:
        return "\n".join(values)
    return "\n".join([*values[:_LINES_OF_VALUES], f"… and {left} more"])


def _dot(diagram: Diagram) -> str:
    lines = [
        "digraph states {",
        f"  label={_quoted(diagram.name)};",
        '  node [shape=box, style=rounded, fontname="Helvetica"];',
        '  edge [fontname="Helvetica"];',
    ]
    for one in diagram.locations:
        text = "\n".join(part for part in (one.name, one.invariant, one.rate) if part)
        double = ", peripheries=2" if one.initial else ""
        lines.append(f"  {one.id} [label={_quoted(text)}{double}];")
    for edge in diagram.edges:
        dashed = "" if edge.controllable else ", style=dashed"
        lines.append(f"  {edge.source} -> {edge.target} [label={_quoted(edge.sync)}{dashed}];")
    return "\n".join([*lines, "}", ""])


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
