"""What a simulation walks along: symbolic states, or states with exact times.

A course is at one state. `History` remembers the states on the way.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, Protocol
from zlib import compress, decompress

from ntagen.checker import Model
from ntagen.checker.errors import failing
from ntagen.checker.play import Window, delay_from
from ntagen.checker.runs import Walk
from ntagen.errors import InputError
from ntagen.simulator.network import Network, Part, Parts
from ntagen.values import dataclass

State = dict[str, Any]
"""A state: ``locations`` by number, ``variables``, and ``clocks``; or ``zone``, which is packed."""

Choice = dict[str, Any]
"""What is done in a state: ``move`` is the index of a move, ``delay`` a text such as ``3/2``."""


@dataclass(frozen=True, slots=True)
class Move:
    """What can happen next.

    Attributes:
        parts: The edges that are taken together.
        windows: The delays after which it is possible; ``None`` where there are no exact times.
        who: Who makes it in a game: ``you``, or ``strategy`` if it only allows it.
    """

    parts: Parts
    windows: tuple[Window, ...] | None = None
    who: str = "you"


@dataclass(frozen=True, slots=True)
class Offer:
    """What can happen in a state.

    Attributes:
        moves: The moves.
        end: Why there is none, or how play goes on, in words; empty if there is nothing to say.
        game: What a strategy does next, for the page; ``None`` outside of games.
    """

    moves: tuple[Move, ...]
    end: str = ""
    game: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Done:
    """A step that was made.

    Attributes:
        choice: What was chosen, with the delay that was taken.
        parts: The edges; none if only time passed.
        delay: The delay; ``None`` without exact times.
        who: Who made it.
    """

    choice: Choice
    parts: Parts
    delay: Fraction | None = None
    who: str = "you"


class Course(Protocol):
    """A walk through a model, at a state."""

    @property
    def mode(self) -> str:
        """``symbolic``, ``exact`` or ``game``."""

    def state(self) -> State:
        """The state."""

    def offer(self) -> Offer:
        """What can happen in it.

        Raises:
            ModelError: The model fails in computing it.
        """

    def do(self, choice: Choice) -> Done:
        """Makes a step.

        Raises:
            InputError: It is not possible.
            ModelError: The model fails in it.
        """


class SymbolicCourse:
    """A walk through symbolic states."""

    mode = "symbolic"

    def __init__(self, model: Model, network: Network) -> None:
        self._network = network
        self._walk = model.walk()

    def state(self) -> State:
        """The state."""
        return {
            "locations": self._network.located(self._walk.locations),
            "variables": self._walk.variables,
            "zone": compress("\n".join(self._walk.zone).encode(), 1),
        }

    def offer(self) -> Offer:
        """What can happen in it."""
        moves = tuple(Move(parts) for parts in self._parts())
        end = "" if moves else "deadlock: no move is possible, whatever the clocks are"
        return Offer(moves, end)

    def do(self, choice: Choice) -> Done:
        """Makes a step."""
        index = index_of(choice)
        parts = self._parts()
        if not 0 <= index < len(parts):
            raise InputError(f"there is no move {index + 1} here; there are {len(parts)}")
        self._walk.take(index)
        return Done({"move": index}, parts[index])

    def _parts(self) -> list[Parts]:
        return [
            tuple(Part(process, edge, leg, tuple(select)) for process, edge, leg, select in move)
            for move in self._walk.numbered_moves()
        ]


class ExactCourse:
    """A walk through states with exact clock values."""

    mode = "exact"

    def __init__(self, model: Model, network: Network) -> None:
        self._network = network
        self._walk: Walk = model.walk_exactly()

    def state(self) -> State:
        """The state."""
        unit = self._walk.ticks_per_unit
        raw: State = json.loads(self._walk.state_json())
        clocks = {name: str(Fraction(ticks, unit)) for name, ticks in raw["clocks"].items()}
        return raw | {"locations": self._network.located(raw["locations"]), "clocks": clocks}

    def offer(self) -> Offer:
        """What can happen in it."""
        found, longest = self._choices()
        if any(_is_fine(one, self._walk.ticks_per_unit) for _, windows in found for one in windows):
            # A bound that does not belong to a window is a tick away. With finer ticks, it shows.
            unit = self._walk.ticks_per_unit
            if self._walk.refine(2 * unit):
                choices, longest = self._choices()
                finer = dict(choices)
                found = [
                    (parts, tuple(map(_strict, windows, finer[parts]))) for parts, windows in found
                ]
        end = ""
        if not found:
            end = "time passes for ever, and nothing can happen any more"
            if longest is not None:
                last = Fraction(longest, self._walk.ticks_per_unit)
                stops = f"time stops after {last}" if last else "time cannot pass"
                end = f"deadlock: no move is possible, and {stops} (a timelock)"
        return Offer(tuple(Move(parts, windows) for parts, windows in found), end)

    def do(self, choice: Choice) -> Done:
        """Makes a step."""
        index, delay = index_of(choice), delay_of(choice)
        moves = self.offer().moves
        if not 0 <= index < len(moves):
            raise InputError(f"there is no move {index + 1} here; there are {len(moves)}")
        windows = moves[index].windows or ()
        if delay is None:
            delay = windows[0].soon()
        elif not any(delay in one for one in windows):
            possible = ", or ".join(map(str, windows))
            raise InputError(f"after {delay} this move is not possible: it is possible {possible}")
        try:
            is_fine_enough = self._walk.refine(delay.denominator)
            with failing():
                self._walk.take(index, int(delay * self._walk.ticks_per_unit))
        except OverflowError:
            is_fine_enough = False
        if not is_fine_enough:
            raise InputError(f"the delay {delay} is too long or too fine a fraction of the unit")
        return Done({"move": index, "delay": str(delay)}, moves[index].parts, delay)

    def _choices(self) -> tuple[list[tuple[Parts, tuple[Window, ...]]], int | None]:
        with failing():
            text, longest = self._walk.choices_json()
        unit = self._walk.ticks_per_unit
        return [
            (
                self._network.parts(one["edges"]),
                tuple(_window(first, last, unit) for first, last in one["windows"]),
            )
            for one in json.loads(text)
        ], longest


def _window(first: int, last: int | None, unit: int) -> Window:
    end = None if last is None else Fraction(last, unit)
    return Window(Fraction(first, unit), False, end, last is None)


def _is_fine(window: Window, unit: int) -> bool:
    """Whether one of its ends is no coarser than a tick."""
    ends = [window.first] if window.last is None else [window.first, window.last]
    return any(end.denominator == unit > 1 for end in ends)


def _strict(before: Window, after: Window) -> Window:
    """A window from what it is with ticks, and with ticks of half the length."""
    found = before
    if after.first != before.first:
        found = replace(found, first=2 * after.first - before.first, after_first=True)
    if before.last is not None and after.last is not None and after.last != before.last:
        found = replace(found, last=2 * after.last - before.last, before_last=True)
    return found


def zone_of(state: State) -> list[str] | None:
    """The constraints of a symbolic state; ``None`` for exact clock values.

    With a hundred clocks they are thousands, so a history keeps them packed.
    """
    packed = state.get("zone")
    return None if packed is None else decompress(packed).decode().splitlines()


def index_of(choice: Choice) -> int:
    """The index of the move that is chosen.

    Raises:
        InputError: There is none.
    """
    index = choice.get("move")
    if not isinstance(index, int) or isinstance(index, bool):
        raise InputError("no move is chosen")
    return index


def delay_of(choice: Choice) -> Fraction | None:
    """The delay that is chosen; ``None`` leaves it open.

    Raises:
        InputError: It is no number, or negative.
    """
    text = choice.get("delay")
    if text is None or text == "":
        return None
    return delay_from(str(text))


def matching(moves: Sequence[Move], parts: Parts) -> list[int]:
    """The indices of the moves with these edges."""
    return [index for index, one in enumerate(moves) if one.parts == parts]
